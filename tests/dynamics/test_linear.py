"""The gearbox linearised at its mean load: what alternating forces between the flanks do at the bearings."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.dynamics import flank_transfers
from nvhchain.dynamics.model.assembly import assemble

SPEED, SLOPES = 52.36, (3.6e8, 6.6e8)
LINES = np.array([20.0, 180.0, 350.0, 1200.0, 4800.0])


@pytest.mark.parametrize("face_points", [1, 3])
@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_forces_between_flanks_reach_the_bearings_as_by_the_impedance(
    make_gearbox, make_laws, make_housing, fidelity, torque, face_points
):
    """On the flanks that carry, at one and at several points across the face."""
    gearbox = replace(make_gearbox(), face_points=face_points, gyroscopic=True)
    laws, housing = make_laws(plain_wheel=True, mesh_ripple=0.0, error=0.0), make_housing(gearbox)
    (found,) = flank_transfers(
        gearbox, laws, [housing], LINES, input_torque=torque, input_speed=SPEED, fidelity=fidelity
    )
    a = assemble(gearbox, laws, housing, input_speed=SPEED, fidelity=fidelity)
    flanks = a.contact[int(torque < 0) : 2 * len(a.mesh) : 2]
    stiffness = a.stiffness + (flanks.T * (a.share * np.array(SLOPES)[a.mesh])) @ flanks
    into = np.stack([(a.share * (a.mesh == mesh)) @ flanks for mesh in (0, 1)], axis=1)
    for line, transfer in zip(LINES, found, strict=True):
        omega = 2 * np.pi * line
        dynamic = stiffness + 1j * omega * a.damping - omega**2 * np.diag(a.mass)
        expected = (a.bearing_stiffness + 1j * omega * a.bearing_damping) @ np.linalg.solve(dynamic, -into)
        assert np.abs(transfer - expected).max() < 1e-9 * np.abs(expected).max()


def test_other_natural_frequencies_of_the_housing_are_those_of_its_own_assembly(
    make_gearbox, make_laws, make_housing, fidelity
):
    """Woodbury's identity against another assembly; damping moves with the frequencies."""
    gearbox = make_gearbox()
    laws, housing = make_laws(plain_wheel=True, mesh_ripple=0.0, error=0.0), make_housing(gearbox)
    moved = housing.replace(
        natural_frequency=housing.natural_frequency * np.linspace(0.97, 1.05, len(housing.natural_frequency))
    )
    given = {"input_torque": 250.0, "input_speed": SPEED, "fidelity": fidelity}
    both = flank_transfers(gearbox, laws, [housing, moved], LINES, **given)
    (alone,) = flank_transfers(gearbox, laws, [moved], LINES, **given)
    np.testing.assert_allclose(both[1], alone, rtol=1e-9, atol=1e-12 * np.abs(alone).max())
    assert np.abs(both[1] - both[0]).max() > 0.01 * np.abs(alone).max()
