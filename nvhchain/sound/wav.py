"""WAV files of sound pressure: 32-bit floating point in pascals, with the scale stated inside."""

from __future__ import annotations

import struct
import warnings
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from nvhchain.errors import InputError, require
from nvhchain.files.atomic_write import write_atomic
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked
from nvhchain.sound.signals import RATES, Sound

SCALE = "Sound pressure: sample 1.0 = 1 Pa"
"""Comment (LIST INFO ICMT) of every file."""

_FULL_SCALE = {np.dtype(np.int16): 2.0**15, np.dtype(np.int32): 2.0**31, np.dtype(np.uint8): 2.0**7}
"""Type of integer samples → sample of full scale."""


@checked
def write_wav(sound: Sound, path: str | Path, *, title: str = "") -> Path:
    """Write a sound as 32-bit floating-point WAV in pascals.

    Parameters
    ----------
    sound : Sound
        Sound.
    path : str or Path
        WAV file.
    title : str
        Title in the file (LIST INFO INAM), such as configuration and field point.

    Returns
    -------
    Path
        Path of the file.

    Notes
    -----
    A sample of 1.0 is 1 Pa, which the comment in the file states. Programs for sound quality read it with a
    calibration factor of 1. Players clip samples beyond ±1.
    """
    return write_atomic(Path(path), encoded(sound, title=title))


def encoded(sound: Sound, *, title: str = "") -> bytes:
    """Return the content of a WAV file in pascals."""
    file = BytesIO()
    wavfile.write(file, sound.rate, np.asarray(sound.pressure, dtype=np.float32))
    content = file.getvalue() + _information({"INAM": title, "ICMT": SCALE, "ISFT": "nvhchain"})
    return b"RIFF" + struct.pack("<I", len(content) - 8) + content[8:]


def encoded_16_bit(sound: Sound, full_scale: float) -> bytes:
    """Return the content of a 16-bit WAV file for players; `full_scale` is the pressure (Pa) of the largest sample."""
    file = BytesIO()
    samples = np.rint(np.clip(np.asarray(sound.pressure) / full_scale, -1.0, 1.0) * 32767).astype(np.int16)
    wavfile.write(file, sound.rate, samples)
    return file.getvalue()


@checked
def read_wav(path: str | Path, *, full_scale: float = 1.0) -> Sound:
    """Read the first channel of a WAV file.

    full_scale: pressure (Pa) of a sample of 1.0, or of full scale for integers; 1 for files of `write_wav`.
    Returns sound pressure at the rate of the file.
    """
    require(0 < full_scale < np.inf, f"full_scale = {full_scale:g} Pa of {path} must be positive and finite")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", wavfile.WavFileWarning)
            warnings.filterwarnings("ignore", "Chunk .* not understood", wavfile.WavFileWarning)
            rate, samples = wavfile.read(path)
    except FileNotFoundError:
        raise InputError(f"{path} does not exist: give a WAV file") from None
    except OSError as error:  # a folder, or a file of another user
        raise InputError(f"{path} cannot be read ({error.strerror or error}): give a WAV file") from None
    except wavfile.WavFileWarning as error:
        raise InputError(f"{path} is cut off or damaged ({error}): give the whole file") from None
    except UnboundLocalError:  # scipy's, where no samples follow the header
        raise InputError(f"{path} holds no samples: give a record") from None
    except (ValueError, EOFError, struct.error) as error:
        raise InputError(f"{path} is no WAV file that can be read ({error}): give PCM or floating point") from None
    require(samples.size > 0, f"{path} holds no samples: give a record")
    require(0 < rate <= 2 * RATES[-1], f"{path} has {rate} samples per second: give at most {2 * RATES[-1]}")
    samples = samples if samples.ndim == 1 else samples[:, 0]
    signal: FloatArray = samples.astype(float)
    if samples.dtype == np.uint8:
        signal = signal - 128.0
    signal = signal * (full_scale / _FULL_SCALE.get(samples.dtype, 1.0))
    require(bool(np.isfinite(signal).all()), f"{path} holds samples that are not finite: repair it")
    return Sound(signal, int(rate))


def _information(texts: dict[str, str]) -> bytes:
    """Return a LIST chunk of texts."""
    body = b"INFO"
    for name, text in texts.items():
        if text:
            data = text.encode("utf-8") + b"\0"
            body += name.encode("ascii") + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)
    return b"LIST" + struct.pack("<I", len(body)) + body
