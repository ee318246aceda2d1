"""Effects, indices and best designs from the rows of a study, without a run."""

from types import SimpleNamespace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.plots.designs import effect_bars
from nvhchain.study import (
    Parameter,
    Row,
    Study,
    best_designs,
    idle_parameters,
    indices_from,
    list_designs,
    main_effects,
    run_study,
    running,
    sensitivity,
    spreading,
    tables,
    worst_rows,
    write_study,
)
from nvhchain.study.page import effects
from nvhchain.study.page.results import Results
from nvhchain.testing.coarse_runs import SMALL


def test_plans_have_their_numbers_of_designs_and_repeat():
    ranges = tuple(Parameter(name, (f"a.{name}",), low=1.0, high=3.0) for name in "xyz")

    def designs(plan, count):
        return list_designs(Study("case.toml", ranges, plan=plan, designs=count, seed=3))

    for plan, count in (("latin_hypercube", 10), ("sobol", 16)):
        made = designs(plan, count)
        assert len(made) == count
        assert made == designs(plan, count)
        assert all(1.0 < value < 3.0 for design in made for value in design.values())
    # one value in each tenth of the range
    tenths = sorted(int((design["x"] - 1.0) / 0.2) for design in designs("latin_hypercube", 10))
    assert tenths == list(range(10))
    assert len(designs("sensitivity", 8)) == 8 * 5


def test_a_normal_distribution_has_its_mean_and_deviation():
    parameter = Parameter("x", ("a.x",), mean=2.0, deviation=0.5)
    made = [design["x"] for design in list_designs(Study("case.toml", (parameter,), plan="sobol", designs=1024))]
    assert np.mean(made) == pytest.approx(2.0, abs=0.01)
    assert np.std(made) == pytest.approx(0.5, rel=0.02)


def test_sobol_indices_of_the_ishigami_function_lie_within_their_limits():
    """Exact values with a = 7, b = 0.1: first 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437."""
    angles = tuple(Parameter(f"x{i}", (f"a.x{i}",), low=-np.pi, high=np.pi) for i in range(3))
    study = Study("case.toml", angles, plan="sensitivity", designs=1024)
    x = np.array([[design[f"x{i}"] for i in range(3)] for design in list_designs(study)])
    response = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = indices_from(["x0", "x1", "x2"], "y", response, 1024)
    for index, first, total in zip(found, (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437), strict=True):
        assert index.first_limits[0] < first < index.first_limits[1]
        assert index.total_limits[0] < total < index.total_limits[1]
        assert index.total == pytest.approx(total, abs=0.05)


@pytest.mark.filterwarnings("error")
def test_a_parameter_without_effect_has_indices_of_zero_with_limits_and_no_warning():
    names = tuple(Parameter(name, (f"a.{name}",), low=0.0, high=1.0) for name in ("x", "idle"))
    study = Study("case.toml", names, plan="sensitivity", designs=8)
    response = np.array([design["x"] for design in list_designs(study)])
    idle = indices_from(["x", "idle"], "y", response, 8)[1]
    assert (idle.first, idle.total) == (0.0, 0.0)
    assert (idle.first_limits, idle.total_limits) == ((0.0, 0.0), (0.0, 0.0))


def test_indices_leave_out_a_response_that_some_designs_lack(tmp_path):
    """A linear response: each share is that of the squared coefficient."""
    angles = tuple(Parameter(f"x{i}", (f"a.x{i}",), low=0.0, high=1.0) for i in range(2))
    study = Study("case.toml", angles, plan="sensitivity", designs=256)
    rows = [
        Row(number, design, responses={"level": design["x0"] + 2.0 * design["x1"], "order 3": design["x0"]})
        for number, design in enumerate(list_designs(study))
    ]
    del rows[5].responses["order 3"]
    found = sensitivity(study, rows)
    assert {index.response for index in found} == {"level"}
    assert [index.first for index in found] == [pytest.approx(0.2, abs=0.02), pytest.approx(0.8, abs=0.02)]
    assert f"order 3: no Sobol indices, 1 of {len(rows)} designs lack it" in write_study(study, rows, tmp_path)


def row(design, **responses):
    return Row(design, {"x": design}, responses=responses)


def test_best_designs_are_those_that_no_other_betters_in_both():
    rows = [row(0, level=70.0, mass=3.0), row(1, level=72.0, mass=2.0), row(2, level=71.0, mass=3.5)]
    rows += [row(3, level=75.0, mass=2.0), row(4, level=76.0, mass=1.0)]
    assert [found.design for found in best_designs(rows, "level", "mass")] == [0, 1, 4]
    with pytest.raises(InputError, match="no response 'loudness': choose among level, mass"):
        best_designs(rows, "level", "loudness")


def test_a_design_counts_by_its_worst_operating_point_and_not_at_all_where_one_is_refused():
    points = [(0, 1000.0, 70.0), (0, 2000.0, 80.0), (1, 1000.0, 75.0), (1, 2000.0, 74.0)]
    rows = [Row(n, {"x": n}, speed, responses={"level": level}) for n, speed, level in points]
    rows += [row(2, level=60.0), Row(2, {"x": 2}, 2000.0, refused="no")]
    assert [(one.design, one.speed_rpm, one.responses["level"]) for one in worst_rows(rows)] == [
        (0, 2000.0, 80.0),
        (1, 1000.0, 75.0),
    ]


def test_a_parameter_without_effect_is_named():
    study = Study("case.toml", (Parameter("x", ("a.x",), (0, 1)), Parameter("y", ("a.y",), (0, 1))))
    rows = [Row(n, {"x": n % 2, "y": n // 2}, responses={"level": 60.0 + n % 2}) for n in range(4)]
    assert idle_parameters(study, rows) == ["y"]


def test_a_parameter_that_acts_by_interaction_alone_is_not_named(tmp_path):
    """The level is lower where both values differ: both means are the same; a speed moves nothing and has no name."""
    study = Study("case.toml", tuple(Parameter(name, (f"a.{name}",), (0, 1)) for name in "xyz"), speeds_rpm=(1.0, 2.0))
    rows = [
        Row(n, design, speed, responses={"level": 60.0 + (design["x"] == design["y"])})
        for n, design in enumerate(list_designs(study))
        for speed in study.speeds_rpm
    ]
    assert {one.change for one in main_effects(study, rows)} == {0.0}
    assert idle_parameters(study, rows) == ["z"]
    assert "No response depends on z" in write_study(study, rows, tmp_path)


@pytest.mark.parametrize("plan", ["monte_carlo", "grid"])
def test_one_of_twenty_parameters_without_effect_exceeds_its_share_by_chance(plan):
    """Gearboxes at two speeds differ by chance: 24 drawn with a width each, or twelve with both widths."""
    random, exceeded, trials = np.random.default_rng(5), {"width": 0, "speed_rpm": 0}, 400
    width = Parameter("width", ("a.w",), (1, 2))
    seeds = {"values": tuple(range(12))} if plan == "grid" else {"draw": True}
    parameters = (width, Parameter("seed", ("a.seed",), **seeds))
    study = Study("case.toml", parameters, plan, 0 if plan == "grid" else 24, speeds_rpm=(1.0, 2.0))
    for _ in range(trials):
        own = random.normal(size=12 if plan == "grid" else 24)
        rows = [
            Row(n, design, speed, responses={"level": 60.0 + 3.0 * own[n % len(own)] + one})
            for n, design in enumerate(list_designs(study))
            for speed, one in zip(study.speeds_rpm, random.normal(size=2), strict=True)
        ]
        for effect in main_effects(study, rows):
            if effect.parameter in exceeded:
                exceeded[effect.parameter] += not effect.unclear
    assert all(0.02 * trials < count < 0.08 * trials for count in exceeded.values())


@pytest.mark.parametrize("refused", [(), (0, 3), range(12)])
def test_speed_leaves_the_mass_alone_also_where_runs_are_refused(refused):
    random = np.random.default_rng(2)
    study = Study(
        "case.toml", (Parameter("seed", ("a.seed",), draw=True),), "monte_carlo", 12, speeds_rpm=(1500.0, 1800.0)
    )
    rows = [
        Row(n, {"seed": n}, speed, refused="has not settled")
        if speed > 1500 and n in refused
        else Row(n, {"seed": n}, speed, responses={"level": 60.0 + own + 0.01 * speed, "mass_kg": own})
        for n, own in enumerate(random.uniform(1.0, 2.0, 12))
        for speed in study.speeds_rpm
    ]
    found = {effect.response: effect for effect in main_effects(study, rows)}
    if len(refused) == 12:
        assert not found
        return
    assert found["mass_kg"].change == pytest.approx(0.0, abs=1e-12)
    assert found["level"].change == pytest.approx(3.0)
    assert all(effect.chance >= 0.0 for effect in found.values())


def test_effects_larger_than_chance_are_told_from_the_others(tmp_path, monkeypatch):
    """Both widths of six gearboxes: 1 dB beside differences of 0.1 dB, and a tooth that changes 0.01 dB."""
    names = (("width", (1, 2)), ("tooth", (1, 2)), ("seed", tuple(range(6))))
    study = Study("case.toml", tuple(Parameter(name, (f"a.{name}",), values) for name, values in names))
    random = np.random.default_rng(2)
    rows = [
        Row(n, one, responses={"level": 60.0 + one["width"] + 0.01 * one["tooth"] + 0.1 * random.normal()})
        for n, one in enumerate(list_designs(study))
    ]
    found = {one.parameter: one for one in main_effects(study, rows)}
    assert {name: one.unclear for name, one in found.items()} == {"width": False, "tooth": True, "seed": False}
    bars = []
    monkeypatch.setattr(tables, "effect_bars", lambda *of, **more: bars.append(effect_bars(*of, **more)) or bars[-1])
    lines = write_study(study, rows, tmp_path)
    assert [line.endswith("of its variance, no more than chance") for line in lines if "on average" in line] == [
        name == "tooth" for name in list(found)[:3]
    ]
    ((axes,),) = bars
    grey = [axes.patches[place].get_facecolor()[0] == 0.6 for place in range(3)]
    assert grey == [name == "tooth" for name in found]
    figure, *_ = effects.blocks(Results(study, tuple(rows)))
    assert figure.caption.endswith("Grey: no larger than chance.")
    assert "share_by_chance" in (tmp_path / "effects.csv").read_text()


def test_draws_have_no_effects_since_seeds_have_no_order():
    study = Study("case.toml", (Parameter("s", ("a.seed",), draw=True),), "monte_carlo", 8)
    rows = [Row(n, one, responses={"level": 60.0 + n}) for n, one in enumerate(list_designs(study))]
    assert main_effects(study, rows) == []


def test_a_parameter_of_one_variant_is_tried_in_that_variant():
    """The radius of a hole counts where there are holes; the first and the last design are solid."""
    radius = Parameter("radius", ("a.r",), low=1.0, high=2.0)
    study = Study("case.toml", (Parameter("body", ("a.b",), ("solid", "holes")), radius), "monte_carlo", 6)

    def rows_of(designs):
        return [
            Row(number, design, responses={"level": 60.0 + design["radius"] * (design["body"] == "holes")})
            for number, design in designs
        ]

    bodies = ("solid", "holes", "solid", "holes", "holes", "solid")
    rows = rows_of([(n, {"body": body, "radius": 1.0 + 0.1 * n}) for n, body in enumerate(bodies)])
    runs = SimpleNamespace(study=study, report=lambda line: None, rows=rows_of)
    assert running._add_idle(runs, rows)[0].idle == ()


@pytest.mark.slow
@pytest.mark.parametrize("plan", ["monte_carlo", "latin_hypercube", "sobol", "sensitivity"])
def test_a_parameter_without_effect_is_named_in_plans_of_draws(plan, tmp_path, monkeypatch):
    """The level follows the damping of the housing, that of a bearing at one speed alone, and not that of a shaft."""

    def measured(case, *rest):
        level = 60.0 - 100 * case.housing.modal_damping
        if case.operation.input_speed > 200:
            level += 1e-4 * case.bearings[0].radial_damping
        return {"responses": {"level": level}, "limits": {}, "band": None, "refused": None, "seconds": 0.0}

    for name in ("measure", "measure_drawn"):
        monkeypatch.setattr(spreading, name, measured)
    study = Study(
        SMALL,
        (
            Parameter("housing", ("housing.modal_damping",), low=0.01, high=0.03),
            Parameter("bearing", ("bearings.A1.radial_damping",), low=600, high=2400),
            Parameter("shaft", ("shafts.A.modal_damping",), low=0.01, high=0.03),
        ),
        plan=plan,
        designs=8,
        speeds_rpm=(1500.0, 3000.0),
    )
    rows = run_study(study, out=tmp_path, fidelity=nvh.DRAFT)
    assert len(rows) == 2 * 8 * (5 if plan == "sensitivity" else 1)
    assert idle_parameters(study, rows) == ["shaft"]
    assert "No response depends on shaft" in write_study(study, rows, tmp_path)


def test_parameters_that_vary_alike_or_share_a_level_are_tried_one_by_one():
    """Forty designs at ten speeds. By chance the level goes with y in a share of 0.2; the first and last share z."""
    studied = tuple(Parameter(name, (f"a.{name}",), low=0.0, high=1.0) for name in "xy")
    study = Study("case.toml", (*studied, Parameter("z", ("a.z",), (1, 2))), plan="monte_carlo", designs=40)

    def rows_of(designs):
        return [
            Row(number, design, speed, responses={"level": 60.0 + 5.0 * design["x"]})
            for number, design in designs
            for speed in range(10)
        ]

    shares = np.random.default_rng(0).random((40, 2))
    shares[:, 1] = 0.5 * shares[:, 0] + 0.5 * shares[:, 1]
    designs = [{"x": float(x), "y": float(y), "z": 1 + (0 < n < 39)} for n, (x, y) in enumerate(shares)]
    rows = rows_of(list(enumerate(designs)))
    assert 20 / 400 < next(one.share for one in main_effects(study, rows) if one.parameter == "y") < 20 / 40
    reported = []
    runs = SimpleNamespace(study=study, report=reported.append, rows=rows_of)
    assert set(running._add_idle(runs, rows)[0].idle) == {"y", "z"}
    assert len(reported) == 2


def test_a_response_that_is_the_same_in_all_designs_has_no_effects():
    """A mass of 0.1 + 0.2 or 0.3 kg is one mass: rounding has no share of a variance."""
    study = Study("case.toml", (Parameter("x", ("a.x",), tuple(range(7))), Parameter("y", ("a.y",), (0, 1, 2))))
    masses = (0.1 + 0.2, 0.3, 0.1 + 0.2)
    rows = [
        Row(n, {"x": n % 7, "y": n % 3}, responses={"level": 60.0 + n % 7, "mass": masses[n % 3]}) for n in range(21)
    ]
    found = {(one.response, one.parameter): one for one in main_effects(study, rows)}
    assert found["level", "x"].share == pytest.approx(1.0)
    assert {found["mass", name].share for name in "xy"} == {0.0}
    assert {found["mass", name].change for name in "xy"} == {0.0}
