"""Knobs of the housing's mesh, its modes and its radiating surface."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.fidelity.knob import Knobs, knob


# fmt: off
@dataclass(frozen=True)
class HousingFidelity(Knobs, package="housing"):
    """Mesh of the casting, modes and the transfer of its motion to the radiating surface."""

    element_size: float = knob(low=1e-5, high=1.0, unit="m", sweep=(0.02, 0.016, 0.013, 0.0105),
        meaning="edge of the quadratic tetrahedra")
    mode_ratio: float = knob(1.2, low=0.1, high=20.0, sweep=(1.0, 1.1, 1.2),
        meaning="natural modes are kept up to this multiple of the band's upper limit; Ritz vectors stand for the "
                "others")
    elements_per_turn: float = knob(16.0, high=1000.0, sweep=(8.0, 12.0),
        meaning="elements around bores and other round edges")
    elements_per_bending_wavelength: float = knob(4.0, low=0.1, high=100.0,
        sweep="a limit, beyond which the mesh is refused",
        meaning="fewest elements that are accepted in the wall at the upper band limit")
    samples_per_face: float = knob(6.0, low=0.5, high=100.0, step="surface", sweep=(1.0, 3.0),
        meaning="points per edge of a radiating face at which the motion of the skin is collected")
    voxels_per_face: float = knob(5.0, low=1.0, high=100.0, sweep="of imported housings only",
        meaning="cells per edge of a radiating face in which the envelope of an imported mesh is found")
    mapping_tolerance_db: float = knob(1.0, high=100.0, unit="dB",
        sweep="a limit, beyond which an imported housing is warned of",
        meaning="difference of sound power between radiating faces and skin beyond which a warning is given")
    corrected_frequencies: bool = knob(True, sweep="a correction, measured in docs/measured/housing/mesh_error.md",
        meaning="natural frequencies of quadratic tetrahedra are lowered by the estimated error of these elements")
    residual_flexibility: bool = knob(True, sweep=(False,),
        meaning="Ritz vectors and a static residual stand for excluded modes, or nothing")
    # fmt: on
