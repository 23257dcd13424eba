"""The kernel's cache and compiler: two builds at once, keys, missing and failing compilers."""

import subprocess
import sys

import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.kernel import compiler, traced
from corexy_fmi.kernel.layout import (
    bundled_layout,
    make_layout,
)

BUILD = """
from corexy_fmi.kernel.compiler import kernel_library
from corexy_fmi.kernel.layout import make_layout
print(kernel_library(make_layout({}), 1))
"""


def test_two_builds_at_once_end_with_one_file(tmp_path, monkeypatch):
    monkeypatch.setenv("COREXY_CACHE", str(tmp_path))
    builds = [
        subprocess.Popen([sys.executable, "-c", BUILD], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    answers = {build.communicate(timeout=120)[0].strip() for build in builds}
    assert [build.returncode for build in builds] == [0, 0]
    assert answers == {str(path) for path in tmp_path.iterdir()}


def test_cache_key_knows_what_decides_the_bytes(monkeypatch):
    layout = make_layout({})
    keys = {compiler._fingerprint(layout, 1), compiler._fingerprint(layout, 8)}
    keys.add(compiler._fingerprint(bundled_layout(), 1))
    monkeypatch.setattr(compiler, "FLAGS", (*compiler.FLAGS, "-DNOTHING"))
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    monkeypatch.setattr(compiler, "native_flags", lambda lanes: ("-march=x86-64",))
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    monkeypatch.setattr(compiler, "cpu_name", lambda: "another")
    keys.add(compiler._fingerprint(layout, 1))
    monkeypatch.undo()
    assert len(keys) == 6
    assert compiler._fingerprint(layout, 1) in keys


def test_the_catalogues_digest_is_kept_and_any_source_renews_it(tmp_path, monkeypatch):
    layout, cache, package = bundled_layout(), tmp_path / "cache", tmp_path / "package"
    found = traced.traced_digest(layout, cache)
    (kept,) = cache.iterdir()
    assert kept.read_text() == found == traced._traced(layout)
    monkeypatch.setattr(traced, "_traced", lambda layout: "f" * 64)
    assert traced.traced_digest(layout, cache) == found
    assert traced.traced_digest(make_layout({}), cache) == "f" * 64
    kept.write_text("half of it")
    assert traced.traced_digest(layout, cache) == "f" * 64
    package.mkdir()
    names = []
    for text in ("one", "another"):
        (package / "source.py").write_text(text)
        monkeypatch.setattr(traced, "PACKAGE", package)
        traced._sources.cache_clear()
        names.append(traced._sources())
    assert names[0] != names[1]
    blocked = tmp_path / "no folder"
    blocked.write_text("")
    assert traced.traced_digest(layout, blocked) == "f" * 64
    traced._sources.cache_clear()  # or this process knows the catalogue by another's name


def test_without_a_compiler_the_line_that_installs_one(monkeypatch):
    compiler.find_compiler.cache_clear()
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"install gcc, or the wheel 'ziglang'"):
        compiler.find_compiler()
    compiler.find_compiler.cache_clear()
    monkeypatch.setattr(compiler.importlib.util, "find_spec", lambda name: object())
    assert compiler.find_compiler()[1:] == ("-m", "ziglang", "cc")
    compiler.find_compiler.cache_clear()


def test_a_failing_compiler_is_told(tmp_path):
    (tmp_path / "bad.c").write_text("int nonsense(")
    with pytest.raises(InputError, match="the C compiler failed"):
        compiler.compile_library([tmp_path / "bad.c"], tmp_path / "bad.so")
    assert [path.name for path in tmp_path.iterdir()] == ["bad.c"]


def test_a_cache_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "good.c").write_text("int good(void) { return 1; }")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        compiler.compile_library([tmp_path / "good.c"], tmp_path / "file" / "good.so")
