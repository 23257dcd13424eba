"""A bare host of the FMU's library through ctypes: any call in any order, with what it said."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import fmpy

from corexy_fmi.fmu.variables import Variable, variable_table
from corexy_fmi.kernel.layout import bundled_layout

Logger = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)
Allocate = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
Free = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions."""

    _fields_ = (
        ("logger", Logger),
        ("allocate", Allocate),
        ("free", Free),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class Library:
    """An unpacked FMU's binary, with the table of its variables."""

    def __init__(self, place: Path) -> None:
        description = fmpy.read_model_description(str(place))
        name = description.coSimulation.modelIdentifier
        file = f"{name}{fmpy.sharedLibraryExtension}"
        self.functions = ctypes.CDLL(str(place / "binaries" / fmpy.platform / file))
        self.functions.fmi2Instantiate.restype = ctypes.c_void_p
        self.guid, self.resources = description.guid, (place / "resources").as_uri()
        self.variables: tuple[Variable, ...] = variable_table(bundled_layout())

    def instance(self, name: str, guid: str | None = None, kind: int = 1) -> Instance:
        """A new one; its ``component`` is None where that was refused."""
        return Instance(self, name, guid or self.guid, kind)


class Instance:
    """One instance: `call` gives the status, ``told`` holds (status, category, sentence)."""

    def __init__(self, library: Library, name: str, guid: str, kind: int) -> None:
        self.library, self.told = library, list[tuple[int, str, str]]()
        self._callbacks = Callbacks(
            Logger(self._hear), Allocate(lambda n, size: None), Free(lambda pointer: None)
        )
        made = library.functions.fmi2Instantiate(
            name.encode(), kind, guid.encode(), library.resources.encode(),
            ctypes.byref(self._callbacks), 0, 0,
        )  # fmt: skip
        self.component = ctypes.c_void_p(made) if made else None

    def _hear(self, _e: Any, _name: bytes, status: int, category: bytes, text: bytes) -> None:
        words = ((category or b"").decode(), (text or b"").decode(errors="replace"))
        self.told.append((status, *words))

    def call(self, name: str, *arguments: Any) -> int:
        """Status of a function that takes this instance first."""
        return int(getattr(self.library.functions, f"fmi2{name}")(self.component, *arguments))

    def get(self, references: Sequence[int], whole: bool = False) -> tuple[int, list[float]]:
        """Status and values."""
        count = len(references)
        values = ((ctypes.c_int if whole else ctypes.c_double) * count)()
        kind = "GetInteger" if whole else "GetReal"
        status = self.call(kind, _references(references), ctypes.c_size_t(count), values)
        return status, list(values)

    def set(self, references: Sequence[int], values: Sequence[float], whole: bool = False) -> int:
        """Status of setting values."""
        count, kind = len(references), "SetInteger" if whole else "SetReal"
        array = (ctypes.c_int if whole else ctypes.c_double) * count
        return self.call(kind, _references(references), ctypes.c_size_t(count), array(*values))

    def slope(self, references: Sequence[int], orders: Sequence[int], values: list[float]) -> int:
        """Status of setting input derivatives."""
        count = len(references)
        return self.call(
            "SetRealInputDerivatives", _references(references), ctypes.c_size_t(count),
            (ctypes.c_int * count)(*orders), (ctypes.c_double * count)(*values),
        )  # fmt: skip

    def output_slope(self, references: Sequence[int], order: int) -> tuple[int, list[float]]:
        """Status and first derivatives of outputs."""
        count = len(references)
        values, orders = (ctypes.c_double * count)(), (ctypes.c_int * count)(*[order] * count)
        status = self.call(
            "GetRealOutputDerivatives", _references(references), ctypes.c_size_t(count), orders,
            values,
        )  # fmt: skip
        return status, list(values)

    def along(
        self, outputs: Sequence[int], knowns: Sequence[int], seeds: Sequence[float]
    ) -> tuple[int, list[float]]:
        """Status and directional derivatives."""
        values = (ctypes.c_double * len(outputs))()
        status = self.call(
            "GetDirectionalDerivative", _references(outputs), ctypes.c_size_t(len(outputs)),
            _references(knowns), ctypes.c_size_t(len(knowns)),
            (ctypes.c_double * len(seeds))(*seeds), values,
        )  # fmt: skip
        return status, list(values)

    def setup(self, start: float, stop: float | None) -> int:
        """Status of fmi2SetupExperiment."""
        last = ctypes.c_double(0.0 if stop is None else stop)
        begin = ctypes.c_double(start)
        return self.call(
            "SetupExperiment", 0, ctypes.c_double(0.0), begin, int(stop is not None), last
        )

    def step(self, point: float, duration: float) -> int:
        """Status of fmi2DoStep."""
        return self.call("DoStep", ctypes.c_double(point), ctypes.c_double(duration), 1)

    def save(self) -> tuple[int, ctypes.c_void_p]:
        """Status and a state."""
        state = ctypes.c_void_p()
        return self.call("GetFMUstate", ctypes.byref(state)), state

    def forget(self, state: ctypes.c_void_p) -> int:
        """Status of freeing a state."""
        return self.call("FreeFMUstate", ctypes.byref(state))

    def serialised(self, state: ctypes.c_void_p) -> tuple[int, bytes]:
        """Status and bytes of a state."""
        size = ctypes.c_size_t()
        status = self.call("SerializedFMUstateSize", state, ctypes.byref(size))
        content = ctypes.create_string_buffer(max(size.value, 1))
        return status or self.call("SerializeFMUstate", state, content, size), content.raw

    def restored(self, content: bytes) -> tuple[int, ctypes.c_void_p]:
        """Status and a state made of bytes."""
        state = ctypes.c_void_p()
        size = ctypes.c_size_t(len(content))
        return self.call("DeSerializeFMUstate", content, size, ctypes.byref(state)), state

    def free(self) -> None:
        """The end of it."""
        self.library.functions.fmi2FreeInstance(self.component)
        self.component = None


def _references(numbers: Sequence[int]) -> Any:
    return (ctypes.c_uint * len(numbers))(*numbers)
