"""Displacement and stress of one gear of a loaded pair."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff.base import FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value


class GearField(HandOff):
    """Displacement and stress of one gear of a pair under the forces of its contact lines at one angle, bore held.

    Notes
    -----
    Frame of the gear: z along the shaft from mid-width, tooth 0 on the x axis at z = 0.  Teeth count counter-clockwise.

    The displacement is that of the linear finite elements.  It holds the dents under the point forces of the slices,
    which depend on the mesh.  The local deflection of the contact (Weber–Banaschek) is given apart.
    Within an element of the contact lines neither displacement nor stress converges.
    """

    nodes: FloatArray = array("m", "node, axis", "nodes at rest", fewest=1)
    elements: IntArray = array(
        "1", "element, element_node", "nodes of bricks (20) or tetrahedra (10), in the order of VTK", fewest=1
    )
    displacement: FloatArray = array("m", "node, axis", "displacement of the nodes, bore held")
    von_mises: FloatArray = array("Pa", "node", "equivalent stress (von Mises), averaged at the nodes", lower_limit=0.0)
    gear: str = value("", "pinion or wheel")
    angle: float = value("rad", "wheel angle of the pair")
    teeth: int = value("1", "number of teeth", lower_limit=1)
    module: float = value("m", "normal module", lower_limit=1e-6)
    twist: float = value("rad/m", "turn of the teeth along z")
    mate_direction: float = value("rad", "direction of the mating gear's axis, counter-clockwise from the x axis")
    slice_tooth: IntArray = array("1", "slice", "tooth that carries the slice, from 0", lower_limit=0)
    slice_point: FloatArray = array("m", "slice, axis", "points of contact on the flanks")
    slice_force: FloatArray = array("N", "slice, axis", "force on the gear, friction included")
    local_deflection: FloatArray = array(
        "m", "slice", "local deflection of both flanks along their normal, apart from the displacement", lower_limit=0.0
    )
    friction: float = value("1", "coefficient of friction in the forces", default=0.0, lower_limit=0.0)

    def _check(self) -> None:
        require(self.gear in ("pinion", "wheel"), f"GearField.gear = {self.gear!r}: pinion or wheel")
        corners = self.elements.shape[1]
        require(corners in (10, 20), f"GearField.elements have {corners} nodes each: 10 or 20 are needed")
        low, high = int(self.elements.min()), int(self.elements.max())
        require(
            low >= 0 and high < len(self.nodes),
            f"GearField.elements refer to nodes {low}…{high}, but there are {len(self.nodes)}",
        )

    @property
    def kind(self) -> str:
        """Kind of the elements: "hex20" or "tet10"."""
        return "hex20" if self.elements.shape[1] == 20 else "tet10"

    @property
    def loaded_teeth(self) -> tuple[int, ...]:
        """Teeth that carry force."""
        carrying = np.abs(self.slice_force).max(axis=1, initial=0.0) > 0
        return tuple(int(tooth) for tooth in np.unique(self.slice_tooth[carrying]))

    def stress_away_from_contact(self) -> FloatArray:
        """Return the equivalent stress without that about the points of contact, where it does not converge.

        Returns (n,): equivalent stress after von Mises (Pa), 0 at nodes up to a normal module from a loaded slice.
        """
        away = np.ones(len(self.nodes), dtype=bool)
        for point in self.slice_point[np.abs(self.slice_force).max(axis=1, initial=0.0) > 0]:
            away &= ((self.nodes - point) ** 2).sum(axis=1) > self.module**2
        return np.where(away, self.von_mises, 0.0)
