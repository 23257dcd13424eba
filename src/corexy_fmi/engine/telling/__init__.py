"""Telling: diagnosis.json, intervals, words, and what the report draws."""
