"""`undertow version`."""

import importlib.metadata
import platform

import typer


def version() -> None:
    """Versions of undertow, of what it computes with, and of Python."""
    for package in ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy", "xarray"):
        typer.echo(f"{package} {importlib.metadata.version(package)}")
    typer.echo(f"python {platform.python_version()}")
