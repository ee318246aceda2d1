"""Stated accuracy of hand-offs: errors with unit and meaning, requested limits, and the resulting warnings.

Each class is one kind of accuracy. A step states it for its hand-off; later steps compute with its fields.
docs/developers/add_an_accuracy_field.md explains how to add a field.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from nvhchain.errors import counted, warn_caller
from nvhchain.handoff.base import Accuracy, Doubt, FloatArray, HandOff
from nvhchain.handoff.declared import Label, array, value

CONTACT_LOSS = "contact loss"
"""Kind of the warning of contact loss."""


def warn_of(stated: Accuracy | HandOff) -> None:
    """Issue the warnings of a stated accuracy.

    stated: accuracy, or a hand-off, whose accuracies and those of hand-offs inside count.
    """
    for accuracy in stated.accuracies() if isinstance(stated, HandOff) else (stated,):
        for doubt in accuracy.doubts():
            warn_caller(doubt.text, kind=doubt.kind)


class SurfaceAccuracy(Accuracy):
    """Accuracy of a radiating surface."""

    remeshing_error: float | None = value(
        "1", "error at field points of a surface that was meshed anew, relative to their peak", default=None
    )


class HousingAccuracy(Accuracy):
    """Accuracy of a reduced housing."""

    frequency_error: FloatArray | None = array(
        "1", "mode", "relative error of each natural frequency due to large elements", default=None
    )
    truncation_error_db: float | None = value(
        "dB", "error of the surface velocity due to excluded modes, in the upper three octaves", default=None
    )
    truncation_frequency: FloatArray | None = array(
        "Hz", "truncation_line", "lines of the truncation error", default=None
    )
    truncation_error_at_db: FloatArray | None = array(
        "dB", "truncation_line", "truncation error at lines", default=None
    )
    mapping_frequency: FloatArray | None = array("Hz", "mapping_line", "lines of the mapping error", default=None)
    mapping_error_db: FloatArray | None = array(
        "dB", "mapping_line", "sound power of the radiating faces over that of the skin", default=None
    )
    mapping_tolerance_db: float | None = value("dB", "mapping error that was asked for", default=None)
    missing_flexibility: float | None = value(
        "1", "share of the seats' static flexibility that the given modes do not hold", default=None
    )

    def doubts(self) -> Iterator[Doubt]:
        """Yield warnings of the mapping onto the faces and of missing residual vectors."""
        if self.mapping_error_db is not None and self.mapping_tolerance_db is not None:
            worst = max(self.mapping_error_db.tolist(), key=abs, default=0.0)
            if abs(worst) > self.mapping_tolerance_db:
                yield Doubt(
                    "mapping onto faces",
                    f"the radiating faces miss the sound power of the skin by {worst:+.2g} dB, "
                    f"{self.mapping_tolerance_db:g} dB are tolerated: use smaller faces",
                )
        if self.missing_flexibility:
            yield Doubt(
                "missing flexibility",
                f"modes without residual vectors: about {100 * self.missing_flexibility:.2g} % of the static "
                "flexibility of the seats is excluded; export residual vectors of unit forces at the seats, more "
                "modes, or the solid model where that matters",
            )


class ForceAccuracy(Accuracy):
    """Accuracy of bearing force histories: deflections beyond a mesh law, and contact loss."""

    law_exceeded: tuple[Label, ...] | None = array(
        "", "mesh_exceeding_law", "meshes whose deflections leave their mesh law", default=None
    )
    lowest_deflection: FloatArray | None = array(
        "m", "mesh_exceeding_law", "lowest deflection of its flanks", default=None
    )
    highest_deflection: FloatArray | None = array(
        "m", "mesh_exceeding_law", "highest deflection of its flanks", default=None
    )
    table_lowest: FloatArray | None = array("m", "mesh_exceeding_law", "lower end of its law", default=None)
    table_highest: FloatArray | None = array("m", "mesh_exceeding_law", "upper end of its law", default=None)
    parted: tuple[Label, ...] | None = array("", "parted_mesh", "meshes whose flanks part", default=None)
    parted_time: FloatArray | None = array("s", "parted_mesh", "time without contact", default=None)
    parted_lowest_speed: FloatArray | None = array(
        "rad/s", "parted_mesh", "lowest input speed without contact", default=None
    )
    parted_highest_speed: FloatArray | None = array(
        "rad/s", "parted_mesh", "highest input speed without contact", default=None
    )
    parted_error: float | None = value("1", "expected error of contact loss, relative to the peak force", default=None)
    time_step: float | None = value("s", "time step under contact loss", default=None)
    needed_step: float | None = value("s", "time step that keeps 1e-4 of the peak through contact loss", default=None)
    needed_step_corrected: float | None = value(
        "s", "the same with path_correction, where they are not taken", default=None
    )

    def contact_losses(self) -> list[tuple[str, float, float, float]]:
        """Return mesh, time without contact (s), and the lowest and highest input speed of it (rad/s).

        Speeds that a record does not state are 0 and infinite.
        """
        count = len(self.parted or ())
        ends = (self.parted_lowest_speed, 0.0), (self.parted_highest_speed, np.inf)
        speeds = [np.full(count, unknown) if end is None else end for end, unknown in ends]
        time = np.zeros(count) if self.parted_time is None else self.parted_time
        columns = (column.tolist() for column in (time, *speeds))
        return list(zip(map(str, self.parted or ()), *columns, strict=True))

    def parts_at(self, input_speed: float) -> bool:
        """Return True where flanks part at a speed of the input (rad/s)."""
        near = 1e-9 * abs(input_speed)  # rounding of a mean
        return any(low - near <= input_speed <= high + near for _, _, low, high in self.contact_losses())

    def doubts(self) -> Iterator[Doubt]:
        """Yield warnings of meshes beyond their laws, and of contact loss under long steps."""
        ends = (self.lowest_deflection, self.highest_deflection, self.table_lowest, self.table_highest)
        for mesh, *deflections in zip(
            self.law_exceeded or (), *(() if end is None else 1e6 * end for end in ends), strict=True
        ):
            lowest, highest, low, high = deflections
            yield Doubt(
                "deflection beyond the mesh law",
                f"mesh {mesh}: deflections of {lowest:.4g}…{highest:.4g} µm leave the mesh law, tabulated over "
                f"{low:.4g}…{high:.4g} µm and continued straight beyond: give housing and bearings damping, or "
                "tabulate the law to larger deflections",
            )
        if self.parted_error is None or self.time_step is None or self.needed_step is None:
            return
        if self.time_step <= self.needed_step * (1.0 + 1e-6):
            return
        remedy = f"{1e6 * self.needed_step:g} µs"
        if self.needed_step_corrected is not None:
            remedy += f", or {1e6 * self.needed_step_corrected:g} µs with path_correction"
        for mesh, seconds, _, _ in self.contact_losses():
            yield Doubt(
                CONTACT_LOSS,
                f"mesh {mesh}: its flanks part for {seconds:.3g} s of the record. Steps of {1e6 * self.time_step:.3g} "
                f"µs then leave errors of about {self.parted_error:.1g} of the peak force, more where flanks under "
                f"little load fly far: for 1e-4 take a time_step of {remedy}, and halve it until the forces stay",
            )


class SolverRecord(Accuracy):
    """Solvers and residuals of boundary element systems.

    Notes
    -----
    `direct`, `iterative` and `compressed` are the solvers. The sum of records is that of all systems.
    """

    solvers: tuple[str, ...] | None = array("", "solver", "solvers that were used", default=None)
    residual: float = value(
        "1", "largest residual that an iteration left, relative to its right-hand side", default=0.0
    )
    tolerance: float = value("1", "residual that iterations were asked for; 0 where nothing was iterated", default=0.0)
    condition: float = value("1", "smallest reciprocal condition number of a factorised matrix", default=1.0)

    def __add__(self, other: SolverRecord) -> SolverRecord:
        return SolverRecord(
            tuple(sorted({*(self.solvers or ()), *(other.solvers or ())})),
            max(self.residual, other.residual),
            max(self.tolerance, other.tolerance),
            min(self.condition, other.condition),
        )

    @property
    def provenance(self) -> dict[str, Any]:
        """Record in the form of a provenance."""
        history: dict[str, Any] = {"solver": ", ".join(self.solvers)} if self.solvers else {}
        if self.tolerance:
            history |= {"solver_tolerance": self.tolerance, "solver_residual": self.residual}
        if self.condition < 1.0:
            history["solver_reciprocal_condition"] = self.condition
        return history


class SoundAccuracy(Accuracy):
    """Accuracy of radiated sound and of its operators.

    Notes
    -----
    An error of e dB means a factor 10^(e/20) of the amplitude in either direction. Errors of a mesh hold at the upper
    frequency, at the loudest field points.
    """

    # surface mesh
    upper_frequency: float | None = value("Hz", "frequency at which the errors of the mesh are stated", default=None)
    element_size: float | None = value("m", "element size for which the mesh counts", default=None)
    elements_per_wavelength: float | None = value("1", "elements per wavelength at the upper frequency", default=None)
    asked_elements_per_wavelength: float | None = value("1", "elements per wavelength asked for", default=None)
    expected_error_db: float | None = value("dB", "expected error of mesh or radiation level", default=None)
    asked_error_db: float | None = value("dB", "error of a mesh that is as fine as asked for", default=None)
    expected_error_low_db: float | None = value("dB", "part of it at any frequency, however low", default=None)
    shape_error_db: float | None = value("dB", "part of it where the mesh is coarse for the body", default=None)
    faceting_error_db: float | None = value("dB", "part of it from facets in place of round faces", default=None)
    expected_error_beside_db: float | None = value(
        "dB", "part of it from long triangles beside a small body", default=None
    )
    neighbour_edge_ratio: float | None = value("1", "longest edge beside a small body over its distance", default=None)
    remeshing_error_db: float | None = value("dB", "part of it from meshing the surface anew", default=None)
    clearance: float | None = value("1", "distance of the nearest field point, element edges", default=None)
    expected_error_nearest_db: float | None = value("dB", "expected error at the nearest field point", default=None)
    coarse_share: float | None = value("1", "share of the area in triangles much longer than the rest", default=None)
    even_edge: float | None = value("m", "longest edge of triangles that are not among these", default=None)
    coarse_elements_per_wavelength: float | None = value(
        "1", "elements per wavelength of the longest triangle", default=None
    )
    coarsest_elements_per_wavelength: float | None = value("1", "least of these that carry a wave", default=None)
    expected_error_patch_db: float | None = value(
        "dB", "bound of the error of sound from behind these triangles alone", default=None
    )
    quadrature_error: float | None = value("1", "error of the quadrature, on the surface", default=None)
    asked_quadrature_error: float | None = value("1", "error of the quadrature asked for", default=None)
    fair_singular_order: int | None = value("1", "least singular_order; stated where it is lower", default=None)
    solver_error_db: float | None = value("dB", "part of the expected error from the solver", default=None)
    # resonances of air in openings
    resonance_shift: float | None = value(
        "1", "relative error of the frequencies of resonances of the air in openings", default=None
    )
    resonance_shift_limit: float | None = value(
        "1", "largest shift that needs no search for resonances; stated where none was made", default=None
    )
    resonance_error_db: float | None = value("dB", "largest error of a line beside a resonance", default=None)
    resonance_frequency: float | None = value("Hz", "line of this error", default=None)
    resonance_lines: int | None = value("1", "lines whose error exceeds what was asked for", default=None)
    # master frequencies
    estimated_error_db: float | None = value("dB", "estimated error between chosen masters", default=None)
    tested_error_db: float | None = value("dB", "largest error or change that test masters found", default=None)
    missed_width: float | None = value("Hz", "width of resonances that masters may miss", default=None)
    deciding_points: int | None = value("1", "field points at which the error was estimated", default=None)
    interpolation_error: FloatArray | None = array(
        "1", "point", "largest error of interpolation, relative to the peak of the point", default=None
    )
    interpolation_error_db: float | None = value("dB", "largest error of interpolation of a line", default=None)
    interpolation_frequency: float | None = value("Hz", "line of this error", default=None)
    asked_interpolation_error_db: float | None = value("dB", "error of interpolation asked for", default=None)
    # cancelling parts of motions
    cancellation_error_db: float | None = value("dB", "largest error where parts of a motion cancel", default=None)
    cancellation_frequency: float | None = value("Hz", "line of this error", default=None)
    cancellation_lines: int | None = value("1", "lines whose error exceeds what was asked for", default=None)
    # cheaper levels of radiation
    radiation: str | None = value("", "level of radiation, where it is not boundary elements", default=None)
    lowest_frequency: float | None = value("Hz", "lowest line, for which its errors are stated", default=None)
    size_in_waves: float | None = value("1", "wavenumber times half size of the body there", default=None)
    expected_mean_error_db: float | None = value("dB", "mean error over points and motions, worst body", default=None)
    asked_mean_error_db: float | None = value("dB", "mean error that is tolerated", default=None)
    housing_mean_error_db: float | None = value("dB", "mean error of housings", default=None)
    shaking_error_db: float | None = value("dB", "added where a flat body shakes as a whole", default=None)
    cancelling_error_db: float | None = value(
        "dB", "error of P_3 of a sphere at 0.11, where parts cancel", default=None
    )
    # near field of points and microphones
    nearest_point: int | None = value("1", "index of the nearest field point", default=None)
    nearest_distance: float | None = value("m", "its distance from the middle of the source", default=None)
    needed_distance: float | None = value("m", "distance from which the far field begins", default=None)
    near_field_db: float | None = value("dB", "near field of a dipole at this point and the lowest line", default=None)
    array_radius: float | None = value("m", "radius of the microphone array", default=None)
    array_needed_radius: float | None = value("m", "quarter of a wavelength at the lowest line", default=None)
    array_near_field_db: float | None = value("dB", "near field of a dipole at the array", default=None)
    array_sampling_db: float | None = value("dB", "standard error of the mean over the array", default=None)

    def doubts(self) -> Iterator[Doubt]:
        """Yield warnings of every error above its requested limit."""
        yield from self._mesh_doubts()
        yield from self._resonance_doubts()
        yield from self._line_doubts()
        yield from self._level_doubts()
        yield from self._doubts_nearby()

    def _mesh_doubts(self) -> Iterator[Doubt]:
        size, asked = 1e3 * (self.element_size or 0.0), self.asked_error_db
        if _exceeds(self.shape_error_db, asked):
            yield Doubt(
                "mesh coarse for the body",
                f"surface mesh with elements of {size:.3g} mm is coarse for the body: expect errors of about "
                f"{self.expected_error_low_db:.2g} dB at any frequency; refine it",
            )
        if _exceeds(self.expected_error_beside_db, asked):
            yield Doubt(
                "mesh beside a small body",
                f"a small body lies beside triangles {self.neighbour_edge_ratio:.2g} times as long as they are away "
                f"from its middle: expect errors of about {self.expected_error_beside_db:.2g} dB of its sound at any "
                "frequency; refine them as many times there",
            )
        least = self.coarsest_elements_per_wavelength
        if _exceeds(least, self.coarse_elements_per_wavelength):
            longest = size * (self.elements_per_wavelength or 0.0) / (self.coarse_elements_per_wavelength or 1.0)
            yield Doubt(
                "long triangles",
                f"{100 * (self.coarse_share or 0.0):.2g} % of the area has triangles up to {longest:.3g} mm long, "
                f"{self.coarse_elements_per_wavelength:.2g} elements per wavelength at the upper frequency, where "
                f"{least:g} carry a wave: expect errors of about {self.expected_error_db:.2g} dB, up to "
                f"{self.expected_error_patch_db:.2g} dB of sound from behind them alone; refine them to "
                f"{1e3 * (self.even_edge or 0.0):.3g} mm",
            )
        wanted = self.asked_elements_per_wavelength
        if wanted is not None and _exceeds(wanted, self.elements_per_wavelength):
            yield Doubt(
                "mesh coarse for the band",
                f"surface mesh has {self.elements_per_wavelength:.3g} elements per wavelength at "
                f"{self.upper_frequency:.4g} Hz, {wanted:g} asked: expect errors of about "
                f"{self.expected_error_db:.2g} dB there; refine to "
                f"{size * (self.elements_per_wavelength or 0.0) / wanted:.3g} mm or lower the upper frequency",
            )
        if self.expected_error_nearest_db is not None:
            yield Doubt(
                "field point near the surface",
                f"a field point is {self.clearance:.2g} element edges from the surface: expect errors of about "
                f"{self.expected_error_nearest_db:.2g} dB there, up to 3 dB where the velocity changes from one "
                "element to the next; refine the mesh near it or move it away",
            )
        if _exceeds(self.quadrature_error, self.asked_quadrature_error):
            cause = "needles, sharp edges or thin gaps of the mesh leave"
            remedy = "make triangles less slender, raise singular_order and gap_halvings, or use engine fused"
            if self.fair_singular_order is not None:
                cause, remedy = "too low a singular_order leaves", f"raise it to {self.fair_singular_order} or more"
            yield Doubt(
                "quadrature",
                f"{cause} a relative quadrature error of {self.quadrature_error:.2g} on the surface, "
                f"{self.asked_quadrature_error:g} asked, and pressures there err by several times as much: {remedy}",
            )

    def _resonance_doubts(self) -> Iterator[Doubt]:
        if _exceeds(self.resonance_shift, self.resonance_shift_limit):
            yield Doubt(
                "resonances in openings",
                f"the air in openings of the body may resonate up to {100 * (self.resonance_shift or 0.0):.2g} % "
                "elsewhere than on this mesh, and these masters do not show where: lines that near to a resonance err "
                "by several decibels; interpolate by rational functions between four masters or more, or refine the "
                "surface in its openings",
            )
        if self.resonance_lines:
            yield Doubt(
                "resonances in openings",
                f"the air in openings of the body resonates, and the mesh misses by how much: expect errors up to "
                f"{self.resonance_error_db:.2g} dB, at {self.resonance_frequency:.4g} Hz, and more than "
                f"{self.asked_error_db:.2g} dB at {counted(self.resonance_lines, 'line')}; "
                "refine the surface in its openings",
            )

    def _line_doubts(self) -> Iterator[Doubt]:
        error, reference = self.interpolation_error_db, ""
        if self.interpolation_error is not None and len(self.interpolation_error):
            error = float(20.0 * np.log10(1.0 + self.interpolation_error.max()))
            reference = f" of the peak pressure at field point {self.interpolation_error.argmax()}"
        if _exceeds(error, self.asked_interpolation_error_db):
            yield Doubt(
                "interpolation",
                f"interpolation between master frequencies errs by an estimated {error:.2g} dB{reference} at "
                f"{self.interpolation_frequency:.4g} Hz, {self.asked_interpolation_error_db:g} dB asked: take more "
                "masters, or let the engine choose them",
            )
        if self.cancellation_lines:
            yield Doubt(
                "cancelling motion",
                f"the parts of the motion cancel each other, or the mesh is coarse for waves on the walls, at "
                f"{counted(self.cancellation_lines, 'line')}: expect errors up to "
                f"{self.cancellation_error_db:.2g} dB, at {self.cancellation_frequency:.4g} Hz; "
                "refine the mesh or raise the lower frequency",
            )

    def _level_doubts(self) -> Iterator[Doubt]:
        if not _exceeds(self.expected_mean_error_db, self.asked_mean_error_db):
            return
        flat = self.shaking_error_db is not None
        exact = "unless it is flat and in a baffle, " if flat else ""
        shaking = f" ({self.shaking_error_db:g} dB more where it is flat and shakes as a whole)" if flat else ""
        yield Doubt(
            "level of radiation",
            f"{(self.radiation or '').replace('_', ' ')} at {self.lowest_frequency:.4g} Hz, where wavenumber times "
            f"half size of the body is {self.size_in_waves:.2g}: {exact}expect levels up to "
            f"{self.expected_mean_error_db:.2g} dB too high in the mean ({self.housing_mean_error_db:.2g} dB for a "
            f"housing), {self.expected_error_db:.2g} dB off at single points and in the power of a single "
            f"motion{shaking}, more where its parts cancel ({self.cancelling_error_db:g} dB for P_3 of a sphere at "
            "0.11); choose radiation = 'boundary_elements' or raise the lower frequency",
        )

    def _doubts_nearby(self) -> Iterator[Doubt]:
        if _exceeds(self.needed_distance, self.nearest_distance):
            yield Doubt(
                "near field of a point",
                f"field point {self.nearest_point} is {self.nearest_distance:.3g} m from the source's middle: the "
                f"directivity of a dipole is {self.near_field_db:.2g} dB too high there at the lowest line, and single "
                f"parts of the surface are heard; take {self.needed_distance:.3g} m or more",
            )
        if _exceeds(self.array_needed_radius, self.array_radius):
            share = 0.25 * (self.array_radius or 0.0) / (self.array_needed_radius or 1.0)
            yield Doubt(
                "near field of an array",
                f"array radius {self.array_radius:g} m is {share:.2g} wavelengths at {self.lowest_frequency:.4g} Hz, "
                f"0.25 are needed (ISO 3745): a dipole's power there is {self.array_near_field_db:.2g} dB too high, "
                f"more for higher orders; take {self.array_needed_radius:.3g} m or more, or the surface's power",
            )


def _exceeds(stated: float | None, limit: float | None) -> bool:
    """Return True where both are stated and the first is larger."""
    return stated is not None and limit is not None and stated > limit
