"""Geared flexible shafts against a model of their own: exact dynamic stiffness of every span from the differential
equations of the spinning Timoshenko beam (matrix exponential), all motions of all cross-sections coupled through rigid
gears on helical meshes. No elements, no modes, no condensation.

Equations: W. D. Pilkey, Formulas for Stress, Strain, and Structural Matrices, 2nd ed. (2005), ch. 10 (transfer
matrices); gyroscopic term of the cross-section: H. D. Nelson, J. Mech. Des. 102 (1980) 793–803, eq. (6).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from scipy.linalg import expm

import nvhchain as nvh
from nvhchain.dynamics import Cylinder, bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import MeshLaw

UNIT = 1e9
"""N/m: forces of the state are counted in it, which keeps the exponential well scaled."""


def _derivative(tube, omega, spin):
    """(12, 12) of the state [u, θ, Q, M] along z: u′ = …, Q′ = ρA ü, M′ = −ẑ × Q + rotary inertia."""
    outer, inner = tube.outer_diameter / 2, tube.inner_diameter / 2
    area, second = pi * (outer**2 - inner**2), pi / 4 * (outer**4 - inner**4)
    nu, m = tube.poisson, inner / outer
    cowper = 6 * (1 + nu) * (1 + m * m) ** 2 / ((7 + 6 * nu) * (1 + m * m) ** 2 + (20 + 12 * nu) * m * m)
    shear = tube.young / 2 / (1 + nu)
    heavy, rotary = tube.density * area, tube.density * second
    d = np.zeros((12, 12), complex)
    d[0, 4], d[1, 3] = 1.0, -1.0
    for i, stiffness in enumerate((cowper * shear * area, cowper * shear * area, tube.young * area)):
        d[i, 6 + i], d[6 + i, i] = 1 / stiffness, -heavy * omega**2
    for i, stiffness in enumerate((tube.young * second, tube.young * second, 2 * shear * second)):
        d[3 + i, 9 + i] = 1 / stiffness
        d[9 + i, 3 + i] = -rotary * omega**2 * (1, 1, 2)[i]
    d[9, 7], d[10, 6] = 1.0, -1.0
    d[9, 4], d[10, 3] = 2j * omega * spin * rotary, -2j * omega * spin * rotary
    return d


def _span(tube, length, omega, spin):
    """(12, 12) forces on both ends of a span under their motions."""
    scale = np.repeat([1.0, UNIT], 6)
    t = expm(_derivative(tube, omega, spin) * scale / scale[:, None] * length) * scale[:, None] / scale
    inverse = np.linalg.inv(t[:6, 6:])
    first = np.hstack([-inverse @ t[:6, :6], inverse])  # inner forces at the first end
    second = t[6:, 6:] @ first
    second[:, :6] += t[6:, :6]
    return np.vstack([-first, second])


def _exact(gearbox, helix, pressure, teeth, stiffness, omega, speed):
    """(n_bearing, 3) complex N under a unit transmission error, m along the normal, of the first mesh at `omega`."""
    turns = np.cumprod([1.0, *(z1 / z2 for z1, z2 in teeth)])
    nodes, spans = [], []
    for index, shaft in enumerate(gearbox.shafts):
        (tube,) = shaft.segments
        z = {tube.start, tube.end, shaft.torque_plane, *(body.z for body in shaft.bodies)}
        z |= {bearing.z for bearing in gearbox.bearings if bearing.shaft == shaft.name}
        z = sorted(z)
        spans += [(len(nodes) + i, tube, b - a, index) for i, (a, b) in enumerate(pairwise(z))]
        nodes += [(shaft.name, place) for place in z]
    at = {node: 6 * i for i, node in enumerate(nodes)}
    total = np.zeros((6 * len(nodes), 6 * len(nodes)), complex)
    spin = [speed * turns[i] * (-1) ** i for i in range(len(turns))]
    for first, tube, length, index in spans:
        total[6 * first : 6 * first + 12, 6 * first : 6 * first + 12] += _span(tube, length, omega, spin[index])
    for index, shaft in enumerate(gearbox.shafts):
        for body in shaft.bodies:
            n = at[shaft.name, body.z]
            inertia = [body.mass] * 3 + [body.transverse_inertia] * 2 + [body.polar_inertia]
            total[range(n, n + 6), range(n, n + 6)] -= omega**2 * np.array(inertia)
            total[n + 3, n + 4] += 1j * omega * spin[index] * body.polar_inertia
            total[n + 4, n + 3] -= 1j * omega * spin[index] * body.polar_inertia
        total[at[shaft.name, shaft.torque_plane] + 5, at[shaft.name, shaft.torque_plane] + 5] -= (
            omega**2 * shaft.coupled_inertia
        )
    springs = []
    for bearing in gearbox.bearings:
        n = at[bearing.shaft, bearing.z]
        springs.append(
            np.array([bearing.radial_stiffness] * 2 + [bearing.axial_stiffness])
            + 1j * omega * np.array([bearing.radial_damping] * 2 + [bearing.axial_damping])
        )
        total[range(n, n + 3), range(n, n + 3)] += springs[-1]
    axes = {shaft.name: np.array([*shaft.axis, 0.0]) for shaft in gearbox.shafts}
    rows = []
    for index, (mesh, (z1, z2)) in enumerate(zip(gearbox.meshes, teeth, strict=True)):
        way = (-1) ** index  # the pinion's sense of rotation; the driving pinion of stage 1 is right-handed
        e = axes[mesh.wheel_shaft] - axes[mesh.pinion_shaft]
        distance = np.linalg.norm(e)
        e = e / distance
        moving = way * np.cross([0.0, 0.0, 1.0], e)
        hand = 1.0 if index == 0 else -1.0
        normal = cos(helix) * (cos(pressure) * moving + sin(pressure) * e) - way * hand * sin(helix) * np.array(
            [0, 0, 1]
        )
        row = np.zeros(len(total))
        for name, arm, side in (
            (mesh.pinion_shaft, distance * z1 / (z1 + z2) * e, 1.0),
            (mesh.wheel_shaft, -distance * z2 / (z1 + z2) * e, -1.0),
        ):
            n = at[name, mesh.z]
            row[n : n + 3], row[n + 3 : n + 6] = side * normal, side * np.cross(arm, normal)
        total += stiffness[index] * np.outer(row, row)
        rows.append(row)
    moved = np.linalg.solve(total, stiffness[0] * rows[0])
    return np.array(
        [s * moved[at[b.shaft, b.z] : at[b.shaft, b.z] + 3] for s, b in zip(springs, gearbox.bearings, strict=True)]
    )


STIFFNESS = (3.6e8, 6.6e8)
TEETH = ((20, 50), (30, 82))
HELIX = float(np.arcsin(sin(radians(10.0)) * cos(radians(20.0))))
PRESSURE = float(np.arctan(tan(radians(20.0)) / cos(radians(10.0))))


@pytest.fixture
def undamped_shafts(make_gearbox):
    """The gearbox with an unsymmetric layout, coupled inertias, and damping in the bearings alone."""
    gearbox = make_gearbox(damping=1500.0)
    a, b, c = (replace(shaft, modal_damping=0.0) for shaft in gearbox.shafts)
    return replace(gearbox, shafts=(replace(a, coupled_inertia=0.01), b, replace(c, coupled_inertia=0.05)))


def _off(gearbox, laws, forced, fidelity, frequencies, speed):
    """Largest deviation of the bearing forces over all frequencies, relative to the strongest at each."""
    assembly = assemble(gearbox, laws, None, fidelity=fidelity, input_speed=speed)
    push = STIFFNESS[0] * assembly.contact[0]
    worst = []
    for frequency in frequencies:
        omega = 2 * pi * frequency
        wanted = _exact(gearbox, HELIX, PRESSURE, TEETH, STIFFNESS, omega, speed)
        found = forced(assembly, STIFFNESS, omega, push).reshape(-1, 3)
        worst.append(np.abs(found - wanted).max() / np.abs(wanted).max())
    return np.array(worst)


@pytest.mark.parametrize("speed", [0.0, 20000 * pi / 30])
def test_forced_response_of_geared_flexible_shafts_is_that_of_their_differential_equations(
    undamped_shafts, make_laws, forced_bearing_forces, speed
):
    """50 Hz to 5 kHz, bending, axial and torsional motions of three shafts coupled by two helical meshes; with and
    without gyroscopic terms. The error is that of the elements and falls with their length squared."""
    laws = make_laws(plain_wheel=True, mesh_ripple=0.0, error=0.0)
    frequencies = np.geomspace(50.0, 5000.0, 25)
    errors = [
        _off(
            replace(undamped_shafts, flexible_shafts=True), laws, forced_bearing_forces,
            DynamicsFidelity(1e-5, shaft_element=element, shaft_frequency=40e3), frequencies, speed,
        )
        for element in (10e-3, 5e-3)
    ]  # fmt: skip
    assert errors[0].max() < 2e-2
    assert errors[1].max() < 5e-3
    assert errors[1].max() < 0.3 * errors[0].max()
    rigid = _off(undamped_shafts, laws, forced_bearing_forces, None, frequencies, speed)
    assert np.median(rigid) > 0.3  # the shafts' flexibility is what is tested


def test_a_steady_run_has_the_lines_of_the_differential_equations(undamped_shafts, make_laws, make_law):
    """A sine of transmission error in stage 1, the flanks never part: the line of the bearing forces at the mesh
    frequency, by the time loop."""
    amplitude, speed = 1e-7, 1500 * pi / 30
    first = make_law(0, mesh_ripple=0.0, error=0.0, angles=48)
    error = amplitude * np.sin(TEETH[0][1] * first.angle)
    line = np.array([-1e-3, 1e-3])
    first = first.replace(deflection=line, force=STIFFNESS[0] * (line[None, :] - error[:, None]))
    second = make_law(1, hand=-1, mesh_ripple=0.0, error=0.0)
    second = second.replace(deflection=line, force=STIFFNESS[1] * np.tile(line, (len(second.angle), 1)))
    gearbox = replace(undamped_shafts, flexible_shafts=True, gyroscopic=True)
    fidelity = DynamicsFidelity(5e-6, shaft_element=5e-3, settle_level=1e-5, angle_refinement=16)
    record = bearing_forces(
        gearbox, (first, second), None, input_speed=speed, input_torque=50.0, f_max=2000.0, fidelity=fidelity
    )
    turns = speed / 2 / pi * len(record.time) * (record.time[1] - record.time[0])
    lines = np.fft.rfft(record.force, axis=0)[round(20 * turns)] * 2 / len(record.time)
    wanted = _exact(undamped_shafts, HELIX, PRESSURE, TEETH, STIFFNESS, 20 * speed, speed) * amplitude * -1j
    assert np.abs(lines - wanted).max() < 5e-3 * np.abs(wanted).max()


@pytest.mark.parametrize(("order", "low", "high"), [(20, -29.0, -27.0), (40, -18.5, -16.5), (60, -12.0, -10.0)])
def test_slender_shafts_change_forces_by_tens_of_decibels_as_their_equations_say(request, order, low, high):
    """The small case, its rotors at the free ends of shafts of 24 and 30 mm: what the measured sweep shows for
    `flexible_shafts` there is physics."""
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    (pair,), box = case.pairs, case.gearbox_with_gears
    box = replace(box, shafts=tuple(replace(shaft, modal_damping=0.0) for shaft in box.shafts))
    line, stiffness = np.array([-1e-3, 1e-3]), 2.2e8
    law = MeshLaw(
        angle=np.zeros(1),
        deflection=line,
        force=stiffness * line[None, :],
        period=pair.mesh_period,
        teeth=(20, 30),
        base_radius=pair.base_radius,
        base_helix_angle=pair.base_helix_angle,
        working_pressure_angle=pair.working_pressure_angle,
        centre_distance=pair.centre_distance,
        face_width=pair.face_width,
    )
    omega = order * case.operation.input_speed
    wanted = _exact(box, pair.base_helix_angle, pair.working_pressure_angle, (law.teeth,), (stiffness,), omega, 0.0)
    found = []
    for flexible in (False, True):
        a = assemble(replace(box, flexible_shafts=flexible), [law], None, fidelity=DynamicsFidelity(1e-5))
        row = a.contact[0]
        dynamic = a.stiffness + stiffness * np.outer(row, row) + 1j * omega * a.damping - omega**2 * np.diag(a.mass)
        moved = np.linalg.solve(dynamic, stiffness * row)
        found.append((a.bearing_stiffness + 1j * omega * a.bearing_damping) @ moved)
    rigid, flexible = found
    assert low < 20 * np.log10(np.linalg.norm(wanted) / np.linalg.norm(rigid)) < high
    assert np.abs(flexible.reshape(-1, 3) - wanted).max() < 5e-3 * np.abs(wanted).max()


def test_the_yardstick_has_the_natural_frequency_of_the_textbook_cantilever():
    """1.8751² √(EI/ρA)/l² (Pilkey, table 10-4): the free end gives way without bound, so that its stiffness is 0."""
    omega = 1.8751041**2 * sqrt(210e9 * pi * 0.005**4 / 4 / 7850.0 / pi / 0.005**2)
    signs = [
        np.linalg.det(_span(Cylinder(0.0, 1.0, 0.01), 1.0, factor * omega, 0.0)[np.ix_([6, 10], [6, 10])]).real
        for factor in (0.9990, 1.0005)
    ]
    assert signs[0] > 0.0 > signs[1]
