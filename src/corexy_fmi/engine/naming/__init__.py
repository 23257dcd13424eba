"""Naming: every hypothesis is fitted as hard as the retuned machine, and they compete."""
