"""Parts of the difference of two designs: lines, modes and paths add up."""

from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.levels import a_weighting, decibel, equivalent
from nvhchain.plots.marks import OrderMarks
from nvhchain.report.causes.differences import (
    line_differences,
    named_or_lasting,
    run_up_causes,
    split_difference,
)
from nvhchain.report.page.sections.causes import contributions
from nvhchain.report.page.sections.listening.sound import _orders
from nvhchain.report.run_up import curves_of, loudest, run_up_maps
from nvhchain.report.sentences import verdict
from nvhchain.spectrum import Waterfall

RNG = np.random.default_rng(1)


def sound(orders, size, speed):
    pressure = size * (RNG.standard_normal((len(orders), 1)) + 1j * RNG.standard_normal((len(orders), 1)))
    return FieldPressure(orders * speed / (2 * np.pi), [[0, 0, 1]], pressure, speed)


def overall(of):
    return 10 * np.log10(np.sum(10 ** ((decibel(of.pressure[:, 0]) + a_weighting(of.frequency)) / 10)))


@pytest.mark.parametrize("louder", [0.2, 1.0, 30.0])
def test_lines_add_up_to_the_difference_also_at_other_speeds(louder):
    first, second = sound(np.arange(1.0, 40.0), 0.1, 300.0), sound(np.arange(3.0, 60.0, 0.5), 0.1 * louder, 350.0)
    found = line_differences(first, second)
    assert found.part.sum() == pytest.approx(overall(second) - overall(first), abs=1e-9)
    assert found.order[0] == 1.0
    assert found.part[0] < 0  # the second has no such line
    assert np.isnan(found.frequency[0, 1])


def test_modes_add_up_to_their_line_whatever_their_phases():
    before, after = ({f"mode {i}": complex(*RNG.standard_normal(2)) for i in range(40)} for _ in range(2))
    after |= {"mode 40": 2.0 + 1j}
    pressure = np.array([sum(before.values()), sum(after.values())])
    parts = split_difference(pressure, [before, after], 3.0)
    assert sum(of["part_db"] for of in parts) == pytest.approx(3 * np.diff(np.abs(pressure) ** 2)[0], rel=1e-9)
    few = [{name: complex(*RNG.standard_normal(2)) for name in "abc"} for _ in range(2)]
    *_, others = split_difference(np.array([sum(of.values()) for of in few]), few, 3.0)
    assert others["part_db"] == pytest.approx(0.0, abs=1e-12)  # nothing is left where all parts are listed
    alone = split_difference(np.array([1.0 + 0j, 2.0]), [{"a": 1.0, "b": 0.5j}, {"a": 2.0, "b": 0.5j}], 1.0)
    assert [of["name"] for of in alone] == ["a", "b", "all others"]
    assert [of["part_db"] for of in alone] == pytest.approx([3.0, 0.0, 0.0])


def test_order_of_a_run_up_makes_its_difference_and_all_adds_up():
    rate, seconds = 4000.0, 8.0
    time = np.arange(int(rate * seconds)) / rate
    speed = 2 * np.pi * (10.0 + 15.0 * time / seconds)
    angle = np.cumsum(speed) / rate
    waves = [size * np.sin(20 * angle) + 0.1 * np.sin(33 * angle) for size in (1.0, 0.5)]
    histories = {
        name: PressureHistory(time, [[0, 0, 1]], wave[:, None], speed) for name, wave in zip("ab", waves, strict=True)
    }
    maps = list(run_up_maps(histories, OrderMarks(mesh={"a": 20.0}), high=1500.0).values())
    heard = [float(equivalent(wave, sample_rate=rate)) for wave in waves]
    found = run_up_causes((heard[0], heard[1]), (maps[0][1], maps[1][1]), [20.0, 33.0])
    assert sum(of["part_db"] for of in found) == pytest.approx(heard[1] - heard[0], abs=1e-9)
    assert found[0]["order"] == 20.0
    assert found[0]["part_db"] == pytest.approx(heard[1] - heard[0], rel=0.05)
    alone = [float(equivalent(size * np.sin(20 * angle), sample_rate=rate)) for size in (1.0, 0.5)]
    assert found[0]["levels_dBA"] == pytest.approx(alone, abs=0.2)


def test_record_of_less_than_ten_turns_is_mapped_in_windows_of_half_its_length():
    """That of an input at 900 rpm for 0.5 s, as rattle is recorded."""
    time = np.arange(2000) / 4000.0
    speed = np.full(2000, 2 * np.pi * 15.0)
    wave = np.sin(20 * speed[0] * time)
    history = PressureHistory(time, [[0, 0, 1]], wave[:, None], speed)
    (maps,) = run_up_maps({"a": history}, OrderMarks(mesh={"a": 20.0}), high=600).values()
    for of, line in zip(maps, (300.0, 20.0), strict=True):
        assert len(of.time) >= 2
        assert of.axis[np.abs(of.amplitude[0]).argmax()] == pytest.approx(line, rel=0.01)


def test_lines_of_designs_that_differ_in_their_last_digits_are_one_line():
    sound = np.array([[1.0], [2.0]]) * (1 + 0j)
    runs = [FieldPressure(np.array([1200.0, f]), [[0.0, 0, 1]], sound, 9.0) for f in (2400.0, 2400.0 * (1 + 1e-13))]
    assert contributions._loudest([(1.0, of) for of in runs]).tolist() == [1200.0, 2400.0]


def test_record_of_less_than_eight_turns_has_no_order_to_hear_alone():
    time = np.arange(2000) / 4000.0
    speed = np.full(2000, 2 * np.pi * 15.0)
    history = PressureHistory(time, [[0, 0, 1]], np.sin(20 * speed[0] * time)[:, None], speed)
    assert _orders(SimpleNamespace(runs=[SimpleNamespace(pressure_history=history)])) == []


def test_orders_up_to_the_band_are_followed_not_only_low_harmonics_of_the_mesh():
    """Order 100 of 20 teeth, the fifth harmonic, in a run-up whose band ends above it."""
    time = np.arange(40000) / 8000.0
    speed = 2 * np.pi * (20.0 + 2.0 * time)
    angle = np.cumsum(speed) / 8000.0
    wave = 0.1 * np.sin(20 * angle) + np.sin(100 * angle)
    history = PressureHistory(time, [[0, 0, 1]], wave[:, None], speed)
    marks = OrderMarks(mesh={"stage": 20.0})
    maps = run_up_maps({"one": history}, marks, high=3100.0)
    _, *cuts = curves_of(maps, marks)["one"]
    assert loudest(cuts)[0] == 100.0
    assert "stage × 5" in cuts[-1].name
    assert maps["one"][1].axis[-1] < 3100.0 / 20.0  # above the band there is nothing to follow


def test_the_player_of_a_run_up_names_orders_as_its_curves_do():
    """Also where the strongest line of the map lies beside the mesh order."""
    axis = np.arange(1000) * 0.1
    amplitude = np.full((4, 1000), 1e-6, complex)
    amplitude[:, [200, 399]] = 1.0
    of = Waterfall(np.arange(4.0), np.full(4, 200.0), axis, amplitude, True)
    marks = OrderMarks(mesh={"stage": 20.0})
    history = PressureHistory(np.arange(2) * 10.0, [[0, 0, 1]], np.zeros((2, 1)), np.full(2, 200.0))
    stored = SimpleNamespace(
        runs=[SimpleNamespace(pressure_history=history)],
        curves=curves_of({"one": (of, of)}, marks),
    )
    assert _orders(stored) == [(20.0, "order 20 (stage × 1)"), (40.0, "order 40 (stage × 2)")]


def burst_beside_an_order():
    """Maps and levels of two run-ups with order 20: the second lacks a tone of 0.3 s at 800 Hz, near 1050 rpm."""
    rate, seconds = 4000.0, 10.0
    time = np.arange(int(rate * seconds)) / rate
    speed = 2 * np.pi * (10.0 + 15.0 * time / seconds)
    order = np.sin(20 * np.cumsum(speed) / rate)
    burst = np.where(np.abs(time - 5.0) < 0.15, 8.0 * np.sin(2 * np.pi * 811.0 * time), 0.0)
    waves = [order + burst, 0.8 * order]
    marks = OrderMarks(mesh={"stage": 20.0})
    histories = {
        name: PressureHistory(time, [[0, 0, 1]], wave[:, None], speed) for name, wave in zip("ab", waves, strict=True)
    }
    maps = run_up_maps(histories, marks, high=1500.0)
    return maps, marks, tuple(float(equivalent(wave, sample_rate=rate)) for wave in waves)


def test_sound_between_orders_is_named_by_its_speed_and_not_by_orders():
    maps, marks, heard = burst_beside_an_order()
    in_order = maps["a"][1], maps["b"][1]
    curves = curves_of(maps, marks)["b"]
    assert len(curves) > 2  # the burst has peaks between the orders
    orders = named_or_lasting(curves, in_order, marks)
    assert orders == [20.0]
    found = run_up_causes(heard, in_order, orders)
    assert sum(of["part_db"] for of in found) == pytest.approx(heard[1] - heard[0], abs=1e-9)
    near = found[0]
    assert [of["order"] for of in found] == [None, 20.0, None]  # by size; the rest comes last
    low, high = near["speeds_rpm"]
    assert low < 60 * 17.5 < high
    assert high - low < 300.0
    assert near["part_db"] < 0.6 * (heard[1] - heard[0]) < 0


def test_an_order_that_no_gear_makes_is_kept_where_it_lasts():
    rate = 4000.0
    time = np.arange(int(rate * 10.0)) / rate
    speed = 2 * np.pi * (10.0 + 1.5 * time)
    angle = np.cumsum(speed) / rate
    wave = np.sin(20 * angle) + np.sin(33 * angle)
    marks = OrderMarks(mesh={"stage": 20.0})
    maps = run_up_maps({"a": PressureHistory(time, [[0, 0, 1]], wave[:, None], speed)}, marks, high=1500.0)
    orders = named_or_lasting(curves_of(maps, marks)["a"], (maps["a"][1],), marks)
    assert orders == pytest.approx([20.0, 33.0], abs=0.11)


def test_parts_of_a_run_up_add_up_to_its_difference_as_they_are_written():
    maps, marks, heard = burst_beside_an_order()
    causes = run_up_causes(heard, (maps["a"][1], maps["b"][1]), [20.0])
    rows = [{"speed_rpm": speed, "level_dBA": 60.0} for speed in (600.0, 1500.0)]
    first, second = ({"overall_dBA": level, "over_speed": rows, "mesh_orders": marks.mesh} for level in heard)
    lines = verdict({"field_point": {"name": "m"}, "configurations": {"a": first, "b": second | {"causes": causes}}})
    assert any("sound between the orders at" in line for line in lines)
    parts = [float(line.partition(" dB:")[0].replace("−", "-")) for line in lines if " dB: " in line]
    assert sum(parts) == pytest.approx(round(heard[1] - heard[0], 1), abs=1e-9)


def test_run_ups_of_different_ramps_have_the_same_orders_and_parts_that_add_up():
    """In the second the input turns 13.5 times, so that its windows are shorter than ten turns."""
    rate, marks, histories = 4000.0, OrderMarks(mesh={"stage": 20.0}), {}
    for name, start, end, seconds in (("slow", 10.0, 25.0, 10.0), ("fast", 15.0, 30.0, 0.6)):
        time = np.arange(int(rate * seconds)) / rate
        speed = 2 * np.pi * (start + (end - start) * time / seconds)
        angle = np.cumsum(speed) / rate
        wave = np.sin(20 * angle) + 0.7 * np.sin(40 * angle)
        histories[name] = PressureHistory(time, [[0, 0, 1]], wave[:, None], speed)
    maps = run_up_maps(histories, marks, high=1500.0)
    curves = curves_of(maps, marks)
    assert [of.order for of in curves["slow"]] == [of.order for of in curves["fast"]]
    orders = [of.order for of in curves["slow"][1:]]
    assert orders == pytest.approx([20.0, 40.0], abs=0.05)
    for cuts in curves.values():
        assert (cuts[2].level - cuts[1].level).mean() == pytest.approx(20 * np.log10(0.7), abs=0.3)
    heard = tuple(float(equivalent(of.pressure[:, 0], sample_rate=rate)) for of in histories.values())
    found = run_up_causes(heard, (maps["slow"][1], maps["fast"][1]), orders)
    assert sum(of["part_db"] for of in found) == pytest.approx(heard[1] - heard[0], abs=1e-9)
    assert not any("speeds_rpm" in of for of in found)
