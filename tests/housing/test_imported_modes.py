"""Modes of another solver as a reduced housing: universal file and HDF5, sides of the skin, what is missing."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.housing import RadiatingFaces
from nvhchain.housing.casting.mesh import boundary_faces
from nvhchain.housing.exchange.modal_model import modal_model
from nvhchain.housing.imported.modal_results import (
    has_rigid_motion,
    housing_from_modes,
    missing_flexibility,
    modal_extent,
    modal_skin,
)
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.modes import seat_modes as seat_modes_module
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.modes.truncation import truncation_errors
from nvhchain.housing.skin.shell_sides import outward_sides, outward_skin
from nvhchain.interop.modes.modal_uff import read_modal_uff
from nvhchain.interop.modes.modal_uff_out import write_modal_uff
from tests.housing.casting_model import casting_model
from tests.housing.seat_motion import seat_flexibility

ENGINE = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
F_MAX = 3000.0


def housing(model, casting, fidelity, surface, **options):
    with pytest.warns(AccuracyWarning, match="without residual vectors"):
        return housing_from_modes(
            model,
            {bore.name: bore.centre for bore in casting.bores},
            f_max=F_MAX,
            faces=RadiatingFaces(0.022, mounting_plane=ENGINE, surface=surface),
            fidelity=fidelity,
            **options,
        )


@pytest.fixture(scope="module")
def from_file(modes, casting, fidelity, surface, tmp_path_factory):
    path = write_modal_uff(modes, tmp_path_factory.mktemp("uff") / "modes.unv")
    return housing(read_modal_uff(path), casting, fidelity, surface)


@pytest.mark.slow
def test_error_of_the_mapped_power_is_stated_and_small_with_the_castings_own_faces(from_file):
    stated = from_file.accuracy
    assert stated.mapping_frequency.tolist() == pytest.approx([375.0, 750.0, 1500.0, 3000.0])
    assert all(0 < abs(value) < 0.5 for value in stated.mapping_error_db)


def test_universal_file_keeps_frequencies_damping_and_seat_shapes_to_six_digits(from_file, reduced, casting):
    count = len(from_file.natural_frequency)
    assert count == (reduced.natural_frequency <= 1.4 * F_MAX).sum() > 3
    assert from_file.natural_frequency == pytest.approx(reduced.natural_frequency[:count], rel=1e-5)
    assert from_file.modal_damping == pytest.approx(casting.modal_damping)
    signs = np.sign((from_file.seat_shapes * reduced.seat_shapes[:count]).sum(axis=(1, 2)))
    largest = np.abs(reduced.seat_shapes).max()
    assert from_file.seat_shapes * signs[:, None, None] == pytest.approx(
        reduced.seat_shapes[:count], abs=2e-5 * largest
    )


def test_faces_move_as_those_of_the_casting(from_file, reduced):
    """Of a skin without middles of its edges, which moves linearly between its corners, 30 mm apart."""
    count, area = len(from_file.natural_frequency), reduced.surface.areas
    difference = np.abs(from_file.normal_shapes) - np.abs(reduced.normal_shapes[:count])
    assert (difference**2 @ area).sum() < 0.1**2 * (reduced.normal_shapes[:count] ** 2 @ area).sum()


@pytest.mark.slow
def test_faces_move_to_six_digits_as_those_of_the_casting_where_edges_have_middles(
    modes, mesh, reduced, casting, fidelity, surface, tmp_path
):
    curved = replace(modes, triangles=boundary_faces(mesh.elements))
    found = housing(read_modal_uff(write_modal_uff(curved, tmp_path / "m.unv")), casting, fidelity, surface)
    count = len(found.natural_frequency)
    sign = np.sign((found.seat_shapes * reduced.seat_shapes[:count]).sum(axis=(1, 2)))
    largest = np.abs(reduced.normal_shapes).max()
    assert found.normal_shapes * sign[:, None] == pytest.approx(reduced.normal_shapes[:count], abs=2e-5 * largest)


def test_triangles_turned_over_keep_the_middles_of_their_edges(modes, mesh):
    right = boundary_faces(mesh.elements)
    wrong = np.random.default_rng(5).random(len(right)) < 0.5
    given = np.where(wrong[:, None], right[:, [0, 2, 1, 5, 4, 3]], right)
    for two_sided in (False, True):
        found = modal_skin(replace(modes, triangles=given, two_sided=two_sided))[0].facets
        assert found.tolist() == right.tolist()


def test_missing_flexibility_is_estimated_within_a_factor_of_three(from_file, reduced):
    modal = from_file.seat_shapes.reshape(len(from_file.natural_frequency), -1)
    static = np.trace(seat_flexibility(reduced))
    known = ((modal**2).sum(axis=1) / (2 * np.pi * from_file.natural_frequency) ** 2).sum()
    truth = 1 - (known + np.trace(from_file.seat_residual.reshape(6, 6))) / static
    assert np.trace(from_file.seat_residual.reshape(6, 6)) > 0  # of the modes above the limit
    assert truth / 3 < from_file.accuracy.missing_flexibility < 3 * truth


def test_missing_flexibility_of_a_constant_modal_density_is_that_of_the_top_octave():
    frequency = np.arange(1.0, 4001.0)
    shapes = np.ones((len(frequency), 1, 3))
    cut = 500
    truth = (1 / frequency[cut:] ** 2).sum() / (1 / frequency**2).sum()
    assert missing_flexibility(frequency[:cut], shapes[:cut]) == pytest.approx(truth, rel=0.15)


@pytest.fixture(scope="module")
def with_vectors(mesh, casting):
    """The casting's modes and residual vectors, as a foreign solver gives them: of the static motion alone."""
    model = casting_model(mesh, casting)
    seats = bearing_seats(model, {bore.name: bore.centre for bore in casting.bores})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(seat_modes_module, "_TERMS", 1)
        with pytest.warns(AccuracyWarning, match="tetrahedra are 5.6 times"):
            return modal_model(model, seats, f_top=1.4 * 4000.0, modal_damping=casting.modal_damping)


@pytest.mark.filterwarnings("ignore:casting")
def test_residual_vectors_carry_the_whole_residual_flexibility(with_vectors, reduced, rich, casting, fidelity, surface):
    at = {bore.name: bore.centre for bore in casting.bores}
    found = housing_from_modes(
        with_vectors,
        at,
        f_max=4000.0,
        faces=RadiatingFaces(0.022, mounting_plane=ENGINE, surface=surface),
        fidelity=fidelity,
        residual_vectors=True,
    )
    natural = reduced.mode_count
    assert found.mode_count == natural
    assert found.natural_frequency[:natural] == pytest.approx(reduced.natural_frequency[:natural], rel=1e-10)
    exact = seat_flexibility(reduced)
    assert seat_flexibility(found) == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())
    assert found.accuracy.missing_flexibility == 0.0
    # what vectors of one term err at the upper end of the band is stated, within a factor of two
    load, line = np.eye(len(exact), dtype=complex), np.full(len(exact), 3900.0)
    area = rich.surface.areas

    def missed(frequency):
        got, true = (face_displacement(housing, frequency, load) for housing in (found, rich))
        return np.sqrt((np.abs(got - true) ** 2 @ area).sum() / (np.abs(true) ** 2 @ area).sum())

    stated = truncation_errors(found, line[:1])[0]
    print(missed(0 * line), missed(line), stated)
    assert missed(0 * line) < 0.08  # of faces that know no middles of edges
    assert missed(line) < stated + missed(0 * line)


def test_modes_that_end_below_the_band_before_the_residual_vectors_are_warned_of(
    with_vectors, casting, fidelity, surface, recwarn
):
    last = with_vectors.frequency[-7]  # six residual vectors of two seats follow
    kept = np.delete(np.arange(len(with_vectors.frequency)), slice(-14, -6))
    few = replace(
        with_vectors, **{name: getattr(with_vectors, name)[kept] for name in ("frequency", "damping", "shapes")}
    )
    told = []
    for model, f_max in ((with_vectors, 0.99 * last), (with_vectors, 1.01 * last), (few, 1.01 * last)):
        recwarn.clear()
        housing_from_modes(
            model,
            {bore.name: bore.centre for bore in casting.bores},
            f_max=f_max,
            faces=RadiatingFaces(0.022, mounting_plane=ENGINE, surface=surface),
            fidelity=replace(fidelity, mode_ratio=1.0),
            residual_vectors=True,
        )
        told.append([str(w.message) for w in recwarn if "before the residual vectors" in str(w.message)])
    assert told[:2] == [[], []]  # a file that is complete ends below the band, too
    assert f"the last mode before the residual vectors lies at {few.frequency[-7]:.4g} Hz, below f_max" in told[2][0]


def test_labels_of_nodes_are_those_of_the_model_and_unique(with_vectors, mesh):
    labels = with_vectors.labels.tolist()
    assert len(set(labels)) == len(labels)
    at = dict(zip(labels, with_vectors.nodes, strict=True))
    for row in np.unique(mesh.skin)[:50]:
        assert at[int(row) + 1] == pytest.approx(mesh.nodes[row], abs=1e-15)


@pytest.mark.parametrize(("f_max", "rigid"), [(100.0, 0.09), (1000.0, 0.4), (5000.0, 0.4), (20_000.0, 1.9)])
def test_a_rigid_mode_that_rounding_lifts_is_rigid_in_any_band(modes, f_max, rigid):
    for share, found in ((1.0, True), (1.5, False)):
        lifted = replace(modes, frequency=np.concatenate([[share * rigid], modes.frequency[1:]]))
        assert has_rigid_motion(lifted, f_max) == found


def test_residual_vectors_that_are_not_there_are_refused(modes, casting, fidelity, surface):
    few = int((modes.frequency <= 1.4 * F_MAX).sum()) + 5
    some = replace(modes, frequency=modes.frequency[:few], damping=modes.damping[:few], shapes=modes.shapes[:few])
    with pytest.raises(InputError, match="but 5 modes above 4200 Hz, three per seat are needed, 6"):
        housing_from_modes(
            some,
            {bore.name: bore.centre for bore in casting.bores},
            f_max=F_MAX,
            faces=RadiatingFaces(0.022, surface=surface),
            fidelity=fidelity,
            residual_vectors=True,
        )


def test_rigid_modes_of_rounding_and_without_damping_are_rigid(modes, casting, fidelity, surface):
    """Other solvers give a free structure's rigid modes up to tenths of a hertz."""
    rigid = np.r_[0.2, modes.frequency], np.r_[0.0, modes.damping], np.concatenate([modes.shapes[:1], modes.shapes])
    found = housing(replace(modes, frequency=rigid[0], damping=rigid[1], shapes=rigid[2]), casting, fidelity, surface)
    assert found.natural_frequency[0] == 0.0
    without = housing(modes, casting, fidelity, surface).accuracy.missing_flexibility
    assert found.accuracy.missing_flexibility == pytest.approx(without)


def test_shells_are_turned_outward_whichever_way_they_are_numbered(modes, casting, fidelity, surface, from_file):
    rng = np.random.default_rng(5)
    triangles = modes.triangles[:, :3].copy()
    wrong = rng.random(len(triangles)) < 0.5
    triangles[wrong] = triangles[wrong][:, [0, 2, 1]]
    shells = housing(replace(modes, triangles=triangles, two_sided=True), casting, fidelity, surface)
    difference = np.abs(shells.normal_shapes) - np.abs(from_file.normal_shapes)
    area = surface.areas
    assert (difference**2 @ area).sum() < 0.02**2 * (from_file.normal_shapes**2 @ area).sum()


def flipped(triangles, share):
    wrong = np.random.default_rng(5).random(len(triangles)) < share
    return np.where(wrong[:, None], triangles[:, [0, 2, 1]], triangles), int(wrong.sum())


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_skin_of_solids_that_looks_inward_is_turned_over_and_reported(share, modes):
    """The casting is open nowhere, its cavity is outside of its walls."""
    triangles, wrong = flipped(modes.triangles[:, :3], share)
    skin, _, notes = modal_skin(replace(modes, triangles=triangles))
    assert np.sort(skin.facets[:, :3], axis=1).tolist() == np.sort(modes.triangles[:, :3], axis=1).tolist()
    assert normals(skin.nodes, skin.facets[:, :3]) == pytest.approx(normals(modes.nodes, modes.triangles))
    assert notes == (f"{wrong} triangles of the skin that looked inward turned over",)
    assert modal_skin(modes)[2] == ()


def normals(nodes, triangles):
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def test_wall_of_a_cavity_keeps_looking_into_it():
    """A tetrahedron within another; one face of each is wrong."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    nodes = np.concatenate([4 * corners, 0.5 + corners])
    outer = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    right = np.concatenate([outer, 4 + outer[:, [0, 2, 1]]])
    given = right.copy()
    given[[1, 6]] = given[[1, 6]][:, [0, 2, 1]]
    notes = []
    assert normals(nodes, outward_skin(nodes, given, notes)).tolist() == normals(nodes, right).tolist()
    assert notes == ["2 triangles of the skin that looked inward turned over"]


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0], [0, 2, 1]])
def test_triangles_given_twice_count_once(two_sided, order, modes):
    twice = np.concatenate([modes.triangles[:, :3], modes.triangles[:, order]])
    skin, shells, notes = modal_skin(replace(modes, triangles=twice, two_sided=two_sided))
    assert normals(skin.nodes, skin.facets[:, :3]) == pytest.approx(normals(modes.nodes, modes.triangles))
    assert not shells.any()
    assert notes == (f"{len(modes.triangles)} triangles of the skin on the corners of others excluded",)


@pytest.mark.parametrize("two_sided", [False, True])
def test_triangles_without_area_are_left_out(two_sided, modes):
    nodes = np.vstack([modes.nodes, np.outer([0, 1, 2], [0.01, 0, 0])])
    line = [len(modes.nodes), len(modes.nodes) + 1, len(modes.nodes) + 2]
    bad = np.concatenate([modes.triangles[:, :3], [[0, 0, 1], [2, 2, 2], line]])
    shapes = np.concatenate([modes.shapes, np.zeros((len(modes.frequency), 3, 3))], axis=1)
    model = replace(modes, nodes=nodes, labels=np.arange(len(nodes)), shapes=shapes, triangles=bad, two_sided=two_sided)
    skin, _, notes = modal_skin(model)
    assert normals(skin.nodes, skin.facets[:, :3]) == pytest.approx(normals(modes.nodes, modes.triangles))
    assert "2 triangles of the skin that repeat a corner excluded" in notes
    assert notes[-1] == f"{1 + two_sided} triangles of the skin without area excluded"
    with pytest.raises(InputError, match="no triangle of the skin has an area"):
        modal_skin(replace(model, triangles=bad[-3:-1]))


def test_lone_triangle_has_two_sides():
    found, shells = outward_sides(np.eye(3), np.array([[0, 1, 2]]))
    assert sorted(found.tolist()) == [[0, 1, 2], [0, 2, 1]]
    assert shells.all()


def test_repairs_are_warned_of_and_stated(modes, casting, fidelity, surface):
    twice = replace(modes, triangles=np.concatenate([modes.triangles, modes.triangles]))
    with pytest.warns(AccuracyWarning, match="triangles of the skin on the corners of others excluded"):
        found = housing(twice, casting, fidelity, surface)
    assert found.provenance["repairs"] == [
        f"{len(modes.triangles)} triangles of the skin on the corners of others excluded"
    ]


@pytest.mark.parametrize("vectors", [False, True])
def test_seat_that_does_not_move_is_refused(vectors, modes, casting, fidelity, surface):
    at = {"A1": casting.bores[0].centre}
    shapes = modes.shapes.copy()
    shapes[:, -2:] = 0.0
    with pytest.raises(InputError, match=rf"bearing A1: node {modes.labels[-2]} of modes moves in no mode"):
        housing_from_modes(
            replace(modes, shapes=shapes),
            at,
            f_max=1000.0,
            faces=RadiatingFaces(0.022, surface=surface),
            fidelity=fidelity,
            residual_vectors=vectors,
        )


def test_modes_in_another_unit_of_length_are_refused(modes, fidelity):
    wrong = replace(modes, nodes=1e3 * modes.nodes)
    match = r"the mesh is \d+ m long, 0\.005 … 20 m are taken for a housing"
    with pytest.raises(InputError, match=match):
        housing_from_modes(
            wrong, {"A1": (0, 0, 0)}, labels={"A1": 1}, f_max=F_MAX, faces=RadiatingFaces(0.022), fidelity=fidelity
        )
    with pytest.raises(InputError, match=match):
        modal_extent(wrong)


def test_side_of_open_shells_and_closed_bodies():
    """A tetrahedron with one face turned, and a plate of two triangles beside it."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 0, 0], [6, 0, 0], [5, 1, 0], [6, 1, 0]], float)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [1, 3, 2], [0, 3, 2], [4, 5, 6], [5, 6, 7]])
    found, shells = outward_sides(nodes, triangles)
    assert shells.tolist() == [False] * 4 + [True] * 4
    closed = nodes[found[:4]]
    normal = np.cross(closed[:, 1] - closed[:, 0], closed[:, 2] - closed[:, 0])
    assert (np.einsum("ij,ij->i", normal, closed.mean(axis=1) - nodes[:4].mean(axis=0)) > 0).all()
    plate = np.cross(nodes[found[4:, 1]] - nodes[found[4:, 0]], nodes[found[4:, 2]] - nodes[found[4:, 0]])[:, 2]
    assert plate.tolist() in ([1, 1, -1, -1], [-1, -1, 1, 1])


def test_modes_that_end_below_the_band_and_missing_nodes_are_refused(modes, casting, fidelity):
    few = replace(modes, frequency=modes.frequency[:2], damping=modes.damping[:2], shapes=modes.shapes[:2])
    at = {"A1": casting.bores[0].centre}
    with pytest.raises(InputError, match="its modes end at"):
        housing_from_modes(few, at, f_max=F_MAX, faces=RadiatingFaces(0.022), fidelity=fidelity)
    with pytest.raises(InputError, match="name the node"):
        housing_from_modes(modes, {"A1": (0, 0, 0.5)}, f_max=F_MAX, faces=RadiatingFaces(0.022), fidelity=fidelity)
    undamped = replace(modes, damping=0 * modes.damping)
    with pytest.raises(InputError, match="no damping"):
        housing_from_modes(undamped, at, f_max=F_MAX, faces=RadiatingFaces(0.022), fidelity=fidelity)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"f_max": np.nan}, "f_max = nan Hz must be positive"),
        ({"modal_damping": 1.2}, r"modal_damping = 1\.2 must lie in 0 … 1"),
        ({"positions": {}}, "no bearing seats are given"),
    ],
)
def test_numbers_that_are_none_are_refused_by_name(modes, casting, fidelity, wrong, message):
    at = {bore.name: bore.centre for bore in casting.bores}
    given = {"positions": at, "f_max": F_MAX, "faces": RadiatingFaces(0.022), "fidelity": fidelity, **wrong}
    with pytest.raises(InputError, match=message):
        housing_from_modes(modes, **given)


def test_faces_without_extent_are_refused():
    with pytest.raises(InputError, match="surface_size = 0 m must be positive"):
        RadiatingFaces(0.0)
