"""Modal transfer vectors and noise transfer functions against forced response and radiation, one after the other."""

import numpy as np
import pytest

from nvhchain.acoustics import radiate
from nvhchain.acoustics.radiation.modal_transfer import (
    modal_pressure,
    modal_transfer_vectors,
    noise_transfer_functions,
    transfer_pressure,
)
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import ForceSpectrum
from nvhchain.housing import respond
from nvhchain.testing import hand_offs as cases

POINTS = np.array([[1.0, 0.2, 0.0], [0.0, -1.3, 0.4]])
LINES = np.linspace(110.0, 2870.0, 47)


@pytest.fixture(scope="module")
def reduced():
    return cases.housing()


@pytest.fixture(scope="module")
def atv(reduced, air):
    return cases.monopoles(reduced.surface, POINTS, np.linspace(0.0, 3000.0, 16), air)


@pytest.fixture(scope="module")
def modal(atv, reduced, coarse):
    return modal_transfer_vectors(atv, reduced, LINES, fidelity=coarse)


def relative(value, reference):
    return np.abs(value - reference).max() / np.abs(reference).max()


def test_modal_and_noise_transfer_functions_equal_response_and_radiation(atv, reduced, modal, coarse):
    load = cases.forces(LINES, names=("B1", "A1", "A2"))  # matched by name
    long_way = radiate(atv, respond(reduced, load), fidelity=coarse)
    modes = modal_pressure(modal, reduced, load)
    bearings = transfer_pressure(noise_transfer_functions(modal, reduced), load)
    for short in (modes, bearings):
        assert short.frequency == pytest.approx(long_way.frequency)
        assert relative(short.pressure, long_way.pressure) < 1e-10
        assert short.input_speed == 100.0


def test_two_lines_that_are_one_take_the_same_operator(atv, reduced, modal, coarse):
    """As many lines as the operator has, but not the same: the second took that of the second."""
    load = cases.forces(np.concatenate([LINES[:1], LINES[:1] * (1 + 1e-12), LINES[2:]]))
    for short in (
        modal_pressure(modal, reduced, load),
        transfer_pressure(noise_transfer_functions(modal, reduced), load),
    ):
        long_way = radiate(atv, respond(reduced, load), fidelity=coarse)
        assert relative(short.pressure, long_way.pressure) < 1e-9


def test_modes_and_residual_both_matter(atv, reduced, modal, coarse):
    load = cases.forces(LINES)
    whole = modal_pressure(modal, reduced, load).pressure
    stiff = modal_pressure(modal.replace(residual=np.zeros_like(modal.residual)), reduced, load).pressure
    assert 1e-3 < relative(stiff, whole) < 1.0


def test_only_lines_with_force_are_returned_and_need_an_operator(reduced, modal):
    load = cases.forces(np.concatenate([LINES, [9000.0]]))
    force = load.force.copy()
    force[-1] = 0
    force[3:9] = 0
    partial = modal_pressure(modal, reduced, load.replace(force=force))
    assert partial.frequency.tolist() == [*LINES[:3], *LINES[9:]]
    whole = modal_pressure(modal, reduced, cases.forces(LINES).replace(force=load.force[:-1]))
    assert partial.pressure[3:] == pytest.approx(whole.pressure[9:])
    with pytest.raises(InputError, match=r"1 line with force \(9000"):
        modal_pressure(modal, reduced, load)


def test_lines_that_differ_by_rounding_are_the_same(reduced, modal):
    load = cases.forces(LINES)
    exact = modal_pressure(modal, reduced, load).pressure
    for shift in (1e-12, -1e-12):
        shifted = ForceSpectrum(LINES[3:] * (1 + shift), load.force[3:], load.names)
        assert relative(modal_pressure(modal, reduced, shifted).pressure, exact[3:]) < 1e-8


def test_another_housing_surface_or_bearing_is_refused(atv, reduced, modal, coarse):
    other = reduced.replace(modal_damping=2 * reduced.modal_damping)
    with pytest.raises(InputError, match="another housing"):
        modal_pressure(modal, other, cases.forces(LINES))
    with pytest.raises(InputError, match="another housing"):
        noise_transfer_functions(modal, other)
    moved = reduced.surface.replace(vertices=1.1 * reduced.surface.vertices)
    with pytest.raises(InputError, match="another surface"):
        modal_transfer_vectors(atv, reduced.replace(surface=moved), LINES, fidelity=coarse)
    with pytest.raises(InputError, match="unknown to it: Z; without force: B1"):
        modal_pressure(modal, reduced, cases.forces(LINES, names=("A1", "A2", "Z")))


def test_operators_survive_the_disk(tmp_path, reduced, modal):
    load = cases.forces(LINES)
    functions = noise_transfer_functions(modal, reduced)
    loaded = [hdf5.load(hdf5.save(x, tmp_path / f"{i}.h5")) for i, x in enumerate((modal, functions))]
    assert np.array_equal(
        modal_pressure(loaded[0], reduced, load).pressure, modal_pressure(modal, reduced, load).pressure
    )
    assert np.array_equal(transfer_pressure(loaded[1], load).pressure, transfer_pressure(functions, load).pressure)


def test_undamped_mode_driven_at_its_resonance_is_refused_as_by_the_forced_response(atv, reduced, coarse):
    undamped = reduced.replace(modal_damping=np.zeros_like(reduced.modal_damping))
    at = undamped.natural_frequency[1:2]
    load = cases.forces(at)
    modal = modal_transfer_vectors(atv, undamped, at, fidelity=coarse)
    resonant = rf"mode 2 at {at[0]:.6g} Hz has no damping and is driven at its resonance"
    for answer in (
        lambda: respond(undamped, load),
        lambda: modal_pressure(modal, undamped, load),
        lambda: noise_transfer_functions(modal, undamped),
        lambda: undamped.receptance(at, structural=True),
    ):
        with pytest.raises(InputError, match=resonant):
            answer()
    assert np.isfinite(undamped.receptance(1.001 * at)).all()
    assert np.isfinite(undamped.receptance(at, damping=np.array([0.01]))).all()
