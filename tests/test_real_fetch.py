"""`make real`: fetching a public benchmark, whole and checked, and judging its case."""

import hashlib
import json
import sys
import types

import pytest

from benchmarks import real
from benchmarks.outcome import RESULTS
from corexy_fmi.errors import InputError

TEXTS = {name: name.encode() for name in real.HASHES}


@pytest.fixture
def loader(monkeypatch):
    """A stand-in for the loader: puts down given files, or raises what it is told to."""

    def install(files=None, error=None):
        def load(*, data_file_locations, dir_placement):
            assert data_file_locations
            if error:
                raise error
            folder = real.Path(dir_placement) / "EMPS"
            folder.mkdir()
            for name, text in (files or TEXTS).items():
                (folder / name).write_bytes(text)
            return [str(folder / name) for name in real.HASHES]

        module = types.ModuleType("nonlinear_benchmarks")
        module.EMPS = load
        monkeypatch.setitem(sys.modules, "nonlinear_benchmarks", module)
        hashes = {name: hashlib.sha256(text).hexdigest() for name, text in TEXTS.items()}
        monkeypatch.setattr(real, "HASHES", hashes)

    return install


def test_what_is_fetched_is_kept_and_not_fetched_again(loader, tmp_path):
    loader()
    kept = real.fetch(tmp_path / "real" / "emps")
    assert {p.name: p.read_bytes() for p in kept.iterdir()} == TEXTS
    loader(error=OSError("no network"))
    assert real.fetch(kept) == kept
    assert [p.name for p in kept.parent.iterdir()] == ["emps"]


def test_another_file_is_refused_and_not_kept(loader, tmp_path):
    loader(files=TEXTS | {"DATA_EMPS.mat": b"a sign-in page"})
    with pytest.raises(InputError, match=r"DATA_EMPS.mat: sha256 .*expected"):
        real.fetch(tmp_path / "emps")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "error", [OSError("Name or service not known"), Exception("failed after 5"), ValueError("zip")]
)
def test_without_a_network_one_line_says_what_to_do(loader, tmp_path, error):
    loader(error=error)
    with pytest.raises(
        InputError, match=r"cannot be fetched .*drive.google.com; or python"
    ) as told:
        real.fetch(tmp_path / "emps")
    assert "\n" not in str(told.value)
    assert list(tmp_path.iterdir()) == []


def test_without_the_loader(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "nonlinear_benchmarks", None)
    with pytest.raises(InputError, match=r"nonlinear-benchmarks is missing, expected it: "):
        real.fetch(tmp_path / "emps")


def test_a_folder_without_them(tmp_path):
    with pytest.raises(InputError, match=r"DATA_EMPS.mat: no such file"):
        real.check(tmp_path)


@pytest.mark.skipif(not real.emps.DATA.is_dir(), reason="EMPS is not beside the checkout")
def test_the_hashes_are_those_of_the_recordings():
    assert real.check(real.emps.DATA) == real.emps.DATA


def test_the_stored_case_comes_out_and_a_wrong_one_does_not():
    result = json.loads((RESULTS / "emps.json").read_text(encoding="utf-8"))
    lines, right = real.told(result)
    assert right
    assert any("logged 25, found 25" in line for line in lines)
    late = result | {"pulses": result["pulses"] | {"edge_error_max": 0.021}}
    assert not real.told(late)[1]
    assert not real.told(result | {"pulses": {}})[1]
