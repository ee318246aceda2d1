"""Packages installed on request: the extras of pyproject.toml."""

from __future__ import annotations

from importlib.util import find_spec

from nvhchain.errors import require

EXTRAS = {
    "asammdf": "records",
    "bempp_cl": "bempp",
    "cvxopt": "cholmod",
    "mosqito": "sound",
    "nptdms": "records",
    "pandas": "xarray",
    "pyarrow": "parquet",
    "pyuff": "uff",
    "pyvista": "pictures",
    "pyyeti": "nastran",
    "shtab": "completion",
    "xarray": "xarray",
    "xlsxwriter": "excel",
}
"""Module → extra that installs it."""


def installed(module: str) -> bool:
    """Return whether a module can be imported, without importing it."""
    return find_spec(module) is not None


def remedy(module: str) -> str:
    """Return the command that installs a module of `EXTRAS`."""
    return f"pip install nvhchain[{EXTRAS[module]}]"


def check_installed(module: str) -> None:
    """Raise InputError if a module of `EXTRAS` is missing, with the command that installs it."""
    require(installed(module), f"{module} is not installed: {remedy(module)}")
