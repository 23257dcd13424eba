"""The FMU in Python: a pythonfmu slave around the kernel as a bundled shared library.

The library beside this file holds the stage and its variable table; value references are the same
in both.  Nothing here raises into the host: a failure is logged, told on stderr, and the next step
refuses (pythonfmu crashes hosts after a few exceptions, and knows no other way to say no).
"""

import atexit
import contextlib
import ctypes
import functools
import json
import os
import sys
import weakref
from pathlib import Path
from xml.etree import ElementTree

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

OK, REAL, INTEGER = 0, ctypes.c_double, ctypes.c_int
Logger = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions."""

    _fields_ = (
        ("logger", Logger),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


def listener(heard):
    """A logger for the library that appends (category, sentence) to a list."""

    def hear(_environment, _name, _status, category, message):
        sentence = message.decode(errors="replace").replace("%%", "%").replace("##", "#")
        heard.append((category.decode(), sentence))

    return Logger(hear)


@functools.cache
def end_cleanly(folder):
    """Let pythonfmu's binary forget its interpreter before the process ends (Linux).

    It forgets it twice where the FMU is still loaded then: version 0.7 counts down a reference in
    a block that is free by that time, which now and then aborts a host on its way out.
    """
    if sys.platform == "linux":
        for binary in folder.parent.glob("binaries/*/*.so"):
            atexit.register(forget, str(binary))


def forget(binary):
    """The first time, in good order; a binary that is no longer loaded has nothing to forget."""
    with contextlib.suppress(OSError):
        ctypes.CDLL(binary, mode=os.RTLD_LAZY | os.RTLD_NOLOAD).finalizePythonInterpreter()


def escaped(sentence):
    """The host's logger reads a sentence like printf."""
    return sentence.replace("%", "%%")


def guarded(fallback):
    """Keep every exception of a method inside: remember and log it, and give ``fallback``."""

    def wrap(method):
        @functools.wraps(method)
        def safe(self, *arguments):
            try:
                return method(self, *arguments)
            except Exception as error:
                self.fail(f"{method.__name__}: {error}")
                return fallback(arguments)

        return safe

    return wrap


def nothing(_arguments):
    """Fallback of a method without a result."""


def not_a_number(arguments):
    """Fallback of a getter: as many values as were asked for."""
    return [float("nan")] * len(arguments[0])


class CoreXYPython(Fmi2Slave):
    """The stage; its description is the file that the build put beside it."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.failure = ""
        self.heard = []
        self.folder = Path(self.resources)
        try:
            self.instantiate()
        except Exception as error:
            print(f"{self.instance_name}: {error}", file=sys.stderr)
            raise

    def instantiate(self):
        """Load the library and read the machine; raises OSError or RuntimeError."""
        end_cleanly(self.folder)
        files = sorted(self.folder.glob(f"{__name__}.library.*"))
        if not files:
            raise RuntimeError(f"{self.folder}: no {__name__}.library.*, expected the kernel")
        self.library = ctypes.CDLL(str(files[0]))
        self.library.fmi2Instantiate.restype = ctypes.c_void_p
        self.callbacks = Callbacks(listener(self.heard))
        guid = (self.folder / f"{__name__}.guid").read_bytes()
        component = self.library.fmi2Instantiate(
            self.instance_name.encode(), 1, guid, self.folder.as_uri().encode(),
            ctypes.byref(self.callbacks), 0, 1,
        )  # fmt: skip
        if not component:
            raise RuntimeError(self.heard[-1][1])
        self.component = ctypes.c_void_p(component)
        weakref.finalize(self, self.library.fmi2FreeInstance, self.component).atexit = False

    def to_xml(self, model_options=None):
        """The description of both flavours' table; units, types and ranges are in it."""
        return ElementTree.parse(self.folder / f"{__name__}.xml").getroot()

    def pass_on(self):
        """Events that the library told, into pythonfmu's log.

        Never while the slave is made: pythonfmu sends such messages later, and crashes where the
        instance is freed before.
        """
        for category, sentence in self.heard:
            self.log(escaped(sentence), Fmi2Status.ok, category)
        self.heard.clear()

    def fail(self, sentence):
        """Remember the first failure; log it, and tell stderr too: masters may mute logs."""
        self.failure = self.failure or sentence
        self.log(escaped(sentence), Fmi2Status.error)
        print(f"{self.instance_name}: {sentence}", file=sys.stderr)

    def call(self, function, *arguments):
        """Call the library; raises RuntimeError with its sentence where it refuses."""
        status = getattr(self.library, function)(self.component, *arguments)
        if status != OK:
            raise RuntimeError(self.heard.pop()[1])
        if self.heard:
            self.pass_on()

    @guarded(nothing)
    def setup_experiment(self, start_time, stop_time, tolerance):
        limited = stop_time is not None
        stop = REAL(stop_time if limited else 0.0)
        self.call("fmi2SetupExperiment", 0, REAL(0.0), REAL(start_time), int(limited), stop)

    @guarded(nothing)
    def enter_initialization_mode(self):
        self.call("fmi2EnterInitializationMode")

    @guarded(nothing)
    def exit_initialization_mode(self):
        self.call("fmi2ExitInitializationMode")

    @guarded(lambda arguments: False)
    def do_step(self, current_time, step_size):
        if self.failure:
            raise RuntimeError(f"refused since an earlier failure: {self.failure}")
        self.call("fmi2DoStep", REAL(current_time), REAL(step_size), 1)
        return True

    @guarded(nothing)
    def terminate(self):
        self.call("fmi2Terminate")

    def get(self, function, kind, vrs):
        """Values of one type."""
        values = (kind * len(vrs))()
        self.call(function, (ctypes.c_uint * len(vrs))(*vrs), ctypes.c_size_t(len(vrs)), values)
        return list(values)

    def set(self, function, kind, vrs, values):
        """Set values of one type."""
        count = len(vrs)
        self.call(
            function, (ctypes.c_uint * count)(*vrs), ctypes.c_size_t(count), (kind * count)(*values)
        )

    @guarded(not_a_number)
    def get_real(self, vrs):
        return self.get("fmi2GetReal", REAL, vrs)

    @guarded(lambda arguments: [0] * len(arguments[0]))
    def get_integer(self, vrs):
        return self.get("fmi2GetInteger", INTEGER, vrs)

    @guarded(nothing)
    def set_real(self, vrs, values):
        self.set("fmi2SetReal", REAL, vrs, values)

    @guarded(nothing)
    def set_integer(self, vrs, values):
        self.set("fmi2SetInteger", INTEGER, vrs, values)

    @guarded(lambda arguments: {})
    def _get_fmu_state(self):
        state, size = ctypes.c_void_p(), ctypes.c_size_t()
        self.call("fmi2GetFMUstate", ctypes.byref(state))
        try:
            self.call("fmi2SerializedFMUstateSize", state, ctypes.byref(size))
            content = ctypes.create_string_buffer(size.value)
            self.call("fmi2SerializeFMUstate", state, content, size)
        finally:
            self.call("fmi2FreeFMUstate", ctypes.byref(state))
        return {"native": content.raw.hex(), "failure": self.failure}

    @staticmethod
    def _fmu_state_from_bytes(state):
        """What was saved; damaged bytes give a state that cannot be set."""
        try:
            return {"native": "", "failure": "", **json.loads(state.decode())}
        except (ValueError, TypeError):
            return {"native": "", "failure": ""}

    @guarded(nothing)
    def _set_fmu_state(self, saved):
        state, content = ctypes.c_void_p(), bytes.fromhex(saved["native"])
        size = ctypes.c_size_t(len(content))
        self.call("fmi2DeSerializeFMUstate", content, size, ctypes.byref(state))
        try:
            self.call("fmi2SetFMUstate", state)
        finally:
            self.call("fmi2FreeFMUstate", ctypes.byref(state))
        self.failure = saved["failure"]
