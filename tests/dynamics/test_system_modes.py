"""Modes of the whole gearbox: against dense matrices, small changes of parts, and another program."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.linalg import eigh

from nvhchain.dynamics import Bearing, Cylinder, RigidBody, Shaft, system_modes
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.testing.two_stages import STIFFNESS

SPEED = 2500 * 2 * pi / 60
TORQUE = 250.0


def _stiffness(assembly):
    """Stiffness of all unknowns; the mean slope of the synthetic laws is STIFFNESS."""
    drive = assembly.contact[0::2]
    return assembly.stiffness + (drive.T * np.array(STIFFNESS)) @ drive


@pytest.mark.parametrize("flexible", [False, True], ids=["rigid", "flexible"])
def test_undamped_modes_are_those_of_the_dense_matrices(make_gearbox, make_laws, make_housing, flexible, fidelity):
    gearbox, laws = replace(make_gearbox(), flexible_shafts=flexible), make_laws(plain_wheel=True)
    housing = make_housing(gearbox, modes=8)
    seats = [(bearing.shaft, bearing.z) for bearing in gearbox.bearings]
    found = system_modes(gearbox, laws, housing, input_torque=TORQUE, damped=False, planes=seats, fidelity=fidelity)
    a = assemble(gearbox, laws, housing, fidelity=fidelity)
    squared, shapes = eigh(_stiffness(a), np.diag(a.mass))
    wanted = np.sqrt(squared) / (2 * pi)
    assert found.frequency == pytest.approx(wanted, rel=1e-9)
    assert not found.damping.any()
    moved_seats = (found.housing_motion @ a.seat_shapes.T).reshape(len(wanted), -1, 3)
    moved = (found.plane_motion[:, :, :3] - moved_seats).reshape(len(wanted), -1)
    exact = (a.bearing_map @ shapes)[a.bearings.translations].T
    sign = np.sign((moved * exact).sum(axis=1).real)[:, None]
    assert sign * moved == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())
    for shares in (found.kinetic, found.strain):
        assert shares.sum(axis=1) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("damped", [True, False], ids=["damped", "undamped"])
def test_modes_with_gyroscopic_terms_solve_the_equations_of_motion(
    make_gearbox, make_laws, make_housing, damped, fidelity
):
    """det(λ² M + λ (C + G) + K) = 0; undamped ones need a Hermitian matrix, damped ones a general one."""
    gearbox, laws = replace(make_gearbox(), gyroscopic=True), make_laws(plain_wheel=True)
    housing, speed = make_housing(gearbox, modes=8), 100 * SPEED
    found = system_modes(
        gearbox, laws, housing, input_torque=TORQUE, input_speed=speed, damped=damped, fidelity=fidelity
    )
    a = assemble(gearbox, laws, housing, input_speed=speed, fidelity=fidelity)
    damping = a.damping if damped else speed * a.gyroscopic
    omega = 2 * pi * found.frequency
    eigenvalue = omega * (1j - found.damping / np.sqrt(1 - found.damping**2))
    root = np.sqrt(np.outer(a.mass, a.mass))
    system = [(_stiffness(a) + z * damping) / root + z**2 * np.eye(len(a.mass)) for z in eigenvalue]
    left = [np.linalg.svd(one, compute_uv=False)[-1] for one in system]
    assert max(np.array(left) / omega**2) < 1e-9
    still = system_modes(gearbox, laws, housing, input_torque=TORQUE, damped=damped, fidelity=fidelity)
    assert np.abs(found.frequency[: len(still.frequency)] / still.frequency - 1.0).max() > 0.01


def test_a_share_of_the_strain_is_the_gain_of_a_mode_from_a_stiffer_part(
    make_gearbox, make_laws, make_housing, fidelity
):
    """Rayleigh: a part stiffer by ε raises ω² by ε times its share; one of more mass lowers it."""
    gearbox, laws = replace(make_gearbox(), flexible_shafts=True), make_laws(plain_wheel=True)
    housing, grown = make_housing(gearbox, modes=8), 1e-5

    def modes(of=gearbox, of_laws=laws, held=housing):
        return system_modes(of, of_laws, held, input_torque=TORQUE, damped=False, fidelity=fidelity)

    found = modes()
    stiffer = replace(
        gearbox.bearings[2],
        radial_stiffness=gearbox.bearings[2].radial_stiffness * (1 + grown),
        axial_stiffness=gearbox.bearings[2].axial_stiffness * (1 + grown),
    )
    boxes = {
        f"bearing {stiffer.name}": modes(
            replace(gearbox, bearings=tuple(stiffer if b.name == stiffer.name else b for b in gearbox.bearings))
        ),
        "mesh A/B": modes(of_laws=(replace(laws[0], force=laws[0].force * (1 + grown)), laws[1])),
        "housing": modes(
            held=replace(
                housing,
                natural_frequency=housing.natural_frequency * np.sqrt(1 + grown),
                seat_residual=housing.seat_residual / (1 + grown),
            )
        ),
    }
    for part, changed in boxes.items():
        share = found.strain[:, found.strain_parts.index(part)]
        gain = ((changed.frequency / found.frequency) ** 2 - 1.0) / grown
        assert gain == pytest.approx(share, abs=2e-4), part
    last = gearbox.shafts[2]
    heavy = replace(
        last,
        segments=tuple(replace(part, density=part.density * (1 + grown)) for part in last.segments),
        bodies=tuple(
            RigidBody(
                body.z, *(size * (1 + grown) for size in (body.mass, body.polar_inertia, body.transverse_inertia))
            )
            for body in last.bodies
        ),
    )
    loss = 1.0 - (modes(replace(gearbox, shafts=(*gearbox.shafts[:2], heavy))).frequency / found.frequency) ** 2
    assert loss / grown == pytest.approx(found.kinetic[:, found.kinetic_parts.index("shaft C")], abs=2e-4)
    a_mode_of_the_housing = np.argmax(found.strain[:, found.strain_parts.index("housing")])
    assert found.kinetic[a_mode_of_the_housing, found.kinetic_parts.index("housing")] > 0.5


def test_a_spinning_rotor_on_two_bearings_agrees_with_another_program(make_gearbox, make_laws):
    """ROSS 2.3.0, 20 Timoshenko elements of Cowper's shear coefficient: a shaft of 500 × 40 mm with a disc.

    Damped frequencies (Hz) and damping ratios at 20000 rpm, bending modes only.
    """
    frequency = [185.3578, 193.5062, 392.8167, 633.5555, 753.7371, 886.8144, 1154.5172, 1318.5774]
    damping = [0.0018424, 0.0021581, 0.008304, 0.0165891, 0.0156816, 0.0150338, 0.0148095, 0.0069447]
    box = make_gearbox()
    rotor = Shaft(
        "A", box.shafts[0].axis, (Cylinder(-0.3, 0.2, 0.04),), (RigidBody(0.0, 8.0, 0.055, 0.03),), modal_damping=0.0
    )
    front = Bearing("A1", "A", -0.25, 2e7, 1e6, radial_damping=200.0)
    rear = Bearing("A2", "A", 0.15, 3e7, 1e6, radial_damping=300.0)
    others = tuple(bearing for bearing in box.bearings if bearing.shaft != "A")
    gearbox = replace(
        box,
        shafts=(rotor, *box.shafts[1:]),
        bearings=(front, rear, *others),
        flexible_shafts=True,
        gyroscopic=True,
    )
    laws = make_laws(plain_wheel=True)
    soft = (replace(laws[0], force=1e-7 * laws[0].force), laws[1])  # the train hardly holds the rotor
    found = system_modes(
        gearbox,
        soft,
        None,
        input_torque=1e-6,
        input_speed=20000 * pi / 30,
        planes=[("A", front.z), ("A", rear.z)],
        fidelity=DynamicsFidelity(1e-5, shaft_element=0.025, shaft_frequency=2e4),
    )
    moves = found.kinetic[:, found.kinetic_parts.index("shaft A")] > 0.99
    sideways = np.abs(found.plane_motion[:, :, :2]).max(axis=(1, 2)) > 1e-3
    own = found.frequency[moves & sideways], found.damping[moves & sideways]
    assert own[0][: len(frequency)] == pytest.approx(frequency, rel=2e-4)
    assert own[1][: len(frequency)] == pytest.approx(damping, rel=2e-3)
