"""Judging: replays, data kept back, and what may be said."""
