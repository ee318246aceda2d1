"""Contributions of each mode and each panel of the housing to the sound pressure at a point: p = Σ p_i."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    ModalTransferVectors,
    ReducedHousing,
    SurfaceVelocity,
)
from nvhchain.housing.casting.panels import Panels
from nvhchain.housing.modes.response import modal_displacement


@dataclass(frozen=True, eq=False)
class Contributions:
    """Parts of a pressure.

    Parameters
    ----------
    frequency : (n_f,) frequencies (Hz).
    points : (n_point, 3) field points (m).
    names : names of the n_part parts.
    pressure : (n_f, n_point, n_part) complex pressure (Pa); its sum over the parts is the total pressure.
    """

    frequency: FloatArray
    points: FloatArray
    names: tuple[str, ...]
    pressure: ComplexArray

    @property
    def total(self) -> ComplexArray:
        """Total pressure (n_f, n_point) Pa."""
        return np.asarray(self.pressure.sum(axis=2))

    @property
    def shares(self) -> FloatArray:
        """Shares Re(p_i p*) / |p|² (n_f, n_point, n_part): their sum is one; a part that cancels others is negative."""
        total = self.total
        power = np.abs(total) ** 2
        along = (self.pressure * np.conj(total)[:, :, None]).real
        return np.asarray(along / np.where(power > 0, power, 1.0)[:, :, None])


def modal_contributions(
    modal: ModalTransferVectors, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> Contributions:
    """Return the pressure by mode, named by number and natural frequency; the residual flexibility comes last.

    Raises InputError if the lines of the load differ from those of `modal`, and for another housing.
    """
    require(
        modal.housing == housing.content_hash, "the modal transfer vectors belong to another housing: make them again"
    )
    lines = force_spectrum.frequency
    require(
        len(lines) == len(modal.frequency) and np.allclose(lines, modal.frequency, rtol=1e-9),
        f"the load has {len(lines)} lines, the modal transfer vectors {len(modal.frequency)}: make them at its lines",
    )
    force = force_spectrum.sort_bearings(housing.names)
    rate = 2j * np.pi * lines[:, None]
    modes = modal.modes * (rate * modal_displacement(housing, lines, force))[:, None, :]
    residual = modal.residual.reshape(*modal.residual.shape[:2], -1)
    rest = np.einsum("fpc,fc->fp", residual, rate * force)
    names = [f"mode {i}, {f:.0f} Hz" for i, f in enumerate(housing.natural_frequency, start=1)]
    return Contributions(lines, modal.points, (*names, "residual"), np.concatenate([modes, rest[:, :, None]], axis=2))


def panel_contributions(
    velocity: SurfaceVelocity, panels: Panels, radiate: Callable[[SurfaceVelocity], FieldPressure]
) -> Contributions:
    """Return the pressure by panel: each radiates alone while the others are rigid and at rest.

    radiate : function from surface velocity to pressure, such as `partial(nvhchain.acoustics.radiate, vectors)`.
    """
    require(
        len(panels.part) == len(velocity.surface.triangles),
        f"the panels cover {len(panels.part)} faces, the surface has {len(velocity.surface.triangles)}",
    )
    parts = []
    for number in range(len(panels.names)):
        moving = np.where(panels.part == number, velocity.normal_velocity, 0.0)
        parts.append(radiate(velocity.replace(normal_velocity=moving)))
    pressure = np.stack([part.pressure for part in parts], axis=2)
    return Contributions(parts[0].frequency, parts[0].points, panels.names, pressure)
