"""Manufacturing deviations of the gears and stages of a case."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.dimensions import Angle, Length
from nvhchain.errors import InputError, require, require_within
from nvhchain.gear import (
    FlankTolerances,
    GearDeviations,
    GearGeometry,
    Ghost,
    Misalignment,
    ToothFlanks,
    drawn_deviations,
    flank_tolerances,
    standard_tolerance,
)
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

LARGEST = 0.5e-3
"""Largest deviation (m); a larger one has a wrong unit."""
LARGEST_SHIFT = 0.1e-3
"""Largest tolerance of a centre distance to either side (m), up to which the dynamics takes the axes as drawn."""
_PITCHES = ("single_pitch", "cumulative_pitch", "run_out")
_SHAPES = ("profile_slope", "profile_form", "helix_slope", "helix_form")
COLUMNS = ("tooth", "profile", "face", "deviation_um")
"""Columns of a file of measured topography."""


@dataclass(frozen=True)
class GhostOrder:
    """Undulation of all flanks: amplitude × cos(order × angle of the gear + phase) along the normal.

    Parameters
    ----------
    order : float
        Waves per turn of the gear.
    amplitude : float
        Amplitude (m).
    phase : float
        Phase (rad).
    """

    order: float
    amplitude: Length
    phase: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(0 < self.order <= 1e4, f"ghost order = {self.order:g} is outside 0…10000: give waves per turn")
        require(
            self.order == round(self.order),
            f"ghost order = {self.order:g} must be whole: flanks repeat after a turn of the gear",
        )
        _check_size("ghost amplitude", self.amplitude)


@dataclass(frozen=True)
class Topography:
    """Measured flanks: material along the normal on a grid of every tooth, or of one for all.

    Parameters
    ----------
    file : str
        Path of a CSV table, relative to the case, with the columns tooth, profile, face and deviation_um. Teeth count
        from 0 in the order of mesh; one tooth stands for all. `profile` goes from 0 at the form circle to 1 at the tip
        circle, in even steps of rolled length; `face` from 0 at −z to 1 at +z.
    """

    file: str

    def __post_init__(self) -> None:
        check_fields(self)
        require(bool(self.file), "topography: file is empty: give the path of a table")

    def read(self) -> FloatArray:
        """Return the material (n_tooth or 1, n_profile, n_face) (m)."""
        path = Path(self.file)
        try:
            with path.open(newline="", encoding="utf-8-sig") as lines:
                table = csv.reader(lines)
                header = tuple(name.strip() for name in next(table, []))
                rows = [[float(cell) for cell in row] for row in table if row]
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
        except (UnicodeDecodeError, ValueError) as error:
            raise InputError(f"{path}: no table of numbers ({error}): give columns {', '.join(COLUMNS)}") from None
        require(
            header == COLUMNS and all(len(row) == len(COLUMNS) for row in rows) and bool(rows),
            f"{path}: columns {', '.join(header)[:80]}: give {', '.join(COLUMNS)}, one row per point",
        )
        values = np.array(rows)
        wrong = np.flatnonzero(~(np.isfinite(values).all(axis=1) & (np.abs(values[:, 3]) <= 1e6 * LARGEST)))
        if len(wrong):
            row = ", ".join(f"{value:g}" for value in values[wrong[0]])
            raise InputError(
                f"{path}: row {wrong[0] + 2} ({row}) is not finite, or its deviation is beyond ±{1e6 * LARGEST:g} µm: "
                "repair it, or give µm"
            )
        axes = [np.unique(values[:, column]) for column in range(3)]
        sizes = tuple(len(axis) for axis in axes)
        require(
            len(values) == np.prod(sizes) == len(np.unique(values[:, :3], axis=0)),
            f"{path}: {len(values)} points are no grid of {' × '.join(map(str, sizes))} teeth, profile and face: give "
            "every point once",
        )
        for name, axis in zip(COLUMNS[1:3], axes[1:], strict=True):
            require(
                len(axis) > 1 and np.allclose(axis, np.linspace(0.0, 1.0, len(axis)), atol=1e-6),
                f"{path}: {name} must go from 0 to 1 in even steps, at least two",
            )
        require(np.array_equal(axes[0], np.arange(sizes[0])), f"{path}: teeth must be 0, 1, 2, …")
        order = np.lexsort((values[:, 2], values[:, 1], values[:, 0]))
        return np.asarray(1e-6 * values[order, 3].reshape(sizes))


@dataclass(frozen=True)
class Deviations:
    """Manufacturing deviations of a gear: drawn within a tolerance class, and values in place of the drawn ones.

    Parameters
    ----------
    tolerance_class : int, optional
        Class of ISO 1328-1:2013, 1 to 11. Without one, only what has a value deviates.
    seed : int
        Number of the draw; the same number gives the same gear.
    used : float
        Part of the tolerances of the class that the gear uses up; 1 is a gear at its limits.
    single_pitch, cumulative_pitch : float, optional
        Largest single pitch deviation f_pt and range of the cumulative one F_p of the draw (m).
    pitch : tuple of float
        Place of the drive flank of every tooth (m) in the order of mesh, an arc of the reference circle, in place of a
        draw. It is > 0 towards the mating flank. The coast flanks move along with their teeth.
    run_out : float, optional
        Radial run-out F_r (m), twice the eccentricity.
    run_out_phase : float, optional
        Angle of the eccentricity from the mating axis at time 0, in running direction (rad); drawn by default.
    profile_slope : float, optional
        Slope f_Hα of all teeth (m), > 0 where material is added at the tip.
    profile_form : float, optional
        Form deviation f_fα of all teeth (m), the range of a wave.
    helix_slope : float, optional
        Slope f_Hβ of all teeth (m), > 0 where material is added at +z.
    helix_form : float, optional
        Form deviation f_fβ of all teeth (m), the range of a wave.
    ghosts : tuple of GhostOrder
        Undulations by the generating machine.
    topography : Topography, optional
        Measured drive flanks, in addition.
    first_tooth : int
        Tooth at the pitch point at time 0: the phase of assembly.
    """

    tolerance_class: int | None = None
    seed: int = 1
    used: float = 1.0
    single_pitch: Length | None = None
    cumulative_pitch: Length | None = None
    pitch: tuple[Length, ...] = ()
    run_out: Length | None = None
    run_out_phase: Angle | None = None
    profile_slope: Length | None = None
    profile_form: Length | None = None
    helix_slope: Length | None = None
    helix_form: Length | None = None
    ghosts: tuple[GhostOrder, ...] = ()
    topography: Topography | None = None
    first_tooth: int = 0

    def __post_init__(self) -> None:
        check_fields(self)
        require(self.seed >= 0, f"deviations: seed = {self.seed} must be 0 or more")
        require_within("deviations: used", self.used, 0, 10, "", "1 is a gear at the limits of its class")
        for name in (*_PITCHES, *_SHAPES):
            value, signed = getattr(self, name), name.endswith("slope")
            require(signed or value is None or value >= 0.0, f"deviations: {name} = {value} m must be 0 or more")
            _check_size(name, value)
        for value in self.pitch:
            _check_size("pitch", value)
        require(
            not self.pitch or (self.single_pitch is None and self.cumulative_pitch is None),
            "deviations: pitch states every tooth: leave single_pitch and cumulative_pitch out",
        )

    def gear_deviations(self, geometry: GearGeometry, *, drives: bool) -> GearDeviations:
        """Return the deviations of a gear.

        drives: True for the pinion of a stage.
        """
        drawn = drawn_deviations(
            geometry, self.limits(geometry), seed=self.seed, drives=drives, angle=self.run_out_phase
        )
        require(
            len(self.pitch) in (0, geometry.teeth),
            f"pitch has {len(self.pitch)} entries: give one for each of {geometry.teeth} teeth",
        )
        drive, coast = (self._stated(flanks, sign) for flanks, sign in ((drawn.drive, 1.0), (drawn.coast, -1.0)))
        if self.topography is not None:
            drive = replace(drive, topography=self.topography.read())
        return replace(
            drawn,
            drive=drive,
            coast=coast,
            eccentricity=drawn.eccentricity if self.run_out is None else 0.5 * self.run_out,
            ghosts=tuple(Ghost(one.order, one.amplitude, one.phase) for one in self.ghosts),
            first_tooth=self.first_tooth,
        )

    def limits(self, geometry: GearGeometry) -> FlankTolerances:
        """Return the tolerances that a draw fills (m)."""
        if self.tolerance_class is None:
            limits = FlankTolerances(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        else:
            limits = flank_tolerances(geometry, self.tolerance_class).scaled(self.used)
        values = {
            "single_pitch": 0.0 if self.pitch else self.single_pitch,
            "cumulative_pitch": self.cumulative_pitch,
            "run_out": self.run_out,
        }
        limits = replace(limits, **{name: value for name, value in values.items() if value is not None})
        if self.run_out is not None and self.cumulative_pitch is None:
            return replace(limits, cumulative_pitch=inf)  # the run-out is stated
        if self.cumulative_pitch is not None and self.run_out is None and self.tolerance_class is None:
            return replace(limits, run_out=self.cumulative_pitch)
        return limits

    def _stated(self, flanks: ToothFlanks, sign: float) -> ToothFlanks:
        """Return flanks with the values that the case gives."""
        given: dict[str, Any] = {
            name: np.full(len(flanks.pitch), value) for name in _SHAPES if (value := getattr(self, name)) is not None
        }
        if self.pitch:
            given["pitch"] = sign * np.array(self.pitch)
        return replace(flanks, **given)

    def words(self, geometry: GearGeometry) -> str:
        """Return the deviations in words."""
        parts = []
        if self.tolerance_class is not None:
            limits = flank_tolerances(geometry, self.tolerance_class)
            parts.append(
                f"ISO 1328-1 class {self.tolerance_class}, {100 * self.used:g} % used, seed {self.seed}: f_pT "
                f"{1e6 * limits.single_pitch:g}, F_pT {1e6 * limits.cumulative_pitch:g}, F_rT "
                f"{1e6 * limits.run_out:g}, f_HαT {1e6 * limits.profile_slope:g}, f_HβT "
                f"{1e6 * limits.helix_slope:g} µm"
            )
        sizes = {name: getattr(self, name) for name in (*_PITCHES, *_SHAPES)}
        parts += [f"{name} {1e6 * value:g} µm" for name, value in sizes.items() if value is not None]
        parts += [f"pitch of {len(self.pitch)} teeth"] if self.pitch else []
        parts += [f"ghost order {one.order:g} of {1e6 * one.amplitude:g} µm" for one in self.ghosts]
        parts += [f"topography {Path(self.topography.file).name}"] if self.topography else []
        return "; ".join(parts) or "none"


@dataclass(frozen=True)
class StageTolerances:
    """Tolerances of the axes of a stage, within which a draw lies.

    Parameters
    ----------
    centre_distance : float, optional
        Largest change of the centre distance to either side (m).
    centre_distance_grade : int, optional
        IT grade of ISO 286 for the centre distance, 5 to 11, in place of a value: JS, half to either side.
    misalignment : Misalignment
        Largest angles of the axes to either side (rad).
    seed : int
        Number of the draw, even within the tolerances.
    """

    centre_distance: Length | None = None
    centre_distance_grade: int | None = None
    misalignment: Misalignment = Misalignment()  # noqa: RUF009 (frozen)
    seed: int = 1

    def __post_init__(self) -> None:
        check_fields(self)
        require(self.seed >= 0, f"tolerances: seed = {self.seed} must be 0 or more")
        require(
            self.centre_distance is None or self.centre_distance_grade is None,
            "tolerances: give centre_distance or centre_distance_grade, not both",
        )
        sizes = {"centre_distance": self.centre_distance, **vars(self.misalignment)}
        for name, value in sizes.items():
            require(value is None or value >= 0.0, f"tolerances: {name} = {value} must be 0 or more: it is ±")
        _check_size("centre_distance", self.centre_distance)

    def drawn(self, centre_distance: float) -> tuple[float, Misalignment]:
        """Return a centre distance (m) and the angles of the axes within the tolerances."""
        half = self.centre_distance or 0.0
        if self.centre_distance_grade is not None:
            half = 0.5 * standard_tolerance(centre_distance, self.centre_distance_grade)
        require(
            half <= LARGEST_SHIFT,
            f"tolerances: centre_distance ± {1e6 * half:g} µm is beyond ±{1e6 * LARGEST_SHIFT:g} µm: take a finer "
            "grade, or another centre distance of stage and shafts",
        )
        shares = np.random.default_rng(self.seed).uniform(-1.0, 1.0, 3)
        change, plane_tilt, normal = (
            float(share * size)
            for share, size in zip(shares, (half, self.misalignment.in_plane, self.misalignment.normal), strict=True)
        )
        return centre_distance + change, Misalignment(plane_tilt, normal)


def _check_size(name: str, value: float | None) -> None:
    require(
        value is None or abs(value) <= LARGEST,
        f"deviations: {name} = {value} m is beyond ±{LARGEST:g} m: give it in m",
    )
