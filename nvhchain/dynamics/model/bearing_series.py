"""Bearings in series with the residual flexibility of their seats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nvhchain.bearings import StiffnessMatrix
from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray, IntArray

if TYPE_CHECKING:
    from nvhchain.dynamics.model.parts import Bearing


@dataclass(frozen=True, eq=False)
class BearingSeries:
    """Bearings and seats in series; m = motions · n_bearing.

    motions : motions of a bearing: 3 translations, or 5 with the tilts about x and y where a bearing has a model.
    stiffness, damping : (m, m) of the series.
    preload : (m,) force and moment on the seats without displacement of shafts and housing modes (N, N m); None for
        bearings through the origin.
    translations : (3 n_bearing,) rows of the translations.
    residual : (m, m) residual flexibility of the seats.
    """

    motions: int
    stiffness: FloatArray
    damping: FloatArray
    preload: FloatArray | None
    translations: IntArray
    residual: FloatArray


def motions_of(bearings: Sequence[Bearing]) -> int:
    """Return the motions of a bearing: 3 translations, or 5 with the tilts about x and y where one has a model."""
    return 3 if all(bearing.model is None for bearing in bearings) else 5


def bearing_series(bearings: Sequence[Bearing], residual: FloatArray) -> BearingSeries:
    """Return the series of linear bearings and the residual flexibility of their seats.

    residual : (m, m) with the motions of `motions_of`.

    Without models the stiffness is (K_b⁻¹ + R)⁻¹. With T = (I + K_b R)⁻¹, which needs no inverse of K_b, it is
    T K_b. The damping is T C_b Tᵀ. A bearing with the force f₀ at the displacement u₀ has the preload T (f₀ − K_b u₀).

    Raises InputError if the stiffness of a bearing depends on its load, or if the residual makes a series unstable.
    """
    if motions_of(bearings) == 3:
        k_b = np.array([k for b in bearings for k in (b.radial_stiffness, b.radial_stiffness, b.axial_stiffness)])
        c_b = np.array([c for b in bearings for c in (b.damping[0], *b.damping)])
        k_eff = np.linalg.inv(np.diag(1.0 / k_b) + residual)
        k_eff = 0.5 * (k_eff + k_eff.T)
        c_eff = (k_eff / k_b) @ np.diag(c_b) @ (k_eff / k_b).T
        _check_stable(bool((np.linalg.eigvalsh(k_eff) > 0.0).all()))
        return BearingSeries(3, k_eff, c_eff, None, np.arange(len(k_b)), residual)
    size = 5 * len(bearings)
    translations = (5 * np.arange(len(bearings))[:, None] + np.arange(3)).ravel()
    k_b, c_b, apart = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    for i, bearing in enumerate(bearings):
        block = slice(5 * i, 5 * i + 5)
        if not bearing.linear:
            raise InputError(
                f"bearing {bearing.name}: its stiffness depends on its load, which the dynamics take as given: use the "
                "gearbox of nvhchain.dynamics.equilibrium at the torque of the run"
            )
        force, k_b[block, block] = bearing.evaluate(np.zeros(5))
        if isinstance(bearing.model, StiffnessMatrix):
            apart[block] = force
        own = [bearing.radial_damping, bearing.radial_damping, bearing.axial_damping, 0.0, 0.0]
        c_b[block, block] = np.diag(own) + bearing.damping_time * k_b[block, block]
    turned = np.linalg.inv(np.eye(size) + k_b @ residual)
    k_eff = turned @ k_b
    k_eff = 0.5 * (k_eff + k_eff.T)
    lowest, *_, highest = np.linalg.eigvalsh(k_eff)
    _check_stable(lowest >= -1e-9 * highest)
    return BearingSeries(
        5, k_eff, turned @ c_b @ turned.T, turned @ apart if apart.any() else None, translations, residual
    )


def _check_stable(stable: bool) -> None:
    require(
        bool(stable),
        "the housing's seat residual is so negative that bearing and seat in series are unstable: add housing modes",
    )
