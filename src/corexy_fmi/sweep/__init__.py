"""Many parameter sets of one rectangle: drawn, run in the kernel's lanes, kept as Parquet."""
