"""The kernel's shared library: compiled once, cached by the hash of all that decides its bytes."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import platformdirs

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.kernel.generate import generated_header, sizes_header
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.kernel.traced import traced_digest

# no contraction: every build gives the same bits; SLP vectors slow one lane and make eight fast;
# without trapping math selects become vectors below AVX-512 (three times as fast), values the same
FLAGS = (
    "-std=c99",
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-tree-slp-vectorize",
    "-fPIC",
    "-fvisibility=hidden",
)
# loops over lanes become vectors, never calls that copy memory
LANE_FLAGS = ("-ftree-slp-vectorize", "-fopenmp-simd", "-fno-tree-loop-distribute-patterns")
PARTS = ("begin", "belt", "free_form", "friction", "kick", "math", "rows", "sense", "wide")
STAGE_HEADERS = ("stage.h", *(f"stage_{part}.h" for part in PARTS))
KERNEL_SOURCES = (*STAGE_HEADERS, "stage.c", "batch.c")
SUFFIX = {"Windows": ".dll", "Darwin": ".dylib"}.get(platform.system(), ".so")
MISSING = "no C compiler found: install gcc, or the wheel 'ziglang' (pip install ziglang, 100 MB)"


class NoCompilerError(InputError):
    """There is no C compiler; the line says how to get one."""


def native_sources() -> Path:
    """Folder of the C sources written by hand: in the source tree, or bundled into the wheel."""
    bundled = Path(__file__).parents[1] / "fmu_src" / "native"
    return bundled if bundled.is_dir() else Path(__file__).parents[3] / "fmu_src" / "native"


def cache_folder() -> Path:
    """Where compiled kernels are kept; the environment's COREXY_CACHE overrides it."""
    chosen = os.environ.get("COREXY_CACHE")
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("corexy_fmi"))


@cache
def find_compiler() -> tuple[str, ...]:
    """Command of a C compiler: CC, gcc, clang, cc, or zig's wheel.

    Raises NoCompilerError with the line that installs one where there is none.
    """
    for name in (os.environ.get("CC"), "gcc", "clang", "cc"):
        if name and shutil.which(name):
            return (name,)
    if importlib.util.find_spec("ziglang"):
        return (sys.executable, "-m", "ziglang", "cc")
    raise NoCompilerError(MISSING)


def has_compiler() -> bool:
    """Whether `find_compiler` finds one."""
    try:
        find_compiler()
    except NoCompilerError:
        return False
    return True


@cache
def _compiler_version(command: tuple[str, ...]) -> str:
    asked = [*command, "--version"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout


def write_generated(layout: Layout, folder: Path) -> None:
    """Write the generated headers of a layout."""
    (folder / "stage_sizes.h").write_text(sizes_header(layout))
    (folder / "stage_generated.h").write_text(generated_header(layout))


def compile_library(sources: Sequence[Path], target: Path, *flags: str) -> None:
    """Compile C sources to a shared library, beside its target and then renamed.

    Raises InputError with the compiler's first lines where it fails, and where the target cannot be
    written.
    """
    with write_beside(target) as beside:
        files = [*map(str, sources), "-o", str(beside)]
        run_compiler([*find_compiler(), *FLAGS, *flags, "-shared", *files, "-lm"])


def run_compiler(command: Sequence[str], folder: Path | None = None) -> None:
    """Run a C compiler in a folder.  Raises InputError with its first lines where it fails."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise InputError(f"the C compiler failed: {done.stderr.strip()[:800]}")


def _fingerprint(layout: Layout, lanes: int) -> str:
    """Hash of sources, generator output, CPU and flags: kernels of equal ones do the same."""
    digest = hashlib.sha256()
    for name in KERNEL_SOURCES:
        digest.update((native_sources() / name).read_bytes())
    digest.update(traced_digest(layout, cache_folder()).encode())
    parts = (platform.machine(), cpu_name(), *FLAGS, *native_flags(lanes), str(lanes))
    digest.update("\0".join(parts).encode())
    return digest.hexdigest()[:20]


def _compiler_fingerprint() -> str:
    compiler = find_compiler()
    told = "\0".join([*compiler, _compiler_version(compiler)])
    return hashlib.sha256(told.encode()).hexdigest()[:8]


@cache
def cpu_name() -> str:
    """Model and feature flags of this CPU, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor()
    told = ("model name", "flags", "Features")
    return " ".join(sorted({x for x in info.read_text().splitlines() if x.startswith(told)}))


def portable_flags(compiler: Sequence[str]) -> tuple[str, ...]:
    """Flags that keep a compiler from using what only this CPU has; zig does unless it is told."""
    return ("-mcpu=baseline",) if "ziglang" in compiler else ()


def native_flags(lanes: int) -> tuple[str, ...]:
    """Flags that let the compiler use all of this CPU; wide vectors where it has them."""
    vectors = LANE_FLAGS if lanes > 1 else ()
    if platform.machine() not in ("x86_64", "AMD64"):
        return ("-mcpu=native", *vectors)
    wide = ("-mprefer-vector-width=512",) if "avx512f" in cpu_name() else ()
    return ("-march=native", *wide, *vectors)


def kernel_library(layout: Layout, lanes: int) -> Path:
    """Path of the kernel for a layout and a number of lanes, compiled if it is not cached.

    Two processes that build at once each compile beside and rename: both end with the same file.
    Without a compiler any cached one of the same sources will do; raises NoCompilerError where
    there is none.
    """
    name = f"kernel-{lanes}-{_fingerprint(layout, lanes)}"
    try:
        target = cache_folder() / f"{name}-{_compiler_fingerprint()}{SUFFIX}"
    except NoCompilerError:
        for target in sorted(cache_folder().glob(f"{name}-*{SUFFIX}")):
            return target
        raise
    if not target.exists():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_generated(layout, folder)
            native = native_sources()
            include = (f"-I{folder}", f"-I{native}", f"-DLANES={lanes}")
            sources = [native / "stage.c", native / "batch.c"]
            compile_library(sources, target, *include, *native_flags(lanes))
    return target
