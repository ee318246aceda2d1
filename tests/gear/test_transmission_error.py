"""Loaded transmission error from the mesh law against the contact solved at the load itself."""

import dataclasses

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import STANDARD
from nvhchain.gear.contact.engagement import Engagement
from nvhchain.gear.contact.local_law import contact_half_width
from nvhchain.gear.laws.mesh_law import mesh_law
from nvhchain.gear.laws.transmission_error import deflection_at_force, loaded_mesh, quasi_static_transmission_error


@pytest.fixture(scope="module")
def case(make_pair, make_compliances):
    pair = make_pair(2, thickness_allowance=40e-6)
    compliances = make_compliances(pair)
    force = pair.normal_force(625.0)
    law = mesh_law(pair, nominal_force=force, fidelity=STANDARD.gear, compliances=compliances)
    return Engagement(pair, compliances, STANDARD.gear), law, force


@pytest.mark.parametrize("load", [0.1, 0.5, 1.0, 1.5])
def test_table_reproduces_the_directly_solved_transmission_error(case, load):
    engagement, law, force = case
    angle, te = quasi_static_transmission_error(law, load * force)
    direct = np.array([loaded_mesh(engagement, a, load * force, guess=20e-6).deflection for a in angle])
    direct /= np.cos(law.base_helix_angle)
    assert np.abs(te - direct).max() < 3e-3 * direct.mean()  # tip edges that come in between two tabulated deflections


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"force": np.inf}, "force = inf N must be positive and finite"),
        ({"force": -1.0}, "force = -1 N must be positive"),
        ({"angle": np.nan}, "angle = nan rad must be finite"),
        ({"guess": 0.0}, "guess = 0 m must be a positive deflection"),
    ],
)
def test_a_load_or_an_angle_that_is_no_number_to_solve_for_is_refused(case, given, why):
    with pytest.raises(InputError, match=why):
        loaded_mesh(case[0], **{"angle": 0.02, "force": 1e3, "guess": 1e-6} | given)


def test_loaded_mesh_balances_the_force_and_shares_it_out(case):
    engagement, _, force = case
    mesh = loaded_mesh(engagement, 0.02, force, guess=1e-6)
    assert mesh.force.sum() == pytest.approx(force, rel=1e-6)
    share = mesh.load_share()
    assert sum(share.values()) == pytest.approx(1.0)
    assert 2 <= len(share) <= 3
    assert mesh.tangent_stiffness > mesh.force.sum() / mesh.deflection > 0


def test_pressure_carries_the_line_load(case):
    """The Hertzian half ellipse: q = π/2 · p_max · L."""
    engagement, _, force = case
    mesh = loaded_mesh(engagement, 0.02, force, guess=10e-6)
    materials = (engagement.pair.pinion.material, engagement.pair.wheel.material)
    q = mesh.force / mesh.lines.length
    width = contact_half_width(q, mesh.lines.curvature, materials)
    np.testing.assert_allclose(np.pi / 2 * mesh.pressure * width, q, rtol=1e-12)
    # Hertz's own formula: p_max = √(q E* /(π ρ))
    e_star = 210e9 / (2 * (1 - 0.3**2))
    np.testing.assert_allclose(mesh.pressure, np.sqrt(q * e_star / (np.pi * mesh.lines.curvature)), rtol=1e-12)


def test_a_face_of_several_axial_pitches_is_cut_as_finely_as_one_of_a_pitch(make_pair, make_compliances):
    """Of so wide a helical face little swing is left: that of the slices must stay below it."""
    pair = make_pair(1, face_width=80e-3)
    assert pair.overlap_ratio == pytest.approx(1.64, abs=0.01)
    compliances, force, swing = make_compliances(pair), pair.normal_force(900.0), []
    for slices in (32, 128):
        fidelity = dataclasses.replace(STANDARD.gear, slices=slices)
        engagement = Engagement(pair, compliances, fidelity)
        assert np.diff(np.unique(engagement.lines(0.0).axial)).max() <= pair.face_width / pair.overlap_ratio / slices
        angles = np.arange(12) / 12 * pair.mesh_period
        swing.append(np.ptp([loaded_mesh(engagement, a, force, guess=2e-5).deflection for a in angles]))
    assert swing[0] == pytest.approx(swing[1], rel=0.05)


def test_back_flank_load_gives_a_deflection_beyond_the_gap(case):
    engagement, law, force = case
    drive, back = deflection_at_force(law, force), deflection_at_force(law, -force)
    assert (back < -engagement.pair.backlash).all()
    # mirror images up to the phase: equal mean
    assert -(back.mean() + engagement.pair.backlash) == pytest.approx(drive.mean(), rel=1e-2)


def test_deflection_between_the_columns_is_that_of_scipys_monotone_cubic(case):
    """Of the loaded columns and the one next to them without load, row by row; also where only one column is loaded."""
    _, law, force = case
    light = 0.9 * law.force[:, np.searchsorted(law.deflection, 0.0) + 1].max()
    columns = np.flatnonzero(law.force.max(axis=0) > 0)[0]
    short = dataclasses.replace(law, deflection=law.deflection[: columns + 1], force=law.force[:, : columns + 1])
    least = 0.5 * short.force[:, -1].min()
    for table, load in ((law, force), (law, -force), (law, light), (short, least)):
        expected = []
        for row in table.force:
            loaded = np.flatnonzero(row * load > 0)
            at = np.arange(max(loaded[0] - (load > 0), 0), min(loaded[-1] + (load < 0), len(row) - 1) + 1)
            expected.append(PchipInterpolator(row[at], table.deflection[at])(load))
        np.testing.assert_allclose(deflection_at_force(table, load), expected, rtol=1e-13)


def test_where_a_law_stays_level_the_deflection_jumps(case):
    _, law, _ = case
    force = np.tile([0.0, 5.0, 5.0, 6.0, 6.0], (len(law.angle), 1))
    table = dataclasses.replace(law, deflection=np.arange(5.0), force=force)
    below, at, above, end = (deflection_at_force(table, load)[0] for load in (5 - 1e-9, 5.0, 5 + 1e-9, 6.0))
    assert (at, end) == (1.0, 3.0)
    assert below == pytest.approx(1.0, abs=1e-6)
    assert above == pytest.approx(2.0, abs=1e-6)


def test_a_load_beyond_the_table_is_refused(case):
    _, law, force = case
    with pytest.raises(InputError, match="outside the mesh law"):
        deflection_at_force(law, 20 * force)
    with pytest.raises(InputError, match="no unique deflection"):
        deflection_at_force(law, 0.0)


def test_an_absurd_load_raises_instead_of_extrapolating_the_local_law(case):
    engagement, _, force = case
    with pytest.raises(SolverError):
        loaded_mesh(engagement, 0.0, 300 * force, guess=1e-3)
