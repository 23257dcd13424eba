"""How long a micro-step may be, for the kernel in C and the reference in Python alike.

Measured (benchmarks/accuracy.py): keeps rectangle runs within 2 um of an exact solution.
"""

STEP_RESOLUTION = 0.75  # micro-step times the fastest natural frequency [1]
STEP_LONGEST = 1.0e-4  # [s], three times as long where idlers are damped at STEP_CALM
STEP_CALM = 8.0e3  # damping over inertia [1/s]
TIED = 4.0  # times that extrapolated rates of damped belts may shorten a step; beyond: idlers tied
