"""A small radiator and the pair of gears that the sweeps of these tests turn knobs on."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.case import FieldPoint, RadiatorCase, Sphere
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity


@pytest.fixture(scope="session")
def sphere():
    """An oscillating sphere: more lines than are solved one by one, and a field point in a weak direction."""
    points = (FieldPoint("front", (0.0, 0.1, 0.9)), FieldPoint("side", (0.6, 0.0, 0.2)))
    lines = tuple(200.0 + 100.0 * n for n in range(18))
    return RadiatorCase("sphere", Sphere(0.1), lines, points, pulsation=0.3, velocity=(0.0, 0.0, 1.0))


@pytest.fixture(scope="session")
def gearbox(request):
    """The single stage up to 2500 Hz: two modes of its housing."""
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    return replace(case, band=replace(case.band, high=2500.0))


@pytest.fixture(scope="session")
def tiny():
    """As coarse as the single stage can be modelled up to 2500 Hz, but for the slices."""
    gear = GearFidelity(
        profile_elements=2, width_layers=2, slices=32, angles_per_mesh=16, deflections=10, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    )  # fmt: skip
    housing = HousingFidelity(element_size=0.02, elements_per_turn=8)
    acoustics = AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0)
    return Fidelity("tiny", gear, DynamicsFidelity(time_step=40e-6), housing, acoustics)
