"""What the scene does not need is not computed: counted at the doors where the work is done.

One pair of gears in a small casting, the wheel with five slots, as coarse as it can be modelled.
"""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics.solutions import exterior
from nvhchain.case import FieldPoint
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.gear import Slots
from nvhchain.gear.compliance import flank_compliance
from nvhchain.handoff import ForceSpectrum
from nvhchain.housing.modes import seat_modes

pytestmark = pytest.mark.filterwarnings(
    "ignore:equivalent radiated power at", "ignore:rayleigh at", "ignore:the air in openings"
)  # models are coarse on purpose

TINY = Fidelity(
    "tiny",
    GearFidelity(
        profile_elements=2, width_layers=2, slices=6, angles_per_mesh=16, deflections_per_doubling=2, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.02, elements_per_turn=8),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)  # fmt: skip
HIGH = 2500.0  # Hz
NEAR, FAR = FieldPoint("near", (0.02, -0.01, 0.62)), FieldPoint("far", (0.5, 0.8, 0.3))


class Counts:
    """What was done: boundary element solutions (frequencies, points), gear bodies and teeth, housing reductions."""

    def __init__(self, patch):
        self.frequencies, self.points, self.modes_to, self.modes, self.unknowns = [], [], [], [], []
        self.teeth = defaultdict(set)
        self.responses = 0
        self._wrap(patch, exterior, "band_values", self._solved)
        self._wrap(patch, seat_modes, "modes_and_ritz_vectors", self._modes)
        self._wrap(patch, flank_compliance, "body_flexibility", self._bodies)

    @staticmethod
    def _wrap(patch, module, name, note):
        original = getattr(module, name)

        def counted(*args, **kwargs):
            result = original(*args, **kwargs)
            note(result, *args)
            return result

        patch.setattr(module, name, counted)

    def _bodies(self, response, mesh, *rest):
        self.teeth[len(mesh.blank.top)].update(range(len(response)))

    def _solved(self, solved, frequency):
        self.frequencies += list(frequency)
        self.points.append(solved.values.shape[1])

    def _modes(self, result, stiffness, mass, limit, load, terms):
        self.modes_to.append(limit)
        self.unknowns.append(stiffness.shape[0])
        self.modes.append(result[0])

    @property
    def nothing(self):
        return not (self.frequencies or self.modes_to or self.teeth)


@pytest.fixture(scope="module")
def case(request):
    base = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    pinion, wheel = base.gears
    slotted = replace(wheel, blank=Slots(5, 0.022, 0.031, 0.7, 0.003))
    band = replace(base.band, high=HIGH)
    return replace(base, gears=(pinion, slotted), band=band, field_points=(NEAR,))


@pytest.fixture(scope="module")
def whole(case, tmp_path_factory):
    """(folder of the operators, result, counts) of a run from drawing to sound."""
    folder = tmp_path_factory.mktemp("operators")
    with pytest.MonkeyPatch.context() as patch:
        counts = Counts(patch)
        result = nvh.run(case, fidelity=TINY, operators=folder)
    return folder, result, counts


@pytest.fixture
def counts(monkeypatch):
    return Counts(monkeypatch)


def test_only_the_teeth_of_one_sector_are_loaded(whole):
    """A solid pinion: one tooth of 20; five slots under 30 teeth: six."""
    assert whole[2].teeth == {20: {0}, 30: set(range(6))}


def test_no_mode_above_the_limit_is_kept_and_the_housing_is_solved_once(whole):
    counts, limit = whole[2], TINY.housing.mode_ratio * HIGH
    assert counts.modes_to == [pytest.approx(limit)]
    assert counts.modes[0].max() <= limit
    assert whole[1].housing.mode_count == len(counts.modes[0]) > 0


def test_boundary_elements_are_solved_for_the_points_asked_for_within_the_band_each_frequency_once(whole, case):
    counts = whole[2]
    assert set(counts.points) == {1}
    assert case.band.low <= min(counts.frequencies) < max(counts.frequencies) <= HIGH * (1 + 1e-9)
    assert len(counts.frequencies) == len(set(counts.frequencies))


def test_the_plan_counts_what_is_then_done_within_a_factor_of_two(whole, case):
    counts, result = whole[2], whole[1]
    planned = {name: n for stage in nvh.plan(case, fidelity=TINY).steps for name, n in stage.counts.items()}
    done = {
        "teeth": sum(len(teeth) for teeth in counts.teeth.values()),
        "unknowns": counts.unknowns[0],
        "modes": result.housing.mode_count,
        "triangles": len(result.housing.surface.triangles),
        "masters": len(result.transfer_vectors.frequency),
    }
    assert set(planned) == set(done)
    for name, n in done.items():
        assert 0.5 <= planned[name] / n <= 2, name
    assert planned["teeth"] == done["teeth"] == 7


def test_another_speed_on_the_same_operators_solves_no_finite_and_no_boundary_elements(whole, case, counts):
    faster = replace(case, operation=replace(case.operation, input_speed=1.17 * case.operation.input_speed))
    nvh.run(faster, fidelity=TINY, operators=whole[0])
    assert counts.nothing


def test_a_longer_record_solves_no_more_boundary_elements_for_the_lines_without_force_between(whole, case, counts):
    finer = replace(case, band=replace(case.band, resolution=case.band.resolution / 3))
    result = nvh.run(finer, fidelity=TINY, operators=whole[0])
    assert len(result.force_spectrum.frequency) > 2 * len(whole[1].force_spectrum.frequency)
    assert counts.nothing


def test_another_field_point_solves_boundary_elements_only(whole, case, counts):
    nvh.run(replace(case, field_points=(NEAR, FAR)), fidelity=TINY, operators=whole[0])
    assert not counts.modes_to
    assert not counts.teeth
    assert set(counts.points) == {2}


def test_another_blank_solves_its_own_body_but_no_housing_and_no_boundary_elements(whole, case, counts):
    pinion, wheel = case.gears
    three = replace(case, gears=(pinion, replace(wheel, blank=Slots(3, 0.02, 0.03, 1.2, 0.004))))
    nvh.run(three, fidelity=TINY, operators=whole[0])
    assert counts.teeth == {30: set(range(10))}
    assert not counts.modes_to
    assert not counts.frequencies


def test_a_velocity_only_question_solves_no_boundary_elements(whole, case, counts):
    asked = replace(case, quantities=("surface_velocity",), field_points=())
    result = nvh.run(asked, fidelity=TINY, mesh_laws=whole[1].mesh_laws, housing=whole[1].housing)
    assert counts.nothing
    assert result.transfer_vectors is None


def test_a_question_for_the_lines_of_given_forces_solves_nothing_at_all(whole, case, counts):
    asked = replace(case, quantities=("bearing_forces",), field_points=())
    result = nvh.run(asked, fidelity=TINY, bearing_forces=whole[1].bearing_forces)
    assert counts.nothing
    assert result.housing is None
    assert result.force_spectrum.content_hash == whole[1].force_spectrum.content_hash


def test_a_force_only_question_moves_no_surface(whole, case, monkeypatch):
    asked = replace(case, quantities=("bearing_forces",), field_points=())
    monkeypatch.setattr("nvhchain.housing.respond", lambda *_: pytest.fail("the surface was moved"))
    result = nvh.run(asked, fidelity=TINY, mesh_laws=whole[1].mesh_laws, housing=whole[1].housing)
    assert result.force_spectrum.content_hash == whole[1].force_spectrum.content_hash


def test_lines_without_force_have_no_velocity_no_transfer_vectors_and_no_pressure(whole, case, counts):
    spectrum = whole[1].force_spectrum
    few = [19, 39, 59]
    force = np.zeros_like(spectrum.force)
    force[few] = spectrum.force[few]
    given = ForceSpectrum(spectrum.frequency, force, spectrum.names, spectrum.input_speed)
    result = nvh.run(case, fidelity=TINY, force_spectrum=given, housing=whole[1].housing)
    assert result.surface_velocity.frequency.tolist() == spectrum.frequency[few].tolist()
    assert counts.frequencies == spectrum.frequency[few].tolist()
    assert result.pressure.frequency.tolist() == spectrum.frequency[few].tolist()
    assert not counts.modes_to
    assert not counts.teeth


def test_what_the_start_leaves_between_the_lines_costs_no_boundary_elements_and_says_nothing(whole, case, counts):
    """Five slots under 30 teeth: all but every sixth line of the record lie below `settle_level`."""
    folder, result = whole[:2]
    spectrum = result.force_spectrum
    size = np.abs(spectrum.force).max(axis=(1, 2))
    forced = size > TINY.dynamics.settle_level * size.max()
    assert 16 < forced.sum() < 0.5 * len(forced)  # more lines than are solved each by itself
    loud = ForceSpectrum(
        spectrum.frequency, spectrum.force * forced[:, None, None], spectrum.names, spectrum.input_speed
    )
    alone = nvh.run(case, fidelity=TINY, operators=folder, force_spectrum=loud)
    assert counts.nothing
    assert alone.transfer_vectors.content_hash == result.transfer_vectors.content_hash
    assert len(alone.pressure.frequency) == forced.sum()
    assert alone.overall == pytest.approx(result.overall, abs=1e-9)


@pytest.mark.slow
def test_a_band_whose_waves_are_longer_than_the_housing_takes_faces_that_show_its_shape(whole, case):
    """Up to 300 Hz: 0.46 m by the waves of the air, at a housing 0.13 m deep; against the faces of the whole band."""
    slow = replace(case.operation, input_speed=20 * np.pi)  # meshes at 200 Hz
    low = replace(case, operation=slow, band=replace(case.band, low=100.0, high=300.0))
    laws = {"mesh_laws": whole[1].mesh_laws}
    coarse, fine = (nvh.run(low, fidelity=TINY, **laws, **more) for more in ({}, {"housing": whole[1].housing}))
    faces = [len(result.housing.surface.triangles) for result in (coarse, fine)]
    assert faces[0] < faces[1]
    assert coarse.overall == pytest.approx(fine.overall, abs=0.5)


@pytest.mark.parametrize("radiation", ["rayleigh", "equivalent_radiated_power"])
def test_cheaper_levels_of_radiation_solve_no_boundary_elements(whole, case, counts, radiation):
    cheap = replace(TINY, acoustics=replace(TINY.acoustics, radiation=radiation))
    spectrum, housing = whole[1].force_spectrum, whole[1].housing
    result = nvh.run(case, fidelity=cheap, force_spectrum=spectrum, housing=housing)
    assert counts.nothing
    assert np.abs(result.pressure.pressure).max() > 0
