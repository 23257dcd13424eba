"""Effects that stand in no catalogue, each with a law unlike any entry there."""

from .effects import Effect, between

AXIS = {"x": 0.0, "y": 1.0}


def odd(first):
    """Slots of the odd law numbered `first` for x and the next for y."""

    def slots(where, p, form):
        out = {"odd_kind": first + AXIS[where], "odd_size": p["size"]}
        return out | {f"odd_{k}": p[k] for k in ("place", "width") if k in p}

    return slots


def place(rng):
    return {"place": float(rng.uniform(-0.02, 0.02))}


def bow(where, p, form):
    return {"bow": p["size"]}


KINDS = (
    # a guide that springs back on one side only: F = -size max(q - place, 0)^2  [N/m^2]
    Effect(
        "one_sided_spring", ("x", "y"), "size", (1.0, 2e4), odd(1.0), 1.0,
        shape=place, on_stage=True,
    ),
    # a magnetic bump, a conservative hill on the way: F = size u exp((1 - u^2)/2),
    # u = (q - place) / width; size is the peak force [N]
    Effect(
        "magnetic_bump", ("x", "y"), "size", (1e-3, 3.0), odd(3.0), 0.01, signed=True,
        shape=lambda rng: place(rng) | {"width": between(rng, 2e-3, 8e-3)}, on_stage=True,
    ),
    # a force across the motion: F_x = size v_y, or F_y = size v_x  [N s/m]
    Effect(
        "cross_coupling", ("x", "y"), "size", (1e-2, 60.0), odd(5.0), 0.1,
        signed=True, on_stage=True,
    ),
    # gusts at random instants, other ones in each recording; size is the largest force [N]
    Effect("gusts", ("x", "y"), "size", (1e-3, 3.0), odd(7.0), 0.01, on_stage=True),
    # a bent measuring axis: x_m = x + size y^2  [1/m]
    Effect("bent_axis", ("sensor",), "size", (1e-4, 0.5), bow, 1e-3, signed=True),
)  # fmt: skip
BY_NAME = {e.name: e for e in KINDS}
