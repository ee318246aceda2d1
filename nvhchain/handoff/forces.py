"""Bearing forces in time and over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.handoff.accuracy import ForceAccuracy
from nvhchain.handoff.base import ComplexArray, FloatArray, HandOff
from nvhchain.handoff.declared import Label, array, value


class BearingForces(HandOff):
    """Histories of bearing forces on the housing.

    Notes
    -----
    A transmission error is r_bP φ_P − r_bG φ_G along the transverse line of action, > 0 under a driving torque. Each φ
    is counted from the nominal rotation in its gear's running direction. The output lag is the lag of the output shaft
    behind the input's angle times the speed ratio. It is > 0 under a driving torque, too.
    """

    time: FloatArray = array("s", "time", "time, uniform", fewest=2)
    force: FloatArray = array("N", "time, bearing, axis", "bearing force on the housing")
    names: tuple[str, ...] = array("", "bearing", "bearing names")
    positions: FloatArray = array("m", "bearing, axis", "bearing seat centres")
    input_speed: FloatArray = array("rad/s", "time", "speed of the input shaft", spread=True)
    periodic: bool = value("1", "record covers whole common periods of a steady state", default=False)
    mesh_deflection: FloatArray = array("m", "time, mesh", "dynamic mesh deflection", default=())
    transmission_error: FloatArray | None = array("m", "time, mesh", "transmission error of every mesh", default=None)
    output_lag: FloatArray | None = array("rad", "time", "transmission error, input to output", default=None)
    accuracy: ForceAccuracy = value("", "stated accuracy", default=ForceAccuracy())
    error_names: tuple[Label, ...] | None = array(
        "", "ends", "shafts of every mesh, then input and output", default=None
    )
    moment: FloatArray | None = array(
        "N m", "time, bearing, tilt", "moment of every bearing on the housing, about x and y", default=None
    )

    def _check(self) -> None:
        step = np.diff(self.time)
        jitter = float(np.abs(step - step.mean()).max() / step.mean())
        require(
            jitter < 1e-4,
            f"BearingForces.time is not uniform (steps differ by {100 * jitter:.3g} % of the mean): resample it first",
        )

    @property
    def wrench(self) -> FloatArray:
        """Forces (n_t, n_bearing, 3), with the moments (n_t, n_bearing, 5) where they are recorded."""
        return self.force if self.moment is None else np.concatenate([self.force, self.moment], axis=2)

    @property
    def sample_rate(self) -> float:
        """Sample rate (Hz)."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))

    def recorded(self, quantity: str) -> FloatArray:
        """Return a recorded quantity (n_t, …), the input of spectra and waterfalls.

        Parameters
        ----------
        quantity : str
            `force`, `moment`, `mesh_deflection`, `transmission_error` or `output_lag`.

        Raises
        ------
        InputError
            If the name is unknown, or the record does not contain the quantity.
        """
        known = {
            "force": self.force,
            "moment": self.moment,
            "mesh_deflection": self.mesh_deflection,
            "transmission_error": self.transmission_error,
            "output_lag": self.output_lag,
        }
        require(quantity in known, f"{quantity!r} is not recorded with bearing forces: choose from {', '.join(known)}")
        history = known[quantity]
        if history is None or history.size == 0:
            raise InputError(
                f"the record holds no {quantity}: it comes from another program or an earlier version; compute it again"
            )
        return history

    def sort_bearings(self, names: tuple[str, ...], motions: int = 3) -> FloatArray:
        """Return the force (n_t, motions · n_bearing), the bearings in the order of `names`, which must be the same.

        motions : 3 for forces (N), 5 for forces and moments about x and y (N m) of every bearing.
        """
        return np.asarray(_sort_bearings(self, names, motions))


class ForceSpectrum(HandOff):
    """Bearing force spectra, single-sided complex peak amplitudes under e^{+jωt}."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    force: ComplexArray = array("N", "frequency, bearing, axis", "bearing force spectrum, peak")
    names: tuple[str, ...] = array("", "bearing", "bearing names")
    input_speed: float = value("rad/s", "speed of the input shaft, 0 where it varies", default=0.0)
    moment: ComplexArray | None = array(
        "N m", "frequency, bearing, tilt", "spectrum of the moments about x and y, peak", default=None
    )

    def _check(self) -> None:
        require(
            self.input_speed >= 0.0,
            f"ForceSpectrum.input_speed = {self.input_speed} rad/s must not be negative: 0 where it varies",
        )

    @property
    def wrench(self) -> ComplexArray:
        """Forces (n_f, n_bearing, 3), with the moments (n_f, n_bearing, 5) where there are any."""
        return self.force if self.moment is None else np.concatenate([self.force, self.moment], axis=2)

    def select(self, lines: Any) -> ForceSpectrum:
        """Return the spectrum at some of its lines: indices, a slice or a mask."""
        moment = None if self.moment is None else self.moment[lines]
        return self.replace(frequency=self.frequency[lines], force=self.force[lines], moment=moment)

    def sort_bearings(self, names: tuple[str, ...], motions: int = 3) -> ComplexArray:
        """Return the force (n_f, motions · n_bearing), the bearings in the order of `names`, which must be the same.

        motions : 3 for forces (N), 5 for forces and moments about x and y (N m) of every bearing.
        """
        return np.asarray(_sort_bearings(self, names, motions))


def force_and_moment(wrench: Any) -> dict[str, Any]:
    """Return the fields `force` and `moment` of values (n, n_bearing, 3 or 5); 3 have no moment."""
    return {"force": wrench[:, :, :3], "moment": wrench[:, :, 3:] if wrench.shape[2] > 3 else None}


def _sort_bearings(forces: BearingForces | ForceSpectrum, names: tuple[str, ...], motions: int) -> Any:
    """Sort forces (n, motions · n_bearing) in the order of `names`; bearings without moments have none."""
    bearings = forces.names
    require(
        isinstance(names, Sequence) and all(isinstance(name, str) for name in names),
        f"{names!r} are no names of bearings: give a sequence of texts",
    )
    unknown, missing = sorted(set(bearings) - set(names)), sorted(set(names) - set(bearings))
    require(
        not unknown and not missing,
        f"bearing names differ: the housing has {', '.join(names)}; unknown to it: "
        f"{', '.join(unknown) or 'none'}; without force: {', '.join(missing) or 'none'}",
    )
    order = [bearings.index(name) for name in names]
    given = forces.force if motions == 3 else forces.wrench
    found = np.zeros((len(given), len(names), motions), dtype=given.dtype)
    found[:, :, : given.shape[2]] = given[:, order]
    return found.reshape(len(given), -1)
