"""Options that decide themselves: the estimates of a linear gearbox, and what they leave out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.case import AUTO, DECIDABLE, PLAIN, Options, Ramp
from nvhchain.errors import InputError
from nvhchain.scene import Scene, decided, linear_level, modelled, modelled_alike, option_lines
from nvhchain.scene.linear_level import LinearGearbox, level_change, spectral_distance
from nvhchain.scene.modelling import MESH_OPTIONS, UNKNOWN, Modelling, OptionEstimate, _chosen

OPEN = Options()


@pytest.fixture(scope="module")
def small(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.fixture(scope="module")
def stiff(small):
    """Shafts a thousand times as stiff: nothing bends."""
    stout = [replace(s, segments=tuple(replace(c, young=2.1e14) for c in s.segments)) for s in small.shafts]
    return replace(small, name="stiff", shafts=tuple(stout))


def test_soft_shafts_are_modelled_and_what_they_bring_to_light(small):
    found = {each.option: each for each in modelled(replace(small, options=OPEN), nvh.DRAFT).options}
    assert found["flexible_shafts"].modelled
    assert found["flexible_shafts"].level_db < -15
    # on rigid shafts, whose resonance hides all else, friction is nothing
    plain = {each.option: each for each in modelled(small, nvh.DRAFT).options}
    assert plain["friction"].distance_db < 0.5 < 2.0 < found["friction"].distance_db
    assert found["friction"].modelled
    assert not plain["friction"].modelled
    assert not found["gyroscopic"].modelled


@pytest.mark.parametrize("fidelity", [nvh.DRAFT, nvh.STANDARD, nvh.REFERENCE])
def test_what_is_left_out_stays_below_the_tolerance(small, fidelity):
    decision = modelled(replace(small, options=OPEN), fidelity)
    assert abs(decision.excluded_db) <= decision.excluded_distance_db <= fidelity.option_tolerance_db
    assert not decision.case.options.undecided
    linear = LinearGearbox(small)
    full = linear.power(EVERYTHING)
    chosen = linear.power(decision.case.options)
    assert level_change(chosen, full) == pytest.approx(decision.excluded_db, abs=1e-3)


@pytest.mark.parametrize("speed", [900.0, 2600.0, 4500.0])
def test_no_option_beyond_the_tolerance_is_left_out(small, speed):
    """One of −1.7 dB on top of the others was excluded at a tolerance of 1.5 dB, since others hid it."""
    operation = replace(small.operation, input_speed=speed * np.pi / 30)
    decision = modelled(replace(small, options=OPEN, operation=operation), nvh.DRAFT)
    left = [each for each in decision.options if not each.modelled and not each.note]
    assert max(each.distance_db for each in left) <= nvh.DRAFT.option_tolerance_db
    assert decision.excluded_distance_db <= nvh.DRAFT.option_tolerance_db


def test_an_option_that_others_hid_comes_back():
    """Without both the level is 1.2 dB from the full model, but 1.7 dB from that with friction alone."""
    level = {(): 1.2, ("friction",): -0.5, ("shuttling",): 1.0, ("friction", "shuttling"): 0.0}

    class Estimates:
        open = ["friction", "shuttling"]  # noqa: RUF012 (never changed)

        def plain(self, **on):
            return replace(PLAIN, **on)

        def distance(self, before, after):
            on = (tuple(name for name in ("friction", "shuttling") if of.models(name)) for of in (before, after))
            first, second = (level[names] for names in on)
            return abs(first - second)

        def effect(self, name, before, after):
            return self.distance(before, after)

    chosen = {tolerance: _chosen(Estimates(), tolerance)[0] for tolerance in (1.5, 1.8)}
    assert chosen[1.5].models("friction")
    assert not chosen[1.5].models("shuttling")
    assert chosen[1.8] == PLAIN


def test_what_takes_next_to_no_time_is_modelled_where_it_acts_at_all(stiff):
    """Excluded, friction of 0.2 dB widened the limits of a steady state; in a run-up the time loop takes longer."""
    case = replace(stiff, options=OPEN)
    (friction, *_), far = (getattr(modelled(case, nvh.DRAFT), name) for name in ("options", "excluded_distance_db"))
    assert friction.modelled
    assert 0.0 < friction.distance_db < nvh.DRAFT.option_tolerance_db
    assert far < 0.05
    ramp = Ramp(1.05 * case.operation.input_speed, 1.0)
    rising = modelled(replace(case, operation=replace(case.operation, ramp=ramp)), nvh.DRAFT)
    assert not rising.options[0].modelled
    assert rising.excluded_distance_db > far


@pytest.mark.slow
def test_states_of_a_map_share_all_options_that_one_of_them_needs(small):
    """A map took the options of its own case: 70.5 for 58.1 dB(A) at a third of the torque."""
    case = replace(small, options=OPEN)
    speeds, torques = [60.0, 470.0], [6.0, 60.0]
    (of,) = modelled_alike([case], nvh.DRAFT, speeds, torques).values()
    for speed in speeds:
        for torque in torques:
            operation = replace(case.operation, input_speed=speed, input_torque=torque)
            assert set(_on(modelled(replace(case, operation=operation), nvh.DRAFT))) <= set(_on(of))
    stated = modelled_alike([replace(case, options=PLAIN)], nvh.DRAFT, speeds, torques)["single-stage"]
    assert stated.case.options == PLAIN


@pytest.mark.parametrize("torque", [60.0, -60.0])
def test_points_across_a_face_carry_the_force_of_their_mesh(small, torque):
    """Shares of the Gauss points sum to 1, also on back flanks; bent shafts load one end more than the other."""
    case = replace(small, operation=replace(small.operation, input_torque=torque))
    linear = LinearGearbox(case)
    gearbox, laws, _ = linear._model(Options(tilt=True, flexible_shafts=True))
    (loads,) = dynamics.face_loads(gearbox, laws, input_torque=torque, fidelity=nvh.STANDARD.dynamics)
    weights = np.polynomial.legendre.leggauss(len(loads))[1] / 2
    assert weights @ loads == pytest.approx(case.mesh_forces[0], rel=1e-9)
    assert np.ptp(loads) > 0.01 * abs(case.mesh_forces[0])


def test_points_about_the_static_tilt_are_loaded_evenly(small, monkeypatch):
    """With both, meshes that resist the tilt deflect as those of the tilted flanks: the tilt is not counted twice."""
    both = replace(PLAIN, tilt=True, loaded_misalignment=True)
    linear = LinearGearbox(small)
    gearbox, _, deflections = linear._model(both, linear._tilts(False, False))
    alone = linear._model(replace(PLAIN, loaded_misalignment=True), linear._tilts(False, False))[2]
    with monkeypatch.context() as patched:
        patched.setattr(LinearGearbox, "_tilted_deflections", lambda *_: pytest.fail("the tilt is in the laws already"))
        assert linear.power(both).sum() > 0.0
    assert gearbox.face_points == 2
    np.testing.assert_array_equal(deflections[0], alone[0])
    found = {each.option: each for each in modelled(replace(small, options=both), nvh.DRAFT).options}
    assert (found["tilt"].note, found["loaded_misalignment"].note) == ("", "")


def test_a_finer_fidelity_models_no_less(small):
    on = [set(_on(modelled(replace(small, options=OPEN), fidelity))) for fidelity in (nvh.DRAFT, nvh.REFERENCE)]
    assert on[0] <= on[1]


EVERYTHING = Options(0.05, True, True, True, True, True)
"""All options that a gearbox of solid gears can have."""


def _on(decision):
    return [each.option for each in decision.options if each.modelled]


def test_a_run_takes_the_decided_options(small):
    asked = replace(small, options=OPEN)
    scene = Scene(asked, nvh.DRAFT)
    assert scene.gearbox.options == modelled(asked, nvh.DRAFT).case.options
    assert scene.gearbox.gearbox.flexible_shafts
    assert decided(small, nvh.DRAFT) is small


def test_options_stated_by_hand_stay_and_are_named(small):
    asked = replace(small, options=replace(OPEN, flexible_shafts=False, friction=0.08))
    decision = modelled(asked, nvh.DRAFT)
    assert decision.case.options.friction == 0.08
    assert not decision.case.options.flexible_shafts
    assert [each.option for each in decision.disputed] == ["flexible_shafts"]
    assert "excluded by the case, would change the sound: −" in "\n".join(decision.lines)


@pytest.mark.slow
def test_compared_cases_are_modelled_alike(small, stiff):
    soft, stout = (replace(case, options=OPEN) for case in (small, stiff))
    loose = replace(nvh.DRAFT, option_tolerance_db=8.0)
    assert "flexible_shafts" not in _on(modelled(stout, loose))
    both = modelled_alike([stout, soft], loose)
    assert both["stiff"].case.options == both["single-stage"].case.options
    assert "flexible_shafts" in _on(both["stiff"])
    stated = modelled_alike([stout, soft, replace(small, name="rigid", options=PLAIN)], loose)
    assert not any(_on(decision) for decision in stated.values())
    assert stated["stiff"].options[0].asked == "rigid"


def test_compared_gearboxes_share_the_periods_of_equal_meshes(small, stiff, monkeypatch):
    linear_level._period.cache_clear()
    computed, period = [], gear.mesh_period
    monkeypatch.setattr(gear, "mesh_period", lambda pair, **given: computed.append(pair) or period(pair, **given))
    power = LinearGearbox(small).power(PLAIN)
    assert len(computed) == len(small.stages)
    LinearGearbox(stiff).power(PLAIN)
    np.testing.assert_array_equal(LinearGearbox(replace(small, name="again")).power(PLAIN), power)
    assert len(computed) == len(small.stages)


def test_tilts_under_load_add_to_the_misalignment_of_the_case(small, monkeypatch):
    linear_level._period.cache_clear()
    linear = LinearGearbox(small)
    (tilt,) = linear._tilts(False, False)
    tilted, period = [], gear.mesh_period
    monkeypatch.setattr(gear, "mesh_period", lambda pair, **given: tilted.append(pair) or period(pair, **given))
    linear.power(replace(PLAIN, loaded_misalignment=True))
    (own,) = (pair.misalignment for pair in small.pairs)
    assert np.abs(tilt).min() > 5e-6
    assert (tilted[-1].misalignment.in_plane - own.in_plane) == pytest.approx(tilt[0], abs=1e-6)
    assert (tilted[-1].misalignment.normal - own.normal) == pytest.approx(tilt[1], abs=1e-6)


def test_idle_gears_and_coasting_have_no_friction(small):
    coasting = replace(small, options=OPEN, operation=replace(small.operation, input_torque=-60.0))
    found = {each.option: each for each in modelled(coasting, nvh.DRAFT).options}
    assert "drive flanks" in found["friction"].note
    assert found["flexible_shafts"].modelled
    idle = replace(small, options=OPEN, operation=replace(small.operation, input_torque=0.0, mesh_torque=20.0))
    assert not _on(modelled(idle, nvh.DRAFT))


def test_shafts_without_segments_are_not_bent(small):
    bare = [replace(shaft, segments=()) for shaft in small.shafts]
    found = {o.option: o for o in modelled(replace(small, options=OPEN, shafts=tuple(bare)), nvh.DRAFT).options}
    assert "cannot be modelled" in found["flexible_shafts"].note


def test_other_words_than_auto_are_refused():
    with pytest.raises(InputError, match="tilt = 'maybe'"):
        Options(tilt="maybe")


def test_distance_of_spectra_sees_exchanged_orders():
    first, second = np.array([[1.0, 0.1]]), np.array([[0.1, 1.0]])
    assert level_change(first, second) == pytest.approx(0.0)
    assert spectral_distance(first, second) == pytest.approx(10.0)
    assert spectral_distance(first, 2.0 * first) == pytest.approx(level_change(first, 2.0 * first))


def test_linear_orders_are_those_of_the_time_loop(small):
    """With a law that is linear in the deflection and a swing of 1 %, friction and shuttling included."""
    knobs = replace(nvh.DRAFT.dynamics, time_step=5e-6, settle_level=1e-6)
    pair, force = small.pairs[0], small.mesh_forces[0]
    angle = np.arange(32) * pair.mesh_period / 32
    swing, reach = np.cos(2 * np.pi * np.arange(32) / 32 + 0.3), np.linspace(-60e-6, 60e-6, 9)
    k, rest = 3e8, force / 3e8
    moved = 1e-2 * rest * swing
    law = gear.tabulated(pair, angle, reach, k * (reach[None, :] - moved[:, None]))
    mesh = replace(
        small.gearbox.meshes[0],
        friction=dynamics.MeshFriction(0.05, pair.mesh_period, angle, 0.2 * swing, 2e-3 * swing),
        load_centre=dynamics.LoadCentre(pair.mesh_period, angle, 1e-3 * swing),
    )
    box = replace(small.gearbox_with_gears, meshes=(mesh,), flexible_shafts=True)
    speed = small.operation.input_speed
    common = {"input_torque": small.operation.input_torque, "fidelity": knobs}
    found = dynamics.order_forces(box, [law], None, [rest + moved], input_speeds=[speed], **common)
    record = dynamics.bearing_forces(box, [law], None, input_speed=speed, f_max=4000.0, duration=0.0, **common)
    lines = 2 * np.fft.rfft(record.force, axis=0) / len(record.force)
    first = lines[round(20 * record.time[1] * len(record.time) * speed / (2 * np.pi))].ravel()
    assert np.abs(first - found.force[0, 0]).max() < 0.02 * np.abs(first).max()


def test_what_is_left_out_has_an_error_at_every_order(small):
    decision = modelled(replace(small, options=Options()), nvh.DRAFT)
    linear = LinearGearbox(small)
    full = linear.power(EVERYTHING)
    chosen = linear.power(decision.case.options)
    orders = np.array([20.0, 40.0, 41.3])
    error = decision.excluded_error.errors(orders)
    first, second = (np.sqrt(power[0, np.searchsorted(linear.orders, orders[:2])]) for power in (chosen, full))
    mean = 10 ** (decision.excluded_distance_db / 20) - 1
    np.testing.assert_allclose(error[:2], np.maximum(np.abs(second / first - 1), mean), atol=2e-4)
    assert error[2] == pytest.approx(mean, abs=1e-4)


STATES = {name: st.sampled_from([AUTO, False, True]) for name in DECIDABLE} | {
    "friction": st.sampled_from([AUTO, 0.0, 0.08])
}


@pytest.mark.slow
@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.fixed_dictionaries(STATES), st.floats(10.0, 120.0), st.floats(60.0, 600.0))
def test_statements_hold_and_the_rest_stays_within_the_tolerance(small, states, torque, speed):
    operation = replace(small.operation, input_torque=torque, input_speed=speed)
    case = replace(small, options=Options(**states), operation=operation)
    decision = modelled(case, nvh.DRAFT)
    assert not decision.case.options.undecided
    for each in decision.options:
        stated = states[each.option]
        assert each.asked == (AUTO if stated == AUTO else "on" if stated else "off")
        if stated != AUTO:
            assert getattr(decision.case.options, each.option) == stated
    assert abs(decision.excluded_db) <= decision.excluded_distance_db <= nvh.DRAFT.option_tolerance_db


@pytest.mark.slow
def test_the_gearbox_of_the_thesis_decides_all_its_options(request):
    """Its gear bodies vibrate on shafts that bend; every option has an estimate."""
    names = ("friction", "shuttling", "flexible_shafts", "gear_body_modes")
    path = request.config.rootpath / "cases" / "gearbox" / "solid.toml"
    case = nvh.load_case(path, changes=[f"options.{name}=auto" for name in names])
    found = {each.option: each for each in modelled(case, nvh.DRAFT).options}
    assert [found[name].note for name in names] == [""] * 4
    assert found["flexible_shafts"].modelled


def test_the_contact_problem_in_every_step_leaves_options_of_meshes_out(small):
    """Friction of 0.2 dB was chosen, and the run refused what the program itself had decided."""
    case = replace(small, options=OPEN)
    fidelity = replace(nvh.DRAFT, dynamics=replace(nvh.DRAFT.dynamics, mesh_level="contact"))
    for decision in (modelled(case, fidelity), modelled_alike([case], fidelity, [150.0])["single-stage"]):
        assert set(_on(decision)).isdisjoint(MESH_OPTIONS)
        assert "flexible_shafts" in _on(decision)
    assert "cannot be modelled: friction, shuttling, tilt, gear_body_modes" in modelled(case, fidelity).sentences[0]
    assert "friction" in _on(modelled(case, nvh.DRAFT))


def test_the_seconds_of_an_option_are_those_of_its_steps(small):
    """Gears that the load tilts take the balance of their stage; rigid shafts without friction take nothing more."""
    seconds = {
        line.split()[0]: float(line.rsplit("; ", 1)[1].split()[0])
        for line in option_lines(small, nvh.DRAFT)
        if line.endswith(" s")
    }
    assert seconds["loaded_misalignment"] == pytest.approx(0.3, abs=0.05)
    assert seconds["gyroscopic"] == 0.0


def test_options_without_an_estimate_are_not_counted_as_no_decibels(small):
    """A gearbox that idles said that all that it leaves out makes 0.0 dB."""
    found = (
        OptionEstimate("friction", AUTO, modelled=False, note=f"{UNKNOWN}, since idle gears have no mean load"),
        OptionEstimate("tilt", AUTO, modelled=False, level_db=0.1),
    )
    (told,) = Modelling(small, 1.5, found, excluded_db=0.1).sentences
    assert "excluded: tilt, in all +0.1 dB" in told
    assert "excluded with no estimate, which no limits count: friction" in told
