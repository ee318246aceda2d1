"""Largest Hertzian pressure on the flanks of a loaded mesh, as drawn or with deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain.fidelity import GearFidelity
from nvhchain.gear.contact.engagement import Engagement, close_edges
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import DRIVE, GearPair
from nvhchain.gear.laws.deviated_load import pair_forces, tilted
from nvhchain.gear.laws.deviated_pairs import deviated_pairs, mesh_periods
from nvhchain.gear.laws.mesh_law import mesh_law, pair_compliances
from nvhchain.gear.laws.tooth_pairs import tooth_pairs
from nvhchain.gear.laws.transmission_error import loaded_mesh
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked

_SOLVED = 3
"""Mesh periods with the highest pressure by tooth pairs as springs, over which the contact problem is solved."""


@checked
def largest_contact_pressure(
    pair: GearPair, *, nominal_force: float, fidelity: GearFidelity, deviations: PairDeviations | None = None
) -> float:
    """Return the largest Hertzian pressure (Pa) of a mesh period as drawn, or of all turns with deviations.

    nominal_force: force along the flank normal (N).

    With deviations, tooth pairs as coupled springs find the mesh periods; the contact problem is solved there.
    """
    compliances = pair_compliances(pair, fidelity)
    contact = Engagement(pair, compliances, fidelity)
    angles = np.arange(float(fidelity.angles_per_mesh)) * (pair.mesh_period / fidelity.angles_per_mesh)
    if deviations is None:
        return _largest(contact, angles, nominal_force)
    law = mesh_law(pair, nominal_force=nominal_force, fidelity=fidelity, compliances=compliances)
    pairs = tooth_pairs(pair, law, nominal_force=nominal_force, fidelity=fidelity, compliances=compliances)
    later = mesh_periods(pair, deviations)
    made = deviated_pairs(pair, pairs, deviations, DRIVE, later)
    length, curvature = pairs.length[DRIVE], pairs.curvature[DRIVE]
    line_load = np.divide(made.weight, length * curvature, out=np.zeros_like(made.weight), where=length > 0).max(
        axis=-1
    )
    squared = (pair_forces(pairs, made, nominal_force) * tilted(made, line_load)).max(axis=-1)  # up to a constant
    highest = np.argsort(squared.reshape(-1, fidelity.angles_per_mesh).max(axis=1))[-_SOLVED:]
    angles = (highest[:, None] * pair.mesh_period + angles).ravel()
    contact = close_edges(contact, law.deflection[-1], -law.deflection[0] - pair.backlash)
    return _largest(replace(contact, deviations=deviations), angles, nominal_force)


def _largest(contact: Engagement, angles: FloatArray, force: float) -> float:
    """Return the largest pressure (Pa) at wheel angles (rad)."""
    pressed, highest = 1e-9 * force, 0.0
    for angle in angles:
        start = contact.first_contact(float(angle))  # below 0 where flanks lie ahead
        loaded = loaded_mesh(contact, float(angle), force, guess=max(start, 0.0) + pressed)
        pressed, highest = loaded.deflection - start, max(highest, float(loaded.pressure.max()))
    return highest
