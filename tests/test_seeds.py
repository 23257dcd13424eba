"""The score of `make blind` over its seeds, and which cases a shard still has to run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.concealed import proof, render, seeds
from benchmarks.concealed.proof import in_time, waiting
from benchmarks.concealed.render import MARKS


def test_a_shard_goes_on_where_its_file_ends(tmp_path: Path) -> None:
    """Every second case from the second; a cut line and another run's entries do not count."""
    cases = [(f"seed-{n}", {}) for n in range(7)]
    kept = [{"name": "seed-1", "origin": "this"}, {"name": "seed-3", "origin": "another"}]
    lines = [*map(json.dumps, kept), '{"name": "seed-5", "ori']
    (tmp_path / "out.1.jsonl").write_text("\n".join(lines), encoding="utf-8")
    left, out = waiting(cases, "1/2", tmp_path / "out.jsonl", lambda e: e["origin"] == "this")
    assert out.name == "out.1.jsonl"
    assert [name for name, _ in left] == ["seed-3", "seed-5"]
    alone, out = waiting(cases, "0/1", tmp_path / "out.jsonl", lambda e: True)
    assert (len(alone), out.name) == (7, "out.jsonl")


def test_no_case_is_begun_after_its_time() -> None:
    cases = [(f"seed-{n}", {}) for n in range(3)]
    assert list(in_time(cases, 1e9, "cases")) == cases
    assert list(in_time(cases, -1.0, "cases")) == []


def test_the_score_counts_classes_of_near_twins_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Right, a class beside a near twin, a class without one, and a false alarm: two of four."""
    said = (("right", 500.0), ("class", 50.0), ("class", 500.0), ("false_alarm", None))
    planted = [{"name": "axis_skew", "location": "sensor", "parameters": {"angle": 1e-3}}]
    document = {"effects": [], "located": {"coordinate": "sensor", "state": "position"}}
    lines = [
        {"name": f"seed-{n}", "outcome": outcome, "commit": "abc", "document": document,
         "truth": {"kind": "effect" if twin else "null", "E_sep": twin, "E": twin or 0.0,
                   "effects": planted if twin else []}}
        for n, (outcome, twin) in enumerate(said)
    ]  # fmt: skip
    text = "".join(json.dumps(line) + "\n" for line in lines)
    (tmp_path / "seeds.0.jsonl").write_text(text, encoding="utf-8")
    (tmp_path / "seeds.0.seals.jsonl").write_text(5 * "{}\n", encoding="utf-8")
    monkeypatch.setattr(proof, "RESULTS", tmp_path)
    page = "\n".join(seeds.section())
    assert "2/4 = 50.0 %" in page
    assert "1/4 = 25.0 %" in page
    assert "to be begun anew: 1." in page
    assert "effect class 2; effect right 1; null false_alarm 1." in page
    assert "| nulls with imperfect nuisances: anything named or doubted | <= 1 % | 1/1" in page
    assert "right coordinate 2/2" in page
    assert "| axis_skew | 3 | 1 | 2 |" in page
    readme = f"before\n{MARKS[0]}\nold\n{MARKS[1]}\nafter"
    told = render.score_in(readme)
    assert told.startswith("before\n")
    assert told.endswith("\nafter")
    assert "old" not in told
    assert "as asked 2/4 = 50.0 %" in " ".join(told.split())
    assert render.score_in(told) == told
    assert render.score_in("no marks") == "no marks"
    (tmp_path / "later.0.jsonl").write_text(text.replace("abc", "def"), encoding="utf-8")
    (tmp_path / "later.0.seals.jsonl").write_text(4 * "{}\n", encoding="utf-8")
    assert "to be begun anew: 0." in "\n".join(seeds.section(seeds.LATER))
    both = " ".join(render.score_in(readme).split())
    assert "Over 4 of the seeds 200 to 299, by one engine: as asked 2/4 = 50.0 %" in both
    assert "Of these" not in both
    two = text.replace(
        '"seed-3", "outcome": "false_alarm", "commit": "abc"',
        '"seed-3", "outcome": "right", "commit": "def"',
    )
    (tmp_path / "later.0.jsonl").write_text(two, encoding="utf-8")
    newest = "Of these, the last 1, by one engine: as asked 1/1 = 100.0 %"
    assert newest in " ".join(render.score_in(readme).split())
    assert newest in "\n".join(seeds.section(seeds.LATER))
    assert {e["commit"] for e in proof.outcomes("seeds")} == {"abc"}
    (tmp_path / "newest.jsonl").write_text(text, encoding="utf-8")
    told = " ".join(render.score_in(readme).split())
    assert "Over 4 of the seeds 200 to 299, by engines after those: as asked 3/4" in told
    assert "Over 4 of the seeds 300 to 399, by one engine: as asked 2/4 = 50.0 %" in told
    assert "Of these" not in told
    assert len(seeds.every()) == 12
    (tmp_path / "seeds.0.jsonl").unlink()
    assert seeds.section() == []


def test_readme_says_what_the_stored_outcomes_say() -> None:
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    assert render.score_in(readme) == readme
