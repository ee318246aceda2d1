"""Deflections beyond those over which a mesh law is tabulated: it continues there with its end slopes, unchecked."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from nvhchain.dynamics.gearbox import Gearbox
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, MeshLaw

Excursions = dict[str, dict[str, float]]
"""By mesh, as `pinion shaft–wheel shaft`: lowest and highest of the record and of the table, m."""


def excursions(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], forces: BearingForces, fidelity: DynamicsFidelity
) -> Excursions:
    """Meshes whose recorded deflection leaves the table; none at the levels that do not read it in the time loop."""
    found: Excursions = {}
    if fidelity.mesh_level != "table":
        return found
    for mesh, law, deflection in zip(gearbox.meshes, mesh_laws, forces.mesh_deflection.T, strict=True):
        lowest, highest = float(deflection.min()), float(deflection.max())
        low, high = float(law.deflection[0]), float(law.deflection[-1])
        if lowest < low or highest > high:
            found[f"{mesh.pinion_shaft}–{mesh.wheel_shaft}"] = {
                "lowest": lowest, "highest": highest, "table_lowest": low, "table_highest": high
            }  # fmt: skip
    return found


def marked(
    forces: BearingForces, gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], fidelity: DynamicsFidelity
) -> BearingForces:
    """`forces`, with `beyond_mesh_law` in their provenance where they have `excursions`."""
    beyond = excursions(gearbox, mesh_laws, forces, fidelity)
    return forces.replace(provenance=forces.provenance | {"beyond_mesh_law": beyond}) if beyond else forces


def remind(forces: BearingForces) -> None:
    """AccuracyWarning per mesh whose deflections `marked` found beyond its law."""
    warn_beyond_law(forces.provenance.get("beyond_mesh_law", {}))


def joined(parts: Sequence[Excursions]) -> Excursions:
    """Of several pieces of one record."""
    whole: Excursions = {}
    for part in parts:
        for mesh, new in part.items():
            old = whole.get(mesh, new)
            extremes = {"lowest": min(old["lowest"], new["lowest"]), "highest": max(old["highest"], new["highest"])}
            whole[mesh] = new | extremes
    return whole


def warn_beyond_law(found: Excursions) -> None:
    """AccuracyWarning per mesh."""
    for mesh, of in found.items():
        warnings.warn(
            f"mesh {mesh}: deflections of {1e6 * of['lowest']:.4g}…{1e6 * of['highest']:.4g} µm leave the mesh law, "
            f"tabulated over {1e6 * of['table_lowest']:.4g}…{1e6 * of['table_highest']:.4g} µm and continued straight "
            "beyond: give housing and bearings damping, or tabulate the law to larger deflections",
            AccuracyWarning,
            stacklevel=5,
        )
