"""Sweeps: the same results whoever does them, and no chunk that is not whole."""

import json

import numpy as np
import pytest
from sweep_kit import VARY, contents, plan, run, start

from corexy_fmi.sweep.chunk import draw
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.measure import MEASURES
from corexy_fmi.sweep.run import sweep
from corexy_fmi.sweep.workers import Here


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An uninterrupted sweep."""
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("sweep") / "whole"
    assert run(plan(), path) == set()
    return path


def test_one_and_two_workers_give_the_same_bytes(whole, tmp_path):
    run(plan(), tmp_path / "two", jobs=2)
    assert contents(tmp_path / "two") == contents(whole)


def test_the_table_holds_every_set_once(whole):
    from pyarrow.parquet import read_table

    table = read_table(whole / "sets")
    keys = [text.partition("=")[0] for text in VARY]
    assert table.column_names == ["set", *keys, *MEASURES]
    assert sorted(table["set"].to_pylist()) == list(range(200))
    stiffness, gap = (np.array(table[key]) for key in keys)
    assert 500 <= stiffness.min() < 600 < 1700 < stiffness.max() <= 2000
    assert np.median(stiffness) == pytest.approx(1000, rel=0.15)
    assert np.corrcoef(stiffness, np.array(table["contour_error_xy"]))[0, 1] < -0.5
    assert np.median(gap) == pytest.approx(0.01, rel=0.2)
    assert table.schema.metadata[b"machine"] == b"yin2018"


def test_a_corrupt_torn_or_lost_chunk_is_redone(whole, tmp_path):
    run(plan(), tmp_path / "o")
    first, second, third, _ = sorted((tmp_path / "o" / "sets").iterdir())
    data = bytearray(first.read_bytes())
    data[len(data) // 2] ^= 1
    first.write_bytes(data)
    second.write_bytes(second.read_bytes()[:-100])
    third.unlink()
    (tmp_path / "o" / "sets" / ".000009-abcd.parquet").write_bytes(b"of a killed process")
    with (tmp_path / "o" / "chunks.jsonl").open("a") as ledger:
        ledger.write('{"chunk": 1, "ro')
    assert run(plan(), tmp_path / "o") == {3}
    assert contents(tmp_path / "o") == contents(whole)
    assert run(plan(), tmp_path / "o") == {0, 1, 2, 3}


def test_memory_is_bounded_no_more_in_flight_than_asked(whole, tmp_path):
    """Tasks are handed out as tables are kept, never all at once."""
    most, what = [], plan(sets=640)
    folder = Folder(tmp_path / "o", what.document(), {})

    class Counting(Here):
        handed = 0

        def submit(self, fn, /, *args, **kwargs):
            self.handed += 1
            most.append(
                self.handed
                - len(contents(tmp_path / "o") if (tmp_path / "o/sets").is_dir() else ())
            )
            return super().submit(fn, *args, **kwargs)

    sweep(what, folder, folder.open(), Counting(), 3)
    assert len(most) == 10
    assert max(most) == 3


def test_draws_depend_on_seed_and_chunk_alone():
    key = "belt_axial_stiffness"
    first, again, other = plan(), plan(sets=100000), plan(seed=1)
    assert np.array_equal(draw(first, 0)[key], draw(again, 0)[key])
    assert not np.isin(draw(first, 1)[key], draw(first, 0)[key]).any()
    assert not np.isin(draw(other, 0)[key], draw(first, 0)[key]).any()


def test_the_command_says_where_and_goes_on(whole, tmp_path):
    for found in ("0", "200"):
        process = start(tmp_path, 1, 200)
        out, said = process.communicate(timeout=60)
        assert (process.returncode, said) == (0, "")
        assert "surrogate" in out
        assert (f"found done: {found} sets" in out) == (found != "0")
    manifest = json.loads((tmp_path / "o" / "manifest.json").read_text())
    assert manifest["vary"][0]["scale"] == "log"
    assert [len(contents(p)) for p in (tmp_path / "o", whole)] == [4, 4]
