"""Fitting: what may move, the output-error problem, its noise, and least squares on it."""
