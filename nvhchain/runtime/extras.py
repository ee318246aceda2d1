"""Packages installed on request: the extras of pyproject.toml."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from nvhchain.errors import InputError, require

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
    return f'pip install "nvhchain[{EXTRAS[module]}]"'


def check_installed(module: str) -> None:
    """Raise InputError if a module of `EXTRAS` is missing, with the command that installs it."""
    require(installed(module), f"{module} is not installed: {remedy(module)}")


def imported(door: str, module: str) -> ModuleType:
    """Import a module of the package that needs one of `EXTRAS`; InputError if that one is missing or broken."""
    check_installed(module)
    try:
        return import_module(door)
    except Exception as error:  # a package that is built for other versions raises anything
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"{module} is installed but cannot be imported ({reason}): pip install --force-reinstall {module}"
        ) from error
