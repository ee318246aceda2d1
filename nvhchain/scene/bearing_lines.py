"""Loads and stiffness of the bearings in words, and two constants for each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain.bearings.catalogue import RollingBearing
from nvhchain.case import GearboxCase
from nvhchain.case.gearbox import USUAL_DAMPING
from nvhchain.dynamics import Bearing

SOFTEST = 1e3
"""Smallest constant (N/m) of a bearing."""


def constant_bearings(case: GearboxCase) -> tuple[Bearing, ...]:
    """Return the bearings with two constants each: those of a model are means at the static load on rigid seats."""
    if all(bearing.model is None for bearing in case.bearings):
        return case.bearings
    return tuple(
        bearing
        if bearing.model is None
        else replace(
            bearing,
            model=None,
            radial_stiffness=max(SOFTEST, 0.5 * float(stiffness[0, 0] + stiffness[1, 1])),
            axial_stiffness=max(SOFTEST, float(stiffness[2, 2])),
        )
        for bearing, stiffness in zip(case.bearings, case.equilibrium.stiffness, strict=True)
    )


def bearing_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return load and stiffness of every bearing with a model, on rigid seats, and default damping.

    Parameters
    ----------
    case : GearboxCase
        Case.

    Returns
    -------
    tuple of str
        A line for each bearing with a model, at the case's torque, and one for all bearings without damping.
    """
    lines = []
    for i, bearing in enumerate(case.bearings):
        if bearing.model is None:
            continue
        of = case.equilibrium
        load, stiffness = of.bearing_load[i], of.stiffness[i]
        radial = np.linalg.eigvalsh(stiffness[:2, :2])
        text = (
            f"bearing {bearing.name} at {case.static_torque:g} N m: {1e-3 * float(np.hypot(*load[:2])):.3g} kN radial, "
            f"{1e-3 * abs(float(load[2])):.3g} kN axial; stiffness {radial[0]:.2e}…{radial[1]:.2e} N/m radial, "
            f"{stiffness[2, 2]:.2e} N/m axial"
        )
        if isinstance(bearing.model, RollingBearing):
            largest = float(bearing.model.element_loads(of.displacement[i])[0].max())
            text += f"; {bearing.model.title}, an element carries {1e-3 * largest:.3g} kN"
            derived = bearing.model.derived
            text += f"; derived: {', '.join(derived)}" if derived else ""
        lines.append(text)
    return (*lines, *damping_lines(case))


def damping_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return the statement about bearings that the case gives no damping, if there are any."""
    if not case.undamped:
        return ()
    return (
        f"bearing(s) {', '.join(case.undamped)} have no damping in the case and take {USUAL_DAMPING:g} s times their "
        "stiffness (Krämer: 0.25e-5 to 2.5e-5 s): give stiffness_damping, loss_factor, or radial_damping",
    )
