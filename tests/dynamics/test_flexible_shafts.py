"""Flexible shafts: closed forms of the Timoshenko beam, condensation, and the gearbox that stands on them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, cosh, pi, sin, sinh, sqrt

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from nvhchain.dynamics import Cylinder, RigidBody, Shaft, bearing_forces, static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.shaft_beam import _beam, _nodes, elastic_shaft
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import static_state
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

SPEED = 2500 * 2 * pi / 60
LENGTH, RADIUS, YOUNG, NU, RHO = 0.25, 0.02, 210e9, 0.3, 7850.0
AREA, SECOND, SHEAR = pi * RADIUS**2, pi * RADIUS**4 / 4, YOUNG / 2 / (1 + NU)
KAPPA = 6 * (1 + NU) / (7 + 6 * NU)


def _shaft(**changes):
    return Shaft("S", (0.0, 0.0), (Cylinder(0.0, LENGTH, 2 * RADIUS),), **changes)


def _free_free(count):
    """Hz of the free Timoshenko beam by its differential equation: zeros of the determinant of the end conditions."""

    def determinant(omega):
        a, b = RHO * omega**2 / YOUNG, RHO * omega**2 / (KAPPA * SHEAR)
        c = RHO * AREA * omega**2 / (YOUNG * SECOND)
        # w = e^{pz}: p⁴ + (a + b) p² + a b − c = 0
        root = sqrt((a - b) ** 2 / 4 + c)
        d2, e2 = root - (a + b) / 2, root + (a + b) / 2
        d, e = sqrt(abs(d2)), sqrt(e2)
        m, n = (d2 + b) / d, (e2 - b) / e  # slope ψ: m sinh, m cosh and −n sin, n cos
        s = LENGTH
        rows = []
        for z in (0.0, s):
            # moment ψ′ and shear w′ − ψ of cosh dz, sinh dz, cos ez, sin ez
            rows.append([m * d * cosh(d * z), m * d * sinh(d * z), -n * e * cos(e * z), -n * e * sin(e * z)])
            rows.append([(d - m) * sinh(d * z), (d - m) * cosh(d * z), -(e - n) * sin(e * z), (e - n) * cos(e * z)])
        return np.linalg.det(rows)

    # below the frequency at which shear waves begin to travel, 2 π 66 kHz here, all roots are of this kind
    grid = np.linspace(2 * pi * 300, 2 * pi * 30e3, 2000)
    values = [determinant(omega) for omega in grid]
    return [
        brentq(determinant, low, high) / 2 / pi
        for (low, f), (high, g) in pairwise(zip(grid, values, strict=True))
        if f * g < 0
    ][:count]


def _bending(element):
    found = elastic_shaft(_shaft(), [], element=element, frequency=30e3)
    moving = np.abs(found.shapes[0, 0])
    hertz = np.sqrt(found.squared)[moving > 1e-6 * moving.max()] / 2 / pi
    # both planes: every frequency twice, of which x may share in both
    return hertz[np.concatenate([[True], np.diff(hertz) > 1e-6 * hertz[1:]])][:4]


def test_bending_frequencies_of_the_free_beam_are_those_of_its_differential_equation():
    wanted = np.array(_free_free(4))
    coarse, fine = (np.abs(_bending(element) / wanted - 1.0) for element in (1e-2, 5e-3))
    assert fine[:2].max() < 3e-4
    assert fine.max() < 2e-3
    assert coarse / fine == pytest.approx(4.0, rel=0.1)  # second order
    slender = 4.730041**2 / LENGTH**2 * sqrt(YOUNG * SECOND / RHO / AREA) / 2 / pi
    assert 0.85 * slender < wanted[0] < 0.95 * slender  # thick enough for shear and rotary inertia to matter


def test_axial_and_torsional_frequencies_are_those_of_the_rod():
    found = elastic_shaft(_shaft(), [], element=5e-3, frequency=30e3)
    end = np.abs(found.shapes[0])
    hertz = np.sqrt(found.squared) / 2 / pi
    along, turning = hertz[end[2] > 1e-6 * end[2].max()], hertz[end[5] > 1e-6 * end[5].max()]
    assert along[:2] == pytest.approx(sqrt(YOUNG / RHO) / 2 / LENGTH * np.array([1, 2]), rel=1e-3)
    assert turning[:3] == pytest.approx(sqrt(SHEAR / RHO) / 2 / LENGTH * np.array([1, 2, 3]), rel=2e-3)


def test_deflection_of_the_supported_beam_is_exact_with_one_element_per_span():
    """Load P in the middle: P l³/(48 E I) + P l/(4 κ G A)."""
    shaft = _shaft(bodies=(RigidBody(LENGTH / 2, 1.0, 1e-3, 1e-3),))
    z = _nodes(shaft, [], 1.0)
    assert len(z) == 3
    stiffness, _, _ = _beam(shaft, z)
    held = [0, 1, 2, 5, 12, 13]  # ux, uy at both ends; uz, twist once
    kept = np.setdiff1d(np.arange(18), held)
    load = np.zeros(18)
    load[[6, 7]] = 1e4, -2e4
    moved = np.zeros(18)
    moved[kept] = np.linalg.solve(stiffness[np.ix_(kept, kept)], load[kept])
    expected = LENGTH**3 / 48 / YOUNG / SECOND + LENGTH / 4 / KAPPA / SHEAR / AREA
    assert moved[[6, 7]] == pytest.approx([1e4 * expected, -2e4 * expected], rel=1e-9)
    # slope at the ends P l²/(16 E I), about +y for a load along +x and about −x … for one along −y
    slope = LENGTH**2 / 16 / YOUNG / SECOND
    assert moved[[4, 3]] == pytest.approx([1e4 * slope, 2e4 * slope], rel=1e-9)


def test_shear_coefficient_of_a_thin_tube_is_half_that_of_no_shear():
    """Cowper: κ → 2 (1 + ν)/(4 + 3 ν) for m → 1, 6 (1 + ν)/(7 + 6 ν) for the full circle; κ G A from the tip of a
    cantilever so short that shear is nearly all."""
    for inner, kappa in ((0.0, 6 * 1.3 / 8.8), (0.0996, 2 * 1.3 / 4.9)):
        shaft = Shaft("S", (0.0, 0.0), (Cylinder(0.0, 1e-3, 0.1, inner),))
        stiffness, _, _ = _beam(shaft, _nodes(shaft, [], 1.0))
        tip = np.linalg.inv(stiffness[6:, 6:])[0, 0]
        area = pi / 4 * (0.1**2 - inner**2)
        assert 1e-3 / tip / SHEAR / area == pytest.approx(kappa, rel=3e-3)


def test_condensed_statics_is_that_of_all_elements():
    """Free shaft under forces in balance: no mode is kept, or few, and the deflection between its nodes is the same."""
    shaft = _shaft(bodies=(RigidBody(0.08, 2.0, 4e-3, 2e-3),), coupled_inertia=0.01)
    places = (0.02, 0.08, 0.23)
    loads = [(z, np.eye(6)[i]) for z in places for i in range(6)]
    z = _nodes(shaft, list(places), 1e-2)
    stiffness, mass, _ = _beam(shaft, z)
    # forces and moments in balance on the free body
    push = np.zeros((len(z), 6))
    push[[np.argmin(np.abs(z - p)) for p in places], 0] = -0.7, 1.0, -0.3
    push[[np.argmin(np.abs(z - p)) for p in places], 5] = 5.0, -3.0, -2.0
    push[np.argmin(np.abs(z - 0.08)), 4] = 0.02 * 0.7 + 0.23 * 0.3 - 0.08
    flat = push.ravel()
    squared, shapes = eigh(stiffness, mass)
    elastic = slice(6, None)
    assert np.abs(shapes[:, :6].T @ flat).max() < 1e-9  # in balance
    wanted = shapes[:, elastic] @ (shapes[:, elastic].T @ flat / squared[elastic])
    for frequency in (0.0, 5e3, 20e3):
        found = elastic_shaft(shaft, loads, element=1e-2, frequency=frequency)
        of_all = found.shapes.reshape(len(mass), -1)
        moved = of_all @ (of_all.T @ flat / found.squared)
        assert np.abs(moved - wanted)[::6].max() < 1e-9 * np.abs(wanted).max()
        assert np.abs(of_all.T @ mass @ of_all - np.eye(len(found.squared))).max() < 1e-7
    assert len(elastic_shaft(shaft, loads, element=1e-2, frequency=0.0).squared) <= len(loads)


def test_a_spinning_flexible_shaft_whirls_as_its_elements_do():
    """The condensed gyroscopic matrix splits the first bending pair by as much as all elements together."""
    shaft = _shaft(bodies=(RigidBody(0.2, 5.0, 0.05, 0.026),))
    z = _nodes(shaft, [], 1e-2)
    stiffness, mass, spin = _beam(shaft, z)
    assert np.abs(spin + spin.T).max() < 1e-12 * np.abs(spin).max()
    found = elastic_shaft(shaft, [], element=1e-2, frequency=20e3)
    omega = 3000.0

    def pair(k, m, g):
        n = len(k)
        values = np.linalg.eigvals(
            np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(m, k), -omega * np.linalg.solve(m, g)]])
        ).imag
        return np.sort(values[values > 2 * pi * 300])[:2]

    size = 5 + len(found.squared)
    body = shaft.inertia()
    rigid = [body.mass] * 3 + [body.transverse_inertia] * 2
    condensed = pair(
        np.diag(np.concatenate([np.zeros(5), found.squared])),
        np.diag(rigid + [1.0] * (size - 5)),
        found.gyroscopic,
    )
    whole = pair(stiffness, mass, spin)
    assert whole[1] - whole[0] > 0.05 * whole[0]
    assert condensed == pytest.approx(whole, rel=1e-4)


def _stiff(gearbox, factor):
    shafts = tuple(
        replace(s, segments=tuple(replace(c, young=factor * c.young) for c in s.segments)) for s in gearbox.shafts
    )
    return replace(gearbox, shafts=shafts)


KNOBS = DynamicsFidelity(1e-5)


def _flexible(gearbox):
    return replace(gearbox, flexible_shafts=True)


def test_shafts_of_endless_stiffness_are_the_rigid_ones(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    housing = make_housing(gearbox, modes=8)
    operation = {"input_speed": SPEED, "input_torque": 250.0, "f_max": 5000.0}
    rigid = bearing_forces(gearbox, laws, housing, fidelity=KNOBS, **operation)
    errors = []
    for factor in (1.0, 1e3, 1e4):
        found = bearing_forces(_flexible(_stiff(gearbox, factor)), laws, housing, fidelity=KNOBS, **operation)
        errors.append(np.abs(found.force - rigid.force).max() / np.ptp(rigid.force, axis=0).max())
    assert errors[0] > 0.05
    assert errors[1] < 5e-3
    assert errors[2] < 0.2 * errors[1]


@pytest.mark.parametrize("torque", [250.0, -250.0])
def test_reactions_are_fixed_by_statics_however_the_shafts_bend(make_gearbox, make_laws, torque):
    """Radial reactions of two bearings per shaft, and the work of the torques: 2 U = F · δ with the mesh rigid."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    a = assemble(_flexible(gearbox), laws, None, fidelity=KNOBS)
    torques = shaft_torques(gearbox, a.train, torque)
    static = static_state(a, tabulate(laws, 1), torques, np.zeros(2))
    rigid = static_bearing_forces(gearbox, laws, None, input_torque=torque)
    assert static.bearing_force[:, :2] == pytest.approx(rigid[:, :2], abs=1e-6 * np.abs(rigid).max())
    # the sum along z of both bearings too, not its split
    assert static.bearing_force.reshape(3, 2, 3).sum(axis=1) == pytest.approx(
        rigid.reshape(3, 2, 3).sum(axis=1), abs=1e-6 * np.abs(rigid).max()
    )
    flank = 2 * np.arange(2) + (static.mesh_force < 0)
    x = static.position
    work = a.load(torques) @ x - np.abs(static.mesh_force) @ (a.contact[flank] @ x)
    assert work == pytest.approx(x @ a.stiffness @ x, rel=1e-9)
    # the output lags by more than with rigid shafts
    stiff = assemble(gearbox, laws, None)
    lag = [
        of.transmission_error @ static_state(of, tabulate(laws, 1), torques, np.zeros(2)).position for of in (a, stiff)
    ]
    assert abs(lag[0]) > 1.2 * abs(lag[1])
    assert lag[0] * torque > 0


def test_torque_twists_the_shaft_between_coupling_and_gear(make_gearbox, make_laws):
    """T l/(G J) of shaft A, l from the gear to where the torque enters, at the output times the speed ratio."""
    laws, lag = make_laws(plain_wheel=True), []
    for z in (0.05, 0.135, -0.115):
        gearbox = make_gearbox()
        shafts = (replace(gearbox.shafts[0], coupling_z=z), *gearbox.shafts[1:])
        a = assemble(_flexible(replace(gearbox, shafts=shafts)), laws, None, fidelity=KNOBS)
        torques = shaft_torques(gearbox, a.train, 250.0)
        lag.append(a.transmission_error @ static_state(a, tabulate(laws, 1), torques, np.zeros(2)).position)
    per_length = 250.0 / SHEAR / (pi / 32 * 0.03**4) * 0.4 * 30 / 82
    assert lag[1] - lag[0] == pytest.approx(0.085 * per_length, rel=1e-6)
    assert lag[2] - lag[0] == pytest.approx(0.165 * per_length, rel=1e-6)


def test_unknowns_stay_few(make_gearbox, make_laws, make_housing):
    gearbox = _flexible(make_gearbox())
    model = simulation(gearbox, make_laws(), make_housing(gearbox), input_torque=250.0, time_step=1e-5, fidelity=KNOBS)
    assert len(model.assembly.mass) < 110
    assert len(model.assembly.mass) > 15 + 30 + 2


def test_shafts_with_gaps_and_gears_beside_them_are_refused(make_gearbox, make_laws):
    gearbox = _flexible(make_gearbox())
    for segments, message in (
        ((Cylinder(-0.115, 0.0, 0.03), Cylinder(0.01, 0.135, 0.03)), r"no segment covers z = 0…10 mm"),
        ((Cylinder(-0.115, 0.1, 0.03),), r"stands at 105 mm: lengthen the shaft"),
        ((), "needs segments"),
    ):
        changed = replace(gearbox, shafts=(replace(gearbox.shafts[0], segments=segments), *gearbox.shafts[1:]))
        with pytest.raises(InputError, match=message):
            assemble(changed, make_laws(), None, fidelity=KNOBS)
