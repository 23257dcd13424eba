"""The kernel: effects and topologies traced to C, compiled, called for many parameter sets."""
