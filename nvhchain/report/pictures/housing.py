"""Pictures and exchange files of a housing's modes and operating shapes: still, moving, for ParaView."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from nvhchain import plots
from nvhchain.errors import InputError, require
from nvhchain.files.hdf5 import write_text
from nvhchain.handoff import FloatArray, HandOff, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.housing.exchange.exported_modes import exported_modes
from nvhchain.housing.modes.modal_assurance import modal_assurance
from nvhchain.interop import write_glb, write_modal_uff, write_modes_vtkhdf, write_velocity_vtkhdf, write_vtu
from nvhchain.interop.notation.surface_motion import vertex_motion

SUFFIXES = (".csv", ".gif", ".glb", ".unv", ".vtkhdf", ".vtu")
"""Suffixes of files that are not still pictures."""

DRAWN = 0.05
"""Largest motion in a .glb, relative to the size of the body."""


def draw_housings(housings: Mapping[str, ReducedHousing], frequency: Sequence[float]) -> list[Axes]:
    """Draw modes of one housing, the first six or those nearest to `frequency` (Hz), or the modal assurance."""
    housings = {name: housing.drop_ritz_vectors() for name, housing in housings.items()}
    if len(housings) == 1:
        (housing,) = housings.values()
        chosen = [_nearest(housing.natural_frequency, f) for f in frequency]
        return plots.mode_shapes(housing, modes=list(dict.fromkeys(chosen)) or None)
    one, other = _pair(housings)
    rows, columns = (housings[name].natural_frequency for name in (one, other))
    table = modal_assurance(housings[one], housings[other])
    return [plots.modal_assurance_table(table, rows, columns, row_name=one, column_name=other)]


def draw_velocities(velocities: Mapping[str, SurfaceVelocity], frequency: Sequence[float]) -> list[Axes]:
    """Draw levels on the faces at the strongest line, or the operating shape at the line nearest to `frequency`."""
    require(len(velocities) == 1, f"{len(velocities)} surface velocities: a figure shows one")
    ((name, velocity),) = velocities.items()
    if not frequency:
        return [plots.surface_velocity(velocity, name=name)]
    return [plots.operating_shape(velocity, line=_nearest(velocity.frequency, _single_frequency(frequency)), name=name)]


def write_motion(hand_offs: Mapping[str, HandOff], path: Path, frequency: Sequence[float]) -> None:
    """Write the motion of hand-offs to a file with one of the `SUFFIXES`.

    - .gif: one period of the mode or line nearest to `frequency`.
    - .glb: the same motion in three dimensions, coloured by its size, for slides and browsers.
    - .vtu: the same mode or line, without animation.
    - .vtkhdf: all modes or lines.
    - .unv: all modes and residual vectors of a housing.
    - .csv: modal assurance of two housings.

    frequency : frequency (Hz) of a mode or line, or empty. The default is the first elastic mode or the strongest
        line.

    Raises InputError if the hand-offs do not fit the kind of file.
    """
    if path.suffix == ".csv":
        write_text(path, _assurance_csv(hand_offs))
        return
    require(len(hand_offs) == 1, f"{len(hand_offs)} hand-offs: {path.name} shows one")
    (hand_off,) = hand_offs.values()
    if not isinstance(hand_off, ReducedHousing | SurfaceVelocity):
        raise InputError(f"{type(hand_off).__name__} does not go into {path.name}: choose a PNG")
    if path.suffix == ".unv":
        require(isinstance(hand_off, ReducedHousing), f"{path.name} holds modes: give a reduced housing")
        require(not frequency, f"{path.name} holds all modes: leave the frequency out")
        assert isinstance(hand_off, ReducedHousing)
        write_modal_uff(exported_modes(hand_off), path)
        return
    if path.suffix == ".vtkhdf":
        require(not frequency, f"{path.name} holds all modes or lines: leave the frequency out, or choose .vtu")
        if isinstance(hand_off, ReducedHousing):
            write_modes_vtkhdf(hand_off, path)
        else:
            write_velocity_vtkhdf(hand_off, path)
        return
    state = _state(hand_off, frequency)
    if path.suffix == ".gif":
        plots.animate(hand_off.surface, state, path)
        return
    if path.suffix == ".glb":
        _write_glb(hand_off.surface, state, path)
        return
    name = "normal_shape" if isinstance(hand_off, ReducedHousing) else "normal_velocity"
    parts = (
        {"": state.real} if isinstance(hand_off, ReducedHousing) else {"_real": state.real, "_imaginary": state.imag}
    )
    cells = {name + part: values for part, values in parts.items()}
    points = {f"motion{part}": vertex_motion(hand_off.surface, values) for part, values in parts.items()}
    write_vtu(hand_off.surface, path, cells=cells, points=points)


def _write_glb(surface: Surface, state: Any, path: Path) -> None:
    """Write a motion whose largest part is drawn as `DRAWN` times the size of the body."""
    motion = vertex_motion(surface, np.asarray(state, dtype=complex))
    size = np.linalg.norm(np.abs(motion), axis=1)
    largest = float(size.max()) or 1.0
    span = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    colours = colormaps["viridis"](size / largest)[:, :3]
    write_glb(surface, np.asarray(DRAWN * span / largest * motion, dtype=complex), colours, path)


def _state(hand_off: ReducedHousing | SurfaceVelocity, frequency: Sequence[float]) -> Any:
    """Return the normal motion (n_face,) of one mode or line."""
    if isinstance(hand_off, ReducedHousing):
        natural = hand_off.natural_frequency[: hand_off.mode_count]
        require(len(natural) > 0, "the housing has no modes in its band: there is nothing to move")
        first = min(int((natural == 0).sum()), len(natural) - 1)
        return hand_off.normal_shapes[_nearest(natural, _single_frequency(frequency)) if frequency else first]
    line = _nearest(hand_off.frequency, _single_frequency(frequency)) if frequency else plots.strongest_line(hand_off)
    return hand_off.normal_velocity[line]


def _assurance_csv(hand_offs: Mapping[str, HandOff]) -> str:
    """MAC with the natural frequencies (Hz) of one housing in the first column, of the other in the first row."""
    housings = {name: item.drop_ritz_vectors() for name, item in hand_offs.items() if isinstance(item, ReducedHousing)}
    require(len(housings) == len(hand_offs), "a table is made of reduced housings: choose a PNG")
    one, other = _pair(housings)
    table = modal_assurance(housings[one], housings[other])
    head = [f"MAC of {one} (rows) and {other}, Hz", *(f"{f:.6g}" for f in housings[other].natural_frequency)]
    rows = [
        [f"{f:.6g}", *(f"{value:.4f}" for value in row)]
        for f, row in zip(housings[one].natural_frequency, table, strict=True)
    ]
    return plots.Table(tuple(head), tuple(map(tuple, rows))).csv()


def _pair(housings: Mapping[str, ReducedHousing]) -> tuple[str, str]:
    """Names of two housings that have modes; else InputError."""
    require(
        len(housings) == 2,
        f"{len(housings)} housings: give one for its modes, two for their modal assurance",
    )
    one, other = housings
    for name in (one, other):
        require(len(housings[name].natural_frequency) > 0, f"{name} has no modes: nothing can be compared")
    return one, other


def _single_frequency(frequency: Sequence[float]) -> float:
    """Return the only frequency (Hz) of `frequency`; InputError for several."""
    require(len(frequency) == 1, f"{len(frequency)} frequencies are given: one is shown here")
    return frequency[0]


def _nearest(axis: FloatArray, wanted: float) -> int:
    """Index of the value of `axis` (Hz) nearest to `wanted`; InputError outside 0 to twice the highest."""
    require(len(axis) > 0, "there is neither mode nor line to choose from")
    require(
        bool(np.isfinite(wanted)) and 0 <= wanted <= 2 * axis[-1],
        f"at = {wanted:g} Hz: modes or lines lie between {axis[0]:g} and {axis[-1]:g} Hz",
    )
    return int(np.abs(axis - wanted).argmin())
