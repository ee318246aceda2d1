"""The single stage up to 2500 Hz (two modes of its housing), as coarse as it can be modelled."""

from dataclasses import replace
from pathlib import Path

import nvhchain as nvh
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity

TINY = Fidelity(
    "tiny",
    GearFidelity(
        profile_elements=2, width_layers=2, slices=32, angles_per_mesh=16, deflections=10, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.02, elements_per_turn=8),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)  # fmt: skip


def gearbox():
    """The case."""
    case = nvh.load_case(Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml")
    return replace(case, band=replace(case.band, high=2500.0))
