"""Which setting of a peer stands for it, and whether the targets are met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

OURS = "this kernel, 1 lane"
ALLOWED = 2.0  # [um]
GENERAL = ("MuJoCo", "CasADi CVODES", "SciPy")  # with numerics of their own
BORROWED = "CasADi, same scheme, generated C"
Row = Mapping[str, Any]


def selected(points: Sequence[Row]) -> list[Row]:
    """For each peer its cheapest setting within `ALLOWED`, else its most accurate one."""
    peers: dict[str, list[Row]] = {}
    for point in points:
        if point["seconds"] is not None and "other steps" not in point["peer"]:
            peers.setdefault(point["peer"], []).append(point)
    found = []
    for rows in peers.values():
        good = [row for row in rows if row["error_um"] <= ALLOWED]
        by_time, by_error = (lambda r: r["seconds"]), (lambda r: r["error_um"])
        found.append(min(good, key=by_time) if good else min(rows, key=by_error))
    return found


def verdicts(stored: Mapping[str, Any]) -> list[str]:
    """The targets, met or not."""
    lines = [line for one in stored["machines"] for line in _general(one)]
    lines += [line for one in stored["machines"] for line in _port(one)]
    b, share = stored["batch"], stored["costs"]["share_of_peak"]
    if "numba" in b:
        gain = b["numba"] / b["kernel"]
        lines.append(
            f"A batch of {b['sets']} sets on one core: {gain:.1f} times the written-out numba port "
            f"(target 5): {_met(gain >= 5)}."
        )
    of = share["of_fused"]
    lines.append(f"Of the core's peak {of:.0%} (aim 30 %): {_met(of >= 0.3)}.")
    return lines


def _met(flag: bool) -> str:
    return "met" if flag else "**not met**"


def times_of(one: Mapping[str, Any]) -> dict[str, float]:
    """Each peer's time over one lane's."""
    rows = {row["peer"]: row for row in selected(one["points"])}
    return {name: row["seconds"] / rows[OURS]["seconds"] for name, row in rows.items()}


def _general(one: Mapping[str, Any]) -> list[str]:
    """One trajectory against simulators with numerics of their own, and with this project's."""
    times = times_of(one)
    ratios = {k: v for k, v in times.items() if k.startswith(GENERAL)}
    name, least = min(ratios.items(), key=lambda item: item[1])
    lines = [
        f"{one['machine']}: one trajectory is {least:.0f} times as fast as the fastest "
        f"general-purpose simulator with numerics of its own ({name}; target 10): "
        f"{_met(least >= 10)}."
    ]
    if BORROWED in times:
        ratio = times[BORROWED]
        lines.append(
            f"{one['machine']}: and {ratio:.1f} times as fast as CasADi's generated C when that is "
            f"given this project's scheme (target 10): {_met(ratio >= 10)}."
        )
    return lines


def _port(one: Mapping[str, Any]) -> list[str]:
    ratios = {k: v for k, v in times_of(one).items() if k.startswith("numba")}
    return [
        f"{one['machine']}: one trajectory takes {1 / ratio:.2f} of the time of {name} (target: no "
        f"slower): {_met(ratio >= 1)}."
        for name, ratio in ratios.items()
    ]
