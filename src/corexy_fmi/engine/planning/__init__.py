"""Planning: motions that were not run yet, and what they would show."""
