"""A second way to the steady state: harmonic balance of the mesh forces over the exact impedance, no time stepping.

With constant mesh stiffness k in the linear part, contact deflections d obey d̂(ω) = load − G(jω) r̂(ω),
G = W (K + WᵀkW + jωC − ω²M)⁻¹ Wᵀ, r = F(θ, d) − k d at every instant of the common period: N instants, N/2 harmonics,
solved by Newton's method.
"""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.fidelity import DynamicsFidelity

INSTANTS = 720


def _force(law, phase, deflection):
    """F and ∂F/∂δ at matching phases (in periods) and deflections, linear in both between the tabulated values."""
    place = np.mod(phase, 1.0) * len(law.angle)
    row = place.astype(int) % len(law.angle)
    share = (place - np.floor(place))[:, None]
    rows = (1 - share) * law.force[row] + share * law.force[(row + 1) % len(law.angle)]
    cell = np.clip(np.searchsorted(law.deflection, deflection) - 1, 0, len(law.deflection) - 2)
    at = np.arange(len(place))
    slope = (rows[at, cell + 1] - rows[at, cell]) / np.diff(law.deflection)[cell]
    return rows[at, cell] + slope * (deflection - law.deflection[cell]), slope


def _harmonic_balance(gearbox, laws, torque, speed):
    """(INSTANTS, 3 n_bearing) bearing forces over ¼ turn of the input, and drive-flank deflections."""
    a = assemble(gearbox, laws, None)
    load = a.load(shaft_torques(gearbox, a.train, torque))
    drive, n = a.contact[0::2], INSTANTS
    k = np.array([3.6e8, 6.6e8])
    stiffness = a.stiffness + (drive.T * k) @ drive
    base = 4.0 * speed
    omega = base * np.fft.rfftfreq(n, 1.0 / n)
    inverse = np.array([np.linalg.inv(stiffness + 1j * w * a.damping - w**2 * np.diag(a.mass)) for w in omega])
    receptance = drive @ inverse @ drive.T
    # in time: circulant blocks, rows of the response to a unit pulse
    pulse = np.fft.irfft(receptance, n, axis=0)
    index = (np.arange(n)[:, None] - np.arange(n)) % n
    convolution = pulse[index].transpose(0, 2, 1, 3).reshape(2 * n, 2 * n)
    static = np.tile(drive @ np.linalg.solve(stiffness, load), n)
    phases = np.arange(n)[:, None] / n * [5, 3]
    d = static.copy()
    for _ in range(40):
        pairs = [_force(law, phases[:, i], d[i::2]) for i, law in enumerate(laws)]
        force, slope = (np.stack([pair[j] for pair in pairs], axis=1).ravel() for j in (0, 1))
        excess = force - np.tile(k, n) * d
        residual = d - static + convolution @ excess
        if np.abs(residual).max() < 1e-13:
            break
        jacobian = np.eye(2 * n) + convolution * (slope - np.tile(k, n))
        d = d - np.linalg.solve(jacobian, residual)
    else:
        raise AssertionError("harmonic balance did not converge")
    assert (force > 0).all()  # no contact loss, no back flank: what this solution assumes
    spectrum = np.fft.rfft(excess.reshape(n, 2), axis=0)
    x = -(inverse @ (drive.T @ spectrum[:, :, None]))[:, :, 0]
    x[0] += n * np.linalg.solve(stiffness, load)
    bearing = (a.bearing_stiffness @ x[:, :, None] + 1j * omega[:, None, None] * a.bearing_damping @ x[:, :, None])[
        ..., 0
    ]
    return np.fft.irfft(bearing, n, axis=0), d.reshape(n, 2)


@pytest.mark.parametrize("rpm", [900.0, 2500.0, 4200.0])
def test_steady_orders_are_those_of_the_harmonic_balance(make_gearbox, make_laws, rpm):
    gearbox, laws = make_gearbox(damping=10_000.0), make_laws(plain_wheel=True)
    speed = rpm * 2 * pi / 60
    expected, deflection = _harmonic_balance(gearbox, laws, 250.0, speed)
    record = bearing_forces(
        gearbox,
        laws,
        None,
        input_speed=speed,
        input_torque=250.0,
        f_max=4000.0,
        fidelity=DynamicsFidelity(5e-6, angle_refinement=1, settle_level=1e-7),
    )
    count = len(record.time)
    found = np.fft.rfft(record.force.reshape(count, -1), axis=0) / count
    wanted = np.fft.rfft(expected, axis=0) / INSTANTS
    lines = slice(1, 40)  # orders 4 … 156
    strongest = np.abs(wanted[lines]).max()
    assert np.abs(found[0] - wanted[0]).max() < 1e-5 * np.abs(wanted[0]).max()
    assert np.abs(found[lines] - wanted[lines]).max() < 1e-3 * strongest
    assert np.ptp(record.mesh_deflection, axis=0) == pytest.approx(np.ptp(deflection, axis=0), rel=5e-3)
