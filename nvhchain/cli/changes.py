"""Changes by `--set`: values of a case, and knobs of its fidelity."""

from __future__ import annotations

import argparse
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from nvhchain.errors import require

if TYPE_CHECKING:
    from nvhchain.case import Case
    from nvhchain.fidelity import Fidelity

KNOB = "fidelity."
"""Begin of the path of a changed knob."""


def changed_case(options: argparse.Namespace, path: str | None = None) -> Case:
    """Return the case of a command with its changes; those of knobs concern the fidelity."""
    from nvhchain.case import load_case

    changes = [change for change in options.set if not change.startswith(KNOB)]
    return load_case(path or options.case, changes=changes)


def changed_knobs(fidelity: Fidelity, options: argparse.Namespace) -> Fidelity:
    """Return the fidelity with the knobs of `--set fidelity.PACKAGE.KNOB=VALUE`."""
    from nvhchain.case.toml.load import parse_change

    known = [part.name for part in fields(fidelity) if is_dataclass(getattr(fidelity, part.name))]
    for change in options.set:
        if not change.startswith(KNOB):
            continue
        packages = parse_change(change)["fidelity"]
        shape = f"--set {change}: write fidelity.PACKAGE.KNOB=VALUE; packages are {', '.join(known)}"
        require(isinstance(packages, dict), shape)
        for package, knobs in packages.items():
            require(package in known and isinstance(knobs, dict), shape)
            old = getattr(fidelity, package)
            names = [knob.name for knob in fields(old)]
            for knob in knobs:
                require(knob in names, f"--set {change}: knobs of fidelity.{package} are {', '.join(names)}")
            parts: dict[str, Any] = {package: replace(old, **knobs)}
            fidelity = replace(fidelity, name=f"{fidelity.name} with {change}", **parts)
    return fidelity
