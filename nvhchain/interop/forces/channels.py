"""Channels of an imported file, with their units and time axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.interop.forces.channel_units import unit_called, unit_in_name


@dataclass(frozen=True, eq=False)
class Record:
    """Contents of an imported file, unchanged.

    source: name in messages.
    channels: name → values (n_t,) of each channel.
    units: units of channels that the file states.
    times: name → time axis (n_t,) in s, of channels that the file gives.
    unusable: channels that cannot be used, with the reason.
    rotations: channels about an axis, which are moments; None where the file does not part them from forces.
    """

    source: str
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str]
    times: Mapping[str, FloatArray] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)
    rotations: frozenset[str] | None = None

    def values(self, name: str) -> FloatArray:
        """Return one channel; InputError if it is missing, unusable or not finite."""
        self._check_use(name)
        value = np.asarray(self.channels[name], dtype=float)
        bad = np.flatnonzero(~np.isfinite(value))
        require(
            len(bad) == 0,
            f"{self.source}: channel {name!r} has no finite value in sample {bad[0] if len(bad) else 0} "
            f"({len(bad)} such samples): cut the record or repair the gap",
        )
        return value

    def _check_use(self, name: str) -> None:
        """Raise InputError if the channel is missing or unusable."""
        known = ", ".join(list(self.channels)[:20]) or "none"
        require(name in self.channels, f"{self.source}: no channel {name!r}; it has {known}")
        require(name not in self.unusable, f"{self.source}: {name} {self.unusable.get(name)}")

    def time_of(self, names: Sequence[str]) -> FloatArray | None:
        """Return the time axis (n_t,) s of the channels, None without one; InputError if they differ."""
        for name in names:
            self._check_use(name)
        timed = [name for name in names if name in self.times]
        for name in timed[1:]:
            first, own = self.times[timed[0]], self.times[name]
            require(
                len(own) == len(first) and bool((np.abs(own - first) <= 1e-6 * np.diff(first[:2]).sum()).all()),
                f"{self.source}: {name} has another time axis than {timed[0]}: export them alike",
            )
        return self.times[timed[0]] if timed else None

    def check_unit(self, name: str, unit: str) -> None:
        """Raise InputError if the file or the channel's name states another unit."""
        for stated, source in ((self.units.get(name), "the file"), (unit_in_name(name, unit), "its name")):
            require(
                stated is None or unit_called(stated) == unit,
                f"{self.source}: channel {name!r} is in {stated!r} by {source}, but {unit!r} is declared: correct one",
            )
