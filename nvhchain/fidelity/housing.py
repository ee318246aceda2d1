"""Knobs of the housing's mesh, its modes and its radiating surface."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.fidelity.limits import within


@dataclass(frozen=True)
class HousingFidelity:
    """Mesh of the casting, modes and the transfer of its motion to the radiating surface.

    element_size: m, quadratic tetrahedra.  mode_ratio: modes up to this multiple of the band's upper limit.
    truncation_tolerance_db: dB of surface velocity that may be lost with the modes left out, in the mean over the upper
    three octaves of the band and at the four lines that the provenance states, by the housing's own estimate; the
    fewest modes that keep to it are taken, never fewer than the band holds, looked for from mode_ratio up; 0:
    mode_ratio alone decides.
    elements_per_turn: around bores and other round edges.  elements_per_bending_wavelength: fewest that are accepted
    in the wall at the upper band limit.  samples_per_face: points per edge of a radiating face at which the motion of
    the skin is collected.  voxels_per_face: of the grid in which the envelope of a foreign mesh is found, per edge of a
    radiating face.  mapping_tolerance_db: dB by which the radiating faces may miss the sound power of the skin they
    stand for before it is warned of.
    residual_flexibility: whether the modes left out move statically, or not at all.
    """

    element_size: float
    mode_ratio: float = 1.25
    elements_per_turn: float = 16.0
    elements_per_bending_wavelength: float = 4.0
    samples_per_face: float = 6.0
    voxels_per_face: float = 5.0
    mapping_tolerance_db: float = 1.0
    truncation_tolerance_db: float = 0.0
    residual_flexibility: bool = True

    def __post_init__(self) -> None:
        within(
            self,
            "housing",
            ("element_size", 1e-5, 1.0),
            ("mode_ratio", 0.1, 20.0),
            ("elements_per_turn", 0.0, 1000.0),
            ("elements_per_bending_wavelength", 0.1, 100.0),
            ("samples_per_face", 0.5, 100.0),
            ("voxels_per_face", 1.0, 100.0),
            ("mapping_tolerance_db", 0.0, 100.0),
            ("truncation_tolerance_db", 0.0, 20.0),
        )
