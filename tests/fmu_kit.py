"""What the FMU tests share: built FMUs, short commands, a slave with its messages."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from corexy_fmi.effects import catalogue
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.session import unpacked
from corexy_fmi.machine import EffectUse, FreeForm, Machine, load_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle

FLAVOURS = ("native", "python")
LIMIT = 1e-9  # [m] between FMU and kernel


@cache
def folder() -> Path:
    """A folder for FMUs, gone when the tests end."""
    made = Path(tempfile.mkdtemp(prefix="corexy-test-"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


@cache
def template(flavour: str = "native") -> Path:
    """The FMU of the bare machine."""
    return build_fmu(folder(), None, flavour)


@cache
def machine(name: str = "yin2018") -> Machine:
    """A bundled machine."""
    return load_machine(name)


def rectangle(chosen: Machine, *, speed: float = 0.1, size: float = 0.006) -> Recording:
    """A small rectangle with its rest; a dc machine's loop is in the metadata."""
    shape = Rectangle(size, 0.7 * size, speed)
    order = command(shape.motion, chosen.parameters["pulley_radius"], name="rectangle.csv")
    short = order.time < shape.motion.duration - 0.4
    channels = {name: values[short] for name, values in order.channels.items()}
    loop = chosen.controller
    text = {} if loop is None else {"controller": f"pd kp={loop.kp!r} kd={loop.kd!r}"}
    return Recording(order.name, order.time[short], channels, text)


def use(name: str, location: str) -> EffectUse:
    """An effect at a place, with the values that a fit begins with."""
    parameters = catalogue()[name].parameters
    return EffectUse(name, location, {p.name: p.starts[0] for p in parameters})


def diseased() -> Machine:
    """A machine with three effects and a free-form law."""
    law = FreeForm("x", "vx", (-0.1, 0.0, 0.1), (0.3, 0.0, -0.4))
    uses = (
        use("backlash", "motor1"),
        use("stribeck_friction", "xy"),
        use("sensor_delay", "sensor"),
    )
    return replace(machine(), name="diseased", effects=uses, free_forms=(law,))


def largest(one: Recording, other: Recording, *names: str) -> float:
    """Largest difference of some channels, or of all."""
    return max(float(np.abs(one[n] - other[n]).max()) for n in names or one.channels)


class FMU2Told(FMU2Slave):  # type: ignore[misc]
    """fmpy's slave that keeps the messages; fmpy wants class names to begin with FMU2."""

    def __init__(self, place: Path, name: str = "one") -> None:
        self.description = read_model_description(str(place))
        self.place = place
        self.messages: list[str] = []
        self.categories: list[str] = []
        self.statuses: list[int] = []
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.kinds = {v.name: v.type for v in self.description.modelVariables}
        super().__init__(
            guid=self.description.guid,
            unzipDirectory=str(place),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.own_callbacks = fmi2CallbackFunctions()
        self.own_callbacks.logger = fmi2CallbackLoggerTYPE(self.hear)
        self.own_callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(lambda n, size: None)
        self.own_callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(lambda pointer: None)

    def hear(
        self, environment: Any, name: bytes, status: int, category: bytes, text: bytes
    ) -> None:
        """Keep a message."""
        self.messages.append(text.decode())
        self.categories.append(category.decode())
        self.statuses.append(status)

    def status(self, function: str, *arguments: Any) -> int:
        """Status of a call of fmpy's slave, 0 where it went well."""
        try:
            getattr(self, function)(*arguments)
        except FMICallException as error:
            return int(error.status)
        return 0

    def refusal(self, function: str, *arguments: Any) -> str:
        """The sentence of a call that must be refused with an error."""
        told = len(self.messages)
        status = self.status(function, *arguments)
        assert status == 3, f"{function}: status {status}"
        assert len(self.messages) == told + 1
        return self.messages[-1]

    def open(self, *, logging: bool = False) -> FMU2Told:
        """Instantiate."""
        self.instantiate(callbacks=self.own_callbacks, loggingOn=logging)
        return self

    def begin(self, time: float = 0.0, **inputs: float) -> FMU2Told:
        """Initialise with some inputs."""
        self.setupExperiment(startTime=time)
        self.enterInitializationMode()
        self.put(**inputs)
        self.exitInitializationMode()
        return self

    def put(self, **values: float) -> None:
        """Set Real variables."""
        self.setReal([self.references[n] for n in values], list(values.values()))

    def slope(self, phi1: float, phi2: float) -> None:
        """Set the derivatives of both angles."""
        self.setRealInputDerivatives(
            [self.references[n] for n in ("phi1", "phi2")], [1, 1], [phi1, phi2]
        )

    def read(self, *names: str) -> list[float]:
        """Get Real variables."""
        return list(self.getReal([self.references[n] for n in names]))


@contextmanager
def slave(fmu: Path | None = None) -> Iterator[FMU2Told]:
    """An instantiated slave."""
    with unpacked(fmu or template()) as place:
        made = FMU2Told(place).open()
        try:
            yield made
        finally:
            with suppress(FMICallException):
                made.freeInstance()
