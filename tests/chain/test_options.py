"""Options of the dynamics in a case: off, nothing is computed for them; on, the bearing forces are those of the model
that they name."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.case import PLAIN
from nvhchain.chain.loaded import compliances, loaded_case
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity, GearFidelity
from nvhchain.files import hdf5
from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import BearingForces, LoadDistribution, MeshLaw, ReducedHousing, Surface


@pytest.fixture(scope="module")
def load(request, tmp_path_factory):
    small = request.config.rootpath / "cases" / "small" / "single_stage.toml"
    path = tmp_path_factory.mktemp("options") / "case.toml"

    def case(text=""):
        path.write_text(f'base = "{small}"\nquantities = ["bearing_forces"]\n[band]\nhigh = 1500\n{text}')
        return nvh.load_case(path)

    case.path = path  # of the latest one
    return case


@pytest.fixture(scope="module")
def housing(load):
    """A casting of one mode and soft seats."""
    case, count = load(), 4
    corners = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    return ReducedHousing(
        natural_frequency=np.array([900.0]),
        modal_damping=np.array([0.02]),
        seat_shapes=0.3 * np.ones((1, count, 3)),
        normal_shapes=np.ones((1, 4)),
        seat_residual=1e-9 * np.eye(3 * count).reshape(count, 3, count, 3),
        face_residual=np.zeros((count, 3, 4)),
        names=tuple(case.seats),
        positions=np.array(list(case.seats.values())),
        surface=Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])),
    )


COARSE = replace(
    nvh.DRAFT,
    gear=GearFidelity(
        profile_elements=4, width_layers=3, slices=8, angles_per_mesh=16, deflections_per_doubling=2, bodies="analytic"
    ),
    dynamics=DynamicsFidelity(time_step=40e-6),
)


@pytest.fixture(scope="module")
def run(load, housing, tmp_path_factory):
    """A case with `text` added to it, run from gears to bearing forces with operators that all share."""
    folder = tmp_path_factory.mktemp("operators")

    def result(text="", **arguments):
        arguments = {"fidelity": COARSE, "operators": folder, "housing": housing} | arguments
        return nvh.run(load(text), **arguments)

    return result


def moving(result):
    return result.bearing_forces.force - result.bearing_forces.force.mean(axis=0)


def directly(result, gearbox, fidelity=COARSE.dynamics):
    """Bearing forces of `gearbox` with the laws and the housing of a run."""
    case = result.case
    return dynamics.bearing_forces(
        gearbox,
        result.mesh_laws,
        result.housing,
        input_speed=case.operation.input_speed,
        input_torque=case.operation.input_torque,
        f_max=case.band.high,
        fidelity=fidelity,
        duration=1.0 / case.band.resolution,
    )


def test_unasked_nothing_is_computed(run, record, monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise AssertionError("computed although not asked for")

    for module, name in (
        (gear, "load_distribution"),
        (dynamics, "static_misalignment"),
        (dynamics, "MeshFriction"),
        (dynamics, "LoadCentre"),
    ):
        monkeypatch.setattr(module, name, refuse)
    result = run(watcher=record, operators=tmp_path)
    assert sorted(record.began) == ["bearing_forces", "force_spectrum", "mesh_law_stage"]
    assert result.load_distributions == ()
    assert result.mesh_laws[0].tilt_ratio is None
    with pytest.raises(AssertionError, match="not asked"):
        run("[options]\nshuttling = true", operators=tmp_path)


def test_compliances_are_found_once_for_law_and_distribution(run, record, monkeypatch, tmp_path):
    calls, own = [], gear.pair_compliances
    monkeypatch.setattr(gear, "pair_compliances", lambda *given, **named: calls.append(1) or own(*given, **named))
    result = run("[options]\nfriction = 0.05\nshuttling = true", watcher=record, operators=tmp_path)
    assert len(calls) == 1
    assert sorted(record.began) == ["bearing_forces", "force_spectrum", "load_distribution_stage", "mesh_law_stage"]
    (kept,) = tmp_path.glob("load_distribution_stage-*.h5")
    assert hdf5.load(kept, LoadDistribution).content_hash == result.load_distributions[0].content_hash
    again = run("[options]\nfriction = 0.03", watcher=record, operators=tmp_path)
    assert ("load_distribution_stage", "cached") in record.ended  # whatever the coefficient
    assert len(calls) == 1
    assert np.abs(moving(again) - moving(result)).max() > 0.01 * np.abs(moving(result)).max()


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("friction = 0.05", {"friction": True}),
        ("shuttling = true", {"load_centre": True}),
        ("friction = 0.05\nshuttling = true", {"friction": True, "load_centre": True}),
    ],
)
def test_forces_are_those_of_a_gearbox_with_the_tables_of_its_contact(run, text, change):
    plain, result = run(), run(f"[options]\n{text}")
    (of,) = result.load_distributions
    tables = {
        "friction": dynamics.MeshFriction(0.05, of.period, of.angle, of.sliding, of.arm),
        "load_centre": dynamics.LoadCentre(of.period, of.angle, of.offset),
    }
    gearbox = result.case.gearbox_with_gears
    mesh = replace(gearbox.meshes[0], **{name: tables[name] for name in change})
    wanted = directly(result, replace(gearbox, meshes=(mesh,)))
    assert np.array_equal(result.bearing_forces.force, wanted.force)
    assert np.abs(moving(result) - moving(plain)).max() > 0.02 * np.abs(moving(plain)).max()


def test_tilt_brings_points_across_the_face_and_the_ratio_travels_with_the_law(run, tmp_path):
    result = run("[options]\ntilt = true")
    (law,), ratio = result.mesh_laws, result.mesh_laws[0].tilt_ratio
    assert 1.0 < ratio < 1.3  # slices by themselves on bodies that twist as one
    assert hdf5.load(hdf5.save(law, tmp_path / "law.h5"), MeshLaw).tilt_ratio == ratio
    box = result.case.gearbox_with_gears
    assert box.face_points == 2
    wanted = directly(result, replace(box, meshes=(replace(box.meshes[0], tilt_ratio=ratio),)))
    assert np.array_equal(result.bearing_forces.force, wanted.force)
    # a law that says nothing counts as slices side by side; one that resists more makes other forces
    known = [law.replace(tilt_ratio=given) for given in (None, 1.0, 3.0)]
    silent, one, stiff = (run("[options]\ntilt = true", mesh_laws=[of]).bearing_forces.force for of in known)
    assert np.array_equal(silent, one)
    assert np.abs(stiff - one).max() > 1e-3 * np.ptp(one, axis=0).max()


@pytest.mark.parametrize("option", ["flexible_shafts", "gyroscopic"])
def test_shafts_bend_and_spin_in_the_gearbox_of_a_case_that_asks_for_it(run, option):
    plain, result = run(), run(f"[options]\n{option} = true")
    wanted = directly(result, replace(plain.case.gearbox_with_gears, **{option: True}))
    assert np.array_equal(result.bearing_forces.force, wanted.force)
    assert not np.array_equal(result.bearing_forces.force, plain.bearing_forces.force)


@pytest.mark.parametrize("flexible", [False, True])
def test_laws_are_those_of_gears_that_tilt_as_the_loaded_gearbox_does(run, housing, flexible):
    """From the laws that come out, not from the stand-in the chain takes."""
    text = "loaded_misalignment = true" + ("\nflexible_shafts = true" if flexible else "")
    result = run(f"[options]\n{text}")
    case = result.case
    (pair,), (force,), moment, free = case.pairs, case.mesh_forces, np.zeros(1), None
    for _ in range(4):  # the teeth oppose the tilt
        ((in_plane, normal),) = dynamics.opposed_misalignment(
            case.gearbox_with_gears,
            result.mesh_laws,
            housing,
            input_torque=case.operation.input_torque,
            fidelity=COARSE.dynamics,
        )(moment)
        free = in_plane if free is None else free
        tilted = replace(pair, misalignment=gear.Misalignment(float(in_plane), float(normal)))
        load = gear.load_distribution(tilted, nominal_force=force, fidelity=COARSE.gear)
        moment = np.array([force * np.cos(pair.base_helix_angle) * load.offset.mean()])
    assert 1e-5 < abs(in_plane) < 0.995 * abs(free)
    wanted = gear.mesh_law(tilted, nominal_force=gear.law_load(force), fidelity=COARSE.gear)
    off = np.abs(result.mesh_laws[0].force - wanted.force).max()
    assert off < 1e-3 * case.mesh_forces[0]
    plain = run().mesh_laws[0]
    assert np.abs(plain.deflection - wanted.deflection).max() > 1e-7


@pytest.mark.parametrize("shuttling", ["", "\nshuttling = true"])
def test_meshes_that_resist_the_tilt_rest_at_that_of_their_laws(run, housing, monkeypatch, shuttling):
    """Both options were refused together: points of one law for the whole face would have had the tilt twice."""
    given, simulate = [], dynamics.bearing_forces

    def watched(gearbox, laws, *others, **named):
        given.append((gearbox, laws))
        return simulate(gearbox, laws, *others, **named)

    monkeypatch.setattr(dynamics, "bearing_forces", watched)
    run(f"[options]\ntilt = true\nloaded_misalignment = true\nflexible_shafts = true{shuttling}")
    ((gearbox, laws),) = given
    tilt = gearbox.meshes[0].static_tilt
    (found,) = dynamics.static_misalignment(
        gearbox, laws, housing, input_torque=60.0, fidelity=COARSE.dynamics
    )  # of the first angle; shuttling moves it on
    assert abs(tilt.in_plane) > 1e-5
    assert (tilt.moment == 0.0) == bool(shuttling)
    np.testing.assert_allclose(
        found, [tilt.in_plane, tilt.normal], atol=(0.08 if shuttling else 0.01) * abs(tilt.in_plane)
    )


def misaligned(case, housing):
    """Misalignment of the only stage under load."""
    flanks = compliances(case, COARSE, ResultCache(None))
    return loaded_case(case, housing, COARSE, flanks).stages[0].misalignment


def test_gears_under_load_are_kept_by_their_housing(run):
    """On rigid seats they tilt less; the second time nothing is computed."""
    result = run("[options]\nloaded_misalignment = true")
    held, fixed = (misaligned(result.case, housing).in_plane for housing in (result.housing, None))
    assert abs(held - fixed) > 0.01 * abs(held)
    case, none = result.case, []
    assert loaded_case(case, None, COARSE, none) is loaded_case(case, None, COARSE, none)


def test_what_is_assembled_is_added_to(run):
    """The stage's own misalignment, of manufacture, counts too; the teeth push it back a little."""
    own = '[[stages]]\nname = "stage"\nmisalignment = { in_plane_mrad = 0.3 }\n'
    once, twice = run(own + "[options]\nloaded_misalignment = true"), run("[options]\nloaded_misalignment = true")
    tilts = [misaligned(result.case, result.housing).in_plane for result in (once, twice)]
    assert 0.95 * 3e-4 < tilts[0] - tilts[1] < 0.99 * 3e-4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("friction = 1.5", r"options: friction = 1.5 is outside 0…1: give the coefficient"),
        ("friction = -0.1", "friction = -0.1 is outside"),
        ('friction = "dry"', "or give a number"),
        ("shuttling = 1", "must be of type bool"),
        ("shutling = true", "did you mean 'shuttling'"),
    ],
)
def test_nonsense_is_refused(load, text, message):
    with pytest.raises(InputError, match=message):
        load(f"[options]\n{text}")


def test_a_case_without_the_table_has_none_of_them(load):
    assert load().options == PLAIN
    assert load("[options]\nfriction = 0.06").options == replace(PLAIN, friction=0.06)


def test_the_contact_problem_in_the_loop_is_refused_before_any_work(run, record):
    knobs = replace(COARSE, dynamics=replace(COARSE.dynamics, mesh_level="contact"))
    for text in ("friction = 0.05", "shuttling = true", "tilt = true"):
        with pytest.raises(InputError, match="mesh level `contact`"):
            run(f"[options]\n{text}", fidelity=knobs, watcher=record)
    assert record.began == []


def test_load_distributions_may_be_given(run, load, housing, monkeypatch, tmp_path, record):
    """Of another program or run: taken as they are, also from the command line."""
    text = "[options]\nfriction = 0.05\nshuttling = true"
    own = run(text)
    (of,) = own.load_distributions

    def refuse(*_, **__):
        raise AssertionError("computed although given")

    monkeypatch.setattr(gear, "load_distribution", refuse)
    monkeypatch.setattr(gear, "pair_compliances", refuse)
    arguments = {"mesh_laws": own.mesh_laws, "operators": tmp_path, "watcher": record}
    again = run(text, load_distributions=[of], **arguments)
    assert np.array_equal(again.bearing_forces.force, own.bearing_forces.force)
    assert sorted(record.began) == ["bearing_forces", "force_spectrum"]
    assert again.supplied == ("housing", "load_distributions", "mesh_laws")
    other = run(text, load_distributions=[of.replace(sliding=0.0 * of.sliding, arm=0.0 * of.arm)], **arguments)
    assert np.abs(moving(other) - moving(own)).max() > 1e-3 * np.abs(moving(own)).max()
    files = {"law": own.mesh_laws[0], "distribution": of, "housing": housing}
    used = [part for name, it in files.items() for part in ("--use", str(hdf5.save(it, tmp_path / f"{name}.h5")))]
    load(text)
    assert main(["run", str(load.path), "--fidelity", "draft", "--out", str(tmp_path / "out"), *used]) == 0
    finer = run(text, load_distributions=[of], **arguments | {"fidelity": nvh.DRAFT}).bearing_forces
    assert np.array_equal(hdf5.load(tmp_path / "out" / "bearing_forces.h5", BearingForces).force, finer.force)


@pytest.mark.parametrize(
    ("text", "change", "message"),
    [
        ("gyroscopic = true", {}, "load distributions are given, but .* takes none: switch on options.friction"),
        ("shuttling = true", {"count": 2}, "2 load distributions are given for 1 stages"),
        ("shuttling = true", {"period": 1.1}, "repeats after 1.1 mesh periods of its gears"),
    ],
)
def test_load_distributions_of_another_gearbox_are_refused(run, record, text, change, message):
    of = run("[options]\nfriction = 0.05\nshuttling = true").load_distributions[0]
    given = [of.replace(period=change.get("period", 1.0) * of.period)] * change.get("count", 1)
    with pytest.raises(InputError, match=message):
        run(f"[options]\n{text}", load_distributions=given, watcher=record)
    assert record.began == []


def bearings(stiffness):
    rows = (
        f'[[bearings]]\nname = "{name}"\nradial_stiffness = {stiffness}\naxial_stiffness = {stiffness}\n'
        for name in ("A1", "A2", "B1", "B2")
    )
    return "".join(rows)


FLEXIBLE = "flexible_shafts = true\n"


@pytest.mark.parametrize(
    ("text", "flexible", "ratio"),
    [
        ("[operation]\ninput_torque = 600\n", "", (9.9, 10.0)),
        ("[operation]\ninput_torque = 600\n", FLEXIBLE, (9.8, 10.0)),
        ("[operation]\ninput_torque = 1e-6\n", "", (0.0, 1e-3)),
        ("[operation]\ninput_torque = 1e-6\n", FLEXIBLE, (0.0, 1e-3)),
        ("[operation]\ninput_speed_rpm = 20000\n", "", (1.0, 1.0)),
        (bearings(1e12), "", (0.02, 1.0)),
        # the slope of the bent shaft is against that of its bearings, which give way most beside the gear
        (bearings(1e12), FLEXIBLE, (1.0, 3.0)),
    ],
)
def test_tilt_under_load_at_extremes(load, housing, text, flexible, ratio):
    """It goes with the torque, but for teeth that stiffen; beside rigid shafts, stiff bearings leave less of it."""
    options = f"[options]\nloaded_misalignment = true\n{flexible}"

    def tilt(before):
        misalignment = misaligned(load(before + options), housing)
        return np.array([misalignment.in_plane, misalignment.normal])

    usual, found = tilt(""), tilt(text)
    of_usual = np.linalg.norm(found) / np.linalg.norm(usual)
    assert np.linalg.norm(usual) > 1e-5
    assert ratio[0] - 1e-3 <= of_usual <= ratio[1] + 1e-3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (bearings(1.63e5), r"gives way by .* of its meshes, of 1.35 mm at most"),
        ("[operation]\ninput_speed_rpm = 20000\n", "the mesh frequency = 6667 Hz"),
    ],
)
def test_laws_of_tilted_gears_at_extremes_are_refused_where_they_mean_nothing(run, text, message):
    with pytest.raises(InputError, match=message):
        run(f"{text}[options]\nloaded_misalignment = true")


def test_ten_times_the_load_with_laws_of_tilted_gears_is_bounded(run):
    text = "[options]\nloaded_misalignment = true\nflexible_shafts = true\nfriction = 0.05\nshuttling = true"
    force = run(f"[operation]\ninput_torque = 600\n{text}").bearing_forces.force
    mesh = run(text).case.mesh_forces[0]
    assert 10 * mesh / 4 < np.abs(force).max() < 40 * mesh


def test_coasting_is_asked_for_by_a_negative_torque_and_lies_on_the_back_flanks(run, housing):
    result = run("[operation]\ninput_torque = -60")
    record, case = result.bearing_forces, result.case
    static = dynamics.static_bearing_forces(case.gearbox_with_gears, result.mesh_laws, housing, input_torque=-60.0)
    assert np.abs(record.force.mean(axis=0) - static).max() < 0.02 * np.abs(static).max()
    assert record.mesh_deflection.max() < -case.pairs[0].backlash / 2
    assert np.isfinite(result.error_bands["bearing_forces"].level).all()
    driven = run().bearing_forces.force.mean(axis=0)
    # tangential forces change their sides, the gears are pushed apart as before
    assert np.sign(driven[:, 1]).tolist() == (-np.sign(static[:, 1])).tolist()
    with pytest.raises(InputError, match=r"friction and shuttling act on drive flanks .* input_torque = -60 N m"):
        run("[operation]\ninput_torque = -60\n[options]\nfriction = 0.05")


def test_idle_gears_lie_on_their_back_flanks_while_they_speed_up(run):
    """Without load the output brings what the inertias take."""
    with pytest.raises(InputError, match=r"at a constant speed: nothing moves the gears: .* and mesh_torque"):
        run("[operation]\ninput_torque = 0")
    with pytest.raises(InputError, match="mesh_torque = 20 N m with input_torque = 60 N m: it belongs to idle gears"):
        run("[operation]\nmesh_torque = 20")
    text = "[operation]\ninput_torque = 0\nmesh_torque = 20\nramp = { end_speed_rpm = 2400, duration = 0.2 }"
    result = run(text)
    deflection, backlash = result.bearing_forces.mesh_deflection, result.case.pairs[0].backlash
    assert -backlash - 20e-6 < deflection.min() < -0.9 * backlash
    assert deflection.max() < -0.5 * backlash
    assert np.isfinite(result.error_bands["bearing_forces"].level).all()
    assert 1.0 < np.abs(result.bearing_forces.force).max() < result.case.mesh_forces[0]


def test_rigid_seats_need_no_housing_for_bearing_forces(run, load, record):
    text = "[options]\nrigid_housing = true"
    result = run(text, housing=None, watcher=record)
    assert result.housing is None
    assert "housing" not in " ".join(record.began)
    case = result.case
    wanted = dynamics.bearing_forces(
        case.gearbox_with_gears, result.mesh_laws, None, input_speed=case.operation.input_speed, input_torque=60.0,
        f_max=case.band.high, fidelity=COARSE.dynamics, duration=1.0 / case.band.resolution,
    )  # fmt: skip
    assert np.array_equal(result.bearing_forces.force, wanted.force)
    assert np.abs(moving(result) - moving(run())).max() > 0.01 * np.abs(moving(result)).max()
    rigid, flexible = str(nvh.plan(load(text), fidelity=COARSE)), str(nvh.plan(load(), fidelity=COARSE))
    assert "rigid seats" in rigid
    assert "housing: its seats are rigid" in rigid
    assert "housing modes in the loop" in flexible


def test_meshes_about_the_static_tilt_take_laws_that_another_run_made(run, housing):
    """Steady states of a map share the laws of their run: the moment of the load was missing there."""
    text = "[options]\ntilt = true\nloaded_misalignment = true"
    own = run(text)
    again = nvh.run(own.case, fidelity=COARSE, mesh_laws=own.mesh_laws, housing=housing)
    np.testing.assert_allclose(again.bearing_forces.force, own.bearing_forces.force, rtol=1e-9, atol=1e-9)
