"""Studies: designs, runs, tables, effects, and what is refused."""

import csv
import io
import json
import re
import sys
import threading
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas
import pytest

import nvhchain as nvh
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.study import (
    Parameter,
    Row,
    Study,
    check_parameters,
    costs,
    load_study,
    main_effects,
    records_of,
    rows_csv,
    run_study,
    running,
    spreading,
    write_study,
)
from nvhchain.testing.coarse_runs import SMALL

SPHERE = """
kind = "radiator"
name = "ball"
frequencies = [200]
pulsation = 1.0
[body]
type = "sphere"
radius_mm = 10
[[field_points]]
name = "1 m"
position = [1, 0, 0]
"""


@pytest.fixture
def sphere(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(SPHERE)
    return path


def written(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text('case = "ball.toml"\n' + text)
    return path


RADII = '[[parameters]]\nname = "radius"\npath = "body.radius_mm"\nvalues = [5, 10, 20]\n'
SPEEDS = '[[parameters]]\nname = "velocity"\npath = "pulsation"\nvalues = [1.0, 2.0]\n'


def test_levels_of_a_grid_follow_the_closed_form(sphere, tmp_path):
    """Level of a small pulsating sphere: 20 dB a decade of velocity, 40 of radius."""
    study = load_study(written(tmp_path, RADII + SPEEDS))
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    level = {(row.values["radius"], row.values["velocity"]): row.responses["level"] for row in rows}
    assert len(level) == 6
    for radius in (5, 10, 20):
        assert level[radius, 2.0] - level[radius, 1.0] == pytest.approx(20 * np.log10(2), abs=1e-6)
    assert level[20, 1.0] - level[5, 1.0] == pytest.approx(40 * np.log10(4), abs=0.1)
    low, high = rows[0].limits["level"]
    assert low < rows[0].responses["level"] < high
    effects = {effect.parameter: effect for effect in main_effects(study, rows) if effect.response == "level"}
    assert effects["radius"].change == pytest.approx(level[20, 1.0] - level[5, 1.0], abs=1e-6)
    assert (effects["radius"].lowest, effects["radius"].highest) == (5, 20)
    assert effects["radius"].share + effects["velocity"].share == pytest.approx(1.0, abs=1e-6)


def test_rows_outlast_an_interruption_and_equal_designs_are_run_once(sphere, tmp_path, monkeypatch):
    study = load_study(written(tmp_path, RADII.replace("[5, 10, 20]", "[5, 10, 10.0, 20]")))
    real, ran = spreading.measure, []

    def counted(case, *rest):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(case.body.radius)
        return real(case, *rest)

    monkeypatch.setattr(spreading, "measure", counted)
    with pytest.raises(KeyboardInterrupt):
        run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    ran[:] = ["the third alone is left"]
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    assert ran == ["the third alone is left", pytest.approx(0.02)]
    assert rows[1].responses == rows[2].responses
    monkeypatch.setattr(spreading, "measure", real)
    fresh = run_study(study, out=tmp_path / "other", fidelity=nvh.DRAFT)
    assert [row.responses for row in fresh] == [row.responses for row in rows]


def test_a_failed_design_is_a_row_with_its_reason_and_is_tried_again(sphere, tmp_path, monkeypatch):
    study = load_study(written(tmp_path, RADII.replace("5, 10, 20", "10, 999.9")))
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    assert rows[0].refused is None
    assert "field point 0" in rows[1].refused
    assert not rows[1].responses
    real, ran = spreading.measure, []
    monkeypatch.setattr(spreading, "measure", lambda case, *rest: ran.append(case.body.radius) or real(case, *rest))
    assert run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)[1].refused == rows[1].refused
    assert ran == [0.9999]
    lines = write_study(study, rows, tmp_path / "out")
    assert any(line.startswith("1 of 2 runs were refused, the first: ") for line in lines)
    table = list(csv.DictReader(io.StringIO((tmp_path / "out" / "study.csv").read_text())))
    assert table[1]["level"] == ""
    assert table[1]["refused"] == rows[1].refused


class Losing:
    """Executor whose second task loses its worker."""

    def __init__(self):
        self.tasks = 0

    def submit(self, function, *arguments):
        self.tasks += 1
        future = Future()
        if self.tasks == 2:
            future.set_exception(BrokenExecutor("killed"))
        else:
            future.set_result(function(*arguments))
        return future


def test_a_lost_worker_costs_one_run_and_changes_no_row(sphere, tmp_path):
    from concurrent.futures import Executor

    class Pool(Losing, Executor):
        pass

    study = load_study(written(tmp_path, RADII))
    pool = Pool()
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT, executor=pool)
    assert pool.tasks == 3
    alone = run_study(study, out=tmp_path / "other", fidelity=nvh.DRAFT)
    assert [row.responses for row in rows] == [row.responses for row in alone]


def test_the_nearest_path_that_is_named_can_be_set(tmp_path):
    """A field inside a list without names is no path: the list is."""
    for path, near in (
        ("shafts.A.young_GPa", r"nearest path: shafts\.A\.segments \(a list without names: give all of it\)$"),
        ("shafts.A.modal_dampin", "did you mean 'modal_damping'"),
        ("gears.pinion.face_width_mm", r"nearest path: gears\.pinion\.geometry\.face_width_mm$"),
    ):
        study = Study(SMALL, (Parameter("x", (path,), (0.01, 0.02)),))
        with pytest.raises(InputError, match=near):
            run_study(study, out=tmp_path, fidelity=nvh.DRAFT)


def test_a_study_states_what_the_base_case_leaves_out(tmp_path, monkeypatch):
    """Bending shafts excluded by the case: the remark of `run`, in progress, at the end and on the page."""

    def measured(case, *rest):
        responses = {"level": 60.0 - 100 * case.housing.modal_damping}
        return {"responses": responses, "limits": {}, "band": None, "refused": None, "seconds": 0.0}

    monkeypatch.setattr(spreading, "measure", measured)
    off = "\n".join(f"{name} = false" for name in ("flexible_shafts", "gyroscopic", "gear_body_modes"))
    (tmp_path / "plain.toml").write_text(f'base = "{SMALL.resolve()}"\nname = "plain"\n[options]\n{off}\n')
    study = Study(tmp_path / "plain.toml", (Parameter("damping", ("housing.modal_damping",), (0.01, 0.02)),))
    shown = []
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT, progress=shown.append)
    remark = "plain: flexible_shafts excluded by the case, would change the sound: "
    assert len([line for line in shown if line.startswith(remark)]) == 1
    assert len([line for line in write_study(study, rows, tmp_path / "out") if line.startswith(remark)]) == 1
    assert (tmp_path / "out" / "report.html").read_text().count(remark) == 1


def test_the_studies_of_the_page_fit_the_cases_that_they_name(tmp_path):
    """Every study of docs/howto/studies.md in an empty folder with the single stage."""
    page = Path("docs/howto/studies.md").read_text(encoding="utf-8")
    assert main(["new", "single-stage", str(tmp_path)]) == 0
    blocks = re.findall(r"```toml\n(.*?)```", page, re.S)
    for text in blocks:
        (tmp_path / re.match(r"# (\w+\.toml)", text)[1]).write_text(text)
    studies = [tmp_path / re.match(r"# (\w+\.toml)", text)[1] for text in blocks if "[[parameters]]" in text]
    assert len(studies) == 2
    for path in studies:
        check_parameters(load_study(path))


def test_a_study_without_a_file_has_a_table_for_pandas(sphere, tmp_path):
    """A failed run has no level; a limit that does not exist is a missing number."""
    study = Study(sphere, (Parameter("radius", ("body.radius_mm",), (5, 10, -1)),))
    rows = run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    table = pandas.DataFrame(records_of(study, rows))
    assert list(table.columns) == next(csv.reader(io.StringIO(rows_csv(study, rows))))
    assert table["radius"].tolist() == [5, 10, -1]
    assert table["level"].dtype == float
    assert table["level"][1] == rows[1].responses["level"]
    assert table["level"].isna().tolist() == [False, False, True]


def test_variants_change_several_places_together(sphere, tmp_path):
    text = (
        '[[parameters]]\nname = "kind"\n[parameters.variants.small]\n"body.radius_mm" = 5\npulsation = 4.0\n'
        "[parameters.variants.large]\n"
    )
    rows = run_study(load_study(written(tmp_path, text)), out=tmp_path / "out", fidelity=nvh.DRAFT)
    assert [row.values["kind"] for row in rows] == ["small", "large"]
    # a quarter of the area, four times the velocity
    assert rows[0].responses["level"] == pytest.approx(rows[1].responses["level"], abs=0.05)


def test_tables_are_ascii_with_empty_cells():
    rows = [
        Row(0, {"x": "ä"}, responses={"level": 60.0}, limits={"level": (None, 61.0)}),
        Row(1, {"x": "b"}, refused="too large, by 2"),
    ]
    text = rows_csv(Study("case.toml", (Parameter("x", ("a.x",), ("ä", "b")),)), rows)
    assert text.isascii()
    first, second = csv.DictReader(io.StringIO(text))
    assert (first["level lower"], first["level upper"], first["refused"]) == ("", "61", "")
    assert (second["level"], second["refused"]) == ("", "too large, by 2")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a study without parameters has one design"),
        (RADII.replace("radius_mm", "radios_mm"), "radius: does not fit ball.toml.*did you mean 'radius_mm'"),
        (RADII.replace("[5, 10, 20]", "[]"), "radius: values = .. is empty: give two values or more"),
        (RADII.replace("body.radius_mm", "radius_mm"), "unknown field.*; nearest path: body.radius_mm"),
        (RADII.replace("mm", "m_") + SPEEDS.replace("pulsation", "pulse"), "radius: does not(.|\n)*velocity: does not"),
        (RADII + "low = 1\nhigh = 2\n", "not values and low and high"),
        (RADII.replace("values = [5, 10, 20]", "low = 3\nhigh = 1"), "low = 3 must be below high = 1"),
        (RADII.replace("[5, 10, 20]", "[5, 5.0]"), "all values give the same case"),
        (RADII.replace("body.radius_mm", "name").replace("[5, 10, 20]", '["a", "b"]'), "all values give the same case"),
        (RADII + RADII, "radius"),
        ("seed = -1\n" + RADII, "seed = -1 must be a whole number, 0 or more"),
        ("seed = 1.5\n" + RADII, "seed = 1.5 must be a whole number"),
        ("most_designs = 2.5\n" + RADII, "most_designs = 2.5 must be a whole number"),
        ('plan = "monte_carlo"\ndesigns = 2.5\n' + RADII, "designs = 2.5 must be a whole number"),
        ('pareto = ["a\\u0000", "b"]\n' + RADII, "holds control characters"),
        ('plan = "list"\n' + RADII + SPEEDS, "as many values everywhere, not"),
        ('plan = "sobol"\ndesigns = 6\n' + RADII, "needs a power of two, such as 8"),
        ('plan = "latin_hypercube"\n' + RADII, "needs a positive number"),
        ("most_designs = 2\n" + RADII, "3 designs are more than most_designs = 2"),
        ("speed = 3\n" + RADII, "unknown field 'speed'"),
        (RADII.replace('"radius"', '"seconds"'), "seconds is a column of every table"),
        (RADII.replace("path =", "peth ="), "radius: unknown field 'peth'"),
        ("speeds_rpm = [1800, 1800]\n" + RADII, "repeats a value: give each one once"),
        ("speeds_rpm = [1800]\n" + RADII, "speeds_rpm: ball.toml is no gearbox and has neither speed nor torque"),
        ('plan = "gird"\n' + RADII, "plan: no 'gird': did you mean 'grid'"),
        ('plan = "monte-carlo"\ndesigns = 4\n' + RADII, "plan: no 'monte-carlo': did you mean 'monte_carlo'"),
        (RADII + RADII.replace('"radius"', '"size"'), "size and radius both set body.radius_mm"),
        ("torques = [5]\n" + RADII.replace("body.radius_mm", "operation.input_torque"), "radius and torques both set"),
        (RADII.replace("values = [5, 10, 20]", "low = nan\nhigh = 1"), "radius: low = nan must be a finite number"),
        (RADII.replace("[5, 10", '["wide", 10'), "'wide' must be"),
        ('pareto = ["level", "levle"]\n' + RADII, "pareto: no response 'levle': did you mean 'level'"),
        ("targets = { lodness = 3 }\n" + RADII, "targets: no response 'lodness': known: level"),
        (
            'plan = "optimise"\ndesigns = 10\n[optimise]\nresponse = "mass_kg"\n' + RADII,
            "optimise: no response 'mass_kg'",
        ),
    ],
)
def test_bad_studies_are_refused_before_any_run(sphere, tmp_path, text, said, capsys):
    path = written(tmp_path, text)
    assert main(["study", str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert __import__("re").search(said, error)
    assert "Traceback" not in error
    assert not (tmp_path / "out" / "rows").exists()


@pytest.mark.parametrize("asked", ["orders", "loudness"])
def test_responses_that_no_run_of_the_case_has_are_refused_before_any_run(asked, tmp_path):
    case = nvh.load_case(SMALL, changes=("quantities=['bearing_forces']",))
    nvh.save_case(case, tmp_path / "case.toml")
    study = Study(
        tmp_path / "case.toml", (Parameter("damping", ("housing.modal_damping",), (0.01, 0.02)),), responses=(asked,)
    )
    with pytest.raises(InputError, match=r"add quantities = \['pressure'\]"):
        run_study(study, out=tmp_path / "out", fidelity=nvh.DRAFT)
    assert not (tmp_path / "out").exists()


def test_a_target_may_be_a_response_of_one_operating_point_alone(tmp_path, monkeypatch):
    """A transmission error needs a driving torque. Responses that no run has end the study after one design."""
    ran = []

    def measured(case, *rest):
        ran.append(case.operation.input_torque)
        found = {"level": 60.0} | ({"transmission_error_um of stage": 2.0} if ran[-1] > 0 else {})
        return {"responses": found, "limits": {}, "band": None, "refused": None, "seconds": 0.0}

    monkeypatch.setattr(spreading, "measure", measured)
    damping = Parameter("damping", ("housing.modal_damping",), (0.01, 0.02))
    study = Study(
        SMALL,
        (damping,),
        torques=(-50.0, 100.0),
        targets={"transmission_error_um of stage": 3.0},
        responses=("orders",),
    )
    misspelt = replace(study, targets={"transmission_error_um of stag": 3.0, "loudness_sone": 9.0})
    with pytest.raises(
        InputError, match=r"did you mean 'transmission_error_um of stage'(.|\n)*responses = \['loudness'\] adds it"
    ):
        run_study(misspelt, out=tmp_path, fidelity=nvh.DRAFT)
    assert not ran
    wrong = replace(study, targets={"order stage x 10": 3.0})
    with pytest.raises(InputError, match="no response 'order stage x 10'"):
        run_study(wrong, out=tmp_path, fidelity=nvh.DRAFT)
    assert ran == [-50.0, 100.0]
    assert len(run_study(study, out=tmp_path, fidelity=nvh.DRAFT)) == 4
    assert ran == 2 * [-50.0, 100.0]
    with pytest.raises(InputError, match="no response"):
        run_study(wrong, out=tmp_path, fidelity=nvh.DRAFT)
    assert ran == 2 * [-50.0, 100.0]


def test_the_command_prints_best_designs_and_writes_tables(sphere, tmp_path, capsys):
    path = written(tmp_path, RADII)
    assert main(["study", str(path), "--plan"]) == 0
    planned = capsys.readouterr().out
    assert "3 designs at 1 operating point, 3 runs" in planned
    assert re.search(r"; disk 0\.\d+ MB with the rows, [\d.]+ GB are free", planned)
    assert main(["study", str(path), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("Lowest level: ")
    assert "3 of 3: level " in said.err
    assert said.err.index("transfer_vectors …") < said.err.index("1 of 3: ")
    assert said.err.count("transfer_vectors …") == 1
    assert {"study.csv", "effects.csv", "effects.png"} <= {file.name for file in (tmp_path / "out").iterdir()}
    records = [json.loads(file.read_text()) for file in (tmp_path / "out" / "rows").iterdir()]
    assert len(records) == 3


@pytest.mark.slow
def test_workers_give_the_rows_of_one_process(sphere, tmp_path):
    path = written(tmp_path, RADII)
    for name, more in (("one", []), ("two", ["--workers", "2"])):
        assert main(["study", str(path), "--out", str(tmp_path / name), *more]) == 0
    one, two = (
        [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(text.splitlines())]
        for text in ((tmp_path / name / "study.csv").read_text() for name in ("one", "two"))
    )
    assert one == two


def test_a_plan_counts_shared_operators_once(sphere, tmp_path):
    found = {cost.name: cost.times for cost in costs(load_study(written(tmp_path, RADII + SPEEDS)), nvh.DRAFT)}
    assert found == {"surface": 6, "transfer vectors": 3}
    path = tmp_path / "stage.toml"
    path.write_text(
        f'case = "{Path("cases/small/single_stage.toml").resolve()}"\nspeeds_rpm = [1500, 1800]\n[[parameters]]\n'
        'name = "holes"\n[parameters.variants.none]\n[parameters.variants.six]\n'
        '"gears.wheel.blank" = { type = "holes", count = 6, hole_radius_mm = 5, pitch_radius_mm = 26 }\n'
    )
    found = {cost.name: cost.times for cost in costs(load_study(path), nvh.DRAFT)}
    assert found == {
        "housing": 1,
        "mesh law stage": 2,
        "bearing forces": 4,
        "transfer vectors": 1,
        "velocity, pressure": 4,
    }


def test_the_plan_of_a_search_counts_what_its_parameters_leave_alone_once(tmp_path):
    path = tmp_path / "search.toml"
    path.write_text(
        f'case = "{Path("cases/small/single_stage.toml").resolve()}"\nplan = "optimise"\ndesigns = 12\n'
        'torques = [40, 60]\n[optimise]\nresponse = "level"\ndraws = 3\n[[parameters]]\nname = "allowance"\n'
        'path = "gears.pinion.geometry.thickness_allowance_um"\nlow = 30\nhigh = 60\n[[scatter]]\nname = "damping"\n'
        'path = "bearings.A1.radial_damping"\nlow = 900\nhigh = 1500\n'
    )
    found = {cost.name: cost.times for cost in costs(load_study(path), nvh.DRAFT)}
    assert (found["housing"], found["transfer vectors"], found["bearing forces"]) == (1, 1, 72)
    assert found["mesh law stage"] == 24


@pytest.mark.parametrize("plan", ["monte_carlo", "optimise"])
def test_a_plan_of_drawn_gearboxes_counts_one_housing(plan, tmp_path):
    """Drawn damping of the housing moves neither its modes nor its transfer vectors; seeds move the mesh law."""
    kind = "scatter" if plan == "optimise" else "parameters"
    path = tmp_path / "draws.toml"
    path.write_text(
        f'case = "{Path("cases/small/single_stage.toml").resolve()}"\nplan = "{plan}"\ndesigns = 12\n'
        + '[optimise]\nresponse = "level"\ndraws = 5\n[[parameters]]\nname = "allowance"\n'
        'path = "gears.pinion.geometry.thickness_allowance_um"\nlow = 30\nhigh = 60\n'
        * (plan == "optimise")
        + f'[[{kind}]]\nname = "damping"\npath = "housing.modal_damping"\nmean = 0.02\ndeviation = 0.002\n'
        f'[[{kind}]]\nname = "seed"\npath = "gears.pinion.deviations.seed"\ndraw = true\n'
    )
    found = {cost.name: cost.times for cost in costs(load_study(path), nvh.DRAFT)}
    assert (found["housing"], found["transfer vectors"]) == (1, 1)
    assert found["bearing forces"] == (60 if plan == "optimise" else 12)


def test_no_workers_are_refused(sphere, tmp_path, capsys):
    assert main(["study", str(written(tmp_path, RADII)), "--workers", "0"]) == 2
    assert "--workers = 0: give 1 or more" in capsys.readouterr().err


def test_variants_have_names_that_tables_and_figures_may_show():
    with pytest.raises(InputError, match=r"size: variants: name = .* holds '\\x1b'"):
        Parameter("size", variants=(("a\x1b[2J", {"body.radius": 0.01}),))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # raised where a generator closes
def test_ten_interruptions_at_random_moments_end_with_the_same_table(sphere, tmp_path):
    """An exception at a random call of any function, ten times, with the rows and operators that are there by then."""
    study = load_study(written(tmp_path, RADII))

    def run(folder, last):
        calls = 0

        def count(frame, event, argument):
            nonlocal calls
            called = event == "call" and frame.f_code.co_filename != threading.__file__  # locks cannot be interrupted
            calls += called
            if called and calls == last:
                sys.setprofile(None)
                raise KeyboardInterrupt

        sys.setprofile(count)
        try:
            rows = run_study(study, out=tmp_path / folder, fidelity=nvh.DRAFT)
        finally:
            sys.setprofile(None)
        return calls, "\n".join(line.rsplit(",", 2)[0] for line in rows_csv(study, rows).splitlines())

    run("first", None)  # imports and compiles
    whole, table = run("whole", None)
    interrupted = 0
    for last in np.random.default_rng(41).integers(1, whole // 3, size=10):
        try:
            assert run("out", last)[1] == table
        except KeyboardInterrupt:
            interrupted += 1
    assert interrupted >= 6  # Python ignores exceptions in some places, such as the end of a generator
    assert run("out", None)[1] == table


@pytest.mark.parametrize(
    ("name", "path", "title", "text"),
    [
        ("hole_radius_mm", "gears.wheel.blank.hole_radius_mm", "hole_radius / mm", "hole_radius = 2.5 mm"),
        ("relief", "gears.wheel.geometry.micro.drive.tip_relief.amount_um", "relief / µm", "relief = 2.5 µm"),
        ("slot", "gears.wheel.blank.angular_width_deg", "slot / °", "slot = 2.5°"),
        ("torque", "operation.input_torque", "torque / N m", "torque = 2.5 N m"),
        ("shift", "gears.wheel.geometry.profile_shift", "shift", "shift = 2.5"),
    ],
)
def test_parameters_have_the_unit_in_which_their_path_is_typed(name, path, title, text):
    parameter = Parameter(name, (path,), low=1.0, high=4.0)
    assert parameter.title == title
    assert parameter.text(2.5) == text


def test_lines_and_page_of_a_study_state_units(sphere, tmp_path):
    study = Study(str(sphere), (Parameter("radius_mm", ("body.radius_mm",), (8, 10.5)),), "grid")
    rows = run_study(study, fidelity=nvh.DRAFT, out=tmp_path / "out")
    lines = write_study(study, rows, tmp_path / "out")
    assert "design 0 (radius = 8 mm)" in lines[0]
    assert "(8 mm lowest, 10.5 mm highest)" in lines[2]
    page = (tmp_path / "out" / "report.html").read_text()
    assert "radius / mm" in page
    assert "level / dB(A)" in page
    assert '"error_x"' in page  # levels of both designs on the first screen
    assert (tmp_path / "out" / "effects.csv").read_text().splitlines()[1].startswith("level,radius_mm,mm,")


def test_a_study_states_what_its_case_assumes():
    """A housing drawn by rule, as a run says beside its level."""
    case = nvh.load_case(SMALL)
    assumed = replace(case, assumptions=("The housing is drawn by rule.",))
    study = Study("case.toml", (Parameter("x", ("operation.input_torque",), (50, 60)),))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "load_case", lambda *_, **__: assumed)
        found = running.remarks(study, nvh.DRAFT)
    assert found[0] == f"{case.name}: The housing is drawn by rule"
