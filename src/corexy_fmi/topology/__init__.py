"""The stages as tables: coordinates, belt sections, masses and friction."""

from corexy_fmi.topology.axes import SINGLE_AXIS, TWO_MASS
from corexy_fmi.topology.corexy import CONDENSED, FULL, KINEMATIC, REDUCED
from corexy_fmi.topology.planar import CARTESIAN, H_FRAME
from corexy_fmi.topology.stage import Constants, Section, Stage

COREXY = (FULL, REDUCED, KINEMATIC, CONDENSED)
STAGES = {stage.name: stage for stage in (*COREXY, SINGLE_AXIS, TWO_MASS, CARTESIAN, H_FRAME)}
__all__ = [
    "CARTESIAN",
    "CONDENSED",
    "FULL",
    "H_FRAME",
    "KINEMATIC",
    "REDUCED",
    "SINGLE_AXIS",
    "STAGES",
    "TWO_MASS",
    "Constants",
    "Section",
    "Stage",
]
