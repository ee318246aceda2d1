"""Manufacturing deviations in case files: what they mean, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Deviations, GearboxCase
from nvhchain.errors import InputError
from nvhchain.scene.bearing_lines import deviation_lines
from tests.gear.test_deviations import pitch_deviations


@pytest.fixture
def case_file(request: pytest.FixtureRequest) -> Path:
    """The single stage with gears of class 6."""
    return request.config.rootpath / "cases/small/class_6.toml"


def load(path: Path, *changes: str) -> GearboxCase:
    """Gearbox of a file with changes."""
    case = nvh.load_case(path, changes=changes)
    assert isinstance(case, GearboxCase)
    return case


def test_values_take_the_place_of_what_a_class_draws(case_file: Path) -> None:
    """Run-out, slopes and pitch as stated; the rest fills the class."""
    case = load(
        case_file,
        "gears.pinion.deviations.run_out_um = 10",
        "gears.pinion.deviations.run_out_phase_deg = 90",
        "gears.pinion.deviations.helix_slope_um = -3",
        "gears.wheel.deviations.pitch_um = [" + ", ".join(["1", "-1"] * 15) + "]",
    )
    (pair,) = case.deviations
    assert pair is not None
    pinion, wheel = pair.pinion, pair.wheel
    assert pinion is not None
    assert wheel is not None
    assert pinion.eccentricity == pytest.approx(5e-6)
    assert pinion.eccentricity_angle == pytest.approx(np.pi / 2)
    assert pinion.drive.helix_slope == pytest.approx(-3e-6)
    single, _ = pitch_deviations(case.gears[0].geometry, pinion)
    assert np.abs(single).max() == pytest.approx(8.5e-6, rel=1e-6)
    assert wheel.drive.pitch == pytest.approx(1e-6 * np.array([1.0, -1.0] * 15))
    assert wheel.coast.pitch == pytest.approx(-wheel.drive.pitch)
    assert abs(pair.misalignment.in_plane) <= 0.1e-3
    assert case.gears[0].deviations != Deviations()


def test_a_gearbox_without_deviations_has_none(request: pytest.FixtureRequest) -> None:
    """The plain case; gears of a class repeat after all teeth have met."""
    plain = load(request.config.rootpath / "cases/small/single_stage.toml")
    assert plain.deviations == (None,)
    assert deviation_lines(plain) == ()
    lines = deviation_lines(load(request.config.rootpath / "cases/small/class_6.toml"))
    assert "ISO 1328-1 class 6, 100 % used, seed 1: f_pT 8.5, F_pT 26" in lines[0]
    assert lines[1] == "until all teeth have met again 0.1 s pass: lines are 10 Hz apart"


def test_measured_flanks_are_read_from_a_table(case_file: Path, tmp_path: Path) -> None:
    """A table on a grid, in any order of its rows; gaps and other columns are refused."""
    table = tmp_path / "flanks.csv"
    rows = [f"0,{p},{f},{10 * p + f}" for f in (0, 1) for p in (1, 0, 0.5)]
    table.write_text("tooth,profile,face,deviation_um\n" + "\n".join(rows), encoding="utf-8")
    change = f"gears.pinion.deviations.topography.file = '{table.as_posix()}'"
    (pair,) = load(case_file, change).deviations
    assert pair is not None
    assert pair.pinion is not None
    grid = 1e-6 * np.array([[[0, 1], [5, 6], [10, 11]]])
    assert pair.pinion.drive.topography == pytest.approx(grid)
    for text, message in (
        ("tooth,profile,face,deviation_um\n" + "\n".join(rows[1:]), "5 points are no grid of 1 × 3 × 2"),
        ("tooth,roll,face,deviation_um\n" + "\n".join(rows), "give tooth, profile, face, deviation_um"),
        ("tooth,profile,face,deviation_um\n0,x,0,1", "no table of numbers"),
        ("tooth,profile,face,deviation_um\n0,0,0,1\n0,0,1,nan", r"row 3 \(0, 0, 1, nan\) is not finite"),
        ("tooth,profile,face,deviation_um\n0,0,0,0.02\n0,0,1,501", "row 3 .* is beyond|beyond ±500 µm"),
    ):
        table.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            load(case_file, change)
    table.unlink()
    with pytest.raises(InputError, match="cannot be read"):
        load(case_file, change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("gears.pinion.deviations.tolerance_class = 12", "tolerance class 12 is not a whole number of 1…11"),
        ("gears.pinion.deviations.run_out_mum = 3", "is no unit of 'run_out'"),
        ("gears.pinion.deviations.runout_um = 3", "did you mean 'run_out_um'"),
        ("gears.pinion.deviations.run_out = 12", "is beyond ±0.0005 m.*write run_out_mm = 12"),
        ("gears.pinion.deviations.pitch_um = [1, 2]", "pitch has 2 entries: give one for each of 20 teeth"),
        ("gears.pinion.deviations.used = -1", "used = -1 is outside 0…10"),
        ("gears.pinion.deviations.ghosts = [{ order = 2.5, amplitude_um = 1 }]", "ghost order = 2.5 must be whole"),
        ("stages.stage.tolerances.centre_distance_grade = 12", "IT grade 12 is not a whole number of 5…11"),
        ("stages.stage.tolerances.centre_distance_um = 120", "± 120 µm is beyond ±100 µm: take a finer grade"),
        ("gears.pinion.geometry.face_width_mm = 3", "face width 3 mm is outside 4…1200 mm"),
    ],
)
def test_bad_deviations_are_refused_with_limit_and_remedy(case_file: Path, change: str, message: str) -> None:
    """One line with the place, the value, the limit and the remedy."""
    with pytest.raises(InputError, match=message):
        load(case_file, change)
