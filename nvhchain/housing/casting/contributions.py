"""Contributions of modes and panels of the housing to the sound pressure at a point, p = Σ p_i; its panels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.errors import counted, require
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    IntArray,
    ModalTransferVectors,
    ReducedHousing,
    Surface,
    SurfaceVelocity,
)
from nvhchain.housing.casting.casting import REAR, Casting
from nvhchain.housing.casting.mesh import mounting_plane_faces
from nvhchain.housing.modes.response import modal_displacement


@dataclass(frozen=True, eq=False)
class Contributions:
    """Parts of a pressure.

    frequency: (n_f,) frequencies (Hz).
    points: (n_point, 3) field points (m).
    names: names of the n_part parts.
    pressure: (n_f, n_point, n_part) complex pressure (Pa); its sum over the parts is the total pressure.
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
        projection = (self.pressure * np.conj(total)[:, :, None]).real
        return np.asarray(projection / np.where(power > 0, power, 1.0)[:, :, None])


def modal_contributions(
    modal: ModalTransferVectors, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> Contributions:
    """Return the pressure by mode, named by number and natural frequency; all excluded modes come last.

    Raises InputError if the lines of the load differ from those of `modal`, and for another housing.
    """
    require(
        modal.housing == housing.content_hash, "the modal transfer vectors belong to another housing: make them again"
    )
    lines = force_spectrum.frequency
    require(
        len(lines) == len(modal.frequency) and np.allclose(lines, modal.frequency, rtol=1e-9),
        f"the load has {counted(len(lines), 'line')}, the modal transfer vectors {len(modal.frequency)}: "
        "make them at its lines",
    )
    force = force_spectrum.sort_bearings(housing.names, housing.motions)
    rate = 2j * np.pi * lines[:, None]
    modes = modal.modes * (rate * modal_displacement(housing, lines, force))[:, None, :]
    residual = modal.residual.reshape(*modal.residual.shape[:2], -1)
    natural = housing.mode_count
    rest = np.einsum("fpc,fc->fp", residual, rate * force) + modes[:, :, natural:].sum(axis=2)
    modes = modes[:, :, :natural]
    names = (*mode_names(housing), "residual")
    return Contributions(lines, modal.points, names, np.concatenate([modes, rest[:, :, None]], axis=2))


def mode_names(housing: ReducedHousing) -> list[str]:
    """Return the names of natural modes: their numbers and frequencies."""
    natural = housing.natural_frequency[: housing.mode_count]
    return [f"mode {number}, {frequency:.0f} Hz" for number, frequency in enumerate(natural, start=1)]


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


_SAME_PLACE = 1e-9
"""Largest difference of two distances to node groups that count as one, over the surface's extent."""


@dataclass(frozen=True, eq=False)
class Panels:
    """Names of the panels, and the number (n_face,) of the panel of each face."""

    names: tuple[str, ...]
    part: IntArray

    def __post_init__(self) -> None:
        require(len(set(self.names)) == len(self.names) > 0, f"panels: names must be distinct, got {self.names}")
        require(
            bool((self.part >= 0).all() and (self.part < len(self.names)).all()),
            f"panels: a face belongs to none of the {len(self.names)} parts",
        )


def casting_panels(casting: Casting, surface: Surface) -> Panels:
    """Return rear bosses by bearing, rear wall, flange, mounting side, and the side wall by its direction."""
    centre, normal = surface.centroids, surface.normals
    names = ["side wall +x", "side wall −x", "side wall +y", "side wall −y", "rear wall", "flange", "mounting side"]
    facing_x = np.abs(normal[:, 0]) >= np.abs(normal[:, 1])
    part = np.where(facing_x, np.where(normal[:, 0] >= 0, 0, 1), np.where(normal[:, 1] >= 0, 2, 3))
    edge = surface.areas.mean() ** 0.5
    part[centre[:, 2] > casting.depth - casting.chamfer] = 4
    part[(centre[:, 2] < casting.flange_thickness + 0.25 * edge) & (np.abs(normal[:, 2]) > 0.5)] = 5
    part[centre[:, 2] < 0.9 * casting.flange_thickness] = 5
    part[mounting_plane_faces(surface)] = 6
    for bore in casting.bores_in(REAR):
        reach = bore.radius + casting.boss_thickness + 0.1 * edge
        distance = np.hypot(centre[:, 0] - bore.centre[0], centre[:, 1] - bore.centre[1])
        part[(distance < reach) & (centre[:, 2] > casting.depth - 0.1 * edge)] = len(names)
        names.append(f"boss {bore.name}")
    return Panels(tuple(names), part)


def group_panels(surface: Surface, groups: Mapping[str, FloatArray]) -> Panels:
    """Return panels from `groups`, name → points (n, 3) m.

    Each face belongs to the group of its nearest point, and to the smallest of several such groups.
    """
    require(len(groups) > 0, "no groups are given: at least one is needed")
    distance = np.array([cKDTree(points).query(surface.centroids)[0] for points in groups.values()])
    near = distance <= distance.min(axis=0) + _SAME_PLACE * np.ptp(surface.vertices, axis=0).max()
    size = np.array([len(points) for points in groups.values()])
    return Panels(tuple(groups), np.where(near, size[:, None], size.max() + 1).argmin(axis=0))
