"""What a fit leaves in one recording, against the noise that is known of the channel.

That is the noise of a quieter recording, at rest, or between loops (`quiet.py`).  Where a fit's
errors stay well above it, they are no noise, whatever their colour: something is not explained.
"""

from __future__ import annotations

from dataclasses import dataclass

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.jitter import scatter
from corexy_fmi.engine.fitting.quiet import louder, surprise


@dataclass(frozen=True)
class Loud:
    """A channel of a recording, and how many times as large as noise its whitened errors are."""

    ratio: float
    channel: str
    recording: str

    @property
    def told(self) -> str:
        """The same in words."""
        left = f"what is left of {self.channel} in {self.recording}"
        return f"{left} is {self.ratio:.1f} times the noise that the channel has elsewhere"


def loudest(fit: Fit) -> Loud | None:
    """Where a fit leaves most above its noise; None where nothing stands out."""
    problem, found = fit.problem, []
    for r, run in enumerate(problem.runs):
        errors = (e[0] for e in problem.errors(fit.u[None], r))
        for samples, noise, own in zip(run.samples, problem.noise[r], errors, strict=True):
            known = float(scatter(run, samples, own).mean())
            ratio = surprise(noise, own, samples, known)
            if louder(ratio, len(own), len(own)):
                found.append(Loud(ratio, samples.channel, run.name))
    return max(found, key=lambda loud: loud.ratio, default=None)
