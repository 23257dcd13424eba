"""Sweeps that are stopped: killed, interrupted, a worker lost."""

import os
import signal

import pytest
from sweep_kit import contents, group_is_gone, plan, run, start, wait_for_chunks

from corexy_fmi.errors import InputError
from corexy_fmi.sweep.chunk import run_chunk
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.run import sweep
from corexy_fmi.sweep.workers import Here

pytest.importorskip("pyarrow")


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("jobs", [1, 2])
def test_resumed_after_a_kill_it_equals_an_uninterrupted_run(tmp_path, jobs):
    process = start(tmp_path, jobs, 20000)
    wait_for_chunks(tmp_path, 2, process)
    process.kill()
    process.communicate(timeout=30)
    assert group_is_gone(process.pid)
    kept = contents(tmp_path / "o")
    assert 2 <= len(kept) < 20000 // 64
    stop_after = max(int(name[:6]) for name in kept if name[0] != ".") + 3
    resumed = plan(sets=20000)
    folder = Folder(
        tmp_path / "o",
        resumed.document(),
        {"machine": "yin2018", "surrogate": resumed.machine.surrogate},
    )
    done = folder.open()
    assert len(done) >= 2
    skipped = set(range(stop_after, resumed.chunks))  # the rest would only take time
    sweep(resumed, folder, done | skipped, Here(), 1)
    for index in range(stop_after):
        other = Folder(tmp_path / "fresh", resumed.document(), folder.about)
        other.keep(index, run_chunk(resumed, index))
    assert contents(tmp_path / "o") == contents(tmp_path / "fresh")


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_leaves_finished_chunks_and_no_mess(tmp_path):
    process = start(tmp_path, 2, 100000)
    wait_for_chunks(tmp_path, 2, process)
    os.killpg(process.pid, signal.SIGINT)
    out, said = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert said == "interrupted, nothing was left half-written\n"
    assert group_is_gone(process.pid)
    names = {path.name for path in (tmp_path / "o").rglob("*") if path.is_file()}
    assert not [name for name in names if name.startswith(".")]
    resumed = plan(sets=100000)
    folder = Folder(tmp_path / "o", resumed.document(), {})
    assert len(folder.open()) == len(contents(tmp_path / "o")) >= 2


def test_a_worker_that_died_is_told_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("corexy_fmi.sweep.run.run_chunk", die)
    with pytest.raises(InputError, match="a worker process died"):
        run(plan(), tmp_path / "o", jobs=2)


def die(what, index):
    """A task that ends its process."""
    os._exit(3)
