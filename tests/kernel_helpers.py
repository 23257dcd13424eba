"""What the tests of stage, kernel, effects and accuracy share: machines, motions and a probe."""

import ctypes
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.compiler import SUFFIX, compile_library, native_sources, write_generated
from corexy_fmi.kernel.layout import bundled_layout, nominal_index
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import load_machine
from corexy_fmi.machine.check import STEPPER_ONLY
from corexy_fmi.simulate import machine_vector
from corexy_fmi.topology import STAGES
from corexy_fmi.topology.corexy import equivalent_stiffness

MACHINES = ("yin2018", "light_bench", "gt2_printer")
STEPPER, DC = 0, 1
CHANNELS = ("x", "y", "vx", "vy", "ax", "ay", "phi1", "phi2", "x_true", "y_true", "V1", "V2")
STEP, SAME = 1.5e-4, 1e-9
LOOP = {"mode": "closed_loop", "kp": 20.0, "kd": 0.1}


def vector(machine="yin2018", effects=(), **nominal):
    """Parameter vector of a bundled machine; ``effects`` are (name, location, values) triples."""
    layout = bundled_layout()
    values = machine_vector(load_machine(machine), layout)
    for name, value in nominal.items():
        values[nominal_index(name)] = value
    for name, location, numbers in effects:
        first = layout.find(name, location).parameter
        values[first : first + len(numbers)] = numbers
    return values


def parameters(machine="yin2018"):
    """Nominal parameters of a bundled machine by name."""
    return dict(load_machine(machine).parameters)


def angles_of(path, radius=5e-3):
    """Motor angles (n, 2) [rad] of a path (n, 2) [m], eq. (1)."""
    return np.column_stack([path[:, 0] + path[:, 1], path[:, 0] - path[:, 1]]) / radius


def drive(time, path, radius=5e-3, **loop):
    """Excitation of a path (n, 2) [m] at times (n,) [s]."""
    return Excitation(np.asarray(time, float), *angles_of(path, radius).T, **loop)


def polyline(points, speed, row=1e-3, rest=0.0):
    """Times and path along points [m] at constant speed, a row at each corner."""
    points = np.asarray(points, float)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    knots = np.concatenate([[0.0], np.cumsum(lengths / speed)])
    end = knots[-1] + rest
    time = np.union1d(np.arange(0.0, end, row), np.append(knots, end))
    time = time[np.append(True, np.diff(time) > 1e-9)]
    path = np.column_stack([np.interp(time, knots, column) for column in points.T])
    return time, path


def lively(rows=80, row=1e-3, radius=5e-3):
    """A short run with speed in both axes, reversals and rests: times and path."""
    time = row * np.arange(rows)
    still = np.minimum(time, 0.7 * time[-1])
    x = 8e-3 * np.sin(90 * still) + 0.02 * still
    y = 6e-3 * np.sin(70 * still) ** 3
    return time, np.column_stack([x, y])


def run(excitation, values, **options):
    """One lane's response (channels, rows)."""
    return run_lanes(bundled_layout(), excitation, np.atleast_2d(values), **options)[0]


def start_values(effect, which=0):
    """A set of parameter values from which a fit begins."""
    return [p.starts[min(which, len(p.starts) - 1)] for p in effect.parameters]


def cases(fidelities=tuple(STAGES), drives=("stepper", "dc")):
    """Every (effect, location, fidelity, drive) that exists."""
    return [
        (effect.name, location, fidelity, drive)
        for effect in catalogue().values()
        for location in effect.locations
        for fidelity in fidelities
        for drive in drives
        if fidelity in effect.fidelities
        and drive in effect.drives
        and not (fidelity in STEPPER_ONLY and drive == "dc")
        and not (fidelity != "full" and location.startswith("pulley"))
    ]


FRICTIONLESS = {  # but for the viscous friction of carriage and bridge
    name: 0.0
    for name in load_machine("yin2018").parameters
    if name.endswith("coulomb_friction") or name == "pulley_viscous_friction"
}


STIFFNESS = 2 * equivalent_stiffness(parameters())  # [N/m] of the stage along x and along y
QUIET = {n: 0.0 for n in parameters() if n.endswith("friction")}
DAMPED = {**FRICTIONLESS, "belt_damping_time": 1e-3}


def still(rows=3000, step=1e-3, volts=(0.0, 0.0), mode="angles"):
    """Inputs that do not change."""
    return Excitation(np.arange(rows) * step, *(np.full(rows, v) for v in volts), mode)


def at_rest(effects, rows=3000, channels=("x", "y"), fidelity="full", **nominal):
    """The last row of a run with motors held at zero."""
    values = vector(effects=effects, **(nominal or DAMPED))
    return run(still(rows), values, channels=channels, fidelity=fidelity)[:, -1]


@cache
def _probe_library():
    double, pointer = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_generated(bundled_layout(), folder)
        include = (f"-I{folder}", f"-I{native_sources()}", "-DLANES=1")
        target = folder / f"probe{SUFFIX}"
        compile_library([Path(__file__).with_name("probe.c")], target, *include)
        library = ctypes.CDLL(str(target))
    library.probe_new.restype = ctypes.c_void_p
    library.probe_new.argtypes = [ctypes.c_int, ctypes.c_int, pointer, pointer]
    library.probe_advance.argtypes = [ctypes.c_void_p, double, double]
    for name in ("set", "drive", "get"):
        getattr(library, f"probe_{name}").argtypes = [ctypes.c_void_p, pointer, pointer]
    for name in ("free", "limit", "elastic"):
        getattr(library, f"probe_{name}").argtypes = [ctypes.c_void_p]
    for name in ("limit", "elastic", "sine", "cosine", "exponential"):
        getattr(library, f"probe_{name}").restype = double
    for name in ("sine", "cosine", "exponential"):
        getattr(library, f"probe_{name}").argtypes = [double]
    return library


def elementary(name):
    """One of the kernel's own functions: sine, cosine, exponential."""
    return np.vectorize(getattr(_probe_library(), f"probe_{name}"))


def _pointer(values):
    return np.ascontiguousarray(values, float).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Probe:
    """One lane of the compiled stage, with all its coordinates open."""

    def __init__(self, values, fidelity="full", drive=STEPPER, angles=(0.0, 0.0)):
        self.library, self.count = _probe_library(), len(STAGES[fidelity].coordinates)
        topology = list(STAGES).index(fidelity)
        self.stage = self.library.probe_new(topology, drive, _pointer(values), _pointer(angles))

    def __del__(self):
        self.library.probe_free(self.stage)

    def set(self, q, v):
        """Set positions and velocities; motors are held at their angles."""
        self.library.probe_set(self.stage, _pointer(q), _pointer(v))

    def drive(self, rates=(0.0, 0.0), volts=(0.0, 0.0)):
        """Motor rates [rad/s] (stepper) or voltages (dc) from now on."""
        self.library.probe_drive(self.stage, _pointer(rates), _pointer(volts))

    def advance(self, duration, limit):
        """Advance by a duration [s] in steps of at most limit [s]."""
        self.library.probe_advance(self.stage, duration, limit)

    def get(self):
        """Positions and velocities."""
        q, v = np.zeros(self.count), np.zeros(self.count)
        self.library.probe_get(self.stage, _pointer(q), _pointer(v))
        return q, v

    def accelerations(self, q, v, step=1e-8):
        """What the compiled step makes of a state, over a very short step."""
        self.set(q, v)
        self.drive(rates=v[2:4])
        self.advance(step, 1.0)
        return (self.get()[1] - v) / step

    @property
    def elastic(self):
        """The belts' elastic energy [J] at the last forces."""
        return self.library.probe_elastic(self.stage)

    @property
    def limit(self):
        """The automatic step [s]."""
        return self.library.probe_limit(self.stage)


def excitation(dc=False, rows=80):
    """A short run for either drive."""
    return drive(*lively(rows), **(LOOP if dc else {}))


def assert_same(layout, given, values, **options):
    """Kernel and reference agree in all channels, relative to the largest value of each."""
    options = {"channels": CHANNELS, "limit": STEP, **options}
    fast = run_lanes(layout, given, values[None], **options)[0]
    slow = run_reference(layout, given, values, **options)
    for name, found in zip(CHANNELS, fast, strict=True):
        size = np.abs(slow[name]).max()
        assert np.isfinite(found).all()
        assert np.abs(found - slow[name]).max() <= SAME * size, name
    return fast
