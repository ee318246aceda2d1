"""A foreign file's channels and what the file says about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.interop.forces.channel_units import unit_called, unit_in_name


@dataclass(frozen=True, eq=False)
class Record:
    """A foreign file as it is.

    source: what messages call it.  channels: name → (n_t,) values.  units: name → unit, where the file states one.
    times: name → (n_t,) s, where the file gives the channel a time axis.  unusable: name → why it is no input here.
    """

    source: str
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str]
    times: Mapping[str, FloatArray] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)

    def values(self, name: str) -> FloatArray:
        """One channel; InputError when it is missing, unusable or holds values that are not finite."""
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
        """InputError when the channel is missing or unusable."""
        known = ", ".join(list(self.channels)[:20]) or "none"
        require(name in self.channels, f"{self.source}: no channel {name!r}; it has {known}")
        require(name not in self.unusable, f"{self.source}: {name} {self.unusable.get(name)}")

    def time_of(self, names: Sequence[str]) -> FloatArray | None:
        """(n_t,) s that the file gives the channels, None where it does not; InputError where they differ."""
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
        """InputError when the file or the channel's own name states another unit for it."""
        for stated, source in ((self.units.get(name), "the file"), (unit_in_name(name, unit), "its name")):
            require(
                stated is None or unit_called(stated) == unit,
                f"{self.source}: channel {name!r} is in {stated!r} by {source}, but {unit!r} is declared: correct one",
            )
