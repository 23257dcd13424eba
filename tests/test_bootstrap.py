"""scripts/bootstrap: installs once, also in a path with spaces; one line for what is missing."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TOOLS = ("cat", "cksum", "dirname", "mkdir", "chmod", "sh")
VENV_PYTHON = """#!/bin/sh
case "$*" in
  *sys.prefix*) echo "{root}/.venv" ;;
  *ziglang*) exit {ziglang} ;;
  *) echo "$*" >> "{root}/pip.log" ;;
esac
"""
PYTHON = """#!/bin/sh
case "$*" in
  --version) echo "Python {version}" ;;
  *version_info*) exit {old} ;;
  *ensurepip*) exit {no_venv} ;;
  *venv*)
    mkdir -p .venv/bin
    cat "{root}/venv_python" > .venv/bin/python
    chmod +x .venv/bin/python ;;
esac
"""
pytestmark = pytest.mark.skipif(os.name == "nt", reason="a POSIX script")


class Place:
    """A checkout in a folder with a space, and a system of which only some commands exist."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "a checkout"
        (self.root / "scripts").mkdir(parents=True)
        for name in ("scripts/bootstrap", "constraints.txt", "pyproject.toml"):
            shutil.copy(ROOT / name, self.root / name)
        self.bin = folder / "bin"
        self.bin.mkdir()
        for tool in TOOLS:
            (self.bin / tool).symlink_to(shutil.which(tool))
        self.add("make", "exit 0")
        self.add("cc", "exit 0")
        self.python()

    def add(self, name: str, text: str) -> None:
        (self.bin / name).write_text(f"#!/bin/sh\n{text}\n")
        (self.bin / name).chmod(0o755)

    def python(self, version="3.11.2", old=0, no_venv=0, ziglang=1) -> None:
        values = {"version": version, "old": old, "no_venv": no_venv, "root": self.root}
        self.add("python3", PYTHON.format(**values))
        inside = VENV_PYTHON.format(root=self.root, ziglang=ziglang)
        (self.root / "venv_python").write_text(inside)

    def run(self) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [self.bin / "sh", self.root / "scripts" / "bootstrap"],
            env={"PATH": str(self.bin)},
            capture_output=True,
            text=True,
        )

    @property
    def calls(self) -> list[str]:
        log = self.root / "pip.log"
        return log.read_text().splitlines() if log.exists() else []


@pytest.fixture
def place(tmp_path):
    return Place(tmp_path)


def test_installs_once_and_then_needs_nothing(place):
    assert place.run().returncode == 0
    assert len(place.calls) == 2
    assert all("constraints.txt" in call for call in place.calls)
    again = place.run()
    assert (again.returncode, again.stdout) == (0, "")
    assert len(place.calls) == 2


def test_new_constraints_install_again(place):
    place.run()
    with (place.root / "constraints.txt").open("a") as file:
        file.write("# newer\n")
    place.run()
    assert len(place.calls) == 4


def test_missing_python(place):
    (place.bin / "python3").unlink()
    done = place.run()
    assert done.returncode == 1
    assert "apt-get install python3 python3-venv" in done.stderr


def test_old_python(place):
    place.python(version="3.9.2", old=1)
    done = place.run()
    assert done.returncode == 1
    assert "Python 3.9.2 is too old" in done.stderr


def test_missing_venv(place):
    place.python(no_venv=1)
    done = place.run()
    assert done.returncode == 1
    assert "apt-get install python3-venv" in done.stderr


def test_missing_make_is_said(place):
    (place.bin / "make").unlink()
    assert "apt-get install make" in place.run().stdout


def test_missing_compiler_names_the_wheel_and_its_size(place):
    (place.bin / "cc").unlink()
    done = place.run()
    assert done.returncode == 1
    assert "pip install ziglang (about 100 MB to download, 411 MB installed)" in done.stderr
    place.python(ziglang=0)
    shutil.rmtree(place.root / ".venv")
    assert place.run().returncode == 0
