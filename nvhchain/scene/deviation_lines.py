"""Manufacturing deviations of a case in words."""

from __future__ import annotations

from nvhchain.case import GearboxCase, Stage
from nvhchain.scene.mechanics import recorded_time


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
    """Return a line for every stage with manufacturing deviations, with the spacing of lines that they ask for.

    Parameters
    ----------
    case : GearboxCase
        Case.

    Returns
    -------
    tuple of str
        Lines; none for gears as drawn.
    """
    lines = [f"stage {stage.name}: {'; '.join(words)}" for stage in case.stages if (words := _words(case, stage))]
    if any(case.deviations) and case.ramp is None:
        time = recorded_time(case)
        lines.append(f"until all teeth have met again {time:.4g} s pass: lines are {1.0 / time:.4g} Hz apart")
    return tuple(lines)
