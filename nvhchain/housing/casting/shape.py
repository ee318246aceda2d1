"""Shape of a casting for pictures."""

from __future__ import annotations

from nvhchain.fem.faces import flat_triangles
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import boundary_faces, mesh_casting
from nvhchain.housing.skin.shape import HousingShape


def casting_shape(casting: Casting, fidelity: HousingFidelity) -> HousingShape:
    """Mesh a casting and return its surface with seats and bolts."""
    mesh = mesh_casting(casting, fidelity)
    names = (bore.name for bore in casting.bores)
    triangles = flat_triangles(boundary_faces(mesh.elements))
    return HousingShape(mesh.nodes, triangles, dict(zip(names, mesh.seats, strict=True)), mesh.bolts)
