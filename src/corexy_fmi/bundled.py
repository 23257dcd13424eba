"""Where the files that travel with the package lie."""

from importlib import resources
from pathlib import Path


def bundled_folder(name: str) -> Path:
    """The folder of that name in the installed package, else at the root of the source tree."""
    package = Path(str(resources.files("corexy_fmi")))
    installed = package / name
    return installed if installed.is_dir() else package.parents[1] / name
