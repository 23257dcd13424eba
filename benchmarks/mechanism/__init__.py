"""Causes realised by mechanism in MuJoCo, which nobody here wrote: sealed cases of their own.

A tilted stage, a pin in a slot, a bridge that yaws, a frame and a tool on springs, belts of unequal
stiffness or with damping: parts of a model in MJCF, none of them a law of this package.
"""

import benchmarks.concealed  # noqa: F401  puts the plant on the path
