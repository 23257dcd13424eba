"""A sweep on a Dask cluster of its own, where dask is installed."""

import importlib.util
import subprocess
import sys

import pytest
from sweep_kit import WORDS, contents, plan, run

CLUSTER = """
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""
HAS_BOTH = all(importlib.util.find_spec(name) for name in ("distributed", "pyarrow"))
pytestmark = pytest.mark.skipif(not HAS_BOTH, reason="dask or pyarrow is not installed")


@pytest.fixture
def address(tmp_path):
    """The scheduler of a cluster with one worker in a process of its own."""
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True
    ) as process:
        yield process.stdout.readline().strip()
        process.communicate("\n", timeout=30)


def command(folder, address):
    """The sweep of `plan` as a user does it."""
    words = ["sweep", *WORDS, "--sets", "200", "--chunk", "64", "--dask", address, "--out", "o"]
    words += ["--vary", "carriage_mass=0.05:0.2"]
    return subprocess.run(
        [sys.executable, "-m", "corexy_fmi", *words],
        cwd=folder, capture_output=True, text=True, timeout=60,
    )  # fmt: skip


def test_a_cluster_gives_the_bytes_of_one_process(tmp_path, address):
    done = command(tmp_path, address)
    assert done.returncode == 0, done.stderr
    run(plan(vary=("carriage_mass=0.05:0.2",)), tmp_path / "here")
    assert contents(tmp_path / "o") == contents(tmp_path / "here")


def test_no_scheduler_is_told_in_one_line(tmp_path):
    done = command(tmp_path, "127.0.0.1:1")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "dask: no scheduler at '127.0.0.1:1', expected host:port\n"
    assert list(tmp_path.iterdir()) == []
