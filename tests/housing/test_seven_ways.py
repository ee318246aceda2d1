"""The same casting as our own mesh, as decks of its elements, as files of its modes: the same sound, no speckles."""

import numpy as np
import pytest

from nvhchain.errors import AccuracyWarning
from nvhchain.housing import bearing_seats, housing_from_modes, reduce_model
from nvhchain.housing.casting.mesh import mounting_plane_faces, radiating_surface
from nvhchain.housing.exchange.modal_model import modal_model
from nvhchain.housing.imported.modal_results import modal_skin
from nvhchain.housing.imported.seats import held_holes, seat_rows, seat_walls
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.reduction import reduce_mesh
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import source_power
from nvhchain.housing.skin.normal_motion import normal_motion
from nvhchain.housing.skin.skin import model_skin
from nvhchain.interop import (
    read_modal_hdf5,
    read_modal_uff,
    read_solid_model,
    write_abaqus,
    write_modal_hdf5,
    write_modal_uff,
    write_nastran,
)
from tests.housing.casting_model import casting_model
from tests.housing.seat_motion import seat_flexibility

F_MAX = 4000.0


def swept(housing, lines):
    """Face displacement under unit forces at all seats, one line after the other."""
    load = np.eye(3 * len(housing.names), dtype=complex)
    return [face_displacement(housing, np.full(len(load), line), load) for line in lines]


def power(housing, lines):
    flux = [2j * np.pi * f * (u * housing.surface.areas).T for f, u in zip(lines, swept(housing, lines), strict=True)]
    return np.array([source_power(q, housing.surface.centroids, f).sum() for f, q in zip(lines, flux, strict=True)])


DIGITS = {"deck.bdf": 1e-8, "deck.inp": 1e-8, "modes.h5": 1e-8, "modes.unv": 1e-5}
"""Those that a file keeps of the modes."""


@pytest.fixture(scope="module")
def on_skin(mesh, casting, fidelity):
    """Modes and residual vectors of the casting at its skin."""
    model = casting_model(mesh, casting)
    seats = bearing_seats(model, {bore.name: bore.centre for bore in casting.bores})
    with (
        pytest.warns(AccuracyWarning, match="per bending wavelength of walls"),
        pytest.warns(AccuracyWarning, match="tetrahedra are 5.6 times"),
    ):
        return modal_model(model, seats, f_top=fidelity.mode_ratio * F_MAX, modal_damping=casting.modal_damping)


@pytest.fixture(scope="module", params=DIGITS)
def imported(request, mesh, casting, fidelity, on_skin, tmp_path_factory):
    """The file's name, and the casting through it: as elements, meshed and solved nowhere else, or as their modes."""
    path = tmp_path_factory.mktemp("casting") / request.param
    centres = {bore.name: bore.centre for bore in casting.bores}
    faces = RadiatingFaces(0.022, mounting_plane=MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    options = {"f_max": F_MAX, "faces": faces, "modal_damping": casting.modal_damping, "fidelity": fidelity}
    if path.stem == "deck":
        write = write_nastran if path.suffix == ".bdf" else write_abaqus
        model = read_solid_model(write(casting_model(mesh, casting), path, units="mm-t-s"), units="mm-t-s")
        return path.name, reduce_model(model, bearing_seats(model, centres), **options)
    if path.suffix == ".h5":
        modes = read_modal_hdf5(write_modal_hdf5(on_skin, path))
    else:
        modes = read_modal_uff(write_modal_uff(on_skin, path, units="mm-t-s"))
    return path.name, housing_from_modes(modes, centres, residual_vectors=True, **options)


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:.*per bending wavelength of walls", "ignore:.*tetrahedra are .* as long as the wall"
)
def test_file_of_a_casting_is_the_casting(imported, reduced):
    """Modes, seats and volume velocity to the file's digits; sound power within 0.3 dB over the band."""
    name, found = imported
    digits, count = DIGITS[name], reduced.mode_count
    np.testing.assert_allclose(found.natural_frequency[:count], reduced.natural_frequency[:count], rtol=digits)
    flexible = seat_flexibility(reduced)
    np.testing.assert_allclose(seat_flexibility(found), flexible, atol=digits * np.abs(flexible).max())
    volume = [np.abs(swept(h, [800.0])[0] @ h.surface.areas) for h in (found, reduced)]
    np.testing.assert_allclose(*volume, atol=digits * volume[1].max())
    lines = np.geomspace(F_MAX / 16, F_MAX, 9)
    assert np.abs(10 * np.log10(power(found, lines) / power(reduced, lines))).max() < 0.3


def test_modes_of_a_skin_tell_the_rigid_sets_of_their_deck(mesh, casting, on_skin):
    """Bores of rigid seats and bolt holes, by their motion: they are filled as those of a deck are."""
    model, facets = casting_model(mesh, casting), modal_skin(on_skin)[0].facets
    rows = seat_rows(on_skin, {bore.name: bore.centre for bore in casting.bores})
    found = [*seat_walls(on_skin, rows, np.unique(facets)), *held_holes(on_skin, facets)]
    skin = on_skin.labels[np.unique(facets)]
    known = [np.intersect1d(model.labels[rigid.nodes], skin).tolist() for rigid in model.rigid_sets]
    assert sorted(np.sort(on_skin.labels[plug]).tolist() for plug in found) == sorted(known)
    assert len(known) == len(casting.bores) + casting.bolts


@pytest.mark.slow
def test_power_is_that_of_faces_half_as_long_and_of_the_skin(mesh, casting, surface, motion, reduced, fidelity):
    fine = radiating_surface(casting, 0.011)
    moved = normal_motion(mesh.nodes, mesh.skin, fine, mounting_plane_faces(fine), fidelity.samples_per_face)
    halved = reduce_mesh(mesh, casting, fine, lambda: moved, F_MAX, fidelity)
    lines = np.geomspace(F_MAX / 16, F_MAX, 9)
    assert np.abs(10 * np.log10(power(reduced, lines) / power(halved, lines))).max() < 0.3
    stated = reduce_mesh(mesh, casting, surface, lambda: motion, F_MAX, fidelity).accuracy
    assert np.abs(stated.mapping_error_db).max() < 0.3


def test_faces_at_edges_move_as_their_neighbours_do(mesh, casting):
    """Even and waved motion of the casting: each face of its envelope moves as the wall there along its normal."""
    model = casting_model(mesh, casting)
    skin, _ = model_skin(model)
    plane = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    made = outer_envelope(
        skin,
        [rigid.nodes for rigid in model.rigid_sets],
        RadiatingFaces(0.022, mounting_plane=plane),
        voxels_per_face=5.0,
    )
    surface, loud = made.surface, ~made.silent
    moved = normal_motion(skin.nodes, skin.facets[made.exposed], surface, made.silent, 6.0)
    for field in (
        lambda at: np.tile([1.0, 0.0, 0.0], (len(at), 1)),
        lambda at: np.cos(25 * at[:, :1]) * np.cos(25 * at[:, 1:2]) * [0.5, 0.6, 0.7],
    ):
        exact = np.einsum("ka,ka->k", field(surface.centroids), surface.normals)[loud]
        apart = np.abs((moved @ field(skin.nodes).ravel())[loud] - exact) / np.sqrt((exact**2).mean())
        assert np.sqrt((apart**2).mean()) < 0.1
        assert apart.max() < 0.9
