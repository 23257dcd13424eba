"""The stages as tables: coordinates, belt sections, masses and friction."""

from corexy_fmi.topology.axes import SINGLE_AXIS
from corexy_fmi.topology.corexy import CONDENSED, FULL, KINEMATIC, REDUCED
from corexy_fmi.topology.stage import Constants, Section, Stage

STAGES = {stage.name: stage for stage in (FULL, REDUCED, KINEMATIC, CONDENSED, SINGLE_AXIS)}
__all__ = [
    "CONDENSED",
    "FULL",
    "KINEMATIC",
    "REDUCED",
    "SINGLE_AXIS",
    "STAGES",
    "Constants",
    "Section",
    "Stage",
]
