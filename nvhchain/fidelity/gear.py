"""Knobs of gear bodies, tooth contact and mesh laws."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

from nvhchain.fidelity.knob import Knobs, knob

_DRIVE_DOUBLINGS, _BACK_DOUBLINGS = 3, 2
"""Doublings of the deflection up to the largest of a mesh law; below them its steps are even."""


_ANY_THICKNESS = 100.0
"""Thickness of layers (normal modules) that no gear reaches."""


# fmt: off
@dataclass(frozen=True)
class GearFidelity(Knobs, package="gear"):
    """Finite elements of the bodies, contact slices and the grid of the mesh law."""

    profile_elements: int = knob(low=1, high=100, sweep=(2, 4, 6), meaning="quadratic elements along one flank")
    width_layers: int = knob(low=1, high=200, sweep=(2, 3, 4),
        meaning="element layers of the blank over the face width; with a web between recesses at least four")
    slices: int = knob(low=1, high=2000, sweep=(8, 16, 32),
        meaning="axial slices of a contact line over the face width, or over each axial pitch of a wider face")
    angles_per_mesh: int = knob(low=2, high=10_000, sweep=(24, 48, 96),
        meaning="mesh-law angles per mesh period, which hold half as many harmonics; more at slow speeds, where the "
                "gears are solid")
    deflections_per_doubling: int = knob(low=1, high=100, sweep=(2, 3, 4),
        meaning="mesh-law deflections while the deflection doubles; about half as many on the back flank")
    layer_thickness: float = knob(_ANY_THICKNESS, low=0.05, high=1000.0, sweep=(1.5, 1.0),
        meaning="largest thickness of the element layers of a tooth, in normal modules; each layer of the blank is cut "
                "into equal ones")
    contact_residual: float = knob(1e-10, low=1e-13, high=1e-4, sweep=(1e-5, 1e-7),
        meaning="admissible residual of the complementarity problem, relative to the deflection scale")
    transverse_refinement: int = knob(1, low=1, high=16, sweep="1 is its coarsest value",
        meaning="factor on the elements across tooth and rim (1: four across the tooth)")
    row_aspect: float = knob(1.5, low=0.1, high=10.0, sweep=(2.5, 1.5),
        meaning="radial over circumferential size of the blank's elements under the teeth")
    load_pattern_tolerance: float = knob(1e-3, high=0.1, sweep=(1e-2, 3e-3, 1e-3),
        meaning="part of the forces from a tooth on the body that is neglected, relative")
    far_pattern_tolerance: float = knob(3e-2, high=0.5, sweep=(0.1, 0.03),
        meaning="combinations of these forces that pass less below the rim, relative to the strongest, "
                "do not answer one another through the web")
    bodies: str = knob("elements", choices=("elements", "analytic"), sweep=("analytic",),
        meaning="compliance of teeth and blanks: `elements` or, for a first look, `analytic`. The latter is a "
                "Weber–Banaschek beam on a Sainsot–Velex ring, without holes or slots, and of a web its twist alone")
    corner_gap: float = knob(60e-6, high=0.1, unit="m", sweep=(30e-6,),
        meaning="unloaded gap up to which contact of tip edges beyond the path of contact is sought; 0: none. Where it "
                "is too small for the load (`close_edges`) the approach of the flanks is taken instead")
    drive_reach: float = knob(2.0, low=0.1, high=100.0, sweep=(1.25, 1.5),
        meaning="force at which a mesh law ends on the drive flank, at its softest angle, over the load of the law, "
                "the next power of two above the nominal force")
    back_reach: float = knob(1.25, low=0.1, high=100.0, sweep=(0.5,),
        meaning="force at which a mesh law ends on the back flank, over the load of the law")
    root_refinement: int = knob(4, low=1, high=16, step="root strain", sweep="of root strains only",
        meaning="transverse_refinement of the mesh of one tooth in which root strain is read")
    # fmt: on

    def tooth_layers(self, width: float) -> int:
        """Return the element layers of a tooth over a face width (normal modules), whose blank has no thin web."""
        least = max(1, ceil(round(width / self.layer_thickness, 6)))
        return self.width_layers * -(-least // self.width_layers)

    def even_layers(self, count: int) -> GearFidelity:
        """Return the same knobs with `count` element layers in teeth and blanks, whatever the face width."""
        return replace(self, width_layers=count, layer_thickness=_ANY_THICKNESS)

    @property
    def law_steps(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Steps of a mesh law for each doubling of the deflection, and number of doublings, of drive and back flank."""
        drive = self.deflections_per_doubling
        return (drive, _DRIVE_DOUBLINGS), ((drive + 1) // 2, _BACK_DOUBLINGS)

    @property
    def deflections(self) -> int:
        """Deflections of a mesh law, with both ends of the gap."""
        return sum(steps * (doublings + 1) for steps, doublings in self.law_steps) + 2
