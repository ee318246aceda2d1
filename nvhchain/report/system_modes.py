"""Modes of a gearbox for people: a table, a Campbell diagram, and lines for the terminal."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np

from nvhchain import plots
from nvhchain.case import Case, GearboxCase
from nvhchain.dynamics import SystemModes
from nvhchain.errors import InputError
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.atomic_write import write_output
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.result_cache import Watcher
from nvhchain.kinds import checked
from nvhchain.levels import number_text
from nvhchain.plots import files
from nvhchain.report.marks import mesh_orders
from nvhchain.report.recorded_modes import HARMONICS, mesh_share, modes_over_speed

SHOWN = 12
"""Modes on the terminal: those whose meshes hold most of the strain energy."""
_WORTH = 0.02
"""Smallest share of the meshes in the strain energy of a mode that meets a mesh order."""


@dataclass(frozen=True)
class ModeReport:
    """Modes of a case, with files and lines.

    modes: modes at the nominal speed, up to the highest frequency asked for.
    lines: lines for a terminal.
    files: table (CSV) and Campbell diagram (PNG).
    """

    modes: SystemModes
    lines: tuple[str, ...]
    files: tuple[Path, ...]


@checked
def report_modes(
    case: Case,
    *,
    out: str | Path,
    fidelity: Fidelity = STANDARD,
    operators: str | Path | None = None,
    highest: float | None = None,
    damped: bool = True,
    watcher: Watcher | None = None,
) -> ModeReport:
    """Compute the modes of a gearbox and write their table and Campbell diagram.

    fidelity: knobs of mesh laws, housing and dynamics.
    operators: folder for mesh laws and housing (default: `out`).
    highest: highest frequency (Hz); the upper limit of the case's band by default.
    damped: False leaves all damping out.
    watcher: receives begin and end of the steps.
    """
    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} is a radiator: it has no shafts and meshes")
    found = modes_over_speed(case, fidelity=fidelity, out=out, operators=operators, damped=damped, watcher=watcher)
    top = highest or case.band.high
    nominal_modes, *speed_modes = (_limited(modes, top) for modes in found)
    folder = writable_folder(out, "out")
    table, picture = folder / "modes.csv", folder / "campbell.png"
    write_output(table, _table(nominal_modes).encode())
    meshes = mesh_orders(case)
    rates = {name: order / (2.0 * pi) for name, order in meshes.items()}
    axes = plots.campbell(
        np.array([modes.input_speed for modes in speed_modes]),
        [modes.frequency for modes in speed_modes],
        [mesh_share(modes) for modes in speed_modes],
        {f"{name} × {k}": k * rate for name, rate in rates.items() for k in range(1, HARMONICS + 1)},
        nominal=nominal_modes.input_speed,
    )
    files.save([axes], picture)
    return ModeReport(nominal_modes, tuple(_lines(nominal_modes, rates)), (table, picture))


def _limited(modes: SystemModes, top: float) -> SystemModes:
    kept = int(np.searchsorted(modes.frequency, top, side="right"))
    rows = ("frequency", "damping", "kinetic", "strain", "plane_motion", "housing_motion")
    return replace(modes, **{name: getattr(modes, name)[:kept] for name in rows})


def _table(modes: SystemModes) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    kinetic = [f"kinetic energy: {part}" for part in modes.kinetic_parts]
    strain = [f"strain energy: {part}" for part in modes.strain_parts]
    writer.writerow(["frequency / Hz", "damping ratio", *kinetic, *strain])
    for row in zip(modes.frequency, modes.damping, modes.kinetic, modes.strain, strict=True):
        frequency, damping, moving, strained = row
        writer.writerow([f"{frequency:.6g}", f"{damping:.4g}", *(f"{x:.4f}" for x in (*moving, *strained))])
    return text.getvalue()


def _lines(modes: SystemModes, rates: dict[str, float]) -> list[str]:
    """Return one line per mode that the meshes strain most, and per mesh order close to one of them."""
    mesh_shares = mesh_share(modes)
    shown = np.sort(np.argsort(-mesh_shares, kind="stable")[:SHOWN])
    lines = [
        f"{modes.frequency[i]:8.1f} Hz  damping {round(100 * modes.damping[i], 2) + 0.0:5.2f} %"
        f"  strain {_largest(modes, i, 'strain')}; moves {_largest(modes, i, 'kinetic')}"
        for i in shown
    ]
    candidates = np.flatnonzero(mesh_shares >= _WORTH)
    if not len(candidates):
        return [
            *lines,
            f"No mode strains the meshes by {100 * _WORTH:.0f} % or more: none is compared with their orders",
        ]
    for name, rate in rates.items():
        for k in range(1, HARMONICS + 1):
            excited = k * rate * modes.input_speed
            if excited > modes.frequency[-1]:
                lines.append(f"{name} × {k} at {excited:.1f} Hz and above: beyond all these modes (--highest)")
                break
            near = candidates[np.argmin(np.abs(modes.frequency[candidates] - excited))]
            away = 100.0 * (modes.frequency[near] / excited - 1.0)
            meets = modes.frequency[near] / (k * rate) * 30.0 / pi
            lines.append(
                f"{name} × {k} at {excited:.1f} Hz: next mode {modes.frequency[near]:.1f} Hz, "
                f"{number_text(away, '+.1f')} %, "
                f"met at {meets:.0f} rpm (meshes hold {100 * mesh_shares[near]:.0f} % of its strain)"
            )
    return lines


def _largest(modes: SystemModes, mode: int, kind: str) -> str:
    """Return the three largest shares of a mode, of 1 % at least."""
    names, shares = (
        (modes.strain_parts, modes.strain[mode]) if kind == "strain" else (modes.kinetic_parts, modes.kinetic[mode])
    )
    most = [i for i in np.argsort(-shares)[:3] if shares[i] >= 0.01]
    return ", ".join(f"{names[i]} {100 * shares[i]:.0f} %" for i in most)
