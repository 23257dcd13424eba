"""Diagnoses of recordings as a workshop would make them, by a simulator of its own."""
