"""Hardware in the loop: the board of `firmware/`, driven and recorded like the FMU."""
