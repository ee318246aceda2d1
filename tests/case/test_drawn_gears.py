"""Gears stated as on their drawings in case files: sizes, contradictions, files that are saved and read again."""

import re
from pathlib import Path

import pytest

from nvhchain.case import load_case, save_case
from nvhchain.cli import main
from nvhchain.errors import InputError, mistakes

ROOT = Path(__file__).parents[2]
DRAWN, PLAIN = ROOT / "cases/small/drawn_gears.toml", ROOT / "cases/small/single_stage.toml"


def test_the_page_shows_the_sizes_that_check_prints_and_its_script_runs(capsys):
    page = (ROOT / "docs/howto/drawings.md").read_text(encoding="utf-8")
    assert main(["check", str(DRAWN)]) == 0
    (shown,) = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    assert shown in capsys.readouterr().out
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0], {})


def test_a_saved_case_reads_back_to_the_same_teeth(tmp_path):
    case = load_case(DRAWN)
    again = load_case(save_case(case, tmp_path / "again.toml"))
    assert again.gears == case.gears
    assert [pair.face_width for pair in again.pairs] == [pair.face_width for pair in case.pairs]


def test_faces_that_do_not_align_meet_on_their_common_face():
    case = load_case(PLAIN, changes=["gears.wheel.z_mm = 80", "gears.wheel.geometry.face_width_mm = 20"])
    assert case.pairs[0].face_width == pytest.approx(13e-3)  # 67…83 and 70…90 mm
    assert case.gearbox.meshes[0].z == pytest.approx(76.5e-3)
    with pytest.raises(InputError, match=r"share 0 mm of face, of 0.8 mm at least: move one of their mid-planes"):
        load_case(PLAIN, changes=["gears.wheel.z_mm = 95"])


def test_backlash_of_a_stage_gives_the_thickness_of_a_gear_that_states_none(tmp_path):
    text = PLAIN.read_text(encoding="utf-8").replace("thickness_allowance_um = 40\n", "", 1)
    path = tmp_path / "case.toml"
    path.write_text(text.replace('wheel = "wheel"\n', 'wheel = "wheel"\nnormal_backlash_um = 90\n'), encoding="utf-8")
    case = load_case(path)
    assert case.pairs[0].backlash == pytest.approx(90e-6, abs=1e-12)
    assert case.gears[0].geometry.profile_shift < 0
    assert load_case(save_case(case, tmp_path / "again.toml")).gears == case.gears
    kept = load_case(path, changes=["gears.pinion.geometry.profile_shift = 0"])
    assert (kept.gears[0].geometry.profile_shift, kept.pairs[0].backlash) == (0.0, pytest.approx(90e-6, abs=1e-12))
    assert kept.gears[0].geometry.thickness_allowance > 50e-6


def test_contradictions_of_several_gears_are_named_together():
    changes = [
        "gears.pinion.geometry.teeth = -20",
        'gears.wheel.geometry.reference_profile = "B"',
        "gears.wheel.geometry.rack_tip_radius = 0.38",
    ]
    with pytest.raises(InputError) as failure:
        load_case(PLAIN, changes=changes)
    found = mistakes(failure.value)
    assert len(found) == 2
    assert "teeth = -20: internal gears (ring gears) are not modelled: leave the stage out" in found[0]
    assert "rack_tip_radius = 0.38 contradicts reference_profile = 'B', of 0.3 normal modules" in found[1]


def test_backlash_that_contradicts_the_gears_names_both_values():
    with pytest.raises(
        InputError, match=r"stage stage: backlash 0.09 mm stated, 0.0751711 mm by the tooth thicknesses"
    ):
        load_case(PLAIN, changes=["stages.stage.normal_backlash_um = 90"])
