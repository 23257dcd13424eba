"""What a case consists of before anything is simulated: machine, motions, noise, effects."""

from dataclasses import dataclass, replace

import numpy as np

from . import outside
from .effects import CATALOGUE
from .evidence import Experiment
from .machines import BASES, base, draw_truth, free_groups
from .more import FULL
from .motions import STEP, draw_motion
from .planted import Planted
from .recording import Run
from .sensors import draw_masks, noise_spec

CATALOGUES = {"ten": CATALOGUE, "full": FULL}
SETTINGS = ("rectangles", "commissioning", "dc")
ZEROED = 0.2  # share of recordings whose x, y have the inputs' zero
FILES = ("train1.csv", "train2.csv", "holdout1.csv")


@dataclass(frozen=True)
class World:
    """All that fixes a case's recordings but the planted effects."""

    seed: int
    setting: str
    base_name: str
    values: dict
    runs: tuple
    masks: tuple
    noise: dict
    known: str = "ten"
    zeroed: bool = False  # x, y have the inputs' zero

    @property
    def catalogue(self):
        return CATALOGUES[self.known]

    @property
    def drive(self):
        return "dc" if self.setting == "dc" else "stepper"


def stream(seed, what):
    return np.random.default_rng([seed, int.from_bytes(what.encode(), "big") % 2**31])


def draw_runs(seed, setting, name, values):
    """Two training motions and a held-out one, with what belongs to each recording."""
    rng, runs = stream(seed, "motion"), []
    for _ in FILES:
        ref = draw_motion(rng, setting, name, values, rng.uniform(8.0, 9.5))
        runs.append(fresh_run(rng, ref, setting, values))
    return tuple(runs)


def fresh_run(rng, ref, setting, values):
    """A run of reference angles, begun wherever friction left the stage."""
    give = 0.6 * np.array([values["carriage_coulomb_friction"], values["bridge_coulomb_friction"]])
    bend = tuple((rng.uniform(-1, 1, 2) * give / (10.9 * values["belt_axial_stiffness"])).tolist())
    every = 10 if setting == "rectangles" else 1
    return Run(ref, bend, float(rng.uniform(-1, 1)), gusts(rng, len(ref)), every)


def gusts(rng, rows):
    """Unit pattern of some bell-shaped pushes at random instants, one column for each axis."""
    t, out = np.arange(rows) * STEP, np.zeros((rows, 2))
    for axis in range(2):
        for _ in range(8):
            at, width = rng.uniform(0.5, t[-1]), rng.uniform(0.04, 0.25)
            out[:, axis] += rng.uniform(-1, 1) * np.exp(-0.5 * ((t - at) / width) ** 2)
    return out / np.abs(out).max(axis=0)


def own_of(run, rng, spec):
    """The run with what else is its own in the full draw."""
    rows, time = len(run.ref), run.time[-1]
    gone = np.sort(rng.choice(np.arange(1, rows - 1), round(spec["missing"] * rows), replace=False))
    return replace(
        run,
        onset=float(rng.uniform(-1.0, 2.0)),
        phase=float(rng.uniform(-np.pi, np.pi)),
        lost_at=float(rng.uniform(0.25, 0.75) * time),
        times_lost=int(rng.choice([1, 2, 0], p=(0.7, 0.15, 0.15))),
        missing=tuple(gone.tolist()),
    )


def draw_world(seed, setting, machine, noise, kind, known, leans=False):
    rng = stream(seed, "world")
    drawn = SETTINGS[rng.integers(0, 3)]
    setting = setting or drawn
    drive = "dc" if setting == "dc" else "stepper"
    name = machine or str(rng.choice(list(BASES), p=(0.5, 0.25, 0.25)))
    values = draw_truth(rng, base(name, drive))
    runs = draw_runs(seed, setting, name, values)
    rng = stream(seed, "own") if known == "full" else None
    spec = noise_spec(stream(seed, "noise"), setting, kind, noise, rng)
    if rng:
        runs = tuple(own_of(run, rng, spec) for run in runs)
        runs = (replace(runs[0], times_lost=max(runs[0].times_lost, 1)), *runs[1:])
    # some trackers are zeroed with the motors; without that no rest tells of a constant force
    zeroed = known == "full" and bool(leans or stream(seed, "zero").random() < ZEROED)
    masks = draw_masks(stream(seed, "masks"), spec, runs, drive, zeroed)
    return World(seed, setting, name, values, runs, masks, spec, known, zeroed)


def draw_planted(rng, world, entry, location):
    """An effect of middling size at a location, its shape and form drawn."""
    drive = world.drive
    location = location or str(rng.choice(entry.places(drive) or entry.locations))
    if location not in entry.places(drive):
        raise ValueError(f"{entry.name} at {location!r} is not possible with drive {drive!r}")
    sign = -1.0 if entry.signed and rng.random() < 0.5 else 1.0
    size = sign * float(np.sqrt(entry.bounds[0] * entry.bounds[1]))
    shape = entry.shape(rng)
    if entry.name == "friction_vs_position":  # on the way
        way = world.runs[0].ref @ [1.0, 1.0 if location == "x" else -1.0]
        shape["center"] = float(0.5 * world.values["pulley_radius"] * rng.choice(way))
    return Planted(entry, location, size, shape, entry.form(rng, drive))


def clash(planted):
    """Whether two effects would use the same of the solver's numbers."""
    return len(planted) == 2 and bool(set(planted[0].slots()) & set(planted[1].slots()))


def choose(seed, world, kind, effect, location):
    """The effects of a case, sizes still to be scaled."""
    rng = stream(seed, "effect")
    if kind == "null":
        return ()
    table = outside.BY_NAME if kind == "outside" else {e.name: e for e in world.catalogue}
    known = [e for e in table.values() if world.drive in e.drives]
    wanted = [effect] if isinstance(effect, str) else list(effect or ())
    places = [location] if isinstance(location, str) else list(location or ())
    for name in wanted:
        if name not in table:
            raise ValueError(f"no effect {name!r}; known: {', '.join(table)}")
    while len(wanted) < (2 if kind == "pair" else 1):
        wanted.append(str(rng.choice([e.name for e in known if e.name not in wanted])))
    places += [None] * (len(wanted) - len(places))
    planted = [draw_planted(rng, world, table[n], p)
               for n, p in zip(wanted, places, strict=True)]  # fmt: skip
    while not isinstance(effect, list | tuple) and clash(planted):
        name = str(rng.choice([e.name for e in known if e.name not in wanted]))
        planted[1] = draw_planted(rng, world, table[name], places[1])
    springs = {"stepper_compliance", "detent_torque"}
    if world.drive == "stepper" and springs & {p.effect.name for p in planted}:
        planted = [replace(p, form=p.form | {"form": 0.0, "hold": 5e-4})
                   if p.effect.name == "backlash" else p for p in planted]  # fmt: skip
    return tuple(planted)


def experiment_of(world, train=True):
    """The training (or held-out) recordings as the fit sees them."""
    which = slice(0, 2) if train else slice(2, 3)
    free = free_groups(world.drive)
    return Experiment(world.drive, world.values, free, world.runs[which], world.masks[which])
