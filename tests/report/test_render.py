"""Sound files of a finished run: microphones, orders, background and universal files."""

import json

import numpy as np
import pytest
import pyuff

from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure
from nvhchain.report.sound.render import render_sounds
from nvhchain.sound import Background, background_sound, read_wav, write_wav

ORDERS = np.array([20.0, 40.0])
SIZE = np.array([[0.02 + 0j, 0.5j], [0.01 + 0j, 0.1j]])


@pytest.fixture
def finished(tmp_path):
    hdf5.save(FieldPressure(50 * ORDERS, [[0, 0, 1.0], [1.0, 0, 0]], SIZE, 100 * np.pi), tmp_path / "pressure.h5")
    points = [{"name": name, "position_m": [0, 0, 1]} for name in ("rear", "side 1 m")]
    (tmp_path / "case.json").write_text(json.dumps({"name": "A", "field_points": points, "values": {}}))
    return tmp_path


def rms(path):
    return read_wav(path).rms * np.sqrt(2)


def test_microphone_and_orders_are_chosen(finished, capsys):
    assert main(["sound", str(finished), "--point", "side 1 m", "--only", "40"]) == 0
    assert rms(finished / "sound-A-side_1_m-only-40.wav") == pytest.approx(0.1, rel=1e-6)
    assert main(["sound", str(finished), "--without", "40"]) == 0
    assert rms(finished / "sound-A-without-40.wav") == pytest.approx(0.02, rel=1e-6)
    assert "sample 1.0 = 1 Pa" in capsys.readouterr().out
    assert main(["sound", str(finished), "--point", "front"]) == 2
    assert "A has no microphone 'front'" in capsys.readouterr().err


def test_background_of_another_rate_and_scale_is_added(finished):
    noise = background_sound(Background(np.array([500.0]), np.array([60.0]))).resampled(16000)
    write_wav(type(noise)(noise.pressure / 5.0, noise.rate), finished / "road.wav")
    assert main(["sound", str(finished), "--background", str(finished / "road.wav"), "--full-scale", "5"]) == 0
    both = np.hypot(np.hypot(0.02, 0.01), np.sqrt(2) * 0.02)
    assert rms(finished / "sound-A-background.wav") == pytest.approx(both, rel=0.02)
    ((_, sound),) = render_sounds(finished, background=finished / "road.wav", full_scale=5.0)
    assert sound.loops


def test_universal_file_holds_all_microphones_in_pascals(finished):
    assert main(["sound", str(finished), "--uff"]) == 0
    speed, *signals = pyuff.UFF(str(finished / "sound-A.unv")).read_sets()
    assert speed["data"] == pytest.approx(100 * np.pi)
    assert [of["id1"].strip() for of in signals] == ["rear", "side 1 m"]
    assert [of["rsp_node"] for of in signals] == [1, 2]
    for of, size in zip(signals, SIZE.T, strict=True):
        assert of["ordinate_spec_data_type"] == 15
        assert np.sqrt(2 * np.mean(of["data"] ** 2)) == pytest.approx(np.sqrt((np.abs(size) ** 2).sum()), rel=1e-6)


def test_universal_file_of_an_added_microphone_holds_those_that_were_added(finished):
    added = FieldPressure(50 * ORDERS, [[0, 2.0, 0]], 3 * SIZE[:, :1], 100 * np.pi, point_names=("roof",))
    hdf5.save(added, finished / "microphones.h5")
    assert main(["sound", str(finished), "--uff", "--point", "roof"]) == 0
    for file in ("sound-A-roof.unv", "spectrum-A.unv"):
        sets = pyuff.UFF(str(finished / file)).read_sets()
        names = [of["id1"].strip() for of in (sets if isinstance(sets, list) else [sets])]
        assert "roof" in names
        assert not {"rear", "side 1 m"} & set(names)


@pytest.mark.parametrize("background", [[], ["--background", "case"]])
def test_a_scale_without_a_file_is_refused(finished, capsys, background):
    assert main(["sound", str(finished), "--full-scale", "3", *background]) == 2
    assert "--full-scale 3.0 belongs to a WAV file of --background" in capsys.readouterr().err
