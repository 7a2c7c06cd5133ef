"""`undertow version`: versions of undertow and of what its results depend on."""

import importlib.metadata
import platform

from undertow.cli.options.version import VersionCommand

_PACKAGES = ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy", "xarray")


def version(command: VersionCommand) -> None:
    """Print a line for each package, and one for Python."""
    for package in _PACKAGES:
        print(f"{package} {importlib.metadata.version(package)}")
    print(f"python {platform.python_version()}")
