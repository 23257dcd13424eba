"""Archives of strangers: what leads out, is too much, a link or damaged is refused unwritten."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from fmu_kit import machine, rectangle, template

from corexy_fmi.errors import InputError
from corexy_fmi.fmu import archive as archives
from corexy_fmi.fmu.archive import extract_archive, read_archive
from corexy_fmi.fmu.runner import run_fmu

OUTSIDE = ["../evil", "resources/../../evil", "/tmp/corexy-evil", "C:/evil", "..\\evil", "a\\b",
           "resources//evil", "./evil", "..", "a/."]  # fmt: skip
Spoil = Callable[[zipfile.ZipFile], object]


def spoiled(path: Path, spoil: Spoil) -> Path:
    """A true FMU with something added."""
    path.write_bytes(template().read_bytes())
    with zipfile.ZipFile(path, "a") as archive:
        spoil(archive)
    return path


def refused(path: Path, word: str, folder: Path) -> None:
    """By every way that reads archives, in one line, with nothing written."""
    folder.mkdir(exist_ok=True)
    reads: tuple[Callable[[], object], ...] = (
        lambda: extract_archive(path, folder),
        lambda: read_archive(path),
        lambda: run_fmu(path, rectangle(machine())),
    )
    for read in reads:
        with pytest.raises(InputError, match=word) as caught:
            read()
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_name_that_leads_out_is_refused(name: str, tmp_path: Path) -> None:
    """Zip slip in every spelling."""
    path = spoiled(tmp_path / "slip.fmu", lambda a: a.writestr(zipfile.ZipInfo(name), b"evil"))
    refused(path, "leads out", tmp_path / "into")
    assert not list(tmp_path.rglob("*evil*"))


def test_a_huge_entry_is_refused(tmp_path: Path) -> None:
    """A bomb: half a megabyte that unpacks to more than is allowed."""

    def bomb(archive: zipfile.ZipFile) -> None:
        with archive.open(zipfile.ZipInfo("resources/zeros"), "w", force_zip64=True) as entry:
            for _ in range(archives.LARGEST // (1 << 22)):
                entry.write(bytes(1 << 22))

    path = tmp_path / "bomb.fmu"
    path.write_bytes(template().read_bytes())
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        bomb(archive)
    refused(path, "bytes unpacked", tmp_path / "into")


def test_an_entry_that_lies_about_its_size_is_refused(tmp_path: Path) -> None:
    """More than is told never reaches the disk."""
    path = spoiled(
        tmp_path / "lie.fmu",
        lambda a: a.writestr("resources/zeros", bytes(1 << 20), zipfile.ZIP_DEFLATED),
    )
    told, lie = (size.to_bytes(4, "little") for size in (1 << 20, 10))
    path.write_bytes(path.read_bytes().replace(told, lie))
    folder = tmp_path / "into"
    with pytest.raises(InputError, match="cannot be unpacked"):
        extract_archive(path, folder)
    assert all(f.stat().st_size < 1 << 20 for f in folder.rglob("zeros"))


def test_too_many_entries_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However small."""
    monkeypatch.setattr(archives, "MOST", 5)
    refused(
        spoiled(tmp_path / "many.fmu", lambda a: a.writestr("a", b"")), "entries", tmp_path / "i"
    )


def test_links_and_doubles_are_refused(tmp_path: Path) -> None:
    """A link could point anywhere, a second file could replace the first one unseen."""
    link = zipfile.ZipInfo("resources/link")
    link.create_system, link.external_attr = 3, 0o120777 << 16
    path = spoiled(tmp_path / "link.fmu", lambda a: a.writestr(link, "/etc/passwd"))
    refused(path, "link or a device", tmp_path / "into")
    with pytest.warns(UserWarning, match="Duplicate"):
        double = spoiled(
            tmp_path / "double.fmu", lambda a: a.writestr("resources/machine.txt", b"x")
        )
    refused(double, "stands twice", tmp_path / "into")


@pytest.mark.parametrize("kind", ["cut", "turned", "encrypted"])
def test_damaged_archives_are_refused(kind: str, tmp_path: Path) -> None:
    """With the archive's own trouble in the sentence."""
    data = bytearray(template().read_bytes())
    path = tmp_path / "damaged.fmu"
    if kind == "cut":
        data = data[: len(data) // 2]
    elif kind == "turned":
        data[5000:5200] = bytes(200)
    else:
        at = data.rindex(b"PK\x01\x02")
        data[at + 8] |= 1
    path.write_bytes(data)
    with pytest.raises(
        InputError, match="encrypted" if kind == "encrypted" else "cannot be unpacked"
    ):
        extract_archive(path, tmp_path / "into")


def test_a_true_fmu_is_unpacked_whole(tmp_path: Path) -> None:
    """Every file, with its bytes."""
    extract_archive(template(), tmp_path)
    content = read_archive(template())
    assert {str(f.relative_to(tmp_path)) for f in tmp_path.rglob("*") if f.is_file()} == set(
        content
    )
    assert all((tmp_path / name).read_bytes() == data for name, data in content.items())
