"""Quality of a series: draws, percentiles, shares that fail, ranked tolerances, and their sound."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.case import Deviations, GearboxCase, load_case
from nvhchain.errors import InputError
from nvhchain.plots.designs import percentile_curves
from nvhchain.report.page.blocks import Text
from nvhchain.study import (
    Parameter,
    Row,
    Study,
    failed_shares,
    influences,
    list_designs,
    load_study,
    measure,
    measure_drawn,
    measuring,
    percentiles,
    run_study,
    spreading,
    tables,
    write_study,
)
from nvhchain.study.page import scatter
from nvhchain.study.page.results import Results
from nvhchain.study.quality import share_text
from nvhchain.testing.coarse_runs import SMALL, TINY


def factory(designs: int, **changes: object) -> Study:
    """Two even parameters and a seed, drawn independently."""
    parameters = (
        Parameter("a", ("pulsation",), low=0.0, high=1.0),
        Parameter("b", ("frequency",), low=0.0, high=1.0),
        Parameter("seed", ("gears.pinion.deviations.seed",), draw=True),
    )
    return Study(Path("x.toml"), parameters, "monte_carlo", designs, **changes)  # type: ignore[arg-type]


def rows_of(study: Study) -> list[Row]:
    """Rows whose level is 2 a + b."""
    designs = list_designs(study)
    return [Row(i, one, responses={"level": 2 * one["a"] + one["b"]}) for i, one in enumerate(designs)]


def test_a_draw_is_a_whole_number_of_its_own_for_every_design() -> None:
    """Seeds are independent and repeat with the seed of the study."""
    seeds = [one["seed"] for one in list_designs(factory(200))]
    assert all(isinstance(seed, int) and 0 <= seed < 2**31 for seed in seeds)
    assert len(set(seeds)) == 200
    assert seeds == [one["seed"] for one in list_designs(factory(200))]
    assert seeds != [one["seed"] for one in list_designs(factory(200, seed=2))]


def test_the_share_that_fails_has_its_exact_limits() -> None:
    """Five of a hundred: 1.6 to 11.3 % (Clopper and Pearson); none of a hundred: 0 to 3.6 %."""
    rows = [Row(i, {}, responses={"level": float(i)}) for i in range(100)]
    found = failed_shares(factory(4, targets={"level": 94.5}), rows)[0]
    assert found.share == pytest.approx(0.05)
    assert found.limits == pytest.approx((0.0164, 0.1128), abs=1e-4)
    assert failed_shares(factory(4, targets={"level": 1e3}), rows)[0].limits == pytest.approx((0.0, 0.0362), abs=1e-4)
    with pytest.raises(InputError, match="no response 'loudness': choose among level"):
        failed_shares(factory(4, targets={"loudness": 1.0}), rows)


def test_limits_of_percentiles_hold_the_true_value_nineteen_times_of_twenty() -> None:
    """A thousand samples of fifty from a known distribution, median and 95th percentile."""
    random = np.random.default_rng(3)
    held = np.zeros(3)
    for _ in range(400):
        rows = [Row(i, {}, responses={"level": value}) for i, value in enumerate(random.uniform(size=60))]
        held += [one.limits[0] <= one.percent / 100 <= one.limits[1] for one in percentiles(rows, "level")]
    assert (held >= 0.93 * 400).all()


def test_tolerances_are_ranked_by_their_share_of_the_variance() -> None:
    """Level = 2 a + b: four fifths and one fifth, each within its own limits; seeds have no order."""
    study = factory(400)
    first, second = influences(study, rows_of(study), "level")
    assert (first.parameter, second.parameter) == ("a", "b")
    for found, share in ((first, 0.8), (second, 0.2)):
        assert found.share_limits[0] < share < found.share_limits[1]
        assert found.correlation_limits[0] < found.correlation < found.correlation_limits[1]
    assert influences(study, rows_of(study)[:40], "level") == []


def test_parameters_with_values_are_ranked_among_distributions() -> None:
    """Level = a + b of Var 1/12 each, a class 0, 1, 2 of Var 2/3 and a ghost 0 or 1 of Var 1/4, which is no number."""
    ghosts = ([], [{"order": 33}])
    more = (Parameter("class", ("c",), values=(0, 1, 2)), Parameter("ghost", ("g",), values=ghosts))
    more += (Parameter("idle", ("i",), values=(4, 5, 6, 7)),)
    study = replace(factory(600), parameters=(*factory(600).parameters, *more))
    rows = [
        Row(i, one, responses={"level": one["a"] + one["b"] + one["class"] + (one["ghost"] != [])})
        for i, one in enumerate(list_designs(study))
    ]
    found = {one.parameter: one for one in influences(study, rows, "level")}
    assert list(found)[:2] == ["class", "ghost"]
    assert set(found) == {"a", "b", "class", "ghost", "idle"}
    variance = {"class": 2 / 3, "ghost": 1 / 4, "a": 1 / 12, "b": 1 / 12, "idle": 0.0}
    for name, own in variance.items():
        low, high = found[name].share_limits
        assert low < own / (13 / 12) < high
        assert high - low < 0.15
    assert found["class"].correlation > 0.6
    assert found["ghost"].correlation is None


def test_values_that_no_two_gearboxes_share_are_ranked_as_numbers_or_not_at_all() -> None:
    numbers = Parameter("width", ("w",), values=tuple(range(60)))
    variants = Parameter("kind", variants=tuple((f"kind {number}", {"k": number}) for number in range(60)))
    study = Study("x.toml", (numbers, variants), plan="latin_hypercube", designs=60)
    rows = [Row(n, {"width": n, "kind": f"kind {59 - n}"}, responses={"level": float(n)}) for n in range(60)]
    (found,) = influences(study, rows, "level")
    assert found.parameter == "width"
    assert found.share == pytest.approx(0.99, abs=0.02)
    assert found.correlation == pytest.approx(1.0)


def test_a_study_of_draws_ends_with_percentiles_and_failures(tmp_path: Path) -> None:
    """Lines and files of a hundred gearboxes."""
    study = factory(100, targets={"level": 2.5})
    lines = write_study(study, rows_of(study), tmp_path)
    assert any("95 % of 100 gearboxes have a level below" in line for line in lines)
    assert any("of 100 gearboxes exceed level = 2.5" in line for line in lines)
    assert any(line.startswith("a makes") for line in lines)
    for name in ("percentiles.csv", "ranking.csv", "percentiles.png"):
        assert (tmp_path / name).stat().st_size > 0
    text = (
        'case = "x.toml"\nplan = "monte_carlo"\ndesigns = 4\ntargets = { level = "loud" }\n'
        '[[parameters]]\nname = "s"\npath = "gears.a.deviations.seed"\ndraw = true\n'
    )
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="targets"):
        load_study(tmp_path / "study.toml")


def points_of(study: Study) -> list[Row]:
    """Forty gearboxes at two speeds and torques, of which two jam at the higher torque: louder with both."""
    return [
        Row(n, one, speed, torque, refused="the flanks jam")
        if n < 2 and torque == 60.0
        else Row(n, one, speed, torque, responses={"level": one["a"] + torque + speed / 1500.0})
        for n, one in enumerate(list_designs(study))
        for speed in study.speeds_rpm
        for torque in study.torques
    ]


def test_percentiles_name_their_torque_and_the_gearboxes_without_a_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sentences, page and picture are those of the loudest torque, and of 38 gearboxes out of 40."""
    study = factory(40, speeds_rpm=(1500.0, 3000.0), torques=(40.0, 60.0), targets={"level": 0.0})
    rows = points_of(study)
    counts = {(one.torque, one.designs, one.missing) for one in percentiles(rows, "level")}
    assert counts == {(40.0, 40, 0), (60.0, 38, 2)}
    (failed,) = failed_shares(study, rows)
    assert (failed.designs, failed.missing) == (38, 2)
    drawn = []
    monkeypatch.setattr(tables, "percentile_curves", lambda *of, **more: drawn.append(percentile_curves(*of, **more)))
    monkeypatch.setattr(tables, "save", lambda *_: None)
    lines = write_study(study, rows, tmp_path)
    assert lines[0].startswith("95 % of 38 gearboxes with a result (of 40) have a level at 3000 rpm and 60 N m below")
    assert any("of 38 gearboxes with all results (of 40) exceed level = 0" in line for line in lines)
    figure = scatter.distribution(Results(study, tuple(rows)))
    assert figure is not None
    assert figure.caption == "Percentiles over speed at 60 N m. Dashed: target."
    assert min(figure.data[0]["y"]) > 60.0
    ((axes,),) = drawn
    assert axes.get_title() == "at 60 N m"
    assert list(axes.lines[0].get_ydata()) == pytest.approx(figure.data[0]["y"], rel=1e-6)
    assert "38 of 40" in str(scatter.blocks(Results(study, tuple(rows))))


def test_limits_without_an_end_are_empty_cells(tmp_path: Path) -> None:
    """Three gearboxes: nothing encloses their 95th percentile from above, in percentiles.csv as in study.csv."""
    study = factory(3)
    rows = [Row(n, one, responses={"level": 60.0 + n}) for n, one in enumerate(list_designs(study))]
    write_study(study, rows, tmp_path)
    text = (tmp_path / "percentiles.csv").read_text()
    assert "inf" not in text
    assert ",," in text


def test_a_series_of_which_every_gearbox_fails_somewhere_has_no_share(tmp_path: Path) -> None:
    study = factory(40, speeds_rpm=(1500.0, 3000.0), targets={"level": 0.0})
    rows = [
        Row(n, one, speed, refused="jam" if speed > 2000.0 else None, responses={"level": 60.0} if speed < 2000 else {})
        for n, one in enumerate(list_designs(study))
        for speed in study.speeds_rpm
    ]
    assert "95 % of 40 gearboxes have a level at 1500 rpm below 60.0" in write_study(study, rows, tmp_path)[0]


def test_a_series_of_seeds_alone_asks_for_no_more_gearboxes() -> None:
    """Seeds are not ranked, however many there are; other tolerances are with 50 gearboxes."""

    def words(study: Study) -> list[str]:
        rows = tuple(Row(n, one, responses={"level": float(n)}) for n, one in enumerate(list_designs(study)))
        return [one.text for one in scatter.blocks(Results(study, rows)) if isinstance(one, Text)]

    seeds = "Not ranked, since seeds have no order: seed."
    assert words(replace(factory(60), parameters=factory(60).parameters[2:])) == [seeds]
    assert words(factory(60)) == [seeds]
    assert words(factory(40)) == ["A ranking of parameters needs 50 gearboxes or more that differ in level.", seeds]


def test_a_hypercube_of_ranges_leads_with_its_best_design(tmp_path: Path) -> None:
    """Ranges of a design are no scatter: its points are designs, of which one is the quietest."""
    study = replace(factory(8), plan="latin_hypercube")
    assert [one.drawn for one in (factory(8), study)] == ["gearboxes", "designs"]
    damping = Parameter("damping", ("housing.modal_damping",), low=0.01, high=0.03)
    assert replace(study, parameters=(damping,)).drawn == "gearboxes"
    lines = write_study(study, rows_of(study), tmp_path)
    assert lines[0].startswith("Lowest level: ")
    assert any(line.startswith("95 % of 8 designs have a level below") for line in lines)
    assert write_study(factory(8), rows_of(factory(8)), tmp_path)[0].startswith("95 % of 8 gearboxes")


def test_a_distribution_without_a_target_steps_up_at_each_gearbox() -> None:
    """A third of three gearboxes lies below any level between the first and the second."""
    study = factory(3)
    rows = tuple(Row(n, one, responses={"level": 60.0 + n}) for n, one in enumerate(list_designs(study)))
    figure = scatter.distribution(Results(study, rows))
    assert figure is not None
    assert figure.caption == "Distribution over 3 gearboxes."
    assert figure.data[0]["line"]["shape"] == "hv"


def test_limits_of_a_draw_hold_the_options_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference leaves its options open, and so counts those excluded; the forces take its decision."""
    mean = load_case(SMALL)
    assert isinstance(mean, GearboxCase)
    mean = replace(mean, options=replace(mean.options, shuttling="auto"))
    seen = []

    def run(case: GearboxCase, **means: object) -> None:
        seen.append(case.options.shuttling)
        raise InputError("no more is needed")

    monkeypatch.setattr(measuring.chain, "run", run)
    monkeypatch.setattr(
        measuring, "decided", lambda case, _: replace(case, options=replace(case.options, shuttling=False))
    )
    assert measure_drawn(mean, mean, TINY, tmp_path)["refused"].endswith("no more is needed")
    monkeypatch.setattr(measuring, "_reference_of", lambda *_: SimpleNamespace(housing=None))
    assert measure_drawn(mean, mean, TINY, tmp_path)["refused"].endswith("no more is needed")
    assert seen == ["auto", False]


@pytest.mark.slow
def test_sound_of_a_draw_is_that_of_a_whole_run(tmp_path: Path) -> None:
    """Noise transfer functions and the whole chain give the same level, whatever the damping of the draw."""
    case = load_case(SMALL)
    assert isinstance(case, GearboxCase)
    gears = tuple(replace(gear, deviations=Deviations(6, seed=5)) for gear in case.gears)
    drawn = replace(case, band=replace(case.band, high=2000.0), gears=gears)
    lively = replace(
        drawn,
        housing=replace(drawn.housing, modal_damping=0.011, structural_damping=True),
        bearings=tuple(replace(of, radial_damping=0.8 * of.radial_damping) for of in drawn.bearings),
    )
    mean = replace(
        lively,
        housing=replace(lively.housing, modal_damping=0.02),
        bearings=drawn.bearings,
        gears=case.gears,
    )
    short = measure_drawn(lively, mean, TINY, tmp_path, ("orders",))
    whole = measure(lively, TINY, tmp_path, ("orders",))
    assert short["refused"] is None
    assert "order stage x 2" in short["limits"]
    assert short["limits"].keys() == whole["limits"].keys()
    assert short["band"] is None  # the lines of the mean case are not its own
    assert short["responses"] == pytest.approx(whole["responses"], rel=1e-9)


@pytest.mark.parametrize(
    ("path", "scatter"),
    [
        ("gears.pinion.deviations.run_out_um", True),
        ("stages.stage.tolerances.centre_distance_um", True),
        ("bearings.A1.radial_damping", True),
        ("housing.modal_damping", True),
        ("housing.wall_mm", False),
        ("gears.pinion.geometry.micro.drive.tip_relief.amount_um", False),
    ],
)
def test_parameters_of_a_series_share_housing_and_transfer_vectors(path: str, scatter: bool) -> None:
    """Deviations, tolerances and damping of the plans of draws; a grid keeps limits of its own."""
    parameter = Parameter("x", (path,), low=0.01, high=0.02)
    study = Study(Path("x.toml"), (parameter,), "monte_carlo", 4)
    assert bool(study.scatter) is scatter
    assert not replace(study, parameters=(Parameter("x", (path,), (1, 2)),), plan="grid", designs=0).scatter


def test_another_case_file_gives_draws_new_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Limits of a draw come from the case file, whose damping the draws themselves replace."""
    path, ran = tmp_path / "case.toml", []
    found = {"responses": {"level": 60.0}, "limits": {}, "band": None, "refused": None, "seconds": 0.0}
    monkeypatch.setattr(spreading, "measure_drawn", lambda case, mean, *_: ran.append(mean) or found.copy())
    study = Study(path, (Parameter("x", ("housing.modal_damping",), low=0.02, high=0.03),), "monte_carlo", 2)
    for damping in (0.01, 0.01, 0.04):
        path.write_text(f'base = "{SMALL}"\n[housing]\nmodal_damping = {damping}\n', encoding="utf-8")
        run_study(study, out=tmp_path / "out", fidelity=TINY)
    assert [mean.housing.modal_damping for mean in ran] == [0.01, 0.01, 0.04, 0.04]


def test_a_worker_runs_all_speeds_of_a_gearbox(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They share its mesh law.  The first run alone makes the shared operators; rows are those without workers."""
    speeds: list[list[float]] = []

    def measured(case: GearboxCase, *_: object) -> dict[str, object]:
        level = case.operation.input_speed + 100.0 * case.housing.modal_damping  # type: ignore[union-attr]
        return {"responses": {"level": level}, "limits": {}, "band": None, "refused": None, "seconds": 0.0}

    class Recording(ThreadPoolExecutor):
        def submit(self, *given, **more):  # type: ignore[no-untyped-def]
            speeds.append([round(30 / np.pi * case.operation.input_speed) for _, case, *_ in given[-1]])
            return super().submit(*given, **more)

    monkeypatch.setattr(spreading, "measure_drawn", measured)
    damping = Parameter("x", ("housing.modal_damping",), low=0.02, high=0.03)
    study = Study(SMALL, (damping,), "monte_carlo", 3, speeds_rpm=(1500.0, 1800.0))
    with Recording(1) as executor:
        spread = run_study(study, out=tmp_path / "a", fidelity=TINY, executor=executor)
    assert speeds[:3] == [[1800], [1500, 1800], [1500, 1800]]
    alone = run_study(study, out=tmp_path / "b", fidelity=TINY)
    assert [(row.design, row.speed_rpm, row.responses) for row in spread] == [
        (row.design, row.speed_rpm, row.responses) for row in alone
    ]


def test_shares_are_stated_inside_their_range_with_the_estimate_beyond():
    assert share_text(0.63, (0.4, 0.81)) == "63 % (40…81)"
    assert share_text(1.134, (0.7, 1.5)) == "100 % (70…100; estimated 113, take more designs)"
    assert share_text(-0.04, (-0.2, 0.1)) == "0 % (0…10; estimated −4, take more designs)"


def test_a_parameter_that_does_not_vary_is_not_ranked(recwarn):
    """Its rank correlation is 0 / 0."""
    study = replace(factory(60), parameters=(*factory(60).parameters, Parameter("c", ("x",), (3.0,))))
    rows = [Row(n, {"a": n / 60, "b": n % 7, "seed": n, "c": 3.0}, responses={"level": 60.0 + n}) for n in range(60)]
    assert {one.parameter for one in influences(study, rows, "level")} == {"a", "b"}
    assert not recwarn.list
