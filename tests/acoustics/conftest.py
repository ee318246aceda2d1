import pytest

from nvhchain.acoustics.solutions import quantities
from nvhchain.conventions import Air
from nvhchain.fidelity import AcousticsFidelity


@pytest.fixture(scope="session")
def air():
    return Air(speed_of_sound=343.0, density=1.21)


@pytest.fixture(scope="session")
def coarse():
    """Any mesh is fine enough: tests of physics choose their own meshes."""
    return AcousticsFidelity(elements_per_wavelength=3.0, masters=20)


@pytest.fixture
def solved(monkeypatch):
    """Wavenumbers that an engine was asked for."""
    seen, real = [], quantities.systems

    def systems(engine, surface, wavenumbers, *others):
        seen.extend(wavenumbers)
        return real(engine, surface, wavenumbers, *others)

    monkeypatch.setattr(quantities, "systems", systems)
    return seen
