"""Minutes of rectangles on the emulated board, every step and sample counted.

`python -m tests.hil.soak [MINUTES]`; ten by default.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from corexy_fmi.hil.record import recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.kit import bench, jitter
from tests.hil.rig import Rig, Stage

WIDTH, HEIGHT, SPEED = 0.06, 0.04, 0.039


def soak(minutes: float) -> dict[str, float]:
    """Drive so long; the numbers of the run.  Fails where a step or a sample is missing."""
    loops = round(minutes * 60 / (2 * (WIDTH + HEIGHT) / SPEED))
    began = time.monotonic()
    with Rig(Stage(), tracker_rate=40.0) as rig:
        prepared = bench(rig, Rectangle(WIDTH, HEIGHT, SPEED, loops))
        log = prepared.drive()
        latest, made = jitter(rig, log)
        assert log.complete, log.trouble
        assert log.counts == rig.counts
        run = recording("r.csv", log, prepared.board, prepared.tracker, prepared.begin, {})
        samples = np.count_nonzero(~np.isnan(run["x"]))
        assert prepared.tracker.bad == 0
        assert abs(samples - 40 * run.time[-1]) <= 2
        _, rate = prepared.board.clock.fit()
        assert prepared.board.status is not None
        return {
            "emulated (s)": rig.now(),
            "wall (s)": time.monotonic() - began,
            "steps": sum(made),
            "latest edge (us)": latest,
            "tracker samples": samples,
            "longest interrupt (cycles)": prepared.board.status.longest,
            "least buffered (s)": log.buffered,
            "sent again": log.sent_again,
            "drift found (ppm)": 1e6 * (rate - 1),
        }


if __name__ == "__main__":
    for what, value in soak(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0).items():
        print(f"{what:20} {value:.6g}")
