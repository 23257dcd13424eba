"""Two workers share two cores: BLAS threads of their own would only fight for them."""

import os
from collections.abc import Generator

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from corexy_fmi.errors import InputError


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """The pythonfmu flavour exists for x86-64 only: elsewhere what builds it is skipped."""
    try:
        return (yield)
    except InputError as error:
        if "pythonfmu has no binary for" in str(error):
            pytest.skip(str(error))
        raise
