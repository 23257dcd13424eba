"""A concealed case: drawn from a seed, scaled to a wanted evidence, written and sealed."""

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .evidence import fit, whitened
from .force import planted_force
from .machines import base, machine_toml
from .recording import channels, csv_text
from .scale import Retuning, clean, judge, to_target, true_machine
from .sensors import draw_masks, jittered, noisy
from .world import FILES, World, choose, draw_world, fresh_run, own_of, stream

KINDS, SHARES = ("effect", "pair", "null", "outside"), (0.6, 0.1, 0.2, 0.1)
TARGETS = (150.0, 300.0, 1000.0, 5000.0)
FILE_LIMIT = (0.7, 1.45)  # of the true values: about two of the deviations that a file claims


@dataclass(frozen=True)
class Case:
    """Recordings (CSV text), machine file and sealed truth of one concealed case."""

    truth: dict
    machine_toml: str
    train: dict
    holdout: dict
    train_clean: dict
    holdout_clean: dict
    planted_force: dict | None
    world: World
    planted: tuple = ()


def concealing_machine(world, retuning, planted):
    """The machine file that hides the effect as well as nominal parameters can.

    A factor common to all masses, stiffnesses and frictions changes nothing: it is set so that half
    of the values are above the true ones, for a few that no motion tells may have gone far. Where a
    value leaves what a file may hold, the others are fitted again.
    """
    model, theta, start = retuning.model, retuning.last.theta, base(world.base_name, world.drive)
    free = [name for group in model.experiment.free for name in group]
    scale = np.clip(nearest(world, model.values(theta), free), *FILE_LIMIT)
    for i in range(len(model.groups)):
        model.low[i], model.high[i] = np.sinh(np.log(np.array(FILE_LIMIT) / scale))
    inside = np.clip(theta, model.low, model.high)
    if np.any(inside != theta):
        truth = whitened(model.experiment, clean(world, planted))
        inside = fit(model, truth, inside, fresh=3).theta
    tuned = model.values(inside)
    ratios = [tuned[n] / world.values[n] for n in free]
    room = FILE_LIMIT[0] / min(ratios), FILE_LIMIT[1] / max(ratios)
    scale = np.clip(nearest(world, tuned, free), *room)
    return machine_toml(start | {n: float(scale * tuned[n]) for n in free}, world.drive)


def nearest(world, tuned, free):
    """The common factor that brings most tuned values near to the true ones."""
    return 1.0 / np.median([tuned[n] / world.values[n] for n in free])


def text_of(world, w, run, masks, still, rng):
    """A run's CSV text from its noise-free channels."""
    seen = jittered(rng, w, run, world.noise) if world.noise["jitter"] > 0.0 else still
    shown = noisy(rng, run, seen, masks, world.noise)
    taken = {name: mask for name, (_, _, mask, _) in masks.items()}
    return csv_text(run, shown, taken, world.drive, world.zeroed)


def record(world, planted):
    """CSV texts and noise-free channels of the three runs."""
    w = true_machine(world, planted)
    still = [*clean(world, planted), *clean(world, planted, train=False)]
    parts = zip(FILES, world.runs, world.masks, still, strict=True)
    texts = {
        name: text_of(world, w, run, masks, one, stream(world.seed, "samples" + name))
        for name, run, masks, one in parts
    }
    return texts, dict(zip(FILES, still, strict=True))


def perform(case, ref, number=0):
    """CSV text of one more run of a case's machine, on other reference angles (rows of a ms, 2);
    its noise, and where it starts, are its own."""
    world, rng = case.world, stream(case.world.seed, f"more{number}")
    run = fresh_run(rng, ref, world.setting, world.values)
    run = own_of(run, rng, world.noise) if world.known == "full" else run
    (masks,) = draw_masks(rng, world.noise, (run,), world.drive, world.zeroed)
    w = true_machine(world, case.planted)
    return text_of(world, w, run, masks, channels(w, run), rng)


def assemble(world, planted, toml, truth):
    texts, still = record(world, planted)
    train, hold = FILES[:2], FILES[2:]
    return Case(
        truth, toml,
        {n: texts[n] for n in train}, {n: texts[n] for n in hold},
        {n: still[n] for n in train}, {n: still[n] for n in hold},
        planted_force(world, planted), world, planted,
    )  # fmt: skip


def described(one, world):
    """An effect as its truth has it; a recording's own parameters are `name@file`."""
    parameters = one.parameters()
    if one.effect.own:
        for name, run in zip(FILES, world.runs, strict=True):
            own = one.effect.own(run, one.parameters())
            parameters = {k: v for k, v in parameters.items() if k not in own}
            parameters |= {f"{k}@{name}": float(v) for k, v in own.items()}
    return {
        "name": one.effect.name,
        "location": one.location,
        "parameters": parameters,
        "form": one.form,
    }


def scaled_and_judged(world, planted, target, least=0.0):
    """Sizes that meet the target; E, E_sep, rival of each; the retuned nominal model.

    One effect is not judged where its E, which a judge only lowers, is below `least`.
    """
    if len(planted) == 1:
        one, retuning = to_target(world, planted[0], target)
        if retuning.last.evidence < least:
            return (one,), [{"E": retuning.last.evidence}], retuning
        return (one,), [judge(retuning, one)], retuning
    planted, verdicts = tuple(to_target(world, one, target)[0] for one in planted), []
    for one in planted:
        beside = Retuning(world, [other for other in planted if other is not one])
        beside.fit(planted)
        verdicts.append(judge(beside, one))
    nominal = Retuning(world)
    found = nominal.fit(planted)
    if not planted:
        verdicts = [{"E": found.evidence, "E_sep": 0.0, "nearest_rival": None, "at_bound": []}]
    return planted, verdicts, nominal


def draw(seed, kind=None, effect=None, location=None, setting=None, target_E=None,  # noqa: N803
         noise=None, machine=None, catalogue="ten"):  # fmt: skip
    """A case from its seed; whatever is None is drawn. Same arguments, same bytes.

    `catalogue`: "ten" is the draw of the published proof; "full" draws from all 35 effects, and
    dirty noise, too; where a drawn machine shows less than a third of the evidence (at the largest
    size, or the largest at which no rotor slips), the case moves to yin2018, whose belts give most.
    """
    rng = stream(seed, "case")
    drawn_kind, drawn_target = rng.choice(KINDS, p=SHARES), rng.choice(TARGETS)
    kind = str(kind or ("effect" if effect else drawn_kind))
    target = float(target_E or drawn_target)
    world = draw_world(seed, setting, machine, noise, kind, catalogue)
    planted = choose(seed, world, kind, effect, location)
    if any(one.effect.name == "constant_force" for one in planted):
        world = draw_world(seed, setting, machine, noise, kind, catalogue, leans=True)
    moves = catalogue != "ten" and machine is None and world.base_name != "yin2018"
    least = target / 3 if moves else 0.0
    planted, verdicts, retuning = scaled_and_judged(world, planted, target, least)
    if len(planted) == 1 and verdicts[0]["E"] < least:
        drawn = (seed, kind, effect, location, setting, target_E, noise)
        return draw(*drawn, machine="yin2018", catalogue=catalogue)
    truth = {
        "kind": kind,
        "effects": [described(one, world) for one in planted],
        "E": min(v["E"] for v in verdicts),
        "E_sep": min(v["E_sep"] for v in verdicts),
        "nearest_rival": min(verdicts, key=lambda v: v["E_sep"])["nearest_rival"],
        "each": verdicts,
        "at_bound": sorted({n for v in verdicts for n in v["at_bound"]}),
        "target_E": None if kind == "null" else target,
        "setting": world.setting,
        "base": world.base_name,
        "noise": world.noise,
        "nominal": world.values,
        "deflection": [run.deflection for run in world.runs],
        "seed": seed,
    }
    if catalogue != "ten":
        truth |= {
            "catalogue": catalogue,
            "size_at_bound": [p.effect.name for p in planted if p.at_bound()],
        }
    return assemble(world, planted, concealing_machine(world, retuning, planted), truth)


def twin(case):
    """The same motion, noise seed and machine file, with the effect off."""
    truth = case.truth | {"kind": "null", "effects": [], "twin_of": case.truth["effects"]}
    truth |= {"E": 0.0, "E_sep": 0.0, "nearest_rival": None, "each": [], "target_E": None}
    truth |= {"at_bound": []} | ({"size_at_bound": []} if "size_at_bound" in truth else {})
    return assemble(case.world, (), case.machine_toml, truth)


def write(case, folder):
    """What an engine may see; the truth is not among it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    files = {"machine.toml": case.machine_toml, **case.train, **case.holdout}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def seal(case):
    """SHA-256 of salt + canonical JSON of the truth, and those bytes, to be opened later."""
    text = json.dumps(case.truth, sort_keys=True, separators=(",", ":"))
    sealed = os.urandom(16).hex().encode() + text.encode()
    return hashlib.sha256(sealed).hexdigest(), sealed


__all__ = ["Case", "draw", "perform", "seal", "twin", "write"]
