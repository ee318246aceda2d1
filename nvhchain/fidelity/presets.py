"""Fidelity of the whole chain and its three presets."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.errors import require
from nvhchain.fidelity.acoustics import AcousticsFidelity
from nvhchain.fidelity.dynamics import DynamicsFidelity
from nvhchain.fidelity.gear import GearFidelity
from nvhchain.fidelity.housing import HousingFidelity
from nvhchain.kinds import NAMES


@dataclass(frozen=True)
class Fidelity:
    """Accuracy of the whole chain: a name and one set of knobs per part.

    Parameters
    ----------
    name : str
        Name in provenance and messages.
    gear : GearFidelity
        Knobs of gear bodies, tooth contact and mesh laws.
    dynamics : DynamicsFidelity
        Knobs of the time integration.
    housing : HousingFidelity
        Knobs of the housing's mesh, modes and radiating surface.
    acoustics : AcousticsFidelity
        Knobs of boundary elements and master frequencies.
    option_tolerance_db : float
        Largest estimated effect (dB) of all options together that a case leaves to the program and that are excluded.

    Notes
    -----
    Estimates of options are right to a factor of two (docs/measured/chain/options_decided.md). Their tolerance is
    therefore at most half of the error that the preset stands for.
    """

    name: str
    gear: GearFidelity
    dynamics: DynamicsFidelity
    housing: HousingFidelity
    acoustics: AcousticsFidelity
    option_tolerance_db: float = 0.5

    def __post_init__(self) -> None:
        require(
            self.option_tolerance_db > 0.0,
            f"option_tolerance_db = {self.option_tolerance_db:g} dB must be positive: presets have 0.25 to 0.75 dB",
        )


NAMES[Fidelity] = "nvhchain.DRAFT, nvhchain.STANDARD, nvhchain.REFERENCE or another Fidelity"

DRAFT = Fidelity(
    "draft",
    GearFidelity(
        profile_elements=4,
        width_layers=3,
        slices=32,
        angles_per_mesh=64,
        deflections_per_doubling=3,
        layer_thickness=1.5,
        row_aspect=2.5,
        load_pattern_tolerance=3e-3,
        far_pattern_tolerance=0.1,
    ),
    DynamicsFidelity(time_step=20e-6),
    HousingFidelity(element_size=0.016),
    AcousticsFidelity(elements_per_wavelength=3.0, masters=64, master_tolerance_db=0.5),
    option_tolerance_db=0.75,
)
STANDARD = Fidelity(
    "standard",
    GearFidelity(
        profile_elements=4,
        width_layers=4,
        slices=32,
        angles_per_mesh=96,
        deflections_per_doubling=4,
        layer_thickness=1.1,
    ),
    DynamicsFidelity(time_step=10e-6),
    HousingFidelity(element_size=0.0105),
    AcousticsFidelity(elements_per_wavelength=4.5, masters=128, master_tolerance_db=0.25),
)
REFERENCE = Fidelity(
    "reference",
    GearFidelity(
        profile_elements=10,
        width_layers=6,
        slices=48,
        angles_per_mesh=192,
        deflections_per_doubling=8,
        layer_thickness=0.75,
        row_aspect=1.0,
        load_pattern_tolerance=3e-4,
        far_pattern_tolerance=0.01,
    ),
    DynamicsFidelity(time_step=5e-6),
    HousingFidelity(element_size=0.009, mode_ratio=1.6),
    AcousticsFidelity(
        elements_per_wavelength=5.0,
        masters=256,
        master_tolerance_db=0.02,
        quadrature_order=4,
        close_distances=(1.5, 3.0, 6.0),
        close_orders=(8, 6, 4),
        singular_order=5,
        coarsest_elements_per_wavelength=4.0,
    ),
    option_tolerance_db=0.25,
)
PRESETS = {preset.name: preset for preset in (DRAFT, STANDARD, REFERENCE)}
