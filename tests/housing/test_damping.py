"""Damping of the forced response: modal, structural, dependent on frequency; none at a resonance is refused."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.handoff import ForceSpectrum, ReducedHousing, Surface
from nvhchain.housing import respond
from nvhchain.housing.modes.damping import DampingCurve
from tests.housing.seat_motion import seat_displacement

TETRAHEDRON = Surface(
    vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    triangles=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
)


def oscillator(damping=0.02, natural=(500.0,)):
    """One seat; modes along x of unit modal force and unit face motion, no residual."""
    count = len(natural)
    shapes = np.zeros((count, 1, 3))
    shapes[:, 0, 0] = 1.0
    return ReducedHousing(
        natural_frequency=np.array(natural),
        modal_damping=np.full(count, damping),
        seat_shapes=shapes,
        normal_shapes=np.ones((count, 4)),
        seat_residual=np.zeros((1, 3, 1, 3)),
        face_residual=np.zeros((1, 3, 4)),
        names=("A",),
        positions=np.zeros((1, 3)),
        surface=TETRAHEDRON,
    )


def unit(frequency):
    """Unit force along x at every line."""
    force = np.zeros((len(frequency), 1, 3), dtype=complex)
    force[:, 0, 0] = 1.0
    return ForceSpectrum(frequency=np.array(frequency), force=force, names=("A",))


def test_constant_curve_is_the_modal_damping_viscous_and_structural():
    lines = unit([100.0, 499.0, 500.0, 2000.0])
    curve = DampingCurve(frequency=[1000.0], ratio=[0.02])
    for structural in (False, True):
        plain = respond(oscillator(0.02), lines, structural=structural).normal_velocity
        same = respond(oscillator(0.3), lines, structural=structural, damping=curve).normal_velocity
        assert np.abs(same - plain).max() <= 1e-15 * np.abs(plain).max()


def test_damping_of_a_line_is_read_from_the_curve_at_its_frequency():
    curve = DampingCurve(frequency=[400.0, 600.0], ratio=[0.01, 0.03])
    at = np.array([200.0, 450.0, 500.0, 900.0])
    velocity = respond(oscillator(), unit(at), damping=curve).normal_velocity[:, 0]
    zeta, omega, natural = np.array([0.01, 0.015, 0.02, 0.03]), 2 * np.pi * at, 2 * np.pi * 500.0
    exact = 1j * omega / (natural**2 - omega**2 + 2j * zeta * natural * omega)
    assert np.abs(velocity / exact - 1).max() < 1e-13


def test_structural_damping_acts_on_the_residual_too():
    housing = oscillator(0.05).replace(seat_residual=1e-9 * np.eye(3).reshape(1, 3, 1, 3))
    force = np.array([[0.0, 1.0, 0.0]], dtype=complex)  # across the mode: the residual alone
    plain = seat_displacement(housing, np.array([100.0]), force)[0, 1]
    lossy = seat_displacement(housing, np.array([100.0]), force, structural=True)[0, 1]
    curve = DampingCurve(frequency=[100.0], ratio=[0.2])
    other = seat_displacement(housing, np.array([100.0]), force, structural=True, damping=curve)[0, 1]
    assert plain == 1e-9
    assert lossy == pytest.approx(1e-9 / (1 + 0.1j), rel=1e-14)
    assert other == pytest.approx(1e-9 / (1 + 0.4j), rel=1e-14)


def test_half_power_width_of_structural_damping_is_the_loss_factor():
    # |H|² falls to a half where |1 − r²| = η: r² = 1 ± η
    eta = 0.04
    at = 500.0 * np.sqrt([1 - eta, 1.0, 1 + eta])
    u = respond(oscillator(eta / 2), unit(at), structural=True).normal_velocity[:, 0] / (2j * np.pi * at)
    assert np.abs(u[[0, 2]] / u[1]) ** 2 == pytest.approx([0.5, 0.5], rel=1e-12)


def test_undamped_mode_driven_at_its_resonance_is_refused_and_beside_it_answered():
    housing = oscillator(0.0, natural=(500.0, 700.0))
    with pytest.raises(InputError, match=r"mode 2 at 700 Hz has no damping and is driven at its resonance \(700 Hz\)"):
        respond(housing, unit([100.0, 700.0]))
    beside = respond(housing, unit([700.1])).normal_velocity
    assert np.isfinite(beside).all()
    with pytest.raises(InputError, match="mode 1 at 500 Hz"):
        respond(oscillator(), unit([500.0]), damping=DampingCurve(frequency=[0.0], ratio=[0.0]))
    with pytest.raises(InputError, match="mode 1 at 500 Hz"):
        respond(housing, unit([500.0]), structural=True)


def test_free_housing_follows_newton_and_has_no_answer_at_zero_frequency():
    free = oscillator(0.01, natural=(0.0,))
    omega = 2 * np.pi * 50.0
    velocity = respond(free, unit([50.0])).normal_velocity[0, 0]
    assert velocity == pytest.approx(1j * omega / -(omega**2), rel=1e-14)
    with pytest.raises(InputError, match="mode 1 at 0 Hz"):
        respond(free, unit([0.0, 50.0]))


@pytest.mark.parametrize(
    ("frequency", "ratio", "message"),
    [
        ([1.0, 2.0], [0.1], "give as many"),
        ([2.0, 1.0], [0.1, 0.1], "increase strictly"),
        ([1.0, 2.0], [0.1, 1.0], "fractions of critical"),
        ([1.0, 2.0], [-0.1, 0.5], "fractions of critical"),
        ([-1.0, 2.0], [0.1, 0.5], "not negative"),
        ([1.0, np.nan], [0.1, 0.5], "finite"),
    ],
)
def test_bad_damping_curves_are_refused(frequency, ratio, message):
    with pytest.raises(InputError, match=message):
        DampingCurve(frequency=frequency, ratio=ratio)
