"""A fleet on a Dask cluster that loses a worker midway, where dask is installed."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from fleet_kit import make_fleet, runs

HERE = Path(__file__).parent
CLUSTER = """
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""
pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="dask is not installed"
)


@pytest.fixture
def around(tmp_path):
    """The environment of the cluster and of the command."""
    log = tmp_path / "log"
    log.mkdir()
    paths = os.pathsep.join([str(HERE), *sys.path])
    return os.environ | {"PYTHONPATH": paths, "FLEET_LOG": str(log)}


@pytest.fixture
def address(tmp_path, around):
    """The scheduler of a cluster with two workers in processes of their own."""
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL,
        text=True, env=around,
    ) as process:  # fmt: skip
        yield process.stdout.readline().strip()
        process.communicate("\n", timeout=60)


def command(folder, address, around, task):
    """The fleet as a user does it."""
    words = [task, "fleet", "machines", "--dask", address, "--json"]
    return subprocess.run(
        [sys.executable, "-m", "fleet_kit", *words],
        cwd=folder, capture_output=True, text=True, timeout=120, env=around,
    )  # fmt: skip


def test_a_lost_worker_loses_nothing_and_doubles_nothing(tmp_path, around, address):
    folder = make_fleet(tmp_path / "machines", 8)
    done = command(tmp_path, address, around, "once_deadly")
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["machines"]
    assert [row["machine"] for row in rows] == [f"m{n}" for n in range(8)]
    assert all(row["error"] is None for row in rows)
    log = {n: runs(tmp_path / "log" / f"m{n}") for n in range(8)}
    assert len(log[2]) == 2  # begun where it died, and again
    lost = log[2][0]
    again = {n for n, pids in log.items() if len(pids) > 1}
    assert all(lost in log[n] for n in again)  # only what the lost worker held is done again
    for n in range(8):
        held = json.loads((folder / f"m{n}" / "result" / "row.json").read_text())
        assert held["row"] == rows[n]
    before = {n: len(pids) for n, pids in log.items()}
    assert command(tmp_path, address, around, "once_deadly").returncode == 0
    assert {n: len(runs(tmp_path / "log" / f"m{n}")) for n in range(8)} == before
