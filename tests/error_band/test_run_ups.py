"""The error band of a run-up: as that of the steady run at each of its speeds."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import (
    convolution_lines,
    decay_time,
    modal_transfer_vectors,
    noise_transfer_functions,
    radiate,
    run_up_pressure,
)
from nvhchain.case import Ramp
from nvhchain.error_band import (
    ErrorBand,
    Origin,
    RunUpBand,
    error_band,
    limit_causes,
    limit_parts,
    run_up_band,
    run_up_force_band,
    save_error_bands,
)
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import ForceAccuracy, ForceSpectrum
from nvhchain.handoff.declared import Label
from nvhchain.housing import respond
from nvhchain.levels import decibel
from nvhchain.testing import ball_with_modes
from nvhchain.testing.ball_with_modes import BEARINGS, load
from nvhchain.testing.hand_offs import mesh_law


@pytest.fixture(scope="module")
def silent(housing):
    return ball_with_modes.silent(housing)


@pytest.fixture(scope="module")
def rising():
    return ball_with_modes.rising()


def test_a_run_up_is_as_uncertain_as_the_steady_run_at_each_of_its_speeds(case, housing, parts, rising):
    laws, vectors = [mesh_law([1e-6, 1e-7])], parts[2]
    case = replace(case, band=replace(case.band, low=300.0, high=1700.0))
    lines = convolution_lines(rising.sample_rate, 1700.0, decay_time(housing, 1700.0))
    modal = modal_transfer_vectors(vectors, housing, lines[lines > 250], fidelity=DRAFT.acoustics)
    history = run_up_pressure(noise_transfer_functions(modal, housing), rising)
    made = run_up_band(Origin(case, DRAFT, housing=housing, mesh_laws=laws), history, rising, vectors, housing)
    assert made.speed_levels.shape == (20, 2)
    # apart from the first instants, in which the sound arrives
    for part in (4, 10, 17):
        line = np.array([20 * made.input_speed[part] / (2 * np.pi)])
        forces = ForceSpectrum(line, load(3.0), BEARINGS, input_speed=made.input_speed[part])
        velocity = respond(housing, forces)
        steady = error_band(
            Origin(case, DRAFT, housing=housing, force_spectrum=forces, mesh_laws=laws),
            radiate(vectors, velocity, fidelity=DRAFT.acoustics).replace(input_speed=forces.input_speed),
            velocity,
            transfer_vectors=vectors,
        )
        assert made.speed_levels[part] == pytest.approx(steady.level, abs=1.0)
        assert made.limits[part, :, 1] - made.speed_levels[part] == pytest.approx(
            steady.overall[:, 1] - steady.level, abs=0.35
        )
    low, high = made.overall.T
    assert ((low < made.level) & (made.level < high)).all()
    other = housing.replace(natural_frequency=housing.natural_frequency * 1.002)
    modal = modal_transfer_vectors(vectors, other, lines[lines > 250], fidelity=DRAFT.acoustics)
    moved = run_up_pressure(noise_transfer_functions(modal, other), rising)
    exact = run_up_band(Origin(case, DRAFT), moved, rising, vectors, other)
    inside = (made.limits[2:, :, 0] < exact.speed_levels[2:]) & (exact.speed_levels[2:] < made.limits[2:, :, 1])
    assert inside.all()
    assert "housing" not in exact.bands[0].sources


def test_forces_that_a_mode_changes_are_heard_in_a_run_up(case, silent, parts, rising):
    laws = [mesh_law([1e-6, 1e-7])]
    case = replace(case, band=replace(case.band, low=300.0, high=1700.0))
    lines = convolution_lines(rising.sample_rate, 1700.0, decay_time(silent, 1700.0))
    modal = modal_transfer_vectors(parts[2], silent, lines[lines > 250], fidelity=DRAFT.acoustics)
    history = run_up_pressure(noise_transfer_functions(modal, silent), rising)
    sound = run_up_band(Origin(case, DRAFT, housing=silent, mesh_laws=laws), history, rising, parts[2], silent)
    force = run_up_force_band(Origin(case, DRAFT, housing=silent, mesh_laws=laws), rising)
    for made in (sound, force):
        assert all(band.sources["housing"][:, 0].max() > 1e-3 * band.amplitude.max() for band in made.bands)


def test_the_file_of_a_band_holds_every_place_at_every_line_or_speed(case, rising, tmp_path):
    made = ErrorBand(np.array([1000.0, 2000.0]), np.array([[1.0], [0.1]]), {"one": np.array([[0.25], [0.06]])})
    over_speed = run_up_force_band(Origin(case, DRAFT, mesh_laws=[mesh_law([1e-6, 1e-7])]), rising)
    save_error_bands({"pressure": made, "bearing_forces": over_speed}, tmp_path)
    told = json.loads((tmp_path / "error_bands.json").read_text())
    of_lines, of_speeds = told["pressure"], told["bearing_forces"]
    first, second = of_lines["lines"]
    assert first["frequency_hz"] == 1000.0
    assert first["level"] == pytest.approx(decibel([1.0]))
    assert first["limits"][0] == pytest.approx([*decibel([0.5, 1.5])])
    assert second["limits"][0] == [None, pytest.approx(float(decibel(0.22)))]
    assert of_lines["overall_limits"][0] == pytest.approx(list(made.overall[0]))
    assert of_speeds["overall_level"] == pytest.approx(over_speed.level)
    at = of_speeds["over_speed"][7]
    assert at["speed_rpm"] == pytest.approx(30 / np.pi * over_speed.input_speed[7])
    assert at["level"] == pytest.approx(over_speed.speed_levels[7])
    assert at["limits"][0][1] == pytest.approx(over_speed.limits[7, 0, 1])


def test_a_short_run_up_is_judged_in_as_few_parts_as_leave_lines_in_its_band(case, rising):
    """20 ms, 1000 … 2000 Hz: windows of 4 ms; half of one tells nothing."""
    case, laws = replace(case, band=replace(case.band, low=1000.0, high=2000.0)), [mesh_law([1e-6, 1e-7])]

    def record(samples):
        cut = {name: getattr(rising, name)[:samples] for name in ("time", "force", "input_speed")}
        return rising.replace(**cut)

    made = run_up_force_band(Origin(case, DRAFT, mesh_laws=laws), record(240))
    assert made.speed_levels.shape == (5, 4)
    assert np.isfinite(made.limits[:, :, 1]).all()
    assert made.level[0] < made.overall[0, 1]
    with pytest.raises(
        InputError, match=r"record of 0.002 s is too short to resolve 1000…2000 Hz.*lengthen it to 0.004 s"
    ):
        run_up_force_band(Origin(case, DRAFT, mesh_laws=laws), record(24))
    ramp = replace(case.operation, ramp=Ramp(220.0, 2e-3))
    with pytest.raises(InputError, match=r"lengthen it to 0.004 s or widen the band"):
        replace(case, operation=ramp, quantities=("bearing_forces",))


def test_forces_of_a_run_up_have_their_level_and_band_at_every_speed(case, housing, rising):
    made = run_up_force_band(Origin(case, DRAFT, housing=housing, mesh_laws=[mesh_law([1e-6, 1e-7])]), rising)
    assert made.speed_levels[:, 0] == pytest.approx(
        20 * np.log10(3 * 3**0.5 / 2**0.5 / 1e-6) + 10 * np.log10(1.5), abs=0.1
    )
    relative = [band.sources["gear"].max() / band.amplitude.max() for band in made.bands]
    assert max(relative) < 0.05
    exact = run_up_force_band(Origin(case, DRAFT), rising)
    assert exact.overall[0] == pytest.approx([exact.level[0]] * 2)


def test_parts_with_contact_loss_err_by_it_and_those_where_it_begins_or_ends_may_have_the_level_of_their_neighbours(
    case, housing, rising
):
    """A run-down was 23 dB off, with limits of 3 dB, in the one part where flanks met again."""
    laws = [mesh_law([1e-6, 1e-7])]
    whole = run_up_force_band(Origin(case, DRAFT, housing=housing, mesh_laws=laws), rising)
    begin, end = 0.5 * (whole.input_speed[6] + whole.input_speed[7]), 2.0 * rising.input_speed.max()

    def lost(highest):
        stated = ForceAccuracy(
            parted=(Label("A–B"),),
            parted_time=np.array([0.1]),
            parted_error=0.05,
            parted_lowest_speed=np.array([begin]),
            parted_highest_speed=np.array([highest]),
        )
        return run_up_force_band(Origin(case, DRAFT, housing=housing, mesh_laws=laws, force_accuracy=stated), rising)

    made = lost(end)
    errors = np.array([band.sources["contact loss"].max() / band.amplitude.max() for band in made.bands])
    assert errors == pytest.approx(np.where(made.input_speed > begin, 0.05, 0.0))
    low, high = np.moveaxis(made.limits, 2, 0)
    for part in (6, 7):
        for of, extreme in ((low, np.min), (high, np.max)):
            around = [band.overall[:, int(of is high)] for band in made.bands[part - 1 : part + 2]]
            assert of[part] == pytest.approx(extreme(around, axis=0))
    for part in (0, 4, 9, 19):
        assert made.limits[part] == pytest.approx(made.bands[part].overall)
    assert lost(rising.input_speed.max()).limits[19] == pytest.approx(made.limits[19])
    assert made.opened == (6, 7)


def test_the_causes_of_limits_are_those_of_their_own_place_and_a_jump_is_contact_loss():
    frequency, size = np.array([500.0, 1000.0]), np.ones((2, 2))
    sources = {"housing": np.array([[0.1, 0.01]] * 2) * size, "time step": np.array([[0.01, 0.2]] * 2) * size}
    steady = ErrorBand(frequency, size, sources, weighted=False)
    assert limit_causes(steady, 0).startswith(": 98 % from housing")
    assert "time step (most at 500 Hz); a finer --fidelity or knobs of fidelity.dynamics" in limit_causes(steady, 1)
    levels = np.array([[60.0, 60.0], [60.0, 80.0]])
    limits = np.stack([levels - 3.0, levels + 3.0], axis=2)
    record = RunUpBand(np.array([100.0, 200.0]), levels, limits, (steady, steady))
    assert limit_causes(record, 1).startswith(", widest at 1910 rpm: 100 % from time step")
    assert limit_parts(replace(record, opened=(1,)), 1) == [("contact loss", 1.0, 500.0)]


def test_contact_loss_at_one_speed_is_found_by_its_mean():
    """A mean of equal speeds differs by rounding, and the source was lost."""
    speed = 750.0 * np.pi / 30.0
    stated = ForceAccuracy(
        parted=(Label("A–B"),),
        parted_time=np.array([0.1]),
        parted_lowest_speed=np.array([speed]),
        parted_highest_speed=np.array([speed]),
    )
    assert all(stated.parts_at(speed * (1.0 + error)) for error in (-1e-14, 0.0, 1e-14))
    assert not stated.parts_at(1.001 * speed)


def test_the_widest_part_is_the_one_that_moves_the_whole_most():
    level, width = np.array([[60.0], [80.0], [70.0]]), np.array([[10.0], [1.0], [3.0]])
    limits = np.stack([level - width, level + width], axis=2)
    assert RunUpBand(np.ones(3), level, limits, ()).widest == 1
    limits[2] = [-np.inf, 90.0]
    assert RunUpBand(np.ones(3), level, limits, ()).widest == 2


def test_mean_lines_of_a_run_up_have_its_level_and_the_errors_of_their_parts():
    """Errors of 10 and 30 % at one line count by the energy of their parts; a silent part adds nothing."""
    frequency = np.array([500.0, 1000.0])
    sizes = [np.array([[1.0], [0.0]]), np.array([[2.0], [1.0]]), np.zeros((2, 1))]
    errors = (0.1, 0.3, 0.5)
    bands = tuple(ErrorBand(frequency, size, {"gear": of * size}) for size, of in zip(sizes, errors, strict=True))
    loud = np.array([band.level for band in bands[:2]]) + np.array([[3.0], [-1.0]])
    speed_levels = np.concatenate([loud, [[-2000.0]]])
    made = RunUpBand(np.array([1.0, 2.0, 3.0]), speed_levels, np.stack([speed_levels] * 2, axis=-1), bands)
    assert made.lines.level == pytest.approx(made.level, abs=1e-9)
    first, second = 10**0.3 * 1.0, 10**-0.1 * 4.0
    relative = made.lines.sources["gear"] / made.lines.amplitude
    assert relative[:, 0] == pytest.approx([(0.1 * first + 0.3 * second) / (first + second), 0.3])


def offsets(lines, sources, turns, order, place):
    """Offsets of an order in a run-up of four parts with the same lines; the second microphone is twice as loud."""
    size = np.ones((len(lines), 1)) * np.array([1.0, 2.0])
    bands = tuple(ErrorBand(lines, size, {"masters": sources * size}, weighted=False) for _ in range(4))
    level = np.array([band.level for band in bands])
    made = RunUpBand(np.ones(4), level, np.stack([level, level], axis=2), bands)
    speed = 2 * np.pi * np.array(turns, dtype=float)
    return made.order_offsets(order, np.arange(len(turns)) / 100.0, speed, place=place, width=0.1)


def test_an_order_without_lines_of_its_own_has_the_limits_of_the_band_at_its_own_microphone():
    """Errors of 10 % at the first and of 30 % at the second."""
    for place, relative in ((0, 0.1), (1, 0.3)):
        found = offsets(np.array([100.0, 110.0]), np.array([[0.1, 0.3]]), np.full(12, 5.0), 200.0, place)
        assert found[:, 1] == pytest.approx(np.full(4, 20 * np.log10(1 + 2 * relative)), abs=1e-9)


def test_samples_of_a_run_up_belong_to_the_parts_of_its_band():
    """Ten samples make parts of 3, 3, 2 and 2, each of one speed: the order sweeps no lines of larger error."""
    lines, turns = np.arange(10.0, 300.0), np.array([1.0] * 3 + [5.0] * 3 + [8.0] * 2 + [9.0] * 2)
    own = np.abs(lines[:, None] - 20 * np.unique(turns)).min(axis=1) <= 3.0
    found = offsets(lines, np.where(own, 0.1, 0.5)[:, None], turns, 20.0, 0)[:, 1]
    assert found == pytest.approx(np.full(4, 20 * np.log10(1.2)), abs=1e-9)
