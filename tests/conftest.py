"""Two workers share two cores: BLAS threads of their own would only fight for them."""

import os
from collections.abc import Generator

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from corexy_fmi.errors import InputError

LONG = (  # files that take longest, first: what is left to the end keeps one of two workers alone
    "test_fmu_platforms.py",
    "test_engine_verdicts.py",
    "test_emps.py",
    "test_engine_topologies.py",
    "test_kernel.py",
    "test_diagnosis.py",
    "test_voron.py",
    "test_engine_specification.py",
    "test_cli.py",
    "test_report.py",
    "test_commands.py",
    "test_sweep_stop.py",
    "test_grbl_cli.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The order of the files, their own kept."""
    rank = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.name, len(LONG)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """The pythonfmu flavour exists for x86-64 only: elsewhere what builds it is skipped."""
    try:
        return (yield)
    except InputError as error:
        if "pythonfmu has no binary for" in str(error):
            pytest.skip(str(error))
        raise
