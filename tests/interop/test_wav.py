"""A WAV file holds the pressure signal at a known scale and rate."""

import numpy as np
import pytest
from scipy.io import wavfile

from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure
from nvhchain.interop import write_wav

TONE = FieldPressure(np.arange(1, 11) * 100.0, [[0.0, 0, 1]], np.where(np.arange(1, 11) == 10, 0.5, 0.0)[:, None] + 0j)


def test_wav_holds_a_cosine_of_the_right_amplitude_and_pitch(tmp_path):
    rate, samples = wavfile.read(write_wav(TONE, tmp_path / "a.wav", seconds=1.0, full_scale=1.0))
    time = np.arange(len(samples)) / rate
    assert len(samples) / rate == pytest.approx(1.0, abs=0.01)
    assert np.abs(samples / 32767 - 0.5 * np.cos(2 * np.pi * 1000.0 * time)).max() < 1e-4


def test_clipping_is_refused_and_leaves_no_file(tmp_path):
    with pytest.raises(InputError, match="full scale"):
        write_wav(TONE, tmp_path / "a.wav", full_scale=0.4)
    assert list(tmp_path.iterdir()) == []
