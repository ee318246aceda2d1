"""Gear meshes: exact flanks, matching borders, the drawing's mass, and coarse fidelities that are refused."""

import dataclasses

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.errors import InputError
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fidelity import DRAFT
from nvhchain.gear import Differential, GearBody, GearGeometry, Holes, Slots, ThinRim, mass_properties
from nvhchain.gear.drawing.blank import Web
from nvhchain.gear.elements.gear_mesh import _web_layers, bricks_over_even, gear_mesh

FIDELITY = dataclasses.replace(DRAFT.gear, profile_elements=3, width_layers=3)
GEAR = GearGeometry(50, 2.7e-3, np.radians(20.0), np.radians(-10.0), 22e-3, 22e-3)
CROWN = GearGeometry(82, 2.68e-3, np.radians(20.0), np.radians(10.0), 40e-3, 30e-3)
PINION = GearGeometry(20, 2.7e-3, np.radians(20.0), np.radians(10.0), 22e-3, 15e-3)
SMALL = GearGeometry(28, 2.7e-3, np.radians(20.0), np.radians(-10.0), 22e-3, 12e-3)
BODIES = {
    "pinion": GearBody(PINION),
    "slots": GearBody(GEAR, Slots(5, 32e-3, 55e-3, np.radians(46.0), 5e-3, phase=0.3)),
    "thin web with slots": GearBody(
        GEAR, Slots(3, 32e-3, 50e-3, np.radians(70.0), 3e-3, 0.0, 8e-3, 29e-3, 54e-3, 2e-3)
    ),
    "thin rim": GearBody(CROWN, ThinRim(12e-3, 45e-3, 98e-3, 4e-3)),
    "holes": GearBody(GEAR, Holes(5, 42e-3, 11e-3, phase=0.2)),
    "thin web with holes": GearBody(GEAR, Holes(8, 40e-3, 8e-3, 0.0, 7e-3, 28e-3, 54e-3)),
    "slots from hub to rim": GearBody(SMALL, Slots(4, 17e-3, 27e-3, np.radians(60.0), 1e-3, 0.3, 1e-3, 17e-3, 27e-3)),
    "holes from hub to rim": GearBody(SMALL, Holes(4, 22e-3, 5e-3, 0.2, 1e-3, 17e-3, 27e-3)),
    "differential": GearBody(
        CROWN,
        Differential(94e-3, 58e-3, 14e-3, 64e-3, 86e-3, np.radians(80.0), flange_offset=-8e-3, window_fillet=8e-3),
    ),
}


@pytest.fixture(scope="module", params=BODIES)
def meshed(request):
    body = BODIES[request.param]
    return body, gear_mesh(body, FIDELITY)


def test_mesh_has_the_mass_and_inertia_of_the_drawing(meshed):
    """No brick is inverted, none missing, none twice."""
    body, mesh = meshed
    total = np.zeros(2)
    for solid, copies in ((mesh.pitch_solid, body.geometry.teeth), (mesh.blank_solid, 1)):
        _, M = stiffness_and_mass(solid.nodes, solid.elements, "hex20", STEEL)
        slide, turn = np.zeros((2, *solid.nodes.shape))
        slide[:, 0] = 1.0
        turn[:, 0], turn[:, 1] = -solid.nodes[:, 1], solid.nodes[:, 0]
        total += copies * np.array([u.ravel() @ M @ u.ravel() for u in (slide, turn)])
    np.testing.assert_allclose(total, mass_properties(body)[:2], rtol=5e-4)


def test_flank_nodes_lie_on_the_helicoid(meshed):
    body, mesh = meshed
    gear = body.geometry
    for flank, side in ((0, 1.0), (1, -1.0)):
        x, y, z = mesh.pitch_solid.nodes[mesh.pitch_solid.stacked(mesh.pitch.flanks[flank])].T
        radius = np.hypot(x, y)
        angle = np.arctan2(y, x) - z * np.tan(gear.helix_angle) / gear.pitch_radius
        np.testing.assert_allclose(angle, side * gear.half_tooth_angle(radius), atol=1e-12)
        assert radius.min() == pytest.approx(gear.form_radius)
        assert radius.max() == pytest.approx(gear.tip_circle_radius)
        assert np.ptp(z) == pytest.approx(gear.face_width)


def test_pitches_meet_each_other_and_the_blank_node_by_node(meshed):
    body, mesh = meshed
    solid, tau = mesh.pitch_solid, body.geometry.pitch_angle

    def turned(nodes, angle):
        c, s = np.cos(angle), np.sin(angle)
        return nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])

    left, right, bottom = (
        solid.nodes[solid.stacked(n)] for n in (mesh.pitch.left, mesh.pitch.right, mesh.pitch.bottom)
    )
    np.testing.assert_allclose(turned(left, tau), right, atol=1e-12)
    for tooth in (0, 7, body.geometry.teeth - 1):
        top = mesh.blank_solid.nodes[mesh.blank_solid.stacked(mesh.blank.top[tooth])]
        np.testing.assert_allclose(turned(bottom, tooth * tau), top, atol=1e-12)


def test_blank_repeats_after_one_sector(meshed):
    body, mesh = meshed
    plane, turned = mesh.blank.plane, mesh.blank.rotated_nodes
    turn = plane.angle[turned] - plane.angle - body.sector * body.geometry.pitch_angle
    np.testing.assert_allclose(np.remainder(turn + np.pi, 2 * np.pi), np.pi, atol=1e-9)
    np.testing.assert_allclose(plane.radius[turned], plane.radius, rtol=1e-9)
    assert body.geometry.teeth // body.sector * mesh.sector_elements.sum() == len(mesh.sector_elements)


def test_bore_and_openings_stay_straight_along_the_axis():
    mesh = gear_mesh(BODIES["slots"], FIDELITY)
    edge = np.abs(mesh.blank.plane.radius - 55e-3) < 1e-9
    for nodes in (mesh.blank.bore, np.flatnonzero(edge)):
        columns = mesh.blank_solid.index[::2, nodes]
        xy = mesh.blank_solid.nodes[columns, :2]
        np.testing.assert_allclose(np.ptp(xy, axis=0), 0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("offset", "thickness", "filled"),
    [
        (0.0, 14e-3, "00110"),
        (-12e-3, 16e-3, "11000"),
        (12e-3, 16e-3, "00011"),
        (0.0, 40e-3, "11111"),
        (-14e-3, 12e-3, "11000"),
        (-16e-3, 8e-3, "1100000"),
        (-17e-3, 2e-3, "00110000000"),
    ],
)
def test_layers_meet_the_faces_of_the_web(offset, thickness, filled):
    stations, inside = _web_layers(Web(0.05, 0.09, thickness, offset), np.linspace(-20e-3, 20e-3, 6))
    assert "".join(str(int(i)) for i in inside) == filled
    first, last = np.flatnonzero(inside)[[0, -1]]
    assert (stations[first], stations[last + 1]) == pytest.approx((offset - thickness / 2, offset + thickness / 2))
    assert (np.diff(stations) > 0).all()


def test_elements_are_small_where_a_thin_web_meets_rim_and_hub_and_others_stay():
    """In the web, in the hub and in the rim; rows of a web thicker than elements are tall stay even."""
    hub, rim = 30e-3, 52e-3
    rows = {}
    for thickness in (2e-3, 20e-3):
        mesh = gear_mesh(GearBody(GEAR, ThinRim(thickness, hub, rim)), dataclasses.replace(FIDELITY, row_aspect=1.5))
        rows[thickness] = np.unique(mesh.blank.plane.radius.round(9))
    for radius in (hub, rim):
        at = int(np.searchsorted(rows[2e-3], radius - 1e-9))
        assert np.diff(rows[2e-3][at - 2 : at + 3]).max() < 0.15 * 2e-3
    even = np.diff(rows[20e-3][(rows[20e-3] >= hub - 1e-9) & (rows[20e-3] <= rim + 1e-9)])
    np.testing.assert_allclose(even, even[0], atol=2e-9)
    thin, _ = _web_layers(Web(hub, rim, 3e-3, 0.0), np.linspace(-11e-3, 11e-3, 11))
    np.testing.assert_allclose(np.diff(thin).min(), 0.75e-3)
    assert np.diff(thin).max() <= 2.2e-3


def test_bricks_over_even_are_those_of_the_meshes():
    """The plan's measure of what a thin web takes more."""
    thin, thick = (GearBody(GEAR, ThinRim(thickness, 30e-3, 52e-3)) for thickness in (3e-3, 20e-3))
    count, fidelity = {}, dataclasses.replace(FIDELITY, width_layers=4)
    for body in (thin, thick):
        mesh = gear_mesh(body, fidelity)
        rows = len(np.unique(mesh.blank.plane.radius[: mesh.blank.plane.corners].round(9))) - 1
        count[body] = rows * (len(mesh.blank_solid.index) // 2)
    assert bricks_over_even(thick, fidelity) == 1.0
    assert bricks_over_even(thin, fidelity) == pytest.approx(count[thin] / count[thick])
    assert count[thin] > 2 * count[thick]


@pytest.mark.parametrize("layers", [1, 2, 3])
@pytest.mark.parametrize("thickness", [1.5e-3, 14e-3, 36e-3])
def test_web_between_two_recesses_has_two_layers_of_four(layers, thickness):
    """However few the layers of other blanks are: one layer bends badly."""
    even = np.linspace(-20e-3, 20e-3, layers + 1)
    stations, inside = _web_layers(Web(0.05, 0.09, thickness, 1e-3), even)
    assert inside.sum() == 2
    assert not inside[[0, -1]].any()
    assert len(stations) >= 5


@pytest.mark.parametrize(("count", "width", "phase"), [(20, 17.0, 1.8), (5, 1.0, 0.0)])
def test_opening_or_spoke_narrower_than_an_element_is_refused(count, width, phase):
    slots = Slots(count, 32e-3, 50e-3, np.radians(width), phase=np.radians(phase))
    with pytest.raises(InputError, match="or the spoke beside it, is narrower than one element"):
        gear_mesh(GearBody(GEAR, slots), FIDELITY)
