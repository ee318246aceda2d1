"""Modes of a gearbox kept beside its results in modes.json: Campbell diagram, shares of energy, motion of its parts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import chain
from nvhchain.case import Case, GearboxCase
from nvhchain.dynamics import SystemModes
from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import write_text
from nvhchain.handoff import ComplexArray
from nvhchain.report.marks import mesh_orders

FILE = "modes.json"
"""Name of the file."""

MOST = 60
"""Largest number of modes whose motion is kept."""

HARMONICS = 3
"""Harmonics of every mesh in the Campbell diagram."""

_SPEEDS = 9
_TIMES_NOMINAL = 1.5


def record_modes(case: Case, *, fidelity: Fidelity, out: Path, operators: Path) -> Path | None:
    """Compute the modes of a gearbox from stored hand-offs, and write modes.json; None where there are none."""
    if not isinstance(case, GearboxCase):
        return None
    try:
        found = modes_over_speed(case, fidelity=fidelity, out=out, operators=operators)
    except (InputError, SolverError):
        return None
    content = json.dumps(mode_record(case, found[0], found[1:]))
    write_text(out / FILE, content + "\n")
    return out / FILE


def modes_over_speed(case: GearboxCase, **options: Any) -> Sequence[SystemModes]:
    """Return the modes at the nominal speed, then from rest to the end of a run-up, or to 1.5 times a constant speed.

    options : those of `chain.system_modes`.
    """
    nominal = case.operation.input_speed
    fastest = _TIMES_NOMINAL * nominal
    if case.ramp is not None:
        nominal = fastest = max(case.ramp.start_speed, case.ramp.end_speed)
    return chain.system_modes(case, [nominal, *np.linspace(0.0, fastest, _SPEEDS)], **options)


def mode_record(case: GearboxCase, modes: SystemModes, speed_modes: Sequence[SystemModes]) -> dict[str, Any]:
    """Return the content of modes.json."""
    kept = min(int(np.searchsorted(modes.frequency, case.band.high, side="right")), MOST)
    return {
        "input_torque_Nm": modes.input_torque,
        "nominal_rpm": 30.0 / pi * modes.input_speed,
        "speed_rpm": [30.0 / pi * mode_set.input_speed for mode_set in speed_modes],
        "over_speed_Hz": [_short(mode_set.frequency[mode_set.frequency <= case.band.high]) for mode_set in speed_modes],
        "over_speed_mesh_share": [
            _short(mesh_share(mode_set)[mode_set.frequency <= case.band.high]) for mode_set in speed_modes
        ],
        "orders": {
            f"{name} × {k}": k * order for name, order in mesh_orders(case).items() for k in range(1, HARMONICS + 1)
        },
        "frequency_Hz": _short(modes.frequency[:kept]),
        "damping": _short(modes.damping[:kept]),
        "strain": {part: _short(modes.strain[:kept, i]) for i, part in enumerate(modes.strain_parts)},
        "kinetic": {part: _short(modes.kinetic[:kept, i]) for i, part in enumerate(modes.kinetic_parts)},
        "planes": [
            *({"rotor": gear.rotor, "shaft": gear.shaft, "z": gear.z} for gear in case.gears),
            *({"rotor": bearing.shaft, "shaft": bearing.shaft, "z": bearing.z} for bearing in case.bearings),
        ],
        "plane_motion": _complex(modes.plane_motion[:kept]),
        "housing_motion": _complex(modes.housing_motion[:kept]),
        "cylinders": _cylinders(case),
    }


def mesh_share(modes: SystemModes) -> np.ndarray:
    """Return the share (n,) of all meshes in the strain energy."""
    meshes = [i for i, part in enumerate(modes.strain_parts) if part.startswith("mesh ")]
    return np.asarray(modes.strain[:, meshes].sum(axis=1))


def _cylinders(case: GearboxCase) -> list[dict[str, Any]]:
    """Return the segments of shafts, and gears with their teeth."""
    axes = {shaft.name: list(shaft.axis) for shaft in case.shafts}
    found = [
        {
            "rotor": shaft.name, "axis": axes[shaft.name], "ends": [segment.start, segment.end],
            "radii": [segment.outer_diameter / 2, segment.outer_diameter / 2], "teeth": 0,
        }
        for shaft in case.shafts
        for segment in shaft.segments
    ]  # fmt: skip
    for gear in case.gears:
        geometry = gear.geometry
        ends = [gear.z - geometry.face_width / 2, gear.z + geometry.face_width / 2]
        radii = [geometry.root_radius, geometry.tip_circle_radius]
        found.append(
            {"rotor": gear.rotor, "axis": axes[gear.shaft], "ends": ends, "radii": radii, "teeth": geometry.teeth}
        )
    return found


def _complex(values: ComplexArray) -> dict[str, Any]:
    return {"shape": list(values.shape), "real": _short(values.real.ravel()), "imag": _short(values.imag.ravel())}


def _short(values: np.ndarray) -> list[float]:
    return [float(f"{value:.6g}") for value in values]
