"""The error band: what it is made of, and that it holds answers that are known."""

import json
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import (
    housing_shapes,
    modal_power,
    radiate,
    radiation_resistance,
    sphere,
)
from nvhchain.acoustics.accuracy.radiation_levels import level_accuracy
from nvhchain.case import FieldPoint, RadiatorCase, Ramp, Sphere
from nvhchain.chain.result import Result
from nvhchain.dynamics import LoadCentre, MeshFriction, bearing_forces
from nvhchain.error_band import (
    COVERAGE,
    Origin,
    error_band,
    force_band,
    power_band,
    velocity_band,
)
from nvhchain.error_band.band import remedy
from nvhchain.error_band.gears import AMPLIFICATION, contact_error
from nvhchain.error_band.housing import bearing_velocity, shifted
from nvhchain.error_band.radiation import level_error, radiation_error
from nvhchain.error_band.resonances import force_change
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.handoff import ForceAccuracy, ForceSpectrum, HousingAccuracy, PressureHistory, SoundAccuracy
from nvhchain.handoff.declared import Label
from nvhchain.housing import respond, truncation_errors
from nvhchain.levels import decibel, overall_power, power_level
from nvhchain.report.summary import limits
from nvhchain.spectrum import force_spectrum
from nvhchain.testing import ball_with_modes
from nvhchain.testing.ball_with_modes import BEARINGS, LINES, POINTS, load
from nvhchain.testing.hand_offs import mesh_law

FOUR_MASTERS = pytest.mark.filterwarnings(
    "ignore:interpolation between master frequencies:nvhchain.errors.AccuracyWarning"
)
"""Four masters are enough for what the tests compare."""


def of(case, fidelity, housing, parts, laws=()):
    pressure, velocity, vectors, forces = parts
    return error_band(
        Origin(case, fidelity, housing=housing, force_spectrum=forces, mesh_laws=laws),
        pressure,
        velocity,
        transfer_vectors=vectors,
    )


def test_a_coarse_housing_is_wrong_at_its_resonances_and_less_so_when_it_is_fine(case, housing, parts):
    coarse = of(case, DRAFT, housing, parts)
    finer = housing.replace(accuracy=HousingAccuracy([0.0005, 0.001, 0.002]))
    fine = of(case, DRAFT, finer, parts)
    relative = (coarse.falls["housing"] / coarse.amplitude).max(axis=1)
    assert relative[LINES == 1000.0] > 5 * relative[LINES == 300.0]
    assert (fine.falls["housing"].max(axis=1) < 0.3 * coarse.falls["housing"].max(axis=1)).all()


def test_at_a_resonance_a_moved_mode_lowers_the_sound_and_hardly_raises_it(case, housing, parts):
    """An error of one size up and down left no lower limit, or an upper one that no moved mode reaches."""
    made = of(case, DRAFT, housing, parts)
    (at,) = np.flatnonzero(LINES == 1000.0)
    up, down = made.sources["housing"][at], made.falls["housing"][at]
    assert (down > 5 * up).all()
    assert (COVERAGE * down < made.amplitude[at]).all()
    _, _, vectors, forces = parts
    for share in (-1.9, 1.9):
        other = radiate(vectors, respond(shifted(housing, share), forces), fidelity=DRAFT.acoustics)
        assert (np.abs(other.pressure[at]) >= made.amplitude[at] - 1.05 * COVERAGE * down).all()


def test_the_sound_of_a_housing_whose_modes_are_off_by_what_its_mesh_leaves_open_lies_in_the_band(case, housing, parts):
    made = of(case, DRAFT, housing, parts)
    _, _, vectors, forces = parts
    for factors in ((0.998, 0.996, 0.992), (0.998, 1.0, 0.992), (1.0, 0.996, 1.0)):
        other = housing.replace(natural_frequency=housing.natural_frequency * np.array(factors))
        level = decibel(radiate(vectors, respond(other, forces), fidelity=DRAFT.acoustics).pressure)
        assert ((made.lower < level) & (level < made.upper)).all()


def telling(error):
    """Accuracy of a housing whose excluded modes err by so much at every line."""
    return HousingAccuracy(
        truncation_frequency=np.array([1.0, 1e5]), truncation_error_at_db=np.full(2, 20 * np.log10(1 + error))
    )


def test_modes_left_out_err_as_the_housing_tells_where_it_knows(case, housing, parts):
    found = []
    for error in (0.01, 0.04):
        told = housing.replace(accuracy=telling(error))
        found.append(of(case, DRAFT, told, parts).sources["excluded modes"])
        sound = np.abs(parts[0].pressure)  # up to √n of what n shares make by themselves
        assert (found[-1] > 0.5 * truncation_errors(told, LINES)[:, None] * sound).all()
    assert found[1] == pytest.approx(4 * found[0])


def test_what_is_not_handed_in_is_exact(case, housing, parts):
    pressure, velocity, vectors, _ = parts
    assert set(error_band(Origin(case, DRAFT), pressure, velocity).sources) == {"surface mesh"}
    assert set(error_band(Origin(case, DRAFT), pressure, velocity, transfer_vectors=vectors).sources) == {
        "surface mesh",
        "masters",
    }
    assert "gear" not in of(case, DRAFT, housing, parts).sources
    assert (of(case, DRAFT, housing.replace(accuracy=HousingAccuracy()), parts).sources["housing"] == 0).all()


@pytest.fixture(scope="module")
def meshing(housing, parts):
    """Pressure, velocity, vectors and forces at the first two mesh orders, their sum with a tenth of the first, and
    where no mesh excites anything."""
    turns = 188.5 / (2 * np.pi)
    lines = turns * np.array([20.0, 40.0, 47.3])
    forces = ForceSpectrum(lines, load(1.0, 1.0, 1.0), BEARINGS, input_speed=188.5)
    velocity = respond(housing, forces)
    pressure = radiate(parts[2], velocity, fidelity=DRAFT.acoustics).replace(input_speed=188.5)
    return pressure, velocity, parts[2], forces


def test_forces_are_uncertain_where_the_transmission_error_is_weak_and_open_where_it_is_none(case, housing, meshing):
    """At the strongest harmonic the law's error; at one of a hundredth more, up to the square of the first, which
    excites the second too; nothing is known at a line that nothing excites."""
    made = of(case, DRAFT, housing, meshing, [mesh_law([1e-6, 1e-8])])
    first, weak, none = (made.sources["gear"] / made.amplitude)[:, 0]
    error = AMPLIFICATION * contact_error(case.gears[1].geometry, DRAFT.gear, np.ones(1))[0]
    assert first == pytest.approx(error, rel=0.1)
    assert 5 * error < weak < 100 * error
    assert none == 1.0
    finer = of(case, REFERENCE, housing, meshing, [mesh_law([1e-6, 1e-8])])
    assert (finer.sources["gear"][:2] < 0.5 * made.sources["gear"][:2]).all()


def test_error_of_forces_and_velocity_follow_what_the_gears_and_the_housing_leave_open(case, housing, meshing):
    pressure, velocity, _, forces = meshing
    laws = [mesh_law([1e-6, 1e-8])]
    force = force_band(Origin(case, DRAFT, housing=housing, mesh_laws=laws), forces)
    assert force.amplitude == pytest.approx(np.abs(load(1.0, 1.0, 1.0)).sum(axis=2) / 3**0.5)
    gear = of(case, DRAFT, housing, meshing, laws).sources["gear"] / np.abs(pressure.pressure)
    assert force.sources["gear"][:, 0] / force.amplitude[:, 0] == pytest.approx(gear[:, 0])
    motion = velocity_band(Origin(case, DRAFT, housing=housing, force_spectrum=forces, mesh_laws=laws), velocity)
    share = housing.surface.areas / housing.surface.areas.sum()
    assert motion.amplitude[:, 0] == pytest.approx(np.sqrt(np.abs(velocity.normal_velocity) ** 2 @ share))
    seen = force.sources["housing"][:, :1] / force.amplitude[:, :1]
    assert (seen > 0).all()
    assert (seen < 2 * motion.sources["housing"] / motion.amplitude).all()
    assert set(motion.sources) == {"housing", "excluded modes", "gear", "time step", "settling"}
    exact = velocity_band(Origin(case, DRAFT), velocity)
    assert exact.overall[0] == pytest.approx([exact.level[0]] * 2)
    assert exact.level[0] == pytest.approx(
        10 * np.log10((np.abs(velocity.normal_velocity) ** 2 @ share).sum() / 2 / 1e-18)
    )


@pytest.mark.parametrize("options", [{}, {"friction": 0.05, "shuttling": True}])
def test_forces_change_as_they_do_in_a_run_with_the_housing_that_moves_them_more(case, housing, options):
    """Against time integration, with a law whose stiffness is constant.

    Friction and moving loads are forces of the meshes, too: without them limits of levels were up to 8 dB too wide.
    """
    laws, case = [mesh_law([1e-6, 1e-6, 1e-6])], replace(case, options=replace(case.options, **options))
    gearbox = case.gearbox_with_gears
    if options:
        angle, period = laws[0].angle, laws[0].period
        turned = 2.0 * np.pi * angle / period
        friction = MeshFriction(0.05, period, angle, 0.7 * np.sin(turned) + 0.3, 0.004 * np.cos(2.0 * turned))
        centre = LoadCentre(period, angle, 0.002 * np.sin(turned) + 0.001 * np.cos(3.0 * turned))
        gearbox = replace(gearbox, meshes=(replace(gearbox.meshes[0], friction=friction, load_centre=centre),))
    fidelity = replace(DRAFT, dynamics=replace(DRAFT.dynamics, time_step=5e-6, settle_level=1e-8))
    asked = {"input_speed": 188.5, "input_torque": 60.0, "duration": 1 / 30, "f_max": 2000.0}
    of, *given = (
        force_spectrum(
            bearing_forces(gearbox, laws, each, **asked, fidelity=fidelity.dynamics),
            low=100.0,
            high=2000.0,
        )
        for each in (housing, shifted(housing, -1.0), shifted(housing, 1.0))
    )
    rows = [int(np.abs(of.frequency - 20 * n * 188.5 / (2 * np.pi)).argmin()) for n in (1, 2, 3)]
    lines = of.replace(frequency=of.frequency[rows], force=of.force[rows])
    found = force_change(case, fidelity, housing, laws, lines).apply(lines).force
    true = np.array([each.force[rows] - lines.force for each in given])
    size, off = (np.linalg.norm(each, axis=(2, 3)) for each in (true, found - true))
    assert size[0, 0] > 0.08 * np.linalg.norm(lines.force[0])
    assert set(size.argmax(axis=0)) == {0, 1}
    assert (off.min(axis=0) < 1e-5 * size.max(axis=0)).all()
    assert (off.argmin(axis=0) == size.argmax(axis=0)).all()


def test_a_steady_state_that_loses_contact_errs_by_it(case, housing, meshing):
    forces, laws = meshing[3], [mesh_law([1e-6, 1e-7])]
    stated = ForceAccuracy(parted=(Label("A–B"),), parted_time=np.array([0.1]), parted_error=0.05)
    band = force_band(Origin(case, DRAFT, housing=housing, mesh_laws=laws, force_accuracy=stated), forces)
    assert (band.sources["contact loss"] >= 0.05 * band.amplitude).all()
    assert "dynamics" in remedy("contact loss")


@pytest.mark.parametrize("torque", [20.0, -20.0])
def test_points_that_follow_a_tilt_push_apart_on_drive_flanks_alone(case, housing, meshing, torque):
    """A moment about mid-width is one more force of the mesh; back flanks have none that is known."""
    operation = replace(case.operation, input_torque=torque)
    tilting = replace(case, operation=operation, options=replace(case.options, tilt=True))
    found = force_change(tilting, DRAFT, housing, [mesh_law([1e-6, 1e-6])], meshing[3])
    assert found.away.shape[2] == (2 if torque > 0.0 else 1)


def test_ready_made_laws_are_exact_and_what_is_made_of_them_is_not(case, housing, meshing):
    """Forces that were given are exact."""
    _, velocity, _, forces = meshing
    asked = replace(case, quantities=("bearing_forces", "surface_velocity"), field_points=())
    common = {"force_spectrum": forces, "surface_velocity": velocity, "housing": housing}
    made, ready, given = (
        Result(asked, DRAFT, (mesh_law([1e-6, 1e-8]),), supplied=names, **common).error_bands
        for names in ((), ("mesh_laws",), ("force_spectrum",))
    )
    for quantity in asked.quantities:
        known = made[quantity].sources.keys() - {"gear"}
        assert known == ready[quantity].sources.keys() >= {"housing", "excluded modes", "time step", "settling"}
        for name in known:
            assert ready[quantity].sources[name] == pytest.approx(made[quantity].sources[name])
    assert not given["bearing_forces"].sources
    assert given["surface_velocity"].sources.keys() == {"housing", "excluded modes"}


@pytest.fixture(scope="module")
def silent(housing):
    return ball_with_modes.silent(housing)


@FOUR_MASTERS
def test_a_mode_that_does_not_radiate_is_heard_by_the_forces_that_it_changes(case, silent, parts, meshing):
    """By nothing else, in every quantity; not where the seats stood still in the gearbox."""
    lines, laws = meshing[3], [mesh_law([1e-6, 1e-6])]
    moved = force_change(case, DRAFT, silent, laws, lines).apply(lines)
    vectors, velocity = parts[2], respond(silent, lines)
    pressure = radiate(vectors, velocity, fidelity=DRAFT.acoustics)
    loaded = {"housing": silent, "force_spectrum": lines, "mesh_laws": laws}
    resistance = radiation_resistance(
        housing_shapes(silent), [200.0, 600.0, 1000.0, 1700.0], air=case.air, fidelity=DRAFT.acoustics
    ).replace(housing=silent.content_hash)
    power = modal_power(resistance, silent, lines, fidelity=DRAFT.acoustics)
    sound = np.abs(radiate(vectors, respond(silent, moved), fidelity=DRAFT.acoustics).pressure)
    motion = velocity_band(Origin(case, DRAFT), respond(silent, moved)).amplitude
    resultant = np.sqrt((np.abs(moved.force) ** 2).sum(axis=2))
    assert (sound > 0).all()
    still = replace(case, options=replace(case.options, rigid_housing=True))
    for band, wanted in (
        (lambda of: velocity_band(Origin(of, DRAFT, **loaded), velocity), motion),
        (lambda of: force_band(Origin(of, DRAFT, housing=silent, mesh_laws=laws), lines), resultant),
        (lambda of: power_band(Origin(of, DRAFT, **loaded), power, velocity=velocity), None),
        (lambda of: power_band(Origin(of, DRAFT, **loaded), power, radiation_resistance=resistance), None),
    ):
        found = band(case).sources["housing"]
        assert (found > 0).all() if wanted is None else found == pytest.approx(wanted, rel=1e-3)
        assert (band(still).sources["housing"] == 0).all()
    heard, seats = (
        error_band(Origin(of, DRAFT, **loaded), pressure, velocity, transfer_vectors=vectors) for of in (case, still)
    )
    larger = np.maximum(heard.sources["housing"], heard.falls["housing"])
    # of one deviation; SHAPES_SHARE adds 1.45 of what moved frequencies alone would do
    assert ((0.3 * sound < larger) & (larger < 1.6 * sound)).all()
    assert (np.maximum(seats.sources["housing"], seats.falls["housing"]) < 1e-9 * np.abs(pressure.pressure).max()).all()


def test_a_bearing_that_a_line_hardly_loads_is_as_uncertain_as_the_others_are(case):
    lines = np.array([600.0, 1200.0])
    load = np.array([[3.0, 1e-6], [1.0, 1.0]])[:, :, None] * np.array([1.0, 0.0, 0.0])
    forces = ForceSpectrum(lines, load.astype(complex), ("A1", "B1"), input_speed=188.5)
    error = force_band(Origin(case, DRAFT, mesh_laws=[mesh_law([1e-6, 1e-6])]), forces).error
    assert error[0, 1] == pytest.approx(error[0, 0] / 2**0.5, rel=1e-6)
    assert error[1, 1] == pytest.approx(error[1, 0])


def test_velocity_of_a_housing_whose_modes_are_off_by_what_its_mesh_leaves_open_lies_in_the_band(case, housing, parts):
    _, velocity, _, forces = parts
    made = velocity_band(Origin(case, DRAFT, housing=housing, force_spectrum=forces), velocity)
    for factors in ((0.998, 0.996, 0.992), (0.998, 1.0, 0.992), (1.0, 0.996, 1.0)):
        other = respond(housing.replace(natural_frequency=housing.natural_frequency * np.array(factors)), forces)
        level = velocity_band(Origin(case, DRAFT), other)
        assert ((made.lower < level.upper) & (level.lower < made.upper)).all()


def test_forces_of_two_bearings_that_nearly_cancel_on_the_surface_err_each_by_itself(case, housing, meshing):
    """1 N against 0.9 N at the same seat move it as 0.1 N; what is wrong with either moves it as with 1 N."""
    two = housing.replace(
        seat_shapes=housing.seat_shapes[:, [0, 1, 0, 3]], face_residual=housing.face_residual[[0, 1, 0, 3]]
    )
    lines, laws = meshing[3].frequency, [mesh_law([1e-6, 1e-8])]

    def band(of, other):
        force = load(1.0, 1.0, 1.0)
        force[:, 2] = other * force[:, 0]
        forces = ForceSpectrum(lines, force, BEARINGS, input_speed=188.5)
        return forces, velocity_band(
            Origin(case, DRAFT, housing=of, force_spectrum=forces, mesh_laws=laws), respond(of, forces)
        )

    one, both = band(housing, 0.0), band(two, -0.9)
    assert both[1].amplitude == pytest.approx(0.1 * one[1].amplitude)
    assert bearing_velocity(two, both[0]) == pytest.approx((1 + 0.81) ** 0.5 * one[1].amplitude)
    for name in ("housing", "excluded modes"):
        assert (both[1].sources[name] > 0.3 * one[1].sources[name]).all()


def test_the_band_of_fifty_thousand_lines_takes_no_matrix_of_their_distances(housing):
    lines = np.linspace(50.0, 5000.0, 50_000)
    forces = ForceSpectrum(lines, load(*np.ones(len(lines))), BEARINGS, input_speed=188.5)
    tracemalloc.start()
    bearing_velocity(housing, forces)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 200e6  # of distances 20 GB


def test_velocity_is_judged_at_the_lines_that_carry_force(case, housing, meshing):
    _, velocity, _, forces = meshing
    few = forces.replace(force=forces.force * np.array([1.0, 0.0, 1.0])[:, None, None])
    every, some = (
        velocity_band(
            Origin(case, DRAFT, housing=housing, force_spectrum=of, mesh_laws=[mesh_law([1e-6])]), respond(housing, of)
        )
        for of in (forces, few)
    )
    assert some.frequency.tolist() == velocity.frequency[[0, 2]].tolist()
    assert some.error == pytest.approx(every.error[[0, 2]])


@pytest.mark.parametrize("fidelity", [DRAFT, STANDARD], ids=lambda preset: preset.name)
def test_the_exact_power_of_a_pulsating_sphere_lies_in_the_band(fidelity):
    """½ ρc v² 4πa² (ka)²/(1 + (ka)²) (Morse & Ingard 1968, eq. 7.1.5)."""
    ball = RadiatorCase("ball", Sphere(0.1), (100.0, 700.0, 1900.0), (), pulsation=1.0, quantities=("sound_power",))
    result = nvh.run(ball, fidelity=fidelity)
    made = result.error_bands["sound_power"]
    ka = 2 * np.pi * made.frequency / 343.0 * 0.1
    exact = 0.5 * ball.air.impedance * 4 * np.pi * 0.01 * ka**2 / (1 + ka**2)
    level = power_level(exact)[:, None]
    assert ((made.lower < level) & (level < made.upper)).all()
    assert (made.upper - made.lower < 2.5).all()
    assert made.level[0] == pytest.approx(overall_power(made.frequency, result.sound_power.power))
    low, high = made.overall[0]
    assert low < overall_power(made.frequency, exact) < high


@FOUR_MASTERS
def test_power_of_the_modes_is_uncertain_as_the_velocity_is_where_one_mode_radiates(case, housing, parts):
    """The ball breathes alone at its first resonance: both ways to its power see the same error there."""
    forces = parts[3]
    breathing = housing.replace(
        natural_frequency=housing.natural_frequency[:1],
        modal_damping=housing.modal_damping[:1],
        seat_shapes=housing.seat_shapes[:1],
        normal_shapes=housing.normal_shapes[:1],
        face_residual=0 * housing.face_residual,
        accuracy=HousingAccuracy([0.0025]),
    )
    resistance = radiation_resistance(
        housing_shapes(breathing), [200.0, 600.0, 1000.0, 1700.0], air=case.air, fidelity=DRAFT.acoustics
    ).replace(housing=breathing.content_hash)
    power = modal_power(resistance, breathing, forces, fidelity=DRAFT.acoustics)
    common = {"housing": breathing, "force_spectrum": forces}
    modal = power_band(Origin(case, DRAFT, **common), power, radiation_resistance=resistance)
    plain = power_band(Origin(case, DRAFT, **common), power, velocity=respond(breathing, forces))
    assert modal.sources["housing"] == pytest.approx(plain.sources["housing"], rel=0.1)
    assert modal.amplitude == pytest.approx(20e-6 * np.sqrt(2 * power.power / 1e-12)[:, None])


def test_forces_are_open_where_modes_were_left_out_without_their_statics(case, housing, meshing):
    forces, laws = meshing[3], [mesh_law([1e-6, 1e-8])]
    told = housing.replace(accuracy=telling(0.01))
    force = force_band(Origin(case, DRAFT, housing=told, mesh_laws=laws), forces)
    motion = velocity_band(Origin(case, DRAFT, housing=told, force_spectrum=forces, mesh_laws=laws), meshing[1])
    missed = force.sources["excluded modes"][:, 0] / force.amplitude[:, 0]
    assert (missed > 0).all()
    assert (missed < motion.sources["excluded modes"][:, 0] / motion.amplitude[:, 0]).all()
    bare = replace(DRAFT, housing=replace(DRAFT.housing, residual_flexibility=False))
    still = force_band(Origin(case, bare, housing=housing, mesh_laws=laws), forces).sources["excluded modes"]
    relative = still[:, 0] / force.amplitude[:, 0]
    assert (20 * np.log10(1 + COVERAGE * relative) > 12.4).all()  # two modes of the single stage


def test_the_quadrature_error_that_transfer_vectors_tell_widens_the_band(case, parts):
    surface, told = sphere(0.1, 1), SoundAccuracy(expected_error_db=0.1, quadrature_error=0.05)
    plain = radiation_error(surface, LINES, case, DRAFT.acoustics, SoundAccuracy(expected_error_db=0.1))
    assert set(plain) == {"surface mesh"}
    made = radiation_error(surface, LINES, case, DRAFT.acoustics, told)
    assert COVERAGE * made["quadrature"] == pytest.approx(np.full((len(LINES), 1), 8 * 0.05))


def test_a_cheap_level_of_radiation_is_less_certain_the_smaller_the_body_is_against_the_wavelength(case, parts):
    """At every line what the level says of itself when it warns."""
    pressure, velocity, _, _ = parts
    for radiation in ("rayleigh", "equivalent_radiated_power"):
        cheap = replace(DRAFT, acoustics=replace(DRAFT.acoustics, radiation=radiation))
        made = error_band(Origin(case, cheap), pressure, velocity)
        relative = (made.sources["radiation"] / made.amplitude)[:, 0]
        for line, found in zip(LINES, relative, strict=True):
            with pytest.warns(AccuracyWarning, match=f"{radiation.replace('_', ' ')} at "):
                told = level_accuracy(velocity.surface, np.array([line]), case.air, radiation)
            assert found == pytest.approx(10 ** (told.expected_error_db / 20) - 1)
        assert (np.diff(relative) <= 1e-12).all()
    low = level_error(velocity.surface, np.array([1.0, 10.0]), case.air, "rayleigh")
    assert low[0] - low[1] == pytest.approx(20.0)


@pytest.fixture(scope="module")
def rising():
    return ball_with_modes.rising()


def test_a_summary_holds_the_limits_of_lines_and_of_speeds(case, housing, parts, meshing, rising):
    pressure, velocity, vectors, forces = meshing
    laws, common = (mesh_law([1e-6, 1e-7]),), {"housing": housing, "transfer_vectors": vectors}
    asked = replace(case, quantities=("pressure", "bearing_forces", "surface_velocity"))
    steady = Result(asked, DRAFT, laws, force_spectrum=forces, surface_velocity=velocity, pressure=pressure, **common)
    told = limits(steady)
    assert [line["frequency_hz"] for line in told["lines"]] == pytest.approx(list(pressure.frequency))
    assert told["lines"][0]["limits_db"] == pytest.approx(
        [steady.error_band.lower[0, 0], steady.error_band.upper[0, 0]]
    )
    assert told["lines"][2]["limits_db"][0] is None  # where nothing excites a force all is open
    assert set(told["other_quantities"]) == {"bearing_forces", "surface_velocity"}
    band = steady.error_bands["surface_velocity"]
    assert told["other_quantities"]["surface_velocity"]["limits"][1] == pytest.approx(band.overall[0, 1])
    (source, share, frequency), *_ = band.parts
    assert told["other_quantities"]["surface_velocity"]["limit_parts"][0] == {
        "source": source,
        "share": pytest.approx(share[0]),
        "frequency_hz": frequency[0],
    }
    ramp = replace(case.operation, input_speed=157.0, ramp=Ramp(220.0, 2.0))
    history = PressureHistory(
        rising.time, POINTS, 0.1 * rising.force[:, 0, :2], rising.input_speed
    )  # the level is the record's own
    run_up = Result(
        replace(case, operation=ramp, band=replace(case.band, low=300.0, high=1700.0)),
        DRAFT,
        laws,
        bearing_forces=rising,
        pressure_history=history,
        **common,
    )
    told = limits(run_up)
    band = run_up.error_band
    assert len(band.input_speed) == 20
    assert told["over_speed"][0]["speed_rpm"] < told["over_speed"][-1]["speed_rpm"]
    parts = band.limits[:, 0] - band.speed_levels[:, :1]
    for row in told["over_speed"]:  # windows are as far from their limits as the part that holds them
        high = row["limits_dBA"][1] - row["level_dBA"]
        assert np.abs(parts[:, 1] - high).min() < 1e-9
    level = told["over_speed"][10]["level_dBA"]
    low, high = told["over_speed"][10]["limits_dBA"]
    assert low is None or low < level
    assert level < high
    assert told["error_band_dBA"][1] > run_up.overall[0]
    assert run_up.error_band.level == pytest.approx(run_up.overall, abs=0.1)
    json.dumps(told, allow_nan=False)


def test_a_run_without_sound_has_the_bands_of_what_it_asks_for_and_is_told_where_to_look(case, meshing):
    asked = replace(case, quantities=("bearing_forces",), field_points=())
    result = Result(asked, DRAFT, (mesh_law([1e-6, 1e-7]),), force_spectrum=meshing[3])
    assert set(result.error_bands) == {"bearing_forces"}
    for read in ("error_band", "overall"):
        with pytest.raises(InputError, match=r"quantities = \['bearing_forces'\] leave out the sound pressure: take"):
            getattr(result, read)


@pytest.mark.parametrize("fidelity", [DRAFT, STANDARD], ids=lambda preset: preset.name)
def test_the_exact_pressure_of_a_pulsating_sphere_lies_in_the_band(fidelity):
    """ρ c v jka² e^{−jk(r−a)}/(r (1 + jka)) (Morse & Ingard 1968, eq. 7.1.4)."""
    ball = RadiatorCase("ball", Sphere(0.1), (100.0, 700.0, 1900.0), (FieldPoint("p", (0.0, 0.0, 1.0)),), pulsation=1.0)
    result = nvh.run(ball, fidelity=fidelity)
    made = error_band(Origin(ball, fidelity), result.pressure, result.surface_velocity)
    ka = 2 * np.pi * made.frequency / 343.0 * 0.1
    exact = decibel(ball.air.impedance * ka * 0.1 / np.sqrt(1 + ka**2))[:, None]
    assert ((made.lower < exact) & (exact < made.upper)).all()
    assert (made.upper - made.lower < 2.5).all()


def test_pressure_and_velocity_of_different_runs_are_refused(case, parts):
    pressure, velocity, _, _ = parts
    with pytest.raises(InputError, match="of one run"):
        error_band(Origin(case, DRAFT), pressure.replace(frequency=pressure.frequency + 1.0), velocity)
