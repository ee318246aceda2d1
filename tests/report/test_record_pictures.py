"""`nvhchain plot` on records of bearing forces: forces and transmission errors, steady, swept and running up."""

import numpy as np
import pytest
from matplotlib.image import imread

from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces
from nvhchain.report.pictures import drawing


def record(folder, speed, *, periodic=True, **left_out):
    """Ten turns of order 20, or a run-up of a second to `speed`, rad/s."""
    rate = 5000.0
    count = round(20 * np.pi / speed * rate) if periodic else 5000
    time = np.arange(count) / rate
    turned = speed * time if periodic else 0.5 * speed * time**2
    wave = 1e-6 * np.sin(20 * turned)
    history = np.full(count, speed) if periodic else speed * time
    quantities = {"transmission_error": np.stack([wave, 2 * wave], axis=1), "output_lag": wave} | left_out
    forces = BearingForces(
        time, 1e8 * wave[:, None, None] * np.ones((1, 2, 3)), ("A", "B"), np.zeros((2, 3)), history, periodic,
        **quantities,
    )  # fmt: skip
    return str(hdf5.save(forces, folder / f"record-{speed:g}-{periodic}.h5"))


@pytest.fixture
def drawn(tmp_path):
    def draw(files, *arguments):
        picture = tmp_path / "picture.png"
        assert main(["plot", *files, "--out", str(picture), *arguments]) == 0
        return imread(picture)

    return draw


SPEEDS = (20 * np.pi, 25 * np.pi, 40 * np.pi)


def test_errors_of_steady_records_are_drawn_over_order_and_those_of_several_speeds_as_one_map(drawn, tmp_path):
    files = [record(tmp_path, speed) for speed in SPEEDS]
    lines = drawn(files[:1], "--quantity", "transmission_error")
    assert lines.std() > 0.01
    maps = [drawn(files, "--orders", "--quantity", name) for name in ("force", "transmission_error", "output_lag")]
    assert all(of.std() > 0.05 for of in maps)
    assert maps[0].shape != drawn(files).shape  # without --orders the lines of every bearing


def test_errors_of_run_ups_are_maps(drawn, tmp_path):
    files = [record(tmp_path, 60 * np.pi, periodic=False)]
    assert drawn(files, "--quantity", "transmission_error").std() > 0.05
    assert drawn(files, "--quantity", "output_lag", "--orders").std() > 0.05


@pytest.mark.parametrize("arguments", [(), ("--orders",)])
def test_records_in_time_at_constant_speed_are_mean_spectra(tmp_path, monkeypatch, arguments):
    made = hdf5.load(record(tmp_path, SPEEDS[0]))
    steady = str(hdf5.save(made.replace(periodic=False), tmp_path / "steady.h5"))
    kept = []
    monkeypatch.setattr(drawing, "save", lambda axes, _: kept.extend(axes))
    assert main(["plot", steady, "--quantity", "output_lag", *arguments, "--out", str(tmp_path / "x.png")]) == 0
    (ax,) = kept
    axis, level = ax.lines[0].get_data()
    wave = 20.0 if arguments else 20.0 * SPEEDS[0] / (2 * np.pi)
    assert axis[level.argmax()] == pytest.approx(wave, rel=0.01)
    assert level.max() == pytest.approx(0.0, abs=0.3)  # 1 µrad


def test_records_at_constant_speed_and_run_ups_are_drawn_apart(tmp_path, capsys):
    made = hdf5.load(record(tmp_path, SPEEDS[0]))
    steady = str(hdf5.save(made.replace(periodic=False), tmp_path / "steady.h5"))
    run_up = record(tmp_path, 60 * np.pi, periodic=False)
    assert main(["plot", steady, run_up, "--out", str(tmp_path / "x.png")]) == 2
    assert "some are at constant speed: draw them apart" in capsys.readouterr().err


def test_errors_are_drawn_over_the_angle_of_the_input(drawn, tmp_path, capsys):
    file = record(tmp_path, SPEEDS[0])
    assert drawn([file], "--quantity", "transmission_error", "--angle").std() > 0.05
    assert main(["plot", file, "--angle"]) == 2
    assert "give quantity = transmission_error with it" in capsys.readouterr().err


def test_what_is_not_there_is_said(tmp_path, capsys):
    file = record(tmp_path, SPEEDS[0], transmission_error=None)
    assert main(["plot", file, "--quantity", "transmission_error"]) == 2
    assert "holds no transmission_error" in capsys.readouterr().err
    assert main(["plot", file, "--quantity", "output_lag"]) == 2
    assert "steady speeds with --orders" in capsys.readouterr().err
