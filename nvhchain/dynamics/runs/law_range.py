"""Deflections beyond the tabulated range of a mesh law, where its end slopes continue unchecked."""

from __future__ import annotations

from collections.abc import Sequence

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.runs.contact_loss import Parted, check_parted
from nvhchain.errors import warn_caller
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw

Excursions = dict[str, dict[str, float]]
"""Mesh, as `pinion shaft–wheel shaft`: lowest and highest deflection of its flanks, and the ends of the table (m)."""


def excursions(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], drive: FloatArray, back: FloatArray, fidelity: DynamicsFidelity
) -> Excursions:
    """Return the meshes whose flanks carry beyond the table; none at the level `contact`, which uses no table.

    drive, back : (n, n_mesh) deflections (m) of drive and back flanks, with the sign of the laws.

    The two differ because the flank normals differ and the shafts move apart under load. Each flank counts on the side
    to which it is pressed. It counts on the other side too where the law still pushes, or pulls, at its end.
    """
    found: Excursions = {}
    if fidelity.mesh_level == "contact":
        return found
    for mesh, law, front, behind in zip(gearbox.meshes, mesh_laws, drive.T, back.T, strict=True):
        lowest, highest = float(behind.min()), float(front.max())
        if law.force[:, 0].max() > 0.0:
            lowest = min(lowest, float(front.min()))
        if law.force[:, -1].min() < 0.0:
            highest = max(highest, float(behind.max()))
        low, high = float(law.deflection[0]), float(law.deflection[-1])
        if lowest < low or highest > high:
            found[f"{mesh.pinion_shaft}–{mesh.wheel_shaft}"] = {
                "lowest": lowest, "highest": highest, "table_lowest": low, "table_highest": high
            }  # fmt: skip
    return found


def marked(
    forces: BearingForces,
    back: FloatArray,
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    fidelity: DynamicsFidelity,
    parted: Parted,
) -> BearingForces:
    """Return `forces` with the names of its transmission errors in the provenance, such as A–B, B–C and A–C.

    Where they occur, `beyond_mesh_law` and `parted_flanks` are there, too.

    back : (n, n_mesh) deflections (m) of the back flanks.
    parted : contact loss by mesh.
    """
    names = [f"{mesh.pinion_shaft}–{mesh.wheel_shaft}" for mesh in gearbox.meshes]
    called = {"transmission_errors": [*names, f"{gearbox.input_shaft}–{gearbox.output_shaft}"]}
    beyond = excursions(gearbox, mesh_laws, forces.mesh_deflection, back, fidelity)
    found = {name: of for name, of in (("beyond_mesh_law", beyond), ("parted_flanks", parted)) if of}
    return forces.replace(provenance=forces.provenance | called | found)


def remind(forces: BearingForces) -> None:
    """Warn again of deflections beyond a mesh law and of contact loss in a record.

    Parameters
    ----------
    forces : BearingForces
        Record of `bearing_forces` or a run-up.

    Raises
    ------
    InputError
        If flanks separate under steps so long that the expected error reaches the peak force.

    Notes
    -----
    There is one AccuracyWarning per mesh.
    """
    warn_beyond_law(forces.provenance.get("beyond_mesh_law", {}))
    check_parted(forces.provenance.get("parted_flanks", {}))


def joined(parts: Sequence[Excursions]) -> Excursions:
    """Return the excursions of several pieces of one record."""
    whole: Excursions = {}
    for part in parts:
        for mesh, new in part.items():
            old = whole.get(mesh, new)
            extremes = {"lowest": min(old["lowest"], new["lowest"]), "highest": max(old["highest"], new["highest"])}
            whole[mesh] = new | extremes
    return whole


def warn_beyond_law(found: Excursions) -> None:
    """Warn of deflections beyond a mesh law (AccuracyWarning per mesh)."""
    for mesh, of in found.items():
        warn_caller(
            f"mesh {mesh}: deflections of {1e6 * of['lowest']:.4g}…{1e6 * of['highest']:.4g} µm leave the mesh law, "
            f"tabulated over {1e6 * of['table_lowest']:.4g}…{1e6 * of['table_highest']:.4g} µm and continued straight "
            "beyond: give housing and bearings damping, or tabulate the law to larger deflections"
        )
