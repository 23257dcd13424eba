"""Build CoreXY.ssp: a motion source, the stage and a tracker, connected.

    python examples/importers/build_ssp.py --out build

compiles the two small blocks beside this file for this platform, packs them with the stage's FMU
and describes the system as SSP 1.0; `run_ssp.py` runs it.
"""

from __future__ import annotations

import argparse
import hashlib
import tempfile
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

import fmpy

from corexy_fmi.fmu.archive import read_archive, write_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.kernel.compiler import FLAGS, find_compiler, native_sources, run_compiler
from corexy_fmi.machine import load_machine

HERE = Path(__file__).parent
SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
FMU_TYPE = "application/x-fmu-sharedlibrary"
STOP, STEP = 1.9, 1e-3  # [s]


@dataclass(frozen=True)
class Block:
    """A C file beside this one: variables in the order of its enum, (name, unit, meaning)."""

    name: str
    outputs: tuple[tuple[str, str, str], ...]
    inputs: tuple[tuple[str, str, str], ...]
    parameters: tuple[tuple[str, str, str, float], ...]
    inputs_first: bool = False


SOURCE = Block(
    "Source",
    (
        ("phi1", "rad", "commanded angle of motor 1"),
        ("phi2", "rad", "commanded angle of motor 2"),
        ("phi1_rate", "rad/s", "its rate"),
        ("phi2_rate", "rad/s", "its rate"),
    ),
    (),
    (
        ("width", "m", "of the rectangle, along x", 0.04),
        ("height", "m", "of the rectangle, along y", 0.03),
        ("speed", "m/s", "along its sides", 0.1),
        ("pulley_radius", "m", "of the stage", 5e-3),
    ),
)
TRACKER = Block(
    "Tracker",
    (("x_seen", "m", "x of the last sample"), ("y_seen", "m", "y of the last sample")),
    (("x", "m", "position that is looked at"), ("y", "m", "position that is looked at")),
    (
        ("period", "s", "between samples", 0.025),
        ("resolution", "m", "to which samples are rounded", 1e-5),
    ),
    inputs_first=True,
)
LINKS = (
    *(("source", n, "stage", n) for n in ("phi1", "phi2", "phi1_rate", "phi2_rate")),
    *(("stage", n, "tracker", n) for n in ("x", "y")),
)


def description(block: Block, guid: str) -> bytes:
    """modelDescription.xml of a block."""
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=block.name, guid=guid,
        generationTool="corexy_fmi, examples", license="Apache-2.0",
        variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip
    SubElement(
        root,
        "CoSimulation",
        modelIdentifier=block.name,
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
    )
    units = SubElement(root, "UnitDefinitions")
    for name, exponents in (
        ("m", {"m": "1"}), ("s", {"s": "1"}), ("m/s", {"m": "1", "s": "-1"}),
        ("rad", {"rad": "1"}), ("rad/s", {"rad": "1", "s": "-1"}),
    ):  # fmt: skip
        SubElement(SubElement(units, "Unit", name=name), "BaseUnit", exponents)
    experiment = {"startTime": "0", "stopTime": f"{STOP:g}", "stepSize": f"{STEP:g}"}
    SubElement(root, "DefaultExperiment", experiment)
    variables = SubElement(root, "ModelVariables")
    outputs = [_scalar(variables, *row) for row in _rows(block)]
    structure = SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        node = SubElement(structure, part)
        for index, is_output in enumerate(outputs, start=1):
            if is_output:
                SubElement(node, "Unknown", index=str(index))
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True)


def _rows(block: Block) -> list[tuple[int, str, str, str, str, float | None]]:
    """Reference, name, unit, meaning, causality and start value, by reference."""
    outputs = [(*row, "output", None) for row in block.outputs]
    inputs = [(*row, "input", 0.0) for row in block.inputs]
    signals = [*inputs, *outputs] if block.inputs_first else [*outputs, *inputs]
    parameters = [(n, u, m, "parameter", start) for n, u, m, start in block.parameters]
    return [(i, *row) for i, row in enumerate([*signals, *parameters])]


def _scalar(
    node: Element, reference: int, name: str, unit: str, meaning: str, causality: str,
    start: float | None,
) -> bool:  # fmt: skip
    """Whether it is an output."""
    more = {"output": {"initial": "calculated"}, "parameter": {"initial": "exact"}}
    kind = "fixed" if causality == "parameter" else "continuous"
    attributes = {"name": name, "valueReference": str(reference), "description": meaning}
    attributes |= {"causality": causality, "variability": kind, **more.get(causality, {})}
    value = {} if start is None else {"start": repr(start)}
    SubElement(SubElement(node, "ScalarVariable", attributes), "Real", {"unit": unit} | value)
    return causality == "output"


def block_fmu(block: Block, folder: Path) -> bytes:
    """The FMU of a block, for this platform."""
    code = [HERE / "block.h", HERE / f"{block.name.lower()}.c"]
    digest = hashlib.sha256(b"".join(f.read_bytes() for f in code) + repr(block).encode()).digest()
    guid = f"{{{UUID(bytes=digest[:16])}}}"
    binary = folder / f"{block.name}{fmpy.sharedLibraryExtension}"
    flags = [flag for flag in FLAGS if "visibility" not in flag]
    include = f"-I{native_sources() / 'fmi2'}"
    macro = f'-DGUID="{guid}"'
    words = [*flags, macro, include, "-shared", str(code[1]), "-o", str(binary), "-lm"]
    run_compiler([*find_compiler(), *words])
    target = folder / f"{block.name}.fmu"
    library = f"binaries/{fmpy.platform}/{binary.name}"
    content = {"modelDescription.xml": description(block, guid), library: binary.read_bytes()}
    write_archive(target, content)
    return target.read_bytes()


def structure() -> bytes:
    """SystemStructure.ssd."""
    register_namespace("ssd", SSD)
    register_namespace("ssc", SSC)
    root = Element(f"{{{SSD}}}SystemStructureDescription", version="1.0", name="CoreXY")
    system = SubElement(root, f"{{{SSD}}}System", name="bench")
    elements = SubElement(system, f"{{{SSD}}}Elements")
    seen = [(n, "x_seen" in n or "y_seen" in n) for n, *_ in TRACKER.outputs]
    for name, file in (("source", "Source"), ("stage", "CoreXY"), ("tracker", "Tracker")):
        place = {"name": name, "type": FMU_TYPE, "source": f"resources/{file}.fmu"}
        component = SubElement(elements, f"{{{SSD}}}Component", place)
        connectors = SubElement(component, f"{{{SSD}}}Connectors")
        ends = [(a, "output") for s, a, _, _ in LINKS if s == name]
        ends += [(b, "input") for _, _, e, b in LINKS if e == name]
        ends += [(n, "output") for n, _ in seen if name == "tracker"]
        for connector, kind in ends:
            node = SubElement(connectors, f"{{{SSD}}}Connector", name=connector, kind=kind)
            SubElement(node, f"{{{SSC}}}Real")
    connections = SubElement(system, f"{{{SSD}}}Connections")
    for a, b, c, d in LINKS:
        words = {"startElement": a, "startConnector": b, "endElement": c, "endConnector": d}
        SubElement(connections, f"{{{SSD}}}Connection", words)
    SubElement(root, f"{{{SSD}}}DefaultExperiment", startTime="0", stopTime=f"{STOP:g}")
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True)


def build_ssp(out: Path, machine: str = "yin2018") -> Path:
    """Write CoreXY.ssp and give its path.  Raises InputError where there is no C compiler."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stage = build_fmu(folder, load_machine(machine)).read_bytes()
        content = {"SystemStructure.ssd": structure(), "resources/CoreXY.fmu": stage}
        for block in (SOURCE, TRACKER):
            content[f"resources/{block.name}.fmu"] = block_fmu(block, folder)
    out.mkdir(parents=True, exist_ok=True)
    write_archive(out / "CoreXY.ssp", content)
    return out / "CoreXY.ssp"


def main() -> None:
    """Build and say where."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=Path("build"))
    path = build_ssp(parser.parse_args().out)
    print(f"{path}: {', '.join(sorted(read_archive(path)))}")


if __name__ == "__main__":
    main()
