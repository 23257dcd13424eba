"""The stages as tables: coordinates, belt sections, masses and friction."""

from corexy_fmi.topology.corexy import CONDENSED, FULL, KINEMATIC, REDUCED
from corexy_fmi.topology.stage import Constants, Section, Stage

STAGES = {stage.name: stage for stage in (FULL, REDUCED, KINEMATIC, CONDENSED)}
__all__ = ["CONDENSED", "FULL", "KINEMATIC", "REDUCED", "STAGES", "Constants", "Section", "Stage"]
