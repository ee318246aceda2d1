"""Foreign solid models reduced; the parametric casting, which takes another path, is the yardstick."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from nvhchain.conventions import STEEL
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fem import factorize
from nvhchain.fem.structural.model import Springs, Structure
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing import RadiatingFaces
from nvhchain.housing.exchange.modal_model import modal_model
from nvhchain.housing.imported.mesh_resolution import resolution
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.imported.solid_model import constrained, reduce_model
from nvhchain.housing.modes.damping import DampingCurve
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.reduction import reduce_mesh
from nvhchain.housing.skin.skin import solid_skin
from nvhchain.interop import read_nastran, write_nastran
from nvhchain.testing.elements import held_box
from tests.housing.casting_model import casting_model

ENGINE = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
F_MAX = 4000.0


@pytest.fixture(scope="module")
def foreign(mesh, casting, fidelity, surface, tmp_path_factory):
    """The casting written as Nastran in millimetres, read back and reduced with the casting's own surface."""
    path = write_nastran(casting_model(mesh, casting), tmp_path_factory.mktemp("f") / "casting.bdf", units="mm-t-s")
    model = read_nastran(path, units="mm-t-s")
    seats = bearing_seats(model, {bore.name: bore.centre for bore in casting.bores})
    with pytest.warns(AccuracyWarning, match="tetrahedra are 5.6 times as long"):
        return reduce_model(
            model,
            seats,
            f_max=F_MAX,
            faces=RadiatingFaces(0.022, mounting_plane=ENGINE, surface=surface),
            modal_damping=casting.modal_damping,
            fidelity=fidelity,
        )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*tetrahedra are .* as long as the wall")
@pytest.mark.parametrize("corrected", [False, True])
def test_tetrahedra_of_a_file_state_and_correct_their_frequencies_as_a_casting_does(
    corrected, mesh, casting, surface, motion, fidelity
):
    plainly = replace(fidelity, mode_ratio=1.0)
    own = reduce_mesh(mesh, casting, surface, lambda: motion, F_MAX, replace(plainly, corrected_frequencies=corrected))
    model = casting_model(mesh, casting)
    seats = bearing_seats(model, {bore.name: bore.centre for bore in casting.bores})
    knobs = replace(fidelity, mode_ratio=1.0, corrected_frequencies=corrected)
    faces = RadiatingFaces(0.022, mounting_plane=ENGINE, surface=surface)
    options = {"f_max": F_MAX, "faces": faces, "modal_damping": casting.modal_damping, "fidelity": knobs}
    with pytest.warns(AccuracyWarning, match="bending|tetrahedra") as said:
        made = reduce_model(model, seats, **options)
    assert made.natural_frequency == pytest.approx(own.natural_frequency, rel=1e-9)
    assert "5.6 times as long" in str(said.list[0].message)
    stated = made.accuracy.frequency_error / own.accuracy.frequency_error
    assert (stated >= 1.0).all()  # a file is judged by its worst quarter, of longer elements
    assert stated.max() < (2.0 if corrected else 1.3)
    if corrected:  # a spring to the ground, too weak to matter, changes neither frequencies nor what is known of them
        weak = Springs(np.array([[0, -1]]), 1e-3 * np.eye(12)[None], np.array([1]))
        sprung = reduce_model(replace(model, structure=Structure(springs=weak)), seats, **options)
        assert sprung.natural_frequency == pytest.approx(made.natural_frequency, rel=1e-8)
        assert sprung.accuracy.frequency_error == pytest.approx(made.accuracy.frequency_error, rel=1e-6)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*tetrahedra are 5.6 times as long")
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
    errors = foreign.accuracy.mapping_error_db
    assert len(errors) == 4
    assert all(abs(value) < 1.0 for value in errors)


BOX = HousingFidelity(element_size=0.01, mode_ratio=1.0, voxels_per_face=3)


def reduce_box(model, fidelity=BOX, **options):
    seats = [rigid for rigid in model.rigid_sets if rigid.name == "S"]
    given = {"f_max": 3000.0, "modal_damping": 0.02, "faces": RadiatingFaces(0.02), **options}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AccuracyWarning)
        return reduce_model(model, seats, fidelity=fidelity, **given), [str(w.message) for w in caught]


def test_damping_of_an_imported_model_may_be_a_curve_that_is_read_at_its_modes():
    curve = DampingCurve((0.0, 4000.0), (0.01, 0.03))
    reduced, _ = reduce_box(held_box("hex8"), modal_damping=curve)
    assert reduced.modal_damping == pytest.approx(0.01 + 0.02 * np.minimum(reduced.natural_frequency / 4000.0, 1.0))
    assert np.ptp(reduced.modal_damping) > 0
    with pytest.raises(InputError, match=r"modal_damping = nan must lie in 0 … 0\.5"):
        reduce_box(held_box("hex8"), modal_damping=float("nan"))


@pytest.mark.parametrize("opening", [-1.0, 0.0, float("nan")])
def test_opening_that_is_not_positive_is_refused(opening):
    with pytest.raises(InputError, match=r"opening = \S+ m must be positive"):
        reduce_box(held_box("hex8"), faces=RadiatingFaces(0.02, opening=opening))


@pytest.mark.slow
def test_rigid_motions_that_held_freedoms_leave_are_warned_of():
    free = held_box("hex8", held=False)
    sliding = free.held.copy()
    sliding[free.nodes[:, 0] < 1e-9, 2] = True
    reduced, caught = reduce_box(replace(free, held=sliding))
    # along x and y, and about y, on whose axis the held nodes lie, and z
    assert (reduced.natural_frequency == 0).sum() == 4
    assert any("freedoms are held, and still 4 rigid motions are left" in text for text in caught)
    for model in (free, held_box("hex8")):
        assert not any("rigid motions" in text for text in reduce_box(model)[1])


@pytest.mark.slow
def test_mesh_above_its_validity_is_warned_of_with_the_frequency_it_reaches():
    """Four elements to a wave of free bending of a plate as thick as the box is wide, of which the sides are worst."""
    sides = np.array([0.2 / 3, 0.05])
    wall, edge = 0.06, (sides.sum() + np.hypot(*sides)) / 3  # of half a brick's face
    phase = np.sqrt(STEEL.young / (12 * (1 - STEEL.poisson**2) * STEEL.density)) * wall  # ω = phase · k²
    reach = phase * (2 * np.pi / (4 * edge)) ** 2 / (2 * np.pi)
    (text,) = [text for text in reduce_box(held_box("hex8"), f_max=1.2 * reach)[1] if "bending wavelength" in text]
    assert float(re.search(r"valid to (\S+) Hz", text)[1]) == pytest.approx(reach, rel=1e-3)
    assert not any("bending wavelength" in text for text in reduce_box(held_box("hex8"), f_max=0.98 * reach)[1])


def test_band_far_beyond_the_mesh_is_refused_before_anything_is_solved(monkeypatch):
    """The number of modes is that of the plate: it has been counted up to 12 kHz."""
    model = held_box("hex8", counts=(12, 9, 1), lengths=(0.4, 0.3, 0.005))
    K, M, _ = constrained(model := sound_mesh(model)[0])
    with factorize(sp.csr_matrix(K - (2 * np.pi * 12e3) ** 2 * M), symmetric_positive_definite=False) as factor:
        counted = factor.negative * 1e6 / 12e3
    monkeypatch.setattr("nvhchain.housing.imported.solid_model.seat_modes", None)
    with pytest.raises(InputError, match=r"walls of 5 mm at 1e\+06 Hz, 4 are needed") as refused:
        reduce_box(model, f_max=1e6, faces=RadiatingFaces(0.005))
    told = re.search(
        r"valid to (\S+) Hz; about (\S+) modes lie below 1e[+]06 Hz.* refine to (\S+) mm", str(refused.value)
    )
    assert float(told[2]) == pytest.approx(counted, rel=0.25)
    assert any("bending wavelength" in text for text in resolution_of(model, 4 * float(told[1])))
    with pytest.raises(InputError, match="modes lie below"):
        modal_model(model, [model.rigid_sets[1]], f_top=1e6, modal_damping=0.02)


def resolution_of(model, f_max):
    return [doubt.text for doubt in resolution(model, solid_skin(model), f_max, 4.0)]


@pytest.mark.slow
def test_tetrahedra_much_longer_than_their_wall_is_thick_are_warned_of():
    """A plate of 10 mm: tetrahedra with edges of 40 mm and diagonals of 57 mm along it."""

    def caught(kind, counts):
        model = held_box(kind, counts=counts, lengths=(0.2, 0.12, 0.01))
        return [text for text in reduce_box(model, f_max=100.0, faces=RadiatingFaces(0.01))[1] if "is thick" in text]

    (text,) = caught("tet4", (5, 3, 1))
    assert "tetrahedra are 5.7 times as long as the wall is thick" in text
    assert "22 % too high: refine to 3.5 times" in text
    assert not caught("tet4", (10, 6, 1))
    assert not caught("hex8", (5, 3, 1))


@pytest.mark.slow
def test_the_material_with_the_shortest_waves_decides_how_far_a_mesh_is_good():
    model, (block,) = held_box("hex8"), held_box("hex8").blocks
    soft = replace(
        block, nodes=block.nodes[3:], labels=block.labels[3:], material=replace(STEEL, young=STEEL.young / 4)
    )
    mixed = replace(model, blocks=(replace(block, nodes=block.nodes[:3], labels=block.labels[:3]), soft))
    reach = [
        float(re.search(r"valid to (\S+) Hz", text)[1])
        for one in (model, mixed)
        for text in reduce_box(one, f_max=20e3)[1]
        if "bending wavelength" in text
    ]
    assert reach[1] == pytest.approx(reach[0] / 2, rel=1e-3)
