"""Histories of steady states: sound pressure over time, transmission errors over the angle of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from scipy.integrate import cumulative_trapezoid

from nvhchain import levels
from nvhchain.errors import require
from nvhchain.handoff import BearingForces, FieldPressure
from nvhchain.plots._style import colour, panels, styled

OVERSAMPLING = 10.0
"""Samples per period of the highest line; the drawn curve then reaches its peaks within 5 %."""


@styled
def pressure_history(
    pressures: Mapping[str, FieldPressure], *, point: int = 0, turns: float = 2.0, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw sound pressure over time, one panel per configuration with common scales.

    Parameters
    ----------
    pressures : mapping of str to FieldPressure
        Configuration → pressure at whole multiples of one line spacing.
    point : int
        Index of the field point.
    turns : float
        Turns of the input shaft to draw; a shaft at standstill gives the whole period.
    axes : sequence of Axes, optional
        One per configuration; those of a new figure by default.

    Returns
    -------
    list of Axes
        One per configuration.
    """
    require(len(pressures) > 0, "no pressure given: at least one configuration is needed")
    drawn = panels(len(pressures), axes, height=2.6)
    for index, (ax, (name, field)) in enumerate(zip(drawn, pressures.items(), strict=True)):
        time, signal = levels.time_history(
            field.frequency, field.pressure[:, point], sample_rate=OVERSAMPLING * float(field.frequency[-1])
        )
        rms = float(np.sqrt(np.mean(signal**2)))
        if field.input_speed > 0.0:
            shown = time <= turns * 2.0 * np.pi / field.input_speed
            time, signal = time[shown], signal[shown]
        ax.plot(1e3 * time, signal, color=colour(index), linewidth=1.0)
        ax.set_title(f"{name}: {rms:.3g} Pa RMS", loc="left", color=colour(index), fontweight="bold")
        ax.set_ylabel("sound pressure / Pa")
        ax.margins(x=0.0)
    drawn[-1].set_xlabel("time / ms")
    return drawn


def mesh_names(record: BearingForces) -> tuple[list[str], str]:
    """Return the names of a record's meshes and of its whole train.

    record: record of a run or of another program.
    Returns meshes: shafts of every mesh, such as A–B and B–C, numbered where several meshes have the same shafts.
    Records without names of shafts count their meshes.
    train: first and last shaft, such as A–C; "A–B at the output" beside a mesh of the same shafts.
    """
    errors = record.mesh_deflection if record.transmission_error is None else record.transmission_error
    count = errors.shape[1] if errors.ndim == 2 else 0
    named = record.error_names or ()
    if len(named) == count + 1:
        meshes, train = [str(ends) for ends in named[:-1]], str(named[-1])
        numbers = [meshes[: i + 1].count(ends) for i, ends in enumerate(meshes)]
        twice = {ends for ends in meshes if meshes.count(ends) > 1}
        numbered = [f"{ends} ({i})" if ends in twice else ends for ends, i in zip(meshes, numbers, strict=True)]
        return numbered, f"{train} at the output" if train in meshes else train
    return [f"of mesh {number}" for number in range(1, count + 1)], "from input to output"


@styled
def transmission_error_history(
    records: Mapping[str, BearingForces], *, turns: float = 1.0, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw the transmission errors of the dynamics over the angle of the input, one panel each.

    records: configuration → record of the same gearbox, from its beginning; at low speed the errors are quasi-static.
    turns: turns of the input to draw; the whole record if it is shorter.
    axes: one per mesh, and one for input to output; those of a new figure by default.
    Returns meshes (µm along the line of action), then input to output (µrad at the output).
    """
    require(len(records) > 0, "no record given: at least one configuration is needed")
    require(turns > 0.0, f"turns = {turns:g} must be positive")
    meshes, train = mesh_names(next(iter(records.values())))
    drawn = panels(len(meshes) + 1, axes, height=2.8, share="x")
    for index, (name, record) in enumerate(records.items()):
        count = len(mesh_names(record)[0])
        require(count == len(meshes), f"{name} has {count} meshes, but {len(meshes)} are drawn: draw gearboxes alike")
        angle = cumulative_trapezoid(record.input_speed, record.time, initial=0.0)
        shown = angle <= 2.0 * np.pi * turns
        errors = np.column_stack([record.recorded("transmission_error"), record.recorded("output_lag")])[shown]
        for ax, error in zip(drawn, errors.T, strict=True):
            swing = 1e6 * float(np.ptp(error))
            unit = "µrad" if ax is drawn[-1] else "µm"
            ax.plot(
                np.degrees(angle[shown]),
                1e6 * error,
                color=colour(index),
                # coinciding curves stay visible: the earlier one as a rim around the later one
                linewidth=1.6 + 2.0 * (len(records) - 1 - index),
                label=f"{name}: {swing:.3g} {unit} peak to peak",
            )
            ax.set_ylabel(f"error / {unit}")
    for ax, ends in zip(drawn, [*meshes, train], strict=True):
        ax.set_title(f"transmission error {ends}", loc="left", fontweight="bold")
        ax.margins(x=0.0, y=0.15)
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    drawn[-1].set_xlabel("angle of the input / °")
    return drawn
