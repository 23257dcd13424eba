"""The stages as tables: coordinates, belt sections, masses and friction."""

from corexy_fmi.topology.corexy import FULL, KINEMATIC, REDUCED
from corexy_fmi.topology.stage import Constants, Section, Stage

STAGES = {stage.name: stage for stage in (FULL, REDUCED, KINEMATIC)}
__all__ = ["FULL", "KINEMATIC", "REDUCED", "STAGES", "Constants", "Section", "Stage"]
