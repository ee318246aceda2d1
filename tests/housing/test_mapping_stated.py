"""What the mapping onto the radiating faces does to the sound power is stated of every casting."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import AccuracyWarning
from nvhchain.housing import reduce_housing, reduction
from nvhchain.housing.modes.seat_modes import seat_modes
from nvhchain.housing.reduction import held_matrices
from nvhchain.housing.skin.mapping_error import facet_flux, gathered, source_power

F_MAX = 1700.0


@pytest.fixture
def reduce_it(casting, fidelity, mesh, surface, monkeypatch):
    monkeypatch.setattr(reduction, "mesh_casting", lambda *_: mesh)
    monkeypatch.setattr(reduction, "radiating_surface", lambda *_: surface)
    return lambda tolerance: reduce_housing(
        casting, f_max=F_MAX, surface_size=0.022, fidelity=replace(fidelity, mapping_tolerance_db=tolerance)
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:housing elements of 30 mm")
def test_casting_states_the_error_of_its_mapping_and_warns_beyond_the_tolerance(reduce_it):
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "the radiating faces", AccuracyWarning)
        stated = reduce_it(1.0).accuracy
    found = stated.mapping_error_db
    assert stated.mapping_frequency.tolist() == pytest.approx([212.5, 425.0, 850.0, 1700.0])
    assert all(0 < abs(error) < 0.2 for error in found)
    with pytest.warns(AccuracyWarning, match="the radiating faces miss the sound power of the skin by"):
        assert reduce_it(0.0).accuracy.mapping_error_db.tolist() == found.tolist()


def test_power_of_sources_is_the_closed_double_sum():
    """P = (ρ ω²/8πc) Σ Q_i Q_j* sin(kr)/(kr) of 60 sources over two wavelengths."""
    rng = np.random.default_rng(3)
    places, flux = rng.uniform(-0.3, 0.3, (60, 3)), rng.standard_normal((60, 4)) + 1j * rng.standard_normal((60, 4))
    omega, r = 2 * np.pi * 2000.0, np.linalg.norm(places[:, None] - places, axis=2)
    exact = np.einsum("in,ij,jn->n", flux.conj(), np.sinc(omega / 343 * r / np.pi), flux).real
    expected = 1.21 * omega**2 / (8 * np.pi * 343) * exact
    np.testing.assert_allclose(source_power(flux, places, 2000.0), expected, rtol=1e-9)


def test_cells_of_a_quarter_of_a_face_keep_the_power_of_every_mode_within_a_thirtieth_of_a_decibel(casting, mesh):
    K, M, T = held_matrices(mesh, casting)
    flux = facet_flux(mesh.nodes, mesh.skin) @ (T @ seat_modes(K, M, len(casting.bores), 5600.0).shapes) + 0j
    centres = mesh.nodes[mesh.skin[:, :3]].mean(axis=1)
    exact = source_power(flux, centres, 4000.0)

    def worst(cell):
        places, gather = gathered(centres, cell * 0.022)
        return np.abs(10 * np.log10(source_power(gather @ flux, places, 4000.0) / exact)).max()

    assert worst(0.25) < 0.03 < 0.3 < worst(1.0)
