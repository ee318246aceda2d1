"""Packages that are installed on request: the extras of pyproject.toml."""

from __future__ import annotations

from importlib.util import find_spec

from nvhchain.errors import require

EXTRAS = {"bempp_cl": "bempp", "pyvista": "pictures", "pyuff": "uff", "xarray": "xarray"}
"""Module → extra that installs it."""


def installed(module: str) -> bool:
    """Return whether a module can be imported; nothing is."""
    return find_spec(module) is not None


def remedy(module: str) -> str:
    """Command that installs a module of `EXTRAS`."""
    return f"pip install nvhchain[{EXTRAS[module]}]"


def check_installed(module: str) -> None:
    """Raise InputError with the command that installs a module of `EXTRAS` where it is missing."""
    require(installed(module), f"{module} is not installed: {remedy(module)}")
