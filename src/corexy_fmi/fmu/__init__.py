"""The FMU: one variable table, from it both flavours, and a runner that drives them with fmpy."""
