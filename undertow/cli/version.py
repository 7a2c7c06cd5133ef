"""`undertow version`: show versions."""

import importlib.metadata
import platform

import typer


def version() -> None:
    """Print the versions of undertow, its dependencies and Python."""
    for package in ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy", "xarray"):
        typer.echo(f"{package} {importlib.metadata.version(package)}")
    typer.echo(f"python {platform.python_version()}")
