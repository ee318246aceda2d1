"""Pictures of gears: surfaces of their meshes, what is marked, and what the titles and scales state."""

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.gear import WHEEL, GearBody, GearGeometry, GearPair, LoadedMesh, contact_lines, gear_field, whole_mesh
from nvhchain.gear import nominal_centre_distance as centre_distance
from nvhchain.plots.bodies import gears
from nvhchain.plots.bodies.gear_field import gear_field as drawn_field
from nvhchain.plots.bodies.scene import Part, View, draw_scene, sharp_edges, shell
from nvhchain.testing.elements import brick, tetrahedra

COARSE = dataclasses.replace(DRAFT.gear, profile_elements=2, width_layers=2, row_aspect=2.0, slices=4)
GEOMETRY = GearGeometry(18, 3e-3, np.radians(20.0), 0.0, 12e-3, 6e-3, profile_shift=0.1)
BODY = GearBody(GEOMETRY)
PAIR = GearPair(BODY, BODY, centre_distance(GEOMETRY, GEOMETRY))


@cache
def field():
    lines = contact_lines(PAIR, 0.02, slices=4)
    force = np.full(len(lines.axial), 200.0)
    return gear_field(PAIR, WHEEL, LoadedMesh(lines, 1e-5, force, force, 0.0, (0.0, 0.0), 0.0), COARSE)


@pytest.mark.parametrize("make", [brick, tetrahedra])
def test_surface_of_a_box_has_its_area_and_twelve_sharp_edges(make):
    nodes, elements = make((2, 1, 1), (2.0, 1.0, 1.0))
    of = shell(len(nodes), elements, "hex20" if make is brick else "tet10")
    placed = of.extend_values(nodes)
    a, b, c = placed[of.triangles].transpose(1, 0, 2)
    normal = 0.5 * np.cross(b - a, c - a)
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(10.0)
    assert (normal * (a - [1.0, 0.5, 0.5])).sum() / 3 == pytest.approx(2.0)  # outwards, around its volume
    for segments in (of.outline(placed), sharp_edges(placed, of.triangles)):
        assert np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() == pytest.approx(4 * (2.0 + 1.0 + 1.0))


def test_teeth_under_load_are_marked_on_their_flanks_alone():
    mesh = whole_mesh(BODY, COARSE)
    plain = gears.gear_part(BODY, mesh)
    marked = gears.gear_part(BODY, mesh, teeth=(0, -1))
    changed = (marked.colours != plain.colours).any(axis=1)
    assert (marked.colours[changed] == to_rgb(gears.LOADED[0])).all()
    x, y, _ = np.moveaxis(marked.triangles[changed].mean(axis=1), -1, 0)
    tooth = np.unique(np.round(np.arctan2(y, x) / GEOMETRY.pitch_angle))
    assert tooth.tolist() == [-1.0, 0.0]
    assert np.hypot(x, y).min() > GEOMETRY.root_radius


def test_gears_in_mesh_touch_and_do_not_overlap():
    """Wheel and pinion are placed so that no node of one lies inside the teeth of the other."""
    turns = gears._turns(PAIR, 0.02)
    nodes = whole_mesh(BODY, COARSE).nodes
    c, s = np.cos(turns[1]), np.sin(turns[1])
    x = c * nodes[:, 0] - s * nodes[:, 1] + PAIR.centre_distance
    y = s * nodes[:, 0] + c * nodes[:, 1]
    radius, angle = np.hypot(x, y), np.arctan2(y, x) - turns[0]
    offset = np.abs((angle + GEOMETRY.pitch_angle / 2) % GEOMETRY.pitch_angle - GEOMETRY.pitch_angle / 2)
    on_flank = (radius > GEOMETRY.form_radius) & (radius < GEOMETRY.tip_circle_radius)
    inside = np.zeros(len(radius))
    inside[on_flank] = radius[on_flank] * (GEOMETRY.half_tooth_angle(radius[on_flank]) - offset[on_flank])
    assert inside.max() < 20e-6  # nodes of two elements along a flank


def test_picture_states_angle_scale_and_teeth_and_its_colours_end_away_from_the_contact():
    drawn = drawn_field(field(), name="gear", engine="matplotlib")
    whole, close = (ax.get_title(loc="left") for ax in drawn)
    assert re.fullmatch(r"gear: wheel angle 1\.15°, displacement × [125]0*", whole)
    assert close.startswith("loaded tooth")
    bar = drawn[0].figure.axes[-1]
    assert bar.get_ylabel() == "von Mises stress / MPa"
    assert bar.get_ylim()[1] == pytest.approx(1e-6 * field().stress_away_from_contact().max())
    left, right, low, high = drawn[0].images[0].get_extent()
    tip = 2 * GEOMETRY.tip_circle_radius
    assert tip * 0.9 < high - low < tip * 1.3
    assert tip * 0.8 < right - left < tip * 1.3
    with pytest.raises(InputError, match="quantity = 'strain'"):
        drawn_field(field(), quantity="strain")


def test_nearer_bodies_hide_farther_ones():
    square = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]])
    parts = [
        Part(square + np.array([0, 0, 1.0]), np.array([[1.0, 0, 0]] * 2)),
        Part(square, np.array([[0, 0, 1.0]] * 2)),
    ]
    ax = Figure().add_subplot()
    draw_scene(ax, parts, view=View(elevation=0.0, azimuth=0.0), engine="matplotlib", height=100)
    image = np.asarray(ax.images[0].get_array())
    assert image[50, 50, 0] > 150 > image[50, 50, 2]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["matplotlib", "pyvista"])
@pytest.mark.parametrize("size", [(3.0, 1.0), (1.0, 3.0), (1.0, 40.0)])
def test_bodies_lie_in_a_picture_where_curves_over_it_are_drawn(engine, size):
    """The middle of a red mark on a blue plate, found in the picture."""
    square = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]])
    mark = 0.2 * square + [0.1, 0.05, 0.01]
    parts = [Part(square * [*size, 1.0], np.array([0.0, 0, 1])), Part(mark, np.array([1.0, 0, 0]))]
    ax = Figure().add_subplot()
    draw_scene(ax, parts, view=View(elevation=0.0, azimuth=0.0), engine=engine, height=800)
    image = np.asarray(ax.images[0].get_array()).astype(float)
    rows, columns = np.nonzero(image[:, :, 0] - image[:, :, 2] > 100)
    left, right, low, high = ax.images[0].get_extent()
    x = left + (columns.mean() + 0.5) / image.shape[1] * (right - left)
    y = high - (rows.mean() + 0.5) / image.shape[0] * (high - low)
    pixel = (high - low) / image.shape[0]
    assert abs(x - 0.2) < 2 * pixel
    assert abs(y - 0.15) < 2 * pixel


@pytest.mark.slow
def test_command_line_draws_a_gear_and_a_stage_and_writes_a_field(tmp_path, capsys):
    case = "cases/small/single_stage.toml"
    assert main(["plot", case, "--gear", "wheel", "--out", str(tmp_path / "gear.png")]) == 0
    assert (tmp_path / "gear.png").stat().st_size > 20_000
    for arguments, message in (
        (["plot", case, "--gear", "nothing"], "no gear 'nothing': known: pinion, wheel"),
        (["plot", case, "--stage", "nothing"], "no stage 'nothing': known: stage"),
        (["plot", case, "--out", "picture.gif"], "picture.gif: suffix '.gif' is no format of figures"),
        (["plot", "cases/sphere/pulsating.toml"], "no gears to draw"),
        (["gear-field", case, "--gear", "nothing", "--out", "x.h5"], "no gear 'nothing': known: stage"),
    ):
        assert main(arguments) == 2
        assert message in capsys.readouterr().err
    hdf5.save(field(), tmp_path / "field.h5")
    assert main(["plot", str(tmp_path / "field.h5"), "--out", str(tmp_path / "field.vtu")]) == 0
    assert b"von_mises" in (tmp_path / "field.vtu").read_bytes()
    assert main(["plot", str(tmp_path / "field.h5"), "--stage", "stage"]) == 2
    assert "belong to a case" in capsys.readouterr().err
