"""Cases built in Python, and the files that `save_case` writes."""

import os
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Ramp, SpeedRecord, SurfaceFile
from nvhchain.errors import InputError
from nvhchain.gear import Flank, MicroGeometry, Relief, Slots
from nvhchain.housing import DampingCurve
from nvhchain.interop.rexs import read_rexs

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "cases").glob("*/*.toml"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_a_saved_case_reads_back_equal(example, tmp_path):
    for path in example.parent.glob("*.toml"):
        shutil.copyfile(path, tmp_path / path.name)
    case = nvh.load_case(tmp_path / example.name)
    saved = nvh.save_case(case, tmp_path / "saved.toml")
    assert nvh.load_case(saved) == case
    elsewhere = nvh.save_case(nvh.load_case(example), tmp_path / "saved elsewhere.toml")
    folder = Path(os.path.relpath(example.parent, tmp_path)).as_posix()
    # Lines break where paths are long: the content alone is compared.
    assert tomllib.loads(elsewhere.read_text().replace(f"{folder}/", "")) == tomllib.loads(saved.read_text())


def test_keys_have_short_digits_and_a_meaning(tmp_path):
    text = nvh.save_case(nvh.load_case(EXAMPLES[-2]), tmp_path / "a.toml").read_text()
    single = nvh.save_case(nvh.load_case(ROOT / "cases/small/single_stage.toml"), tmp_path / "b.toml").read_text()
    assert re.search(r"^radius_mm = 10  # Radius of the sphere of the same volume$", text, re.M)
    assert "face_width_mm = 16" in single
    assert "thickness_allowance_um = 40" in single
    assert "input_speed_rpm = 1800  # Mean speed" in single
    assert max(map(len, single.splitlines())) <= 120
    assert single.count("# Number of teeth") == 1
    assert "structural_damping" not in single  # at its default


@pytest.mark.filterwarnings("ignore:field point .* away from the gearbox")
@pytest.mark.parametrize("seed", range(3))
def test_any_number_reads_back_to_the_same_bits(seed, tmp_path):
    rng = np.random.default_rng(seed)
    case = nvh.load_case(ROOT / "cases/small/single_stage.toml")
    for _ in range(40):
        position = tuple(float(x) for x in rng.normal(size=3) * 10.0 ** rng.integers(-3, 3) + np.array([0, 0, 5000]))
        operation = replace(case.operation, input_speed=float(rng.uniform(1, 2000)))
        point = replace(case.field_points[0], position=position)
        changed = replace(case, operation=operation, field_points=(point,), folder=str(tmp_path))
        assert nvh.load_case(nvh.save_case(changed, tmp_path / "x.toml")) == changed


def test_every_kind_of_part_reads_back_equal(tmp_path):
    case = nvh.load_case(ROOT / "cases/gearbox/run_up_slotted.toml")
    relief = Relief(1e-5, 2e-3, "linear")
    micro = MicroGeometry(drive=Flank(profile_crowning=3e-6, tip_relief=relief))
    slots = next(gear for gear in case.gears if isinstance(gear.blank, Slots))
    gears = tuple(
        replace(gear, geometry=replace(gear.geometry, micro=micro)) if gear == slots else gear for gear in case.gears
    )
    housing = replace(case.housing, modal_damping=DampingCurve((500.0, 4000.0), (0.01, 0.03)))
    operation = replace(case.operation, ramp=Ramp(200.0, 3.0))
    changed = replace(case, gears=gears, housing=housing, operation=operation, folder=str(tmp_path))
    assert nvh.load_case(nvh.save_case(changed, tmp_path / "case.toml")) == changed
    assert tomllib.loads((tmp_path / "case.toml").read_text())["gears"][1]["blank"]["type"] in ("slots", "solid")


def test_paths_of_files_follow_the_case_into_another_folder(tmp_path):
    sphere = nvh.load_case(ROOT / "cases/sphere/pulsating.toml")
    body = SurfaceFile("parts/body.stl", 0.001)
    case = replace(sphere, body=body, folder=str(tmp_path / "here"))
    (tmp_path / "there").mkdir()
    saved = nvh.save_case(case, tmp_path / "there" / "case.toml")
    assert 'file = "../here/parts/body.stl"' in saved.read_text()
    record = tmp_path / "here" / "idle.csv"
    record.parent.mkdir()
    rows = "\n".join(f"{0.001 * n},{900 + n % 7}" for n in range(3000))
    record.write_text(f"time,speed\n{rows}\n")
    box = nvh.load_case(ROOT / "cases/small/single_stage.toml")
    operation = replace(box.operation, ramp=Ramp(100.0, 1.0), fluctuation=SpeedRecord(str(record)))
    box = replace(box, operation=operation, folder=str(tmp_path))
    saved = nvh.save_case(box, tmp_path / "there" / "box.toml")
    assert 'file = "../here/idle.csv"' in saved.read_text()
    again = nvh.load_case(saved).operation.fluctuation
    assert Path(again.file).resolve() == record.resolve()


def test_a_case_built_in_python_by_the_page_is_the_example(tmp_path, monkeypatch):
    page = (ROOT / "docs" / "reference" / "cases.md").read_text(encoding="utf-8")
    script = re.search(r"```python\n(.*?)```", page.partition("## Cases in Python")[2], re.S)[1]
    names: dict = {}
    monkeypatch.chdir(tmp_path)
    exec(compile(script, "docs/reference/cases.md", "exec"), names)
    built = names["case"]
    assert nvh.load_case("python-built.toml") == built
    example = nvh.load_case(ROOT / "cases/small/single_stage.toml")
    assert replace(built, name=example.name, folder=example.folder) == example


def test_a_folder_that_is_missing_is_one_error(tmp_path):
    case = nvh.load_case(EXAMPLES[-1])
    with pytest.raises(InputError, match="nowhere"):
        nvh.save_case(case, tmp_path / "nowhere" / "case.toml")


def test_comments_of_a_saved_case_are_said_once_and_have_no_unit_beside_that_of_the_key(request, tmp_path):
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    text = nvh.save_case(case, tmp_path / "saved.toml").read_text()
    comments = [line.partition("#")[2].strip() for line in text.splitlines() if "#" in line]
    repeated = {comment for comment in comments if comments.count(comment) > 1}
    assert repeated <= {"Name of its shaft", "Name of the shaft"}
    for line in text.splitlines():
        key, _, comment = line.partition("#")
        name = key.partition("=")[0].strip()
        assert not (
            name.endswith(("_mm", "_GPa", "_kg_cm2", "_deg")) and re.search(r"\((m|Pa|kg m²|rad)\)| … ", comment)
        )
    assert "# Cylinders of steel that make the shaft\nsegments" in text


def test_a_name_that_ends_in_rexs_writes_rexs(tmp_path):
    """What the format does not hold is named; a radiator and other formats are refused before a file is there."""
    case = nvh.load_case(ROOT / "cases" / "small" / "single_stage.toml")
    with pytest.warns(UserWarning, match=r"unit\.rexs; not in it: housing, microphones"):
        saved = nvh.save_case(case, tmp_path / "unit.rexs")
    unit = read_rexs(saved)
    assert unit.loads[0].torque == pytest.approx(case.operation.input_torque)
    ball = nvh.load_case(ROOT / "cases" / "sphere" / "on_floor.toml")
    with pytest.raises(InputError, match="is a radiator, which REXS does not hold"):
        nvh.save_case(ball, tmp_path / "ball.rexs")
    with pytest.raises(InputError, match=r"end the name in \.toml or \.rexs"):
        nvh.save_case(case, tmp_path / "unit.rexsj")
    assert [path.name for path in tmp_path.iterdir()] == ["unit.rexs"]
