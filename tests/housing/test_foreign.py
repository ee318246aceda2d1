"""Foreign solid models reduced; the parametric casting, which takes another path, is the yardstick."""

import numpy as np
import pytest

from nvhchain.housing.casting_model import casting_model
from nvhchain.housing.engine_plane import EnginePlane
from nvhchain.housing.foreign import reduce_model
from nvhchain.housing.foreign_seats import bearing_seats
from nvhchain.interop import read_nastran, write_nastran

ENGINE = EnginePlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
F_MAX = 4000.0


@pytest.fixture(scope="module")
def foreign(mesh, casting, fidelity, surface, tmp_path_factory):
    """The casting written as Nastran in millimetres, read back and reduced with the casting's own surface."""
    path = write_nastran(casting_model(mesh, casting), tmp_path_factory.mktemp("f") / "casting.bdf", units="mm-t-s")
    model = read_nastran(path, units="mm-t-s")
    seats = bearing_seats(model, {bore.name: bore.centre for bore in casting.bores})
    return reduce_model(
        model,
        seats,
        f_max=F_MAX,
        surface_size=0.022,
        modal_damping=casting.modal_damping,
        fidelity=fidelity,
        engine_plane=ENGINE,
        surface=surface,
    )


def test_casting_read_from_a_file_has_the_same_natural_frequencies(foreign, reduced):
    assert foreign.natural_frequency == pytest.approx(reduced.natural_frequency, rel=1e-10)


def test_seats_and_their_residual_flexibility_are_the_same(foreign, reduced):
    assert foreign.names == reduced.names
    assert foreign.positions == pytest.approx(reduced.positions, abs=1e-12)
    largest = np.abs(reduced.seat_residual).max()
    assert foreign.seat_residual == pytest.approx(reduced.seat_residual, abs=1e-7 * largest)


def test_skin_found_by_voxels_moves_the_faces_as_the_castings_own_skin(foreign, reduced):
    """At 30 mm elements some facets beside the lugs lie within one voxel of two regions."""
    area = reduced.surface.areas
    difference = np.abs(foreign.normal_shapes) - np.abs(reduced.normal_shapes)
    assert (difference**2 @ area).sum() < 0.01**2 * (reduced.normal_shapes**2 @ area).sum()
    residual = (foreign.face_residual - reduced.face_residual).reshape(-1, len(area))
    assert (residual**2 @ area).sum() < 0.02**2 * (reduced.face_residual.reshape(-1, len(area)) ** 2 @ area).sum()


def test_error_of_the_mapped_power_is_stated(foreign):
    errors = foreign.provenance["mapping_error_db"]
    assert len(errors) == 4
    assert all(abs(value) < 1.0 for value in errors.values())
