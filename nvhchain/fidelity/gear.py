"""Knobs of gear bodies, tooth contact and mesh laws."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.errors import require
from nvhchain.fidelity.limits import whole, within

BODIES = ("elements", "analytic")
"""Ways to find how teeth and blanks give way."""


@dataclass(frozen=True)
class GearFidelity:
    """Finite element body, contact slices and the grid of the mesh law.

    profile_elements: quadratic elements along one flank.  width_layers: element layers over the face width; more where
    a web is thin.
    transverse_refinement: factor on the elements across tooth and rim (1: four across the tooth).
    row_aspect: radial over circumferential size of the blank's elements under the teeth.
    root_refinement: the same factor for the mesh in which root strain is read, of one tooth.
    load_pattern_tolerance: what is neglected of the forces a tooth passes to the body, relative.
    corner_gap: m, unloaded gap up to which contact of tip edges beyond the path of contact is looked for; 0: none.
    Where it is too small for the load (`gear.closing_edges`: heavy loads, aluminium, plastics) laws, load distributions
    and transmission errors take what the flanks approach each other by instead.
    bodies: how teeth and blanks give way, `elements` or, for a first look, `analytic` (Weber–Banaschek beam on
    Sainsot–Velex ring; it sees no hole or slot, and of a web its twist alone).
    far_pattern_tolerance: what of them is taken to answer alike at all teeth of a sector, relative.
    slices: axial slices of a contact line over the face width, or over each axial pitch of a wider face.
    angles_per_mesh: mesh-law angles per mesh period, which hold half as many harmonics.
    deflections: mesh-law deflections.  contact_residual: admissible residual of the complementarity
    problem, relative to the deflection scale.  drive_reach, back_reach: mesh-law forces on the drive and back flank,
    times the nominal force.
    """

    profile_elements: int
    width_layers: int
    slices: int
    angles_per_mesh: int
    deflections: int
    contact_residual: float = 1e-10
    transverse_refinement: int = 1
    row_aspect: float = 1.5
    load_pattern_tolerance: float = 1e-3
    far_pattern_tolerance: float = 3e-2
    bodies: str = "elements"
    corner_gap: float = 60e-6
    drive_reach: float = 3.0
    back_reach: float = 1.5
    root_refinement: int = 4

    def __post_init__(self) -> None:
        within(
            self,
            "gear",
            ("profile_elements", 1, 100),
            ("width_layers", 1, 200),
            ("slices", 1, 2000),
            ("angles_per_mesh", 2, 10_000),
            ("deflections", 6, 1000),
            ("contact_residual", 1e-13, 1e-4),
            ("transverse_refinement", 1, 16),
            ("root_refinement", 1, 16),
            ("row_aspect", 0.1, 10.0),
            ("load_pattern_tolerance", 0.0, 0.1),
            ("far_pattern_tolerance", 0.0, 0.5),
            ("drive_reach", 0.1, 100.0),
            ("back_reach", 0.1, 100.0),
            ("corner_gap", 0.0, 0.1),
        )
        whole(self, "gear", "profile_elements", "width_layers", "slices", "angles_per_mesh", "deflections")
        whole(self, "gear", "transverse_refinement", "root_refinement")
        # of those beyond both ends of the gap, as the mesh law shares them; the fewest deflections leave two
        driven = (self.deflections - 2) * self.drive_reach / (self.drive_reach + self.back_reach)
        require(
            driven > 1.5,
            f"gear back_reach = {self.back_reach:g} beside drive_reach = {self.drive_reach:g} leaves {driven:.2g} of "
            f"{self.deflections} deflections to the drive flank, which needs 2: lower back_reach, or raise drive_reach "
            "or deflections",
        )
        require(self.bodies in BODIES, f"gear bodies = {self.bodies!r} is unknown: choose from {', '.join(BODIES)}")
