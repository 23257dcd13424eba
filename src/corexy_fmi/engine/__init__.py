"""Locate, name, model, prove: from recordings to a named cause."""

from corexy_fmi.engine.diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
