"""The contact problems of solid gears, and what they say about tilt, for the options of the dynamics."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import gear
from nvhchain.dynamics.time_loop.law_table import deflection_under
from nvhchain.fidelity import GearFidelity
from nvhchain.files.result_cache import code_version, fingerprint
from nvhchain.gear.drawing.blank import SOLID
from nvhchain.handoff import FloatArray, MeshLaw

TILT = 5e-5
"""rad, of the finite differences: 1 µm over 20 mm of face."""


def solid_solvers(case: Any, fidelity: GearFidelity, folder: Path) -> list[gear.Engagement]:
    """The contact problems of all pairs with solid gears, at any angle; their compliances are kept in `folder`."""
    pairs = [replace(pair, wheel=replace(pair.wheel, blank=SOLID)) for pair in case.pairs]
    kept = folder / f"solid-{fingerprint(code_version('gear'), pairs, fidelity)[:10]}.pickle"
    if not kept.exists():
        kept.write_bytes(pickle.dumps([gear.pair_compliances(pair, fidelity) for pair in pairs]))
    found = pickle.loads(kept.read_bytes())
    return [gear.Engagement(pair, c, fidelity) for pair, c in zip(pairs, found, strict=True)]


def _loaded(solver: gear.Engagement, law: MeshLaw, angle: float, force: float) -> tuple[Any, FloatArray, float]:
    """Contact lines, slice forces (n,) N and deflection, m, at `angle` under `force` in all."""
    tried = law.deflection[law.deflection > 0.0]
    total = np.concatenate([[0.0], solver.mesh_force(angle, tried)])
    deflection = deflection_under(np.concatenate([[0.0], tried]), total, force)
    lines, forces = solver.forces(angle, np.array([deflection]))
    return lines, forces[0], deflection


def tilt_stiffness(solver: gear.Engagement, law: MeshLaw, force: float) -> dict[str, float]:
    """How the contact under `force`, N, resists tilt in the plane of action, mean over a mesh period.

    Returns k b²/12 cos² β_b of slices side by side, the stiffness of the contact problem, both N m/rad, and the swing
    of the load's centre along the face, m.
    """
    pitch = 2.0 * np.pi / law.teeth[1]
    found = []
    for angle in np.arange(12) * pitch / 12:
        lines, forces, at = _loaded(solver, law, float(angle), force)
        near = solver.mesh_force(float(angle), np.array([at * 0.98, at * 1.02]))
        arm = np.cos(solver.pair.base_helix_angle) * lines.axial + solver.pair.sense * np.sin(
            solver.pair.base_helix_angle
        ) * (lines.position - solver.pair.pitch_point)
        tilted = [solver.forces_on(lines, (at + side * TILT * arm)[None, :])[0] for side in (-1.0, 1.0)]
        stiffness = (near[1] - near[0]) / (0.04 * at)
        found.append(
            [
                stiffness * (law.face_width * np.cos(law.base_helix_angle)) ** 2 / 12.0,
                (tilted[1] - tilted[0]) @ arm / (2.0 * TILT),
                forces @ lines.axial / forces.sum(),
            ]
        )
    slices, contact, centre = np.array(found).T
    return {"slices": float(slices.mean()), "contact": float(contact.mean()), "centre": float(np.ptp(centre))}
