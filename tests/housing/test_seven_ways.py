"""The same casting as our own mesh and as decks of its elements: the same structure, the same sound, no speckles."""

import numpy as np
import pytest

from nvhchain.housing import bearing_seats, reduce_model
from nvhchain.housing.casting.mesh import mounting_plane_faces, radiating_surface
from nvhchain.housing.exchange.casting_model import casting_model
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.reduction import reduce_mesh, seat_flexibility
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import source_power
from nvhchain.housing.skin.normal_motion import normal_motion
from nvhchain.housing.skin.skin import model_skin
from nvhchain.interop import read_solid_model, write_abaqus, write_nastran

F_MAX = 4000.0


def swept(housing, lines):
    """Face displacement under unit forces at all seats, one line after the other."""
    load = np.eye(3 * len(housing.names), dtype=complex)
    return [face_displacement(housing, np.full(len(load), line), load) for line in lines]


def power(housing, lines):
    flux = [2j * np.pi * f * (u * housing.surface.areas).T for f, u in zip(lines, swept(housing, lines), strict=True)]
    return np.array([source_power(q, housing.surface.centroids, f).sum() for f, q in zip(lines, flux, strict=True)])


@pytest.fixture(scope="module", params=["deck.bdf", "deck.inp"])
def imported(request, mesh, casting, fidelity, tmp_path_factory):
    """The casting's elements through a file, meshed and solved nowhere else."""
    path = tmp_path_factory.mktemp("deck") / request.param
    write = write_nastran if path.suffix == ".bdf" else write_abaqus
    model = read_solid_model(write(casting_model(mesh, casting), path, units="mm-t-s"), units="mm-t-s")
    return reduce_model(
        model,
        bearing_seats(model, {bore.name: bore.centre for bore in casting.bores}),
        f_max=F_MAX,
        faces=RadiatingFaces(0.022, mounting_plane=MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))),
        modal_damping=casting.modal_damping,
        fidelity=fidelity,
    )


@pytest.mark.filterwarnings("ignore::nvhchain.errors.AccuracyWarning")
def test_deck_of_a_casting_is_the_casting(imported, reduced):
    """Modes and seats to rounding; volume velocity to rounding; sound power within 0.3 dB over the band."""
    np.testing.assert_allclose(imported.natural_frequency, reduced.natural_frequency, rtol=1e-8)
    flexible = seat_flexibility(reduced)
    np.testing.assert_allclose(seat_flexibility(imported), flexible, atol=1e-8 * np.abs(flexible).max())
    volume = [np.abs(swept(h, [800.0])[0] @ h.surface.areas) for h in (imported, reduced)]
    np.testing.assert_allclose(*volume, atol=1e-8 * volume[1].max())
    lines = np.geomspace(F_MAX / 16, F_MAX, 9)
    assert np.abs(10 * np.log10(power(imported, lines) / power(reduced, lines))).max() < 0.3


@pytest.mark.slow
def test_power_is_that_of_faces_half_as_long_and_of_the_skin(mesh, casting, surface, motion, reduced, fidelity):
    fine = radiating_surface(casting, 0.011)
    moved = normal_motion(mesh.nodes, mesh.skin, fine, mounting_plane_faces(fine), fidelity.samples_per_face)
    halved = reduce_mesh(mesh, casting, fine, moved, F_MAX, fidelity)
    lines = np.geomspace(F_MAX / 16, F_MAX, 9)
    assert np.abs(10 * np.log10(power(reduced, lines) / power(halved, lines))).max() < 0.3
    stated = reduce_mesh(mesh, casting, surface, motion, F_MAX, fidelity).accuracy
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
