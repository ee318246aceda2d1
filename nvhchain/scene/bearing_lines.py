"""Statements on the parts of a case: load and stiffness of bearings, manufacturing deviations."""

from __future__ import annotations

import numpy as np

from nvhchain.bearings.catalogue import RollingBearing
from nvhchain.case import GearboxCase, Stage
from nvhchain.case.gearbox import USUAL_DAMPING
from nvhchain.scene.mechanics import recorded_time

_NAMED = 4
"""Largest number of bearings that a statement names one by one."""
_ROUNDING = 1e-6
"""Load, relative to the largest one, below which it is printed as 0."""


def bearing_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return load and stiffness of every bearing with a model, on rigid seats, what was derived, and default damping.

    Returns A line for each bearing with a model, at the case's torque; one for each kind of inside that was derived,
    and one for all bearings without damping.
    """
    if all(bearing.model is None for bearing in case.supports):
        return damping_lines(case)
    equilibrium, lines, inside = case.equilibrium, list[str](), dict[str, list[str]]()
    loads = np.vstack([equilibrium.bearing_load, equilibrium.shaft_bearing_load])
    zero = _ROUNDING * float(np.abs(loads[:, :3]).max())
    for bearing, load, stiffness, moved in zip(
        case.supports, loads, equilibrium.stiffness, equilibrium.displacement, strict=True
    ):
        if bearing.model is None:
            continue
        radial, axial = float(np.hypot(*load[:2])), abs(float(load[2]))
        shown = [f"{1e-3 * value if value > zero else 0.0:.3g} kN" for value in (radial, axial)]
        softest, stiffest = np.linalg.eigvalsh(stiffness[:2, :2])
        text = (
            f"bearing {bearing.name} at {case.static_torque:g} N m: {shown[0]} radial, {shown[1]} axial; "
            f"{softest:.2e}…{stiffest:.2e} N/m radial, {f'{stiffness[2, 2]:.2e}' if stiffness[2, 2] else '0'} N/m axial"
        )
        if isinstance(bearing.model, RollingBearing):
            largest = float(bearing.model.element_loads(moved)[0].max())
            text += f"; an element carries {1e-3 * largest if largest > zero else 0.0:.3g} kN"
            made = f"{bearing.model.title}: {', '.join(bearing.model.derived) or 'all as given'}"
            inside.setdefault(made, []).append(bearing.name)
        lines.append(text)
    lines += [f"{_bearing_names(names)}: {made}" for made, names in inside.items()]
    return (*lines, *damping_lines(case))


def _bearing_names(names: list[str] | tuple[str, ...]) -> str:
    """Return `bearing(s) A1, A2`; of more than four bearings the first three and their number."""
    if len(names) <= _NAMED:
        return f"bearing(s) {', '.join(names)}"
    return f"{len(names)} bearings ({', '.join(names[: _NAMED - 1])}, …)"


def damping_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return the statement about bearings that the case gives no damping, if there are any."""
    if not case.undamped:
        return ()
    return (
        f"{_bearing_names(case.undamped)} have no damping in the case and take {USUAL_DAMPING:g} s times their "
        "stiffness (Krämer: 0.25e-5 to 2.5e-5 s): give stiffness_damping, loss_factor, or radial_damping",
    )


def _words(case: GearboxCase, stage: Stage) -> list[str]:
    """Return the manufacturing deviations of a stage in words, gear by gear and of its axes."""
    gears = {item.name: item for item in case.gears}
    words = [
        f"{name}: {gears[name].deviations.words(gears[name].geometry)}"  # type: ignore[union-attr]
        for name in (stage.pinion, stage.wheel)
        if gears[name].deviations is not None
    ]
    if stage.tolerances is not None:
        distance, tilt = stage.drawn_axes
        words.append(
            f"axes: centre distance {1e3 * distance:.4f} mm, misalignment {1e3 * tilt.in_plane:.3g} and "
            f"{1e3 * tilt.normal:.3g} mrad drawn with seed {stage.tolerances.seed}"
        )
    return words


def deviation_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return a line for every stage with manufacturing deviations, with the spacing of lines that they ask for."""
    lines = [f"stage {stage.name}: {'; '.join(words)}" for stage in case.stages if (words := _words(case, stage))]
    if any(case.deviations) and case.ramp is None:
        time = recorded_time(case)
        lines.append(f"until all teeth have met again {time:.4g} s pass: lines are {1.0 / time:.4g} Hz apart")
    return tuple(lines)
