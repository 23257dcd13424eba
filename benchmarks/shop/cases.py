"""All cases: a truth's kind, then what was done.  See `case.py` for what a case holds."""

from benchmarks.shop import log_cases, sensor_cases, stage_cases

CASES = {case.name: case for part in (stage_cases, log_cases, sensor_cases) for case in part.CASES}
