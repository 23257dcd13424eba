"""What the tests of fleets share: folders of machines, and tasks that stand in for a diagnosis.

    python -m fleet_kit TASK [words of corexy]

is the command line with a task of this file in the place of the diagnosis.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

from corexy_fmi.fleet.table import told

TEXT = "time,phi1,phi2,x,y\n0,0,0,0,0\n0.001,0,0,0,0\n"


def document(seconds=1.0):
    """A diagnosis.json as far as the table reads it."""
    held = {"rms_nominal": 3e-5, "rms_retuned": 2e-5, "rms_explained": 1e-5, "noise_std": 9e-6}
    effect = {"name": "backlash", "location": "motor1", "probability": 0.99}
    return {
        "verdict": "explained", "effects": [effect], "heldout": held | {"weak": True},
        "machine_assumed": True, "seconds": seconds,
    }  # fmt: skip


def make_fleet(folder, count=4, text=TEXT):
    """So many machines m0, m1, .. with one recording each."""
    for n in range(count):
        (folder / f"m{n}").mkdir(parents=True)
        (folder / f"m{n}" / "run.csv").write_text(text)
    return folder


def quick(parcel):
    """A diagnosis that takes no time; each is logged in the folder that FLEET_LOG names."""
    if log := os.environ.get("FLEET_LOG"):
        with (Path(log) / parcel.name).open("a") as file:
            file.write(f"{os.getpid()}\n")
    return {"diagnosis.json": json.dumps(document()).encode()}, told(parcel.name, document())


def slow(parcel):
    """One that takes a minute from the third machine on."""
    if int(parcel.name[1:]) >= 2:
        time.sleep(60)
    return quick(parcel)


def deadly(parcel):
    """One that takes its process with it at machine m2, each time."""
    if parcel.name == "m2":
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(parcel)


def once_deadly(parcel):
    """The same at the first try only; others take a while, so that some are lost with it."""
    done = quick(parcel)
    if parcel.name == "m2" and len(runs(Path(os.environ["FLEET_LOG"]) / "m2")) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.2)
    return done


def runs(path):
    """Processes that began a machine's diagnosis."""
    return path.read_text().split()


def main():
    """The command line with another task."""
    import fleet_kit  # not __main__, so that other processes find the task

    from corexy_fmi import cli
    from corexy_fmi.commands import fleet

    task = sys.argv.pop(1)
    fleet.diagnose_parcel = getattr(fleet_kit, task)
    sys.argv[0] = "corexy"
    cli.main()


if __name__ == "__main__":
    main()
