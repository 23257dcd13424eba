"""Data: recordings as the engine sees them, checked before any physics."""
