"""Background that masks the gearbox, such as road and motor noise: a record, or levels of third octaves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from nvhchain.errors import require, require_within
from nvhchain.kinds import check_fields
from nvhchain.sound import Background, Sound, background_sound, recorded_background

LOUDEST = 200.0
"""Largest magnitude (dB) of a level; larger ones are mistakes in the unit."""


@dataclass(frozen=True)
class RecordedBackground:
    """Background from a WAV file of any sampling rate; its first channel counts.

    Parameters
    ----------
    file : str
        Path of the WAV file, relative to the case.
    full_scale : float
        Sound pressure (Pa) of a sample of 1.0; of integer samples at full scale.
    """

    file: str
    full_scale: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        remedy = "give the pressure of a sample of 1"
        require_within("background: full_scale", self.full_scale, 0, 1e6, "Pa", remedy, above=True)

    def sound(self, folder: Path) -> Sound:
        """Return the background as a loop; InputError where the file cannot be read."""
        return recorded_background(folder / self.file, full_scale=self.full_scale)


@dataclass(frozen=True)
class BackgroundLevels:
    """Background as noise with levels of third octaves.

    Parameters
    ----------
    frequency : tuple of float
        Middle frequencies of third octaves (Hz), rising.
    level : tuple of float
        Their levels (dB re 20 µPa), not weighted.
    """

    frequency: tuple[float, ...]
    level: tuple[float, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            all(abs(level) <= LOUDEST for level in self.level),
            f"background: levels {list(self.level)} dB are outside ±{LOUDEST:g} dB: give dB re 20 µPa",
        )
        _ = self.sound(Path())

    def sound(self, folder: Path) -> Sound:
        """Return the background as a loop of noise."""
        return background_sound(Background(self.frequency, self.level))  # type: ignore[arg-type]
