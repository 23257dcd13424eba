"""The Core-XY stage as a tree of bodies in MJCF, with one mechanism in it or none.

Frame, bridge on it, carriage on the bridge, tool on the carriage; rotors and idlers on hinges; the
twelve belt sections are tendons.  The rotors are driven: they have a huge inertia and are pushed by
exactly what their commanded acceleration asks for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from corexy_fmi.topology import FULL

HUGE = 1e8  # [kg m^2] of a driven rotor: belts turn it by less than 1 nm of travel
STIFF = 0.9999  # MuJoCo's largest impedance: what sticks creeps least
NO_SLIP = 20  # passes that take the rest of the creep away: tens of um under a frame that rings
ARM, PIN, STOP = 4e-3, 5e-4, 5e-4  # [m] pin in the slot: place, radius; half a stop's thickness
MODEL = """<mujoco model="corexy">
  <option timestep="{step!r}" integrator="{integrator}" gravity="{gravity}" iterations="100"
    tolerance="1e-12" noslip_iterations="{no_slip}" noslip_tolerance="1e-12"/>
  <default>
    <joint solreffriction="-0 {rate!r}" solimpfriction="{stiff} {stiff} 1e-3"/>
    <geom contype="0" conaffinity="0"/>
  </default>
  <worldbody>
    <body name="frame">{frame}
      <body name="bridge">{bridge}
        <body name="carriage">{carriage}
        </body>
      </body>{wheels}
    </body>
  </worldbody>
  <tendon>{tendons}</tendon>
  <contact>{pairs}</contact>
  <actuator>{drives}</actuator>
  <sensor><framepos objtype="site" objname="tip" reftype="body" refname="frame"/></sensor>
</mujoco>
"""


@dataclass(frozen=True)
class Parts:
    """What a mechanism puts into the stage; as it stands: nothing.

    ``tilt`` [m/s^2] gravity along x, y; ``ratio`` stiffness of belt 1 over belt 2, less one, their
    mean kept; ``damping_time`` [s] of a tendon over its stiffness; ``gap`` [rad] and ``hold`` [N m]
    of the loose pulley of motor ``loose``; ``yaw`` (stiffness [N m/rad], inertia [kg m^2], damping
    ratio); ``frame`` and ``tool`` (mass [kg], frequency [Hz], damping ratio).
    """

    tilt: tuple[float, float] = (0.0, 0.0)
    ratio: float = 0.0
    damping_time: float = 0.0
    loose: int = 0
    gap: float = 0.0
    hold: float = 0.0
    yaw: tuple[float, float, float] | None = None
    frame: tuple[float, float, float] | None = None
    tool: tuple[float, float, float] | None = None


def joint(name: str, kind: str, axis: str, **numbers: float) -> str:
    """A joint; numbers that are 0 are left out."""
    said = "".join(f' {k}="{float(v)!r}"' for k, v in numbers.items() if v)
    return f'\n<joint name="{name}" type="{kind}" axis="{axis}"{said}/>'


def inertia(mass: float, about: float, off: float = 0.0) -> str:
    """A body's mass [kg] at a distance [m] from its joint, and moment [kg m^2]."""
    moment = f"{float(about)!r} {float(about)!r} {float(about)!r}"
    return f'\n<inertial pos="{off} 0 0" mass="{float(mass)!r}" diaginertia="{moment}"/>'


def sprung(name: str, mass: float, frequency: float, damping_ratio: float) -> str:
    """Two slides of a mass on isotropic springs."""
    omega = 2 * np.pi * frequency
    numbers = {"stiffness": mass * omega**2, "damping": 2 * damping_ratio * mass * omega}
    slides = [joint(f"{name}_{a}", "slide", f, **numbers) for a, f in zip("xy", AXES, strict=True)]
    return "".join(slides) + inertia(mass, 1e-6)


AXES = ("1 0 0", "0 1 0")


def frame_text(parts: Parts) -> str:
    """The frame: fixed, or a mass on springs."""
    return sprung("frame", *parts.frame) if parts.frame else ""


def bridge_text(p: Mapping[str, float], parts: Parts) -> str:
    """The bridge on its guide, and the hinge on which it yaws."""
    guide = {"damping": p["bridge_viscous_friction"], "frictionloss": p["bridge_coulomb_friction"]}
    text, about = joint("y", "slide", AXES[1], **guide), 1e-3
    if parts.yaw:
        stiffness, about, ratio = parts.yaw
        damping = 2 * ratio * np.sqrt(stiffness * about)
        text += joint("yaw", "hinge", "0 0 1", stiffness=stiffness, damping=damping)
    return text + inertia(p["bridge_mass"] + 4 * p["pulley_mass"], about)


def carriage_text(p: Mapping[str, float], parts: Parts) -> str:
    """The carriage on the bridge; where it is seen, or the tool that is seen instead."""
    guide = {
        "damping": p["carriage_viscous_friction"],
        "frictionloss": p["carriage_coulomb_friction"],
    }
    text = joint("x", "slide", AXES[0], **guide) + inertia(p["carriage_mass"], 1e-9)
    tip = '\n<site name="tip"/>'
    tool = f'\n<body name="tool">{sprung("tool", *parts.tool)}{tip}</body>' if parts.tool else tip
    return text + tool


def wheel(name: str, about: float, more: str = "", **numbers: float) -> str:
    """A body on a hinge at the origin: where it stands does not matter to linear tendons.

    Its mass is next to nothing; it lies off the hinge because MuJoCo scales a contact's stiffness
    by how easily the bodies' centres move.
    """
    turn = joint(name, "hinge", "0 0 1", **numbers)
    return f'\n<body name="{name}">{turn}{inertia(1e-12, about, ARM)}{more}\n</body>'


def pin_and_slot(p: Mapping[str, float], parts: Parts) -> tuple[str, str]:
    """A pin on the rotor, a pulley on the rotor's shaft with two stops; which geoms may touch."""
    shaft = {"damping": p["pulley_viscous_friction"], "frictionloss": parts.hold}
    half = ARM * parts.gap / 2 + PIN + STOP
    stops = "".join(
        f'\n<geom name="stop{n}" type="box" size="1e-3 {STOP} 1e-3" pos="{ARM} {s * half!r} 0"/>'
        for n, s in ((1, -1), (2, 1))
    )
    pulley = wheel("pulley", p["pulley_inertia"], stops, **shaft)
    pin = f'\n<geom name="pin" type="sphere" size="{PIN}" pos="{ARM} 0 0"/>'
    pairs = "".join(
        f'\n<pair geom1="pin" geom2="stop{n}" condim="1" solref="{{hard!r}} 1"'
        f' solimp="{STIFF} {STIFF} 1e-6"/>'
        for n in (1, 2)
    )
    return pin + pulley, pairs


def wheels_text(p: Mapping[str, float], parts: Parts) -> tuple[str, str]:
    """Driven rotors and free idlers, and the contacts among them."""
    friction = {
        "damping": p["pulley_viscous_friction"],
        "frictionloss": p["pulley_coulomb_friction"],
    }
    text, pairs = "", ""
    for name in FULL.coordinates[2:]:
        if name not in ("phi1", "phi2"):
            text += wheel(name, p["pulley_inertia"], **friction)
            continue
        more = ""
        if name == f"phi{parts.loose}":
            more, pairs = pin_and_slot(p, parts)
        text += wheel(name, HUGE, more)
    return text, pairs


def tendons_text(p: Mapping[str, float], parts: Parts) -> str:
    """The belts, section by section."""
    text, rho = "", parts.ratio
    for n, (s, k) in enumerate(zip(FULL.sections, FULL.constants(p, 0.0).stiffness, strict=True)):
        k = float(k) * (2 + 2 * rho if s.belt == 1 else 2) / (2 + rho)
        arms = {c: w * (1.0 if c in "xy" else p["pulley_radius"]) for c, w in s.row.items()}
        if parts.loose and f"phi{parts.loose}" in arms:
            arms["pulley"] = arms[f"phi{parts.loose}"]  # its joint counts from the rotor
        if parts.yaw and s.side:
            arms["yaw"] = s.yaw_arm * p["bridge_pulley_spacing"] / 2
        joints = "".join(f'<joint joint="{c}" coef="{float(w)!r}"/>' for c, w in arms.items())
        damping = f' damping="{k * parts.damping_time!r}"' if parts.damping_time else ""
        text += (
            f'\n<fixed name="s{n}" stiffness="{k!r}" springlength="0 0"{damping}>{joints}</fixed>'
        )
    return text


def model_text(p: Mapping[str, float], parts: Parts, step: float, integrator: str) -> str:
    """The model of a machine with these parameters at a time step [s]."""
    wheels, pairs = wheels_text(p, parts)
    return MODEL.format(
        step=step, integrator=integrator, rate=-1 / step, stiff=STIFF, no_slip=NO_SLIP,
        gravity=f"{parts.tilt[0]!r} {parts.tilt[1]!r} 0",
        frame=frame_text(parts), bridge=bridge_text(p, parts), carriage=carriage_text(p, parts),
        wheels=wheels, tendons=tendons_text(p, parts), pairs=pairs.format(hard=2 * step),
        drives="".join(f'<motor joint="phi{n}" gear="{HUGE!r}"/>' for n in (1, 2)),
    )  # fmt: skip
