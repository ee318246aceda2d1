"""Bearing forces in time and over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff.base import (
    ComplexArray,
    FloatArray,
    HandOff,
    array,
    distinct_names,
    frequencies,
    increasing,
    speed_history,
)


@dataclass(frozen=True, eq=False)
class BearingForces(HandOff):
    """Bearing force histories, as they act on the housing.

    time: (n_t,) s, uniform.  force: (n_t, n_bearing, 3) N.  names: n_bearing.  positions: (n_bearing, 3) m.
    input_speed: (n_t,) rad/s of the input shaft (a scalar is spread over the record).
    periodic: True when the record covers whole common periods of a steady state.
    mesh_deflection: (n_t, n_mesh) m, dynamic deflection δ of each mesh; empty when not recorded.
    transmission_error: (n_t, n_mesh) m, of every mesh, r_bP φ_P − r_bG φ_G along the transverse line of action, > 0
    under a driving torque; each φ is counted from the nominal rotation in its gear's running direction.
    output_lag: (n_t,) rad by which the output shaft lags behind the input's angle times the speed ratio: the error of
    the whole gearbox, likewise > 0. Both absent when not recorded.
    """

    time: FloatArray
    force: FloatArray
    names: tuple[str, ...]
    positions: FloatArray
    input_speed: FloatArray
    periodic: bool = False
    mesh_deflection: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    transmission_error: FloatArray | None = None
    output_lag: FloatArray | None = None

    def __post_init__(self) -> None:
        time = array(self, "time", float, (None,))
        force = array(self, "force", float, (len(time), None, 3))
        distinct_names(self, "names", force.shape[1])
        array(self, "positions", float, (force.shape[1], 3))
        speed_history(self, len(time))
        if np.size(self.mesh_deflection) == 0:
            object.__setattr__(self, "mesh_deflection", np.empty((len(time), 0)))
        array(self, "mesh_deflection", float, (len(time), None))
        if self.transmission_error is not None:
            array(self, "transmission_error", float, (len(time), None))
        if self.output_lag is not None:
            array(self, "output_lag", float, (len(time),))
        require(isinstance(self.periodic, bool | np.bool_), f"periodic = {self.periodic!r} must be True or False")
        increasing(self, "time")
        require(len(time) >= 2, f"BearingForces.time has {len(time)} samples: at least 2 are needed")
        step = np.diff(time)
        jitter = float(np.abs(step - step.mean()).max() / step.mean())
        require(
            jitter < 1e-4,
            f"BearingForces.time is not uniform (steps differ by {100 * jitter:.3g} % of the mean): resample it first",
        )

    @property
    def sample_rate(self) -> float:
        """Samples per second, Hz."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))

    def recorded(self, quantity: str) -> FloatArray:
        """(n_t, …) `force`, `mesh_deflection`, `transmission_error` or `output_lag`: what spectra and waterfalls take.

        Raises InputError for another name and where the record does not hold it.
        """
        known = ("force", "mesh_deflection", "transmission_error", "output_lag")
        require(quantity in known, f"{quantity!r} is not recorded with bearing forces: choose from {', '.join(known)}")
        value = getattr(self, quantity)
        require(
            value is not None and value.size > 0,
            f"the record holds no {quantity}: it comes from another program or an earlier version; compute it again",
        )
        return np.asarray(value)

    def in_order(self, names: tuple[str, ...]) -> FloatArray:
        """Force (n_t, 3 n_bearing) N with the bearings in the order of `names`, which must be the same ones."""
        return np.asarray(_in_order(self.force, self.names, names).reshape(len(self.time), -1))


@dataclass(frozen=True, eq=False)
class ForceSpectrum(HandOff):
    """Bearing force spectra, single-sided complex peak amplitudes under e^{+jωt}.

    frequency: (n_f,) Hz.  force: (n_f, n_bearing, 3) N.  names: n_bearing.
    input_speed: rad/s of the input shaft at constant speed, 0 when it varies.
    """

    frequency: FloatArray
    force: ComplexArray
    names: tuple[str, ...]
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        force = array(self, "force", complex, (len(frequency), None, 3))
        distinct_names(self, "names", force.shape[1])
        increasing(self, "frequency", 0.0)
        object.__setattr__(self, "input_speed", float(self.input_speed))
        require(
            isfinite(self.input_speed) and self.input_speed >= 0.0,
            f"ForceSpectrum.input_speed = {self.input_speed} rad/s must be finite and not negative: 0 where it varies",
        )

    def in_order(self, names: tuple[str, ...]) -> ComplexArray:
        """Force (n_f, 3 n_bearing) N with the bearings in the order of `names`, which must be the same ones."""
        return _in_order(self.force, self.names, names).reshape(len(self.frequency), -1)


def _in_order(force: Any, given: tuple[str, ...], names: tuple[str, ...]) -> Any:
    """Forces (n, n_bearing, 3) of the bearings `given` in the order of `names`."""
    require(
        isinstance(names, Sequence) and all(isinstance(name, str) for name in names),
        f"{names!r} are no names of bearings: give a sequence of texts",
    )
    unknown, missing = sorted(set(given) - set(names)), sorted(set(names) - set(given))
    require(
        not unknown and not missing,
        f"bearing names differ: the housing has {', '.join(names)}; unknown to it: "
        f"{', '.join(unknown) or 'none'}; without force: {', '.join(missing) or 'none'}",
    )
    return force[:, [given.index(name) for name in names]]
