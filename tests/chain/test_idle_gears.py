"""Gears without load at constant speed: refused before any work; given forces of zero end in silence."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import cli
from nvhchain.case import Operation, Ramp
from nvhchain.error_band import format_level
from nvhchain.error_band.files import band_record
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import BearingForces, ReducedHousing, Surface
from nvhchain.scene import check_knobs

pytestmark = pytest.mark.filterwarnings(
    "ignore:bearing forces. the record has no mean forces", "ignore:surface mesh with elements of"
)  # models are coarse on purpose

REFUSED = r"input_torque = 0 N m at a constant 1800 rpm: nothing moves idle gears.*give input_torque, a ramp"
MASTERS = replace(nvh.DRAFT, acoustics=AcousticsFidelity(elements_per_wavelength=2.5, masters=24))


@pytest.fixture(scope="module")
def small(request):
    return request.config.rootpath / "cases" / "small" / "single_stage.toml"


LEVEL = "ramp = { end_speed_rpm = 1800, duration = 0.2 }"
NO_HARMONIC = 'fluctuation = { type = "torque_harmonics", harmonics = [{ order = 2, amplitude = 0 }] }'
NO_RECORD = 'fluctuation = { type = "torque_record", file = "t.csv", channel = "torque" }'


@pytest.mark.parametrize(
    "ramp", ["", LEVEL, NO_HARMONIC, f"{LEVEL}\n{NO_RECORD}"], ids=["steady", "level ramp", "harmonic", "record"]
)
@pytest.mark.parametrize("command", ["check", "plan", "run", "compare"])
def test_gears_that_nothing_moves_are_refused_before_any_work(command, ramp, small, tmp_path, capsys):
    file = tmp_path / "idle.toml"
    (tmp_path / "t.csv").write_text("time,torque\n" + "".join(f"{0.001 * n},3\n" for n in range(300)))
    file.write_text(f'base = "{small}"\n[operation]\ninput_torque = 0\nmesh_torque = 10\n{ramp}')
    out = [] if command in ("check", "plan") else ["--out", str(tmp_path / "out")]
    assert cli.main([command, str(file), *out]) == 2
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 1
    assert "nothing moves idle gears" in said.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("ramp", "said"),
    [("", "at a constant speed: nothing moves the gears"), (LEVEL, "give mesh_torque, N m at the input")],
)
def test_no_torque_at_a_constant_speed_is_refused_as_no_motion(ramp, said, small, tmp_path, capsys):
    """The reach of mesh laws is asked for only where something may rattle."""
    file = tmp_path / "idle.toml"
    file.write_text(f'base = "{small}"\n[operation]\ninput_torque = 0\n{ramp}')
    assert cli.main(["check", str(file)]) == 2
    assert said in capsys.readouterr().err


def test_idle_gears_run_where_the_speed_changes_or_forces_are_given(small):
    case = nvh.load_case(small)
    idle = replace(case, operation=Operation(case.operation.input_speed, 0.0, mesh_torque=10.0))
    with pytest.raises(InputError, match=REFUSED):
        check_knobs(idle, nvh.DRAFT)
    check_knobs(idle, nvh.DRAFT, {"force_spectrum"})
    rising = replace(idle, operation=replace(idle.operation, ramp=Ramp(1.1 * case.operation.input_speed, 0.2)))
    check_knobs(rising, nvh.DRAFT)


@pytest.fixture
def silent(small):
    """A case, a housing of one mode and bearing forces of zero."""
    case = nvh.load_case(small)
    case = replace(case, band=replace(case.band, high=1500.0), quantities=("bearing_forces", "pressure"))
    corners, count = 0.05 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), len(case.seats)
    housing = ReducedHousing(
        natural_frequency=np.array([900.0]),
        modal_damping=np.array([0.02]),
        seat_shapes=0.3 * np.ones((1, count, 3)),
        normal_shapes=np.array([[1.0, 0.5, 0.2, -0.3]]),
        seat_residual=1e-9 * np.eye(3 * count).reshape(count, 3, count, 3),
        face_residual=np.zeros((count, 3, 4)),
        names=tuple(case.seats),
        positions=np.array(list(case.seats.values())),
        surface=Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])),
    )
    time = np.arange(8000) / 20e3
    forces = BearingForces(
        time, np.zeros((8000, count, 3)), housing.names, housing.positions, case.operation.input_speed
    )
    return case, housing, forces


@pytest.mark.parametrize("ramp", [None, Ramp(60 * np.pi, 0.4)], ids=["steady", "run-up"])
def test_forces_of_zero_are_said_and_end_in_silence_with_limits(ramp, silent, tmp_path):
    case, housing, forces = silent
    case = replace(case, operation=replace(case.operation, ramp=ramp))
    with pytest.warns(AccuracyWarning, match="exactly zero: nothing moves the housing") as told:
        result = nvh.run(case, fidelity=MASTERS, bearing_forces=forces, housing=housing)
    assert sum("bearing forces" in str(one.message) for one in told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bands = result.error_bands
        for band in bands.values():
            assert not np.isnan(band.level).any()
            assert np.isfinite(band.level).all()
            assert not np.isnan(band.overall).any()
            assert (band.overall <= -1000).all()
            assert format_level(band.level[0], "dB", band.overall[0]) == "silence"
            assert "NaN" not in json.dumps(band_record(band))
            assert band_record(band)["overall_limits"][0] == [None, None]


def test_lines_without_force_have_no_error_of_masters(silent):
    """A record that ends in silence: its last part is loaded at no line, the others at all."""
    case, housing, forces = silent
    case = replace(case, operation=replace(case.operation, ramp=Ramp(60 * np.pi, 0.4)), quantities=("pressure",))
    force = np.array(forces.force)
    force[:4000] = np.random.default_rng(1).normal(size=force[:4000].shape)
    result = nvh.run(case, fidelity=MASTERS, bearing_forces=forces.replace(force=force), housing=housing)
    first, last = result.error_band.bands[0], result.error_band.bands[-1]
    assert not last.amplitude.any()
    assert not last.sources["masters"].any()
    assert first.sources["masters"].shape == first.amplitude.shape
    assert np.isfinite(result.error_band.level).all()
