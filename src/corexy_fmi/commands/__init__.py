"""One file for each command; with `corexy_fmi.cli` the only place that knows the terminal."""
