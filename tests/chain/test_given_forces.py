"""Bearing forces from elsewhere that can hardly be those of the case are told."""

import warnings
from dataclasses import replace
from math import pi

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Ramp
from nvhchain.chain.supplied_forces import warn_of_forces, warn_of_spectrum
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import BearingForces
from nvhchain.spectrum import force_spectrum

TURNS = 3
"""Of the input: 60 meshes."""


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.fixture
def forces(case):
    """What gears and bearings of the case carry by hand: shares by the lever along the shaft, and a mesh tone.

    Radial shares of bearings at z₁, z₂ under a force at z: (z₂ − z)/(z₂ − z₁); tangential T/r, radial T/r tan α_t,
    axial T/r tan β, half of it on either bearing.
    """
    pair, torque = case.pairs[0], case.operation.input_torque
    gear = case.gears[0]
    pitch = [pair.base_radius[i] / np.cos(pair.working_pressure_angle) for i in (0, 1)]
    tangential = torque / pitch[0]
    axes = {shaft.name: np.array(shaft.axis) for shaft in case.shafts}
    e = np.append(axes["B"] - axes["A"], 0.0) / np.linalg.norm(axes["B"] - axes["A"])
    along = case.rotations["A"] * np.cross([0, 0, 1], e)
    tilt = np.arctan(np.tan(pair.base_helix_angle) / np.cos(pair.working_pressure_angle))
    on_wheel = tangential * (
        along + np.tan(pair.working_pressure_angle) * e - case.rotations["A"] * np.tan(tilt) * np.array([0, 0, 1])
    )
    mean = np.zeros((4, 3))
    for shaft, force, arm in (("B", on_wheel, -pitch[1] * e), ("A", -on_wheel, pitch[0] * e)):
        ends = [i for i, bearing in enumerate(case.bearings) if bearing.shaft == shaft]
        z1, z2 = (case.bearings[i].z for i in ends)
        # the axial force at the pitch radius turns the shaft, which a couple of the bearings takes
        couple = arm * force[2] / (z2 - z1)
        mean[ends[0]] = force * (z2 - gear.z) / (z2 - z1) + couple
        mean[ends[1]] = force * (gear.z - z1) / (z2 - z1) - couple
        mean[ends, 2] = force[2] / 2
    speed = case.operation.input_speed
    count = 1200
    time = np.arange(count) * TURNS * 2 * pi / speed / count
    tone = 0.3 * np.cos(20 * speed * time)[:, None, None]
    return BearingForces(
        time, mean * (1.0 + tone), tuple(b.name for b in case.bearings), np.array(list(case.seats.values())), speed,
        periodic=True,
    )  # fmt: skip


def quiet(case, forces):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_forces(case, forces)


def test_forces_that_balance_the_gears_pass_with_the_bearings_in_any_order(case, forces):
    quiet(case, forces)
    turned = [2, 0, 3, 1]
    quiet(
        case,
        forces.replace(
            force=forces.force[:, turned],
            names=tuple(forces.names[i] for i in turned),
            positions=forces.positions[turned],
        ),
    )


def test_a_speed_or_torque_a_little_off_passes(case, forces):
    quiet(case, forces.replace(input_speed=1.02 * forces.input_speed, periodic=False))
    quiet(case, forces.replace(force=1.1 * forces.force))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: {"force": -f.force}, r"means point against .*correct acts_on"),
        (lambda f: {"force": 1e3 * f.force}, r"largest mean is .* N, but .*correct force_unit"),
        (lambda f: {"force": 1e-3 * f.force}, r"largest mean is .* N, but .*correct force_unit"),
        (lambda f: {"positions": f.positions + np.eye(3)[0]}, r"acts 1000 mm from its seat .*positions in m"),
        (lambda f: {"positions": 1e3 * f.positions}, r"mm from its seat .*positions in m"),
        (lambda f: {"input_speed": 2.0 * f.input_speed}, r"runs at 3600…3600 rpm .* asks for 1800 rpm \(limit 90 rpm"),
        (
            lambda f: {k: getattr(f, k)[:-30] for k in ("time", "force", "input_speed")},
            r"called periodic, but the record covers 58\.5 mesh periods of stage stage .*periodic = false",
        ),
    ],
    ids=["sign", "unit", "unit the other way", "frame", "millimetres", "speed", "part of a period"],
)
def test_forces_that_can_hardly_be_those_of_the_case_are_told(case, forces, change, message):
    with pytest.warns(AccuracyWarning, match=message):
        warn_of_forces(case, forces.replace(**change(forces)))


def test_one_channel_of_the_wrong_sign_is_told_with_its_shaft(case, forces):
    force = forces.force.copy()
    largest = np.abs(force.mean(axis=0)).argmax()
    force.reshape(len(force), -1)[:, largest] *= -1.0
    shaft = case.bearings[largest // 3].shaft
    with pytest.warns(AccuracyWarning, match=rf"bearings of shaft {shaft} carry .* but its gears .*signs, axes"):
        warn_of_forces(case, forces.replace(force=force))


def test_a_record_without_means_is_told(case, forces):
    with pytest.warns(AccuracyWarning, match="no mean forces"):
        warn_of_forces(case, forces.replace(force=forces.force - forces.force.mean(axis=0)))


def test_a_run_up_is_held_against_both_its_speeds(case, forces):
    rising = replace(case, quantities=("bearing_forces",), operation=replace(case.operation, ramp=Ramp(200.0, 1.0)))
    of = forces.replace(periodic=False, input_speed=np.linspace(case.operation.input_speed, 200.0, len(forces.time)))
    quiet(rising, of)
    with pytest.warns(AccuracyWarning, match=r"asks for 1800…1909\.9 rpm"):
        warn_of_forces(rising, of.replace(input_speed=1.2 * of.input_speed))


def test_run_takes_them_and_tells(case, forces):
    with pytest.warns(AccuracyWarning, match="correct acts_on"):
        result = nvh.run(
            replace(case, quantities=("bearing_forces",)),
            fidelity=nvh.DRAFT,
            bearing_forces=forces.replace(force=-forces.force),
        )
    assert np.array_equal(result.bearing_forces.force, -forces.force)


def test_a_spectrum_is_held_against_the_speed_and_by_its_line_at_0_hz_against_the_means(case, forces):
    whole = force_spectrum(forces, low=0.0, high=2000.0)
    without = force_spectrum(forces, low=100.0, high=2000.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for spectrum in (whole, without, without.replace(force=-without.force), without.replace(input_speed=0.0)):
            warn_of_spectrum(case, spectrum)
    with pytest.warns(AccuracyWarning, match=r"runs at 3600…3600 rpm .* asks for 1800 rpm"):
        warn_of_spectrum(case, without.replace(input_speed=2.0 * without.input_speed))
    with pytest.warns(AccuracyWarning, match="correct acts_on"):
        warn_of_spectrum(case, whole.replace(force=-whole.force))
    with pytest.raises(InputError, match=r"input_speed = nan must be finite"):
        without.replace(input_speed=np.nan)


def test_run_tells_of_a_spectrum_too(case, forces):
    with pytest.warns(AccuracyWarning, match="correct force_unit"):
        nvh.run(
            replace(case, quantities=("bearing_forces",)),
            fidelity=nvh.DRAFT,
            force_spectrum=force_spectrum(forces.replace(force=1e3 * forces.force), low=0.0, high=2000.0),
        )


def test_moments_that_no_seat_takes_are_told(case, forces):
    moment = 0.01 * forces.force[:, :, :2]
    moved = forces.replace(moment=moment)
    with pytest.warns(AccuracyWarning, match="moments are excluded: seats take forces only"):
        warn_of_forces(case, moved)
    with pytest.warns(AccuracyWarning, match="moments are excluded"):
        warn_of_spectrum(case, force_spectrum(moved, low=0.0, high=2000.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_forces(case, forces.replace(moment=0.0 * moment))
