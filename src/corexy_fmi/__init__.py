"""Dynamics of Core-XY belt stages as an FMU, and the diagnosis of what a model leaves out."""

__version__ = "0.1.0"
