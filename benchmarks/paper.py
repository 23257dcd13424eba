"""docs/paper.md: the paper's figures and claims run again, and kept as a small table.

python -m benchmarks.paper             # runs everything, some minutes
python -m benchmarks.paper --render    # only the page, out of benchmarks/results/paper.json
python -m benchmarks.paper --check     # fails where the page is not what would be rendered
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.outcome import keep_page
from corexy_fmi.reproduce.claimed import claims
from corexy_fmi.reproduce.fig3 import LOOPS, fig3
from corexy_fmi.reproduce.fig4 import fig4
from corexy_fmi.reproduce.fig5 import fig5
from corexy_fmi.reproduce.paper import SETS, SPEEDS, bundled
from corexy_fmi.reproduce.result import Result, markdown, write_result

ROOT = Path(__file__).parents[1]
KEPT, PAGE = ROOT / "benchmarks" / "results" / "paper.json", ROOT / "docs" / "paper.md"
IMAGES = ROOT / "docs" / "images" / "paper"
SETS_DRAWN, SEED = 2000, 0
PICTURES = {("fig4", "yin2018"): "fig4.svg", ("claims", ""): "claims.svg"}
HEAD = """\
# The paper, run again

<!-- Rendered by `python -m benchmarks.paper` from benchmarks/results/paper.json; do not edit. -->

Figures 3 to 5 and the claims of Yin et al., IEEE RCAR 2018, through the FMU (figures) and the
kernel's lanes (claims). The paper's Table I and the points in its figures did not reach us: P1
(`yin2018`) is a **surrogate**, chosen so that the paper's claims hold; P0 has light friction, P2 is
a desktop printer. The reference beside a number is the project's specification, computed with
another solver, not the paper. What is wrong in the printed equations: [errata.md](errata.md).

**In short.** On P1 the claims (a) to (e) hold, and (f) without Coulomb friction; with it a floor
stays. On P0 and P2 most do not: these overshoot, and eq. (17) reads about zero. Of the sets drawn
from plausible ranges {share:.0%} satisfy all six; of these {both:.0%} are overdamped in both axes.
The 4-DoF model falls short of the full one at P1's corners (79 mm/s) by {was};
with its idlers at static weights (`fidelity = "condensed"`, not the paper's) by
{now}.

`corexy reproduce fig3|fig4|fig5|claims` writes the whole tables; here are the parts that can be
compared. Measured at commit {commit}.
"""


def kept(document: dict[str, Any]) -> dict[str, Any]:
    """A document without what fills pages: ideal paths, further speeds, Fig. 5's points."""
    tables = document["tables"][:1] if document["name"] == "fig5" else document["tables"]
    slim = [{**table, "rows": [r for r in table["rows"] if _told(r)]} for table in tables]
    return {**document, "tables": slim}


def _told(row: dict[str, Any]) -> bool:
    return row.get("model") != "ideal" and row.get("speed [m/s]", SPEEDS[0]) in SPEEDS


def measure() -> list[dict[str, Any]]:
    """Run all, leave the pictures of the page, and give the documents."""
    report = lambda what, share: print(f"\r{what} {share:.0%}   ", end="", file=sys.stderr)  # noqa: E731
    machines = [bundled(SETS[name]) for name in ("P1", "P0", "P2")]
    results = [fig3(machines[0], LOOPS, report), *(fig4(m, report) for m in machines)]
    results += [fig5(machines[0], report), claims(SETS_DRAWN, SEED, report)]
    for result in results:
        _picture(result)
    return [kept(result.document()) for result in results]


def _picture(result: Result) -> None:
    """One of the page's two pictures, where the result is one of them."""
    machine = result.command.partition("--machine ")[2].split(" ")[0]
    name = PICTURES.get((result.name, machine))
    if name is None:
        return
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        made = write_result(result, Path(folder))[-1]
        (IMAGES / name).write_bytes(made.read_bytes())


def page(study: dict[str, Any]) -> str:
    """The whole of docs/paper.md."""
    documents = study["results"]
    tables = {table["title"]: table["rows"] for table in documents[-1]["tables"]}
    share = next(rows[-1]["share"] for title, rows in tables.items() if title.startswith("Share"))
    both = documents[-1]["tables"][-1]["rows"][-1]["value"]
    was, now = (_shortfall(documents[1], model) for model in ("4-DoF", "condensed"))
    numbers = {"share": share, "both": both, "was": was, "now": now}
    parts = [HEAD.format(**numbers, commit=study["commit"][:12])]
    for document in documents:
        machine = document["command"].partition("--machine ")[2].split(" ")[0]
        name = PICTURES.get((document["name"], machine))
        text = markdown(document, level=2)
        if name:
            text += f"\n![{document['title']}; {document['label']}](images/paper/{name})\n"
        parts.append(text)
    return "\n".join(parts)


def _shortfall(document: dict[str, Any], model: str) -> str:
    """What a model misses of the full one's error at the highest speed, both turns."""
    rows = next(t["rows"] for t in document["tables"] if t["title"].startswith("Error over"))
    last = [row for row in rows if row["speed [m/s]"] == SPEEDS[-1]]
    return " and ".join(f"{-row[model]:.0%} ({row['turn']})" for row in last)


def main() -> int:
    """Run, render or check; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--render", action="store_true", help="run nothing")
    parser.add_argument("--check", action="store_true", help="write nothing, fail where stale")
    given = parser.parse_args()
    if not (given.render or given.check):
        commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
        command = "python -m benchmarks.paper"
        study = {"command": command, "commit": commit.strip(), "results": measure()}
        text = json.dumps(study, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        KEPT.write_text(text, encoding="utf-8")
    text = page(json.loads(KEPT.read_text(encoding="utf-8")))
    return keep_page(PAGE, text, "python -m benchmarks.paper", check=given.check)


if __name__ == "__main__":
    sys.exit(main())
