"""Housings with one mode or none, hardly damped or hardly moving, and castings of any size: right, or refused."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nvhchain.acoustics import (
    modal_pressure,
    modal_transfer_vectors,
    noise_transfer_functions,
    radiate,
    sphere,
    transfer_pressure,
    transfer_vectors,
)
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ForceSpectrum, ReducedHousing
from nvhchain.housing import Bore, GearSpace, respond
from nvhchain.testing.bodies import reference_casting
from nvhchain.testing.scales import ANY, mostly, powers
from tests.housing.seat_motion import seat_displacement

BALL = sphere(0.1, 2)
KNOBS = AcousticsFidelity(elements_per_wavelength=4.0, masters=8)
MASTERS = np.linspace(50.0, 800.0, 6)
VECTORS = []
REFERENCE = reference_casting()
LENGTHS = (
    "wall", "end_wall", "depth", "bell_depth", "draft", "chamfer", "boss_thickness", "cover_thickness",
    "flange_width", "flange_thickness", "bolt_radius", "lug_radius", "rib_height", "rib_thickness", "modal_damping",
)  # fmt: skip


def vectors():
    """Transfer vectors of the ball, made once."""
    if not VECTORS:
        VECTORS.append(transfer_vectors(BALL, [[0.0, 0.0, 1.0]], MASTERS, fidelity=KNOBS))
    return VECTORS[0]


def housing(modes, natural, damping, shape, residual):
    """Modes of one shape that moves along z, `natural` Hz apart."""
    return ReducedHousing(
        natural_frequency=natural * np.arange(1, modes + 1),
        modal_damping=np.full(modes, damping),
        seat_shapes=np.full((modes, 1, 3), shape),
        normal_shapes=shape * np.tile(BALL.normals[:, 2], (modes, 1)),
        seat_residual=residual * np.eye(3).reshape(1, 3, 1, 3),
        face_residual=residual * np.tile(BALL.normals[:, 2], (1, 3, 1)),
        names=("A1",),
        positions=np.zeros((1, 3)),
        surface=BALL,
    )


@given(
    modes=st.integers(0, 4),
    natural=powers(1e-2, 1e7),
    damping=st.one_of(st.just(0.0), powers(1e-9, 0.9)),
    shape=powers(1e-9, 1e6),
    residual=st.one_of(st.just(0.0), powers(1e-20, 1e-2)),
    force=powers(1e-9, 1e12),
)
def test_response_and_sound_of_any_housing_are_the_sum_of_its_modes(
    tried, modes, natural, damping, shape, residual, force
):
    """Closed form: the ball moves as a whole along z, and three ways to its sound agree."""
    lines = np.array([60.0, 300.0, 750.0])
    made = tried(housing, modes, natural, damping, shape, residual)
    spectrum = ForceSpectrum(lines, np.full((3, 1, 3), force, complex), ("A1",), 10.0)
    velocity = tried(respond, made, spectrum)
    omega, natural_omega = 2 * np.pi * lines[:, None], 2 * np.pi * made.natural_frequency
    receptance = 1.0 / (natural_omega**2 - omega**2 + 2j * damping * natural_omega * omega)
    moved = 3 * force * (shape**2 * receptance.sum(axis=1) + residual)
    expected = 1j * omega * moved[:, None] * BALL.normals[:, 2]
    assert np.abs(velocity.normal_velocity - expected).max() <= 1e-9 * np.abs(expected).max()
    seat = seat_displacement(made, lines, np.full((3, 3), force, complex))
    seats = 3 * force * shape**2 * receptance.sum(axis=1) + force * residual
    assert np.abs(seat[:, 2] - seats).max() <= 1e-9 * np.abs(seats).max()
    direct = radiate(vectors(), velocity, fidelity=KNOBS).pressure
    modal = tried(modal_transfer_vectors, vectors(), made, lines, fidelity=KNOBS)
    for found in (
        modal_pressure(modal, made, spectrum),
        transfer_pressure(noise_transfer_functions(modal, made), spectrum),
    ):
        # single modes may cancel in the sum
        size = max(
            np.abs(direct).max(), 1e-3 * np.abs(modal.modes).max(initial=0.0) * force * shape * np.abs(receptance).sum()
        )
        assert np.abs(found.pressure - direct).max() <= 1e-8 * size


@given(natural=ANY, damping=ANY, shape=ANY, residual=ANY)
def test_nonsense_in_a_reduced_housing_is_refused_or_responds_finitely(tried, natural, damping, shape, residual):
    made = tried(housing, 2, natural, damping, shape, residual)
    if made is None:
        return
    velocity = tried(respond, made, ForceSpectrum([100.0], np.ones((1, 1, 3), complex), ("A1",), 10.0))
    assert velocity is None or np.isfinite(velocity.normal_velocity).all()


@given(st.data())
def test_a_casting_of_any_numbers_is_valid_or_refused(tried, data):
    """The reference casting, one or two of its numbers changed by a factor or to anything."""
    changes = {}
    for name in data.draw(st.lists(st.sampled_from(LENGTHS), max_size=2)):
        factor = data.draw(mostly(powers(0.3, 3.0)), label=name)
        changes[name] = getattr(REFERENCE, name) * factor
    if data.draw(st.booleans()):
        name = data.draw(st.sampled_from(["bolts", "spokes", "side_ribs"]))
        changes[name] = data.draw(st.one_of(st.integers(-3, 300), ANY), label=name)
    if data.draw(st.booleans()):
        x, z, radius = (data.draw(mostly(powers(1e-2, 0.3))) for _ in range(3))
        changes["bores"] = tried(lambda: (Bore("A", (x, 0.0, z), radius), Bore("B", (x, 0.0, 0.221), 0.02)))
        changes["gear_spaces"] = tried(lambda: (GearSpace((x, 0.0), 1.6 * radius), GearSpace((x + 0.1, 0.0), 0.1)))
    if None in changes.values():
        return
    casting = tried(replace, REFERENCE, **changes)
    if casting is not None:
        assert casting.depth > casting.bell_depth > 0
        assert all(np.isfinite(getattr(casting, name)) for name in LENGTHS)
