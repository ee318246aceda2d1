"""Relative error of a result's lines by order of the input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.handoff import FloatArray

TOLERANCE = 1e-6
"""Relative difference of orders that count as equal."""

DECIMALS = 4
"""Decimal digits of relative errors."""

LARGEST = 10.0
"""Largest relative error of an order."""


@dataclass(frozen=True)
class OrderError:
    """Relative errors of amplitudes at the orders of the meshes, and their mean.

    orders: order of the input and its relative error.
    mean: relative error of all other orders.
    """

    orders: tuple[tuple[float, float], ...]
    mean: float

    @classmethod
    def rounded(cls, orders: FloatArray, error: FloatArray, mean: float) -> OrderError:
        """Return the errors (n,) of orders (n,), rounded and limited."""
        capped = np.round(np.minimum(error, LARGEST), DECIMALS)
        return cls(tuple(zip(orders.tolist(), capped.tolist(), strict=True)), round(mean, DECIMALS))

    def divided(self, divisor: float) -> OrderError:
        """Return the errors divided by a number."""
        return OrderError(tuple((order, error / divisor) for order, error in self.orders), self.mean / divisor)

    def errors(self, orders: FloatArray) -> FloatArray:
        """Return the relative errors (n,) of orders (n,)."""
        if not self.orders:
            return np.full(np.shape(orders), self.mean)
        known, error = np.array(self.orders).T
        nearest = np.abs(orders[:, None] - known).argmin(axis=1)
        return np.where(np.abs(orders - known[nearest]) < TOLERANCE * orders, error[nearest], self.mean)


NO_ERROR = OrderError((), 0.0)
"""Error of a model that leaves nothing out."""
