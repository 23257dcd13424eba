"""``corexy diagnose`` and ``corexy demo``: files, document, screen, sameness."""

import json

import fmpy
import pytest

from corexy_fmi.machine import load_machine
from tests.contract.documents import problems

FILES = {"diagnosis.json", "report.html", "machine.toml", "CoreXY.fmu"}
PATIENCE = 300  # [s]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory, measured):
    """One diagnosis without a machine file, for all tests here."""
    import subprocess
    import sys

    folder = tmp_path_factory.mktemp("diagnosed")
    words = ["diagnose", str(measured), "--jobs", "2", "--json", "--out", "result"]
    done = subprocess.run(
        [sys.executable, "-m", "corexy_fmi", *words],
        cwd=folder, capture_output=True, text=True, timeout=PATIENCE,
    )  # fmt: skip
    return folder / "result", done


def test_status_and_files(diagnosed):
    folder, done = diagnosed
    assert done.returncode == 0, done.stderr
    assert {path.name for path in folder.iterdir()} == FILES
    assert [path.name for path in folder.parent.iterdir()] == ["result"]


def test_document_keeps_the_contract(diagnosed):
    folder, done = diagnosed
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert problems(document) == []
    assert json.loads(done.stdout) == document


def test_the_assumed_surrogate_is_said(diagnosed):
    folder, _ = diagnosed
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert document["machine_assumed"] is True
    assert "surrogate" in (folder / "report.html").read_text(encoding="utf-8")


def test_a_twin_of_the_model_lacks_nothing(diagnosed):
    folder, _ = diagnosed
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert document["verdict"] == "nothing_missing"


def test_machine_and_fmu_can_be_used(diagnosed):
    folder, _ = diagnosed
    assert load_machine(folder / "machine.toml").parameters
    assert fmpy.read_model_description(folder / "CoreXY.fmu").fmiVersion == "2.0"


def test_jobs_and_repetition_change_nothing(diagnosed, corexy, measured):
    folder, _ = diagnosed
    done = corexy("diagnose", measured, "--jobs", 1, "--json", "--out", "again")
    documents = [json.loads((folder / "diagnosis.json").read_text()), json.loads(done.stdout)]
    for document in documents:
        del document["seconds"]
    assert documents[0] == documents[1]


def test_screen_and_holdout(corexy, measured, tmp_path):
    judge = tmp_path / "judge.csv"
    judge.write_text(measured.read_text())
    done = corexy(
        "diagnose", measured, "--machine", "yin2018", "--out", "result", "--holdout", judge
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "nothing missing" in done.stdout
    assert "report.html" in done.stdout
    assert "surrogate" in done.stdout
    document = json.loads((tmp_path / "result" / "diagnosis.json").read_text())
    assert {row["role"] for row in document["fit"]} == {"train", "holdout"}
    assert document["heldout"]["weak"] is False
    assert document["machine_assumed"] is False


@pytest.mark.long
def test_demo(corexy_process, tmp_path):
    done = corexy_process("demo", "--out", "demo", timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "demo" / "CoreXY.fmu").is_file()
    reports = list((tmp_path / "demo").glob("*/report.html"))
    assert reports
    for report in reports:
        assert str(report.relative_to(tmp_path)) in done.stdout
        document = json.loads((report.parent / "diagnosis.json").read_text(encoding="utf-8"))
        assert problems(document) == []
