"""Statements on the parts of a case: load and stiffness of bearings, manufacturing deviations."""

from __future__ import annotations

import numpy as np

from nvhchain.bearings.catalogue import RollingBearing
from nvhchain.case import GearboxCase, Stage
from nvhchain.case.gearbox import USUAL_DAMPING
from nvhchain.scene.mechanics import recorded_time


def bearing_lines(case: GearboxCase) -> tuple[str, ...]:
    """Return load and stiffness of every bearing with a model, on rigid seats, and default damping.

    Returns A line for each bearing with a model, at the case's torque, and one for all bearings without damping.
    """
    lines = []
    for i, bearing in enumerate(case.supports):
        if bearing.model is None:
            continue
        of = case.equilibrium
        load, stiffness = np.vstack([of.bearing_load, of.shaft_bearing_load])[i], of.stiffness[i]
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
