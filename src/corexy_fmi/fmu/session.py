"""One FMU instance driven through fmpy: unpacked, stepped, and cleaned up whatever happens."""

from __future__ import annotations

import ctypes
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import extract_archive

Doubles = ctypes.Array[ctypes.c_double]


@contextmanager
def unpacked(fmu: Path) -> Iterator[Path]:
    """The FMU unpacked into a folder that is gone afterwards.

    Raises InputError where the file is no FMU, or a hostile one.
    """
    folder = tempfile.mkdtemp(prefix="corexy-fmu-")
    try:
        extract_archive(fmu, Path(folder))
        yield Path(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


class Session:
    """An FMU of this project from instantiation to its end; use it in a ``with`` block.

    What the FMU refuses becomes an InputError that carries its sentence; ``messages`` holds all.
    """

    def __init__(self, fmu: Path, folder: Path, instance_name: str = "corexy") -> None:
        self.name = Path(fmu).name
        self.messages: list[str] = []
        self.description = _description(fmu, folder)
        simulation = self.description.coSimulation
        _check_path(self.name, folder, simulation.needsExecutionTool)
        self.ramps = bool(simulation.canInterpolateInputs)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.kinds = {v.name: v.type for v in self.description.modelVariables}
        self._slave = self._loaded(folder, simulation.modelIdentifier, instance_name)
        self._callbacks = self._make_callbacks()
        with self._told():
            self._slave.instantiate(callbacks=self._callbacks, loggingOn=True)

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with suppress(FMICallException):
            if kind is None:
                self._slave.terminate()
        self._slave.freeInstance()

    def start(
        self, time: float, inputs: Mapping[str, float], values: Mapping[str, float] | None = None
    ) -> None:
        """Set parameter values and the first inputs, and initialise at a time [s]."""
        with self._told():
            self._slave.setupExperiment(startTime=time)
            self._set(values or {})
            self._slave.enterInitializationMode()
            self._set(inputs)
            self._slave.exitInitializationMode()

    def step(self, time: float, step: float) -> None:
        """One communication step [s] from a time [s]."""
        with self._told():
            self._slave.doStep(time, step)

    def setter(self, names: Sequence[str]) -> Setter:
        """A fast way to set the same Real inputs at every step."""
        return Setter(self, names)

    def getter(self, names: Sequence[str]) -> Getter:
        """A fast way to get the same Real outputs after every step."""
        return Getter(self, names)

    def _set(self, values: Mapping[str, float]) -> None:
        missing = [name for name in values if name not in self.references]
        if missing:
            raise InputError(
                f"{self.name}: no variable {missing[0]!r}, expected an FMU that knows it"
            )
        real = [name for name in values if self.kinds[name] == "Real"]
        whole = [name for name in values if self.kinds[name] != "Real"]
        self._slave.setReal([self.references[n] for n in real], [values[n] for n in real])
        self._slave.setInteger([self.references[n] for n in whole], [int(values[n]) for n in whole])

    def _loaded(self, folder: Path, identifier: str, instance_name: str) -> FMU2Slave:
        """The library, loaded; fmpy leaves the process in another folder where it fails."""
        here = Path.cwd()
        try:
            return FMU2Slave(
                guid=self.description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=identifier,
                instanceName=instance_name,
            )
        except Exception as error:  # fmpy raises bare ones
            raise InputError(
                f"{self.name}: {error}, expected an FMU with a binary for {fmpy.platform_tuple}"
            ) from error
        finally:
            os.chdir(here)

    def _make_callbacks(self) -> fmi2CallbackFunctions:
        """Callbacks whose logger keeps every message."""
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(self._hear)
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        return callbacks

    def _hear(
        self, _environment: Any, _name: bytes, _status: int, _category: bytes, message: bytes
    ) -> None:
        """Messages come like printf's formats: what was doubled for it becomes single."""
        text = message.decode(errors="replace")
        self.messages.append(text.replace("%%", "%").replace("##", "#"))

    @contextmanager
    def _told(self) -> Iterator[None]:
        """A refusal, as the FMU words it."""
        try:
            yield
        except FMICallException as error:
            raise InputError(f"{self.name}: {self._sentence(str(error))}") from error
        except Exception as error:
            if "instantiate" not in str(error):
                raise
            raise InputError(f"{self.name}: {self._sentence(str(error))}") from error

    def _sentence(self, fallback: str) -> str:
        return " ".join(self.messages[-1].split()) if self.messages else fallback


class Setter:
    """Sets the same Real variables again and again, with their derivatives if wanted."""

    def __init__(self, session: Session, names: Sequence[str]) -> None:
        self._slave, self._told = session._slave, session._told
        self._count = len(names)
        self._references = (ctypes.c_uint * self._count)(*(session.references[n] for n in names))
        self._orders = (ctypes.c_int * self._count)(*[1] * self._count)
        self.values: Doubles = (ctypes.c_double * self._count)()
        self.rates: Doubles = (ctypes.c_double * self._count)()

    def apply(self) -> None:
        """Set ``values``."""
        with self._told():
            self._slave.fmi2SetReal(
                self._slave.component, self._references, self._count, self.values
            )

    def apply_rates(self) -> None:
        """Set ``rates`` as input derivatives."""
        with self._told():
            self._slave.fmi2SetRealInputDerivatives(
                self._slave.component, self._references, self._count, self._orders, self.rates
            )


class Getter:
    """Gets the same Real variables again and again."""

    def __init__(self, session: Session, names: Sequence[str]) -> None:
        self._slave, self._told = session._slave, session._told
        self._count = len(names)
        self._references = (ctypes.c_uint * self._count)(*(session.references[n] for n in names))
        self.values: Doubles = (ctypes.c_double * self._count)()

    def read(self) -> Doubles:
        """Fill ``values`` and give them."""
        with self._told():
            self._slave.fmi2GetReal(
                self._slave.component, self._references, self._count, self.values
            )
        return self.values


def _description(fmu: Path, folder: Path) -> Any:
    try:
        description = fmpy.read_model_description(str(folder))
    except Exception as error:  # fmpy raises bare ones
        raise InputError(f"{fmu}: no model description: {error}, expected an FMU") from error
    if description.fmiVersion != "2.0" or description.coSimulation is None:
        raise InputError(f"{fmu}: FMI {description.fmiVersion}, expected FMI 2.0 for co-simulation")
    return description


def _check_path(name: str, folder: Path, needs_python: bool) -> None:
    """pythonfmu decodes no escape but that of a space, and crashes its host on any other."""
    address = quote(str(folder)).replace("%20", " ")
    if needs_python and "%" in address:
        raise InputError(
            f"{name}: {folder}: pythonfmu cannot load from this path, expected letters, digits and "
            "spaces in TMPDIR, or flavour native"
        )
