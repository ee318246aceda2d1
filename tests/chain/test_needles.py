"""Surface files of long needles, as CAD writes cylinders: meshed anew within stated tolerances, or refused."""

import meshio
import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics.surfaces import needles
from nvhchain.acoustics.surfaces.surface import aspects
from nvhchain.cli import main
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import Surface, SurfaceVelocity
from nvhchain.testing import bodies

RADIUS, LENGTH, LINES = 0.05, 0.3, (200.0, 900.0)


def cylinder(segments, along, rings):
    """A closed cylinder along z; caps of `rings` rings round their middles."""
    angle = 2 * np.pi * np.arange(segments) / segments
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    radii = RADIUS * np.arange(1, rings + 1) / rings
    loops = [(radius, -LENGTH / 2) for radius in radii]
    loops += [(RADIUS, z) for z in np.linspace(-LENGTH / 2, LENGTH / 2, along + 1)[1:]]
    loops += [(radius, LENGTH / 2) for radius in radii[-2::-1]]
    middles = LENGTH / 2 * np.array([[0, 0, -1.0], [0, 0, 1.0]])
    points = np.concatenate([*(radius * circle + [0, 0, z] for radius, z in loops), middles])
    here, last = np.arange(segments), len(loops) - 1
    there = (here + 1) % segments
    first, end = len(points) - 2, len(points) - 1
    faces = [np.stack([np.full(segments, first), there, here], axis=1)]
    faces += [np.stack([np.full(segments, end), last * segments + here, last * segments + there], axis=1)]
    for ring in range(last):
        low, high = ring * segments, (ring + 1) * segments
        faces += [np.stack([low + here, low + there, high + there], axis=1)]
        faces += [np.stack([low + here, high + there, high + here], axis=1)]
    return points, np.concatenate(faces)


@pytest.fixture
def case(tmp_path):
    def load(points, faces, motion="pulsation = 1.0"):
        meshio.write(tmp_path / "body.stl", meshio.Mesh(points, [("triangle", faces)]))
        file = tmp_path / "body.toml"
        file.write_text(
            f'kind = "radiator"\nname = "body"\nfrequencies = {list(LINES)}\n{motion}\n'
            '[body]\ntype = "surface_file"\nfile = "body.stl"\n'
            '[[field_points]]\nname = "beside"\nposition = [1.0, 0, 0]\n'
            '[[field_points]]\nname = "above"\nposition = [0.4, 0.3, 0.8]\n'
        )
        return file

    return load


@pytest.fixture(scope="module")
def operators(tmp_path_factory):
    """Folder of transfer vectors, which all motions share."""
    return tmp_path_factory.mktemp("operators")


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["pulsation = 1.0", "velocity = [1.0, 0, 0]", "velocity = [0, 0, 1.0]"])
def test_long_needles_err_by_less_than_is_stated(case, motion, operators):
    """Against a mesh of even triangles, 2240, with the volume of the polygon that both are."""
    truth = nvh.run(nvh.load_case(case(*cylinder(32, 32, 4), motion)), operators=operators)
    with pytest.warns(AccuracyWarning, match=r"surface remeshed: 128 triangles up to \S+ times as long as high -> "):
        found = nvh.run(nvh.load_case(case(*cylinder(32, 1, 1), motion)), operators=operators)
    want, have = truth.pressure.pressure, found.pressure.pressure
    error = 20 * np.log10(1 + np.abs(have - want).max(axis=1) / np.abs(want).max(axis=1))
    stated = [result.transfer_vectors.accuracy.expected_error_db for result in (found, truth)]
    assert error.max() < stated[0]
    assert stated[0] < 0.5
    assert error.max() < 0.1


@pytest.mark.slow
def test_plan_names_the_new_surface_and_keeps_its_time_in_bounds(case, capsys):
    file = case(*cylinder(644 // 4, 1, 1))
    assert main(["plan", str(file)]) == 0
    said = capsys.readouterr().out
    (line,) = (line for line in said.splitlines() if "surface remeshed: 644 triangles" in line)
    assert "volume -0." in line
    plan = nvh.plan(nvh.load_case(file))
    assert 2.0 < plan.seconds < 20.0
    assert 500 < plan.steps[1].counts["triangles"] < 4000


@pytest.mark.slow
def test_new_surface_keeps_volume_area_shape_and_every_body():
    one, faces = cylinder(64, 1, 1)
    both = Surface(np.concatenate([one, one + np.array([0.2, 0, 0])]), np.concatenate([faces, faces + len(one)]))
    made = needles.remesh_needles(both, 0.1)
    assert abs(made.volume_change) < 0.01
    assert made.surface.volume == pytest.approx(both.volume, rel=1e-9)
    assert abs(made.area_change) < 0.02
    assert not needles.has_needles(made.surface)
    x, y, _ = made.surface.vertices.T
    radial = np.hypot(np.where(x > 0.1, x - 0.2, x), y)
    assert radial.max() < RADIUS * 1.004
    assert RADIUS - radial[np.abs(made.surface.vertices[:, 2]) < 0.14].min() < 2e-3
    assert made.distance < 2e-3
    assert needles.remesh_needles(both, 0.1) is made  # once for plan and run


@pytest.mark.slow
def test_a_needle_of_a_millionth_is_meshed_anew(case):
    points, faces = cylinder(16, 8, 2)
    a, b, c = faces[-1]
    other = next(i for i, face in enumerate(faces[:-1]) if a in face and b in face)
    (d,) = set(faces[other]) - {a, b}
    towards = points[c] - points[a]
    points = np.vstack([points, 0.5 * (points[a] + points[b]) + 1e-6 * towards / np.linalg.norm(towards)])
    new = len(points) - 1
    kept = np.delete(faces, [other, len(faces) - 1], axis=0)
    faces = np.vstack([kept, [[a, b, new], [new, b, c], [a, new, c], [b, a, d]]])
    given = Surface(points, faces)
    assert aspects(given).max() > 1e4
    made = needles.remesh_needles(given, 0.05)
    assert not needles.has_needles(made.surface)
    assert made.distance < 2e-3


def test_what_cannot_be_meshed_anew_is_refused_with_its_numbers(monkeypatch):
    """A plate of 1 m and 0.1 mm: even triangles on its rim would be millions."""
    points = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1e-4)], dtype=float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])
    monkeypatch.setattr(needles, "_TRIES", 1)
    with pytest.raises(
        InputError, match=r"12 triangles up to 1e\+04 times as long as high could not be meshed anew: .*as high"
    ):
        needles.remesh_needles(Surface(points, faces), 0.1)


def test_even_surfaces_stay_as_they_are():
    assert needles.remesh_needles(nvh.acoustics.sphere(0.1, 2), 0.01) is None
    assert needles.remesh_needles(Surface(*cylinder(32, 16, 4)), 0.01) is None


def test_cut_edges_leave_the_surface_closed_and_as_large():
    given = Surface(*cylinder(16, 1, 1))
    vertices, triangles, origin = needles.cut_edges(given.vertices, given.triangles, 0.03)
    made = Surface(vertices, triangles)
    assert np.bincount(origin, made.areas) == pytest.approx(given.areas, rel=1e-12)
    assert made.longest_edges.max() <= 0.03
    assert made.volume == pytest.approx(given.volume, rel=1e-12)
    assert made.areas.sum() == pytest.approx(given.areas.sum(), rel=1e-12)


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:needles, sharp edges", "ignore:surface mesh has", "ignore:surface mesh with elements of"
)
def test_needles_handed_in_state_what_they_err_by():
    """Point source in a cylinder of 64 pairs of needles, at 1 kHz 4.6 dB off; meshed anew far below what is stated."""
    given = Surface(*cylinder(64, 1, 1))
    points, wavenumber = np.array([[1.0, 0, 0], [0, 0, 1.0], [0.5, 0.5, 0.5]]), 2 * np.pi * 1000.0 / 343.0
    air = nvh.conventions.Air(speed_of_sound=343.0, density=1.2)
    for surface, least, most in ((given, 3.0, 10.0), (needles.remesh_needles(given, 0.07).surface, 0.0, 0.1)):
        at = surface.vertices[surface.triangles]
        rule = [(i / 18, j / 18, 1 - (i + j) / 18) for i in range(1, 18, 2) for j in range(1, 18 - i, 2)]
        velocity = np.zeros(len(at), dtype=complex)
        for place in rule:
            x = np.einsum("c,fci->fi", place, at)
            r = np.linalg.norm(x, axis=1)
            slope = (1j * wavenumber + 1 / r) * np.exp(-1j * wavenumber * r) / r
            velocity += slope * (x * surface.normals).sum(axis=1) / r / len(rule)
        velocity /= 1j * wavenumber * air.density * air.speed_of_sound
        vectors = nvh.acoustics.transfer_vectors(surface, points, [1000.0], air=air)
        motion = SurfaceVelocity(np.array([1000.0]), velocity[None], surface)
        found = nvh.acoustics.radiate(vectors, motion).pressure[0]
        distance = np.linalg.norm(points, axis=1)
        want = np.exp(-1j * wavenumber * distance) / distance
        error = 20 * np.log10(1 + np.abs(found - want).max() / np.abs(want).max())
        assert least <= error < most
        assert error < vectors.accuracy.expected_error_db


@pytest.mark.slow
def test_layers_of_longer_needles_are_refused_with_what_meshes_them_anew():
    """A layer round a box, 1e4 times as long as high, erred by 1.2 dB where 0.2 were stated; 1000 times by 0.1."""

    def layered(aspect):
        plain = bodies.box((0.1, 0.1, 0.1), 0.025)
        heights = np.unique(np.round(plain.vertices[:, 2], 9))
        steps = np.diff(heights) / [1.0, aspect, 1.0, 1.0]
        vertices = plain.vertices.copy()
        vertices[:, 2] = np.interp(vertices[:, 2], heights, heights[0] + np.append(0.0, steps.cumsum()))
        return Surface(vertices, plain.triangles)

    source, wavenumber = (0.005, -0.005, -0.003), 2 * np.pi * 300.0 / 343.0
    air, points = nvh.conventions.Air(speed_of_sound=343.0, density=1.2), bodies.shell(12, 0.5)
    given = layered(990.0)
    with pytest.warns(AccuracyWarning, match="needles"):
        vectors = nvh.acoustics.transfer_vectors(given, points, [300.0], air=air)
    found = vectors.vectors[0] @ bodies.source_velocity(given, source, 300.0, air).normal_velocity[0]
    want = bodies.source_field(points, source, wavenumber)[0]
    assert 20 * np.log10(1 + np.abs(found - want).max() / np.abs(want).max()) < vectors.accuracy.expected_error_db
    remedy = r"1.1e\+03 times as long as high, 1000 .*nvhchain\.acoustics\.remesh_needles\(surface, element_size\)"
    with pytest.raises(InputError, match=remedy):
        nvh.acoustics.transfer_vectors(layered(1100.0), points, [300.0], air=air)
    made = nvh.acoustics.remesh_needles(layered(1100.0), 0.025).surface
    assert nvh.acoustics.ExteriorProblem(made).surface is made


def test_check_opens_the_surface_file(case, capsys):
    points, faces = cylinder(32, 8, 2)
    assert main(["check", str(case(points, faces))]) == 0
    file = case(points, faces[1:])
    assert main(["check", str(file)]) == 2
    assert "body.stl: Surface is open: 3 edges belong to one triangle only, the first at [" in capsys.readouterr().err


def test_check_refuses_a_body_inside_another_and_leaves_repeated_triangles_out(case, capsys):
    points, faces = cylinder(32, 8, 2)
    again = np.vstack([faces, faces[:3], faces[3:5, ::-1]])
    with pytest.warns(UserWarning, match="5 triangles on the corners of others excluded"):
        assert nvh.load_case(case(points, again)).body.read(case(points, again).parent).volume > 0
    inside = 0.3 * points
    file = case(np.vstack([points, inside]), np.vstack([faces, len(points) + faces]))
    assert main(["check", str(file)]) == 2
    assert "body.stl: body 1 of 2 near" in capsys.readouterr().err
