"""Expected error of a boundary element result before the solution, with warnings above the requested accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress, permutations

import numpy as np

from nvhchain.acoustics.interpolation.adaptive import error_decibel
from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.surfaces.clearance import SHIFT, clearances, resonance_shift
from nvhchain.acoustics.surfaces.surface import (
    LOCAL_COARSENING,
    MESH_ERROR,
    MESH_SCATTER,
    NEEDLE_SHARE,
    SHARP_ANGLE,
    check_mesh,
    edge_table,
    element_sizes,
    needle_share,
    width_to_length,
)
from nvhchain.acoustics.systems.engines import FUSED, Engine
from nvhchain.conventions import Air
from nvhchain.errors import warn_caller
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, RigidPlane, SoundAccuracy, Surface, warn_of

FAINT = 1e-6
"""A-weighted power of a line of sound, relative to the strongest, below which nobody hears it beside that one."""

FACETS = 0.32
"""Error of facets at field points for a round body with its own velocity, relative to the peak. It is relative to the
mean square of the angle (rad) between neighbouring triangles. Measured (docs/measured/acoustics/surfaces.md): 0.13 for
facets that enclose the body's volume, up to 1.1 for corners on the body."""

COARSENESS = 0.03
"""Error at low frequency relative to the peak at field points, over the square of the mean edge. The edge is in radii
of the sphere of equal area, without the excess of the body's length over its width. It is 0.002 for monopoles and 0.07
for dipoles in the same measurements. Strips 1 to 16 times as long as wide with four edges across: 0.12 to 0.19 dB."""

FIELD_POINT_CLEARANCE = 0.5
"""Clearance (element edges) below which a field point is affected by single elements."""

FIELD_POINT_FACTOR = 2.0
"""Ratio of the error next to the surface to that at far field points: 1.3 to 2.4 in the same measurements."""

FIELD_POINT_FLOOR = 0.005
"""Relative error next to the surface at low frequency, due to the constant velocity on each element: 0.3 to 1.3 % in
the same measurements."""

NEIGHBOUR_ERROR = 0.015
"""Error of the sound of a small body that shakes towards another one, relative to its peak. It is relative to the
square of the longest edge there, in distances from the small body's middle, minus one. It is 0.39 to 4.2 times the
measured error. A body that shakes along the other one has a tenth of it, a pulsating body less
(docs/measured/acoustics/small_bodies.md)."""

QUADRATURE_GROWTH = 2.0
"""Ratio of the error at field points to that of constant and linear pressures on the surface. It is 0.01 to 0.5 in
docs/measured/acoustics/quadrature.md. At the coarse edges of wedges of 5 and 20 degrees it is one to ten, with the
error of the mesh."""

NEEDLES = 2.5
"""Growth of the error if needles take more than `NEEDLE_SHARE` of the area. Point sources in cylinders of 64 needles at
300 to 1000 Hz have 0.2 to 2.2 times the error stated for other meshes with the same edges."""

SLOW_SECONDS = 10.0
"""Processor time (s) per frequency for narrow gaps and needles above which a warning is given."""


def expected_accuracy(
    surface: Surface,
    points: FloatArray | None,
    f_max: float,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: Engine = FUSED,
    plane: RigidPlane | None = None,
) -> SoundAccuracy:
    """Return the expected accuracy of mesh and field points at the upper frequency `f_max` (Hz).

    The errors of `check_mesh` apply. The worst of several bodies counts: the sound may come from one of them alone.

    elements_per_wavelength : elements per wavelength at `f_max`.
    expected_error_db : error at the loudest field points, including the next five.
    expected_error_low_db : error at any low frequency, including the next three.
    faceting_error_db : error of facets in place of round faces. Triangles that meet at more than 40° form an edge of
        the body.
    expected_error_beside_db : error of coarse triangles beside a small body (`neighbour_edge_ratio`).
    remeshing_error_db : error of a remeshed surface.
    expected_error_patch_db, coarse_share, coarse_elements_per_wavelength : present for triangles longer than
        `LOCAL_COARSENING` permits. The first is a bound on the error of sound from behind these triangles alone. The
        others are their share of the area and the elements per wavelength of the longest one. Their error
        (`patch_error`) is part of `expected_error_db`. The error of the nearest points counts as if they lay next to
        the longest triangle.
    resonance_shift : relative frequency error of resonances of the air in openings (`resonance_shift`), no part of
        `expected_error_db`. `radiate` and `power_from_waves` state its effect on levels (`resonance_error_db`).
    clearance, expected_error_nearest_db : present for a point nearer than half an element edge: its clearance in
        edges, and the error there at its own pressure. They hold for motions shared by neighbouring elements. A
        single moving element errs by 2.7 dB next to it and by 0.6 dB half an edge away.
    quadrature_error : relative error of constant and linear pressures on the surface. Present for needles, edges
        sharper than 60°, a `singular_order` below 3, and gaps narrower than the engine resolves (`bempp` cuts no
        triangles). Other surface pressures err by up to eight times as much, sixty times if all triangles are
        needles. Their sound errs far less (docs/measured/acoustics/quadrature.md). Twice this error is part of
        `expected_error_low_db`.

    AccuracyWarning if the mesh is coarser than `fidelity.elements_per_wavelength`, or as coarse relative to its own
    size. If triangles of a coarse patch have less than `fidelity.coarsest_elements_per_wavelength` on their longest
    edge. If a point is that near, or the quadrature error exceeds `fidelity.quadrature_error`. RuntimeWarning if gaps
    and needles cost more than `SLOW_SECONDS`.

    An error of e dB means a factor 10^(e/20) in either direction. Silent directions are worse, and so are motions whose
    parts cancel each other. For these, `radiate`, `solve_direct` and `sound_power` state `cancellation_error_db`. Both
    together are an estimate, not a bound: boxes at 4.5 elements per wavelength erred by up to twice as much.
    """
    if f_max <= 0:
        return SoundAccuracy()
    check_mesh(surface, f_max, air, fidelity)
    bodies, wavelength = [body for _, body in split_bodies(surface)], air.speed_of_sound / f_max
    sizes = [element_sizes(body) for body in bodies]
    size = max(max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING) for mean, coarsest in sizes)
    elements_per_wavelength = wavelength / size
    facets = [FACETS * mean_square_angle(body) for body in bodies]
    shapes = [
        facet_error + COARSENESS * mean**2 * 4.0 * np.pi / _compact_area(body)
        for body, facet_error, (mean, _) in zip(bodies, facets, sizes, strict=True)
    ]
    worst = int(np.argmax(shapes))
    faceting, coarse = facets[worst], shapes[worst]
    quadrature = _quadrature_accuracy(surface, fidelity, engine)
    ratio = neighbour_edge_ratio(bodies)
    neighbour_error = min(NEIGHBOUR_ERROR * max(ratio**2 - 1.0, 0.0), 1.0)
    remeshing = surface.accuracy.remeshing_error or 0.0
    low = coarse + neighbour_error + remeshing + QUADRATURE_GROWTH * (quadrature.quadrature_error or 0.0)
    patch, longest_error = (
        max(errors) for errors in zip(*(patch_error(body, size, wavelength) for body in bodies), strict=True)
    )
    growth = NEEDLES if max(map(needle_share, bodies)) > NEEDLE_SHARE else 1.0
    low *= growth
    error = growth * MESH_ERROR / elements_per_wavelength**2 + low + patch
    expected = SoundAccuracy(
        upper_frequency=f_max,
        element_size=size,
        elements_per_wavelength=elements_per_wavelength,
        asked_elements_per_wavelength=fidelity.elements_per_wavelength,
        expected_error_db=error_decibel(error),
        asked_error_db=error_decibel(MESH_ERROR / fidelity.elements_per_wavelength**2),
        expected_error_low_db=error_decibel(low),
        shape_error_db=error_decibel(coarse),
        faceting_error_db=error_decibel(faceting) if faceting > 0 else None,
        expected_error_beside_db=error_decibel(neighbour_error) if neighbour_error > 0 else None,
        neighbour_edge_ratio=ratio if neighbour_error > 0 else None,
        remeshing_error_db=error_decibel(remeshing) if remeshing > 0 else None,
        resonance_shift=resonance_shift(surface, plane) or None,
    )
    expected |= quadrature
    if patch > 0:
        expected |= _patch(surface, size, wavelength, FIELD_POINT_FACTOR * (error + longest_error), fidelity)
    clearance = np.inf if points is None else float(clearances(surface, points, FIELD_POINT_CLEARANCE).min())
    if clearance < FIELD_POINT_CLEARANCE:
        near = error_decibel(FIELD_POINT_FACTOR * (error + longest_error) + FIELD_POINT_FLOOR)
        expected |= SoundAccuracy(clearance=clearance, expected_error_nearest_db=near)
    warn_of(expected)
    return expected


def needle_seconds(surface: Surface, fidelity: AcousticsFidelity) -> tuple[float, float]:
    """Return the processor time (s) of needles and narrow gaps in the fused engine: at every frequency, and once."""
    from nvhchain.acoustics.fused.closure_check import gap_cost

    *_, seconds, once = gap_cost(surface, fidelity)
    return seconds, once


def neighbour_edge_ratio(bodies: Sequence[Surface]) -> float:
    """Return the largest ratio of a triangle's edge to its distance from the middle of another body.

    If it is larger, the radius of the sphere of that body's area replaces the distance. The area counts as much of the
    body's length as it is wide.
    """
    radii = [np.sqrt(_compact_area(body) / (4.0 * np.pi)) for body in bodies]
    worst = 0.0
    for (small, radius), (large, _) in permutations(zip(bodies, radii, strict=True), 2):
        most = float(large.longest_edges.max() / radius)
        if most > max(worst, 1.0):
            middle = small.areas @ small.centroids / small.areas.sum()
            worst = max(worst, 1.0 / max(1.0 / most, clearances(large, middle[None])[0]))
    return worst


def _compact_area(body: Surface) -> float:
    """Return the area (m²) of a body, with as much of its length as it is wide."""
    area = float(body.areas.sum())
    return area * float(width_to_length(body.centroids, body.areas[:, None] / area)[0])


def patch_error(surface: Surface, size: float, wavelength: float) -> tuple[float, float]:
    """Return errors at field points due to triangles much coarser than the rest: of all of them, of the longest one.

    size : element size (m) of the mesh.
    wavelength : m.

    Errors are relative to the peak. They are zero for even meshes.

    A triangle longer than `LOCAL_COARSENING` sizes errs by `MESH_ERROR` (longest edge/wavelength)² of its radiation,
    less the value of the longest edge permitted. For sound of irregular phase, the root of the area-weighted mean
    square counts. Velocities are means over the faces. Those at the centroids of a cap alone would add up to 0.3 at any
    frequency.

    Measured with sources inside a sphere with a cap of 4.7 % at 3 and 1.5 elements per wavelength of the cap: 0.029 and
    0.115 stated with the rest of the mesh. The true errors were 0.030 and 0.154 at 0.4 radii behind the cap. They were
    2.3 times as much at a quarter and 4.8 times at a tenth of the radius. All were less than the stated error of the
    cap alone.
    """
    squares = (surface.longest_edges**2 - (LOCAL_COARSENING * size) ** 2).clip(0.0)
    errors = MESH_ERROR * squares / wavelength**2
    return float(np.sqrt(surface.areas @ errors**2 / surface.areas.sum())), float(errors.max())


def _patch(
    surface: Surface, size: float, wavelength: float, alone: float, fidelity: AcousticsFidelity
) -> SoundAccuracy:
    """Accuracy for triangles much coarser than the rest.  alone: error of sound from behind these alone."""
    even = LOCAL_COARSENING * size
    return SoundAccuracy(
        coarse_share=float(surface.areas[surface.longest_edges > even].sum() / surface.areas.sum()),
        even_edge=even,
        coarse_elements_per_wavelength=wavelength / float(surface.longest_edges.max()),
        coarsest_elements_per_wavelength=fidelity.coarsest_elements_per_wavelength,
        expected_error_patch_db=error_decibel(alone),
    )


def largest_interpolation_error(error: FloatArray, frequency: FloatArray, fidelity: AcousticsFidelity) -> SoundAccuracy:
    """Return the accuracy for the largest of the interpolation errors (n,).

    frequency : (n,) Hz, frequency of each error.
    """
    worst = int(error.argmax())
    return SoundAccuracy(
        interpolation_error_db=error_decibel(float(error[worst])),
        interpolation_frequency=float(frequency[worst]),
        asked_interpolation_error_db=fidelity.master_tolerance_db,
    )


def missed_resonances(
    shift: float,
    poles: int,
    frequency: FloatArray,
    amplitude: FloatArray,
    change: FloatArray,
    fidelity: AcousticsFidelity,
) -> SoundAccuracy:
    """Return the accuracy for resonances that the mesh may miss by `shift` of their frequency.

    poles : number of poles in the interpolation.
    amplitude, change : (n_f,) result and its change.

    It states the largest error of a line (n_f,) Hz beside a resonance, unless its amplitude is 0, and how many lines
    exceed the error of a mesh with `fidelity.elements_per_wavelength`. Without poles, the positions of resonances
    are unknown: it states the shift, and that of openings half an edge wide as its limit. Nothing is stated for a shift
    of zero.
    """
    if shift == 0:
        return SoundAccuracy()
    if poles == 0:
        return SoundAccuracy(resonance_shift=shift, resonance_shift_limit=2.0 * SHIFT)
    error = change / np.where(amplitude > 0, amplitude, np.inf)
    worst = int(error.argmax())
    asked = MESH_ERROR / fidelity.elements_per_wavelength**2
    return SoundAccuracy(
        resonance_error_db=error_decibel(float(error[worst])),
        resonance_frequency=float(frequency[worst]),
        resonance_lines=int(np.count_nonzero(error > asked)),
        asked_error_db=error_decibel(asked),
    )


def mean_square_angle(surface: Surface) -> float:
    """Return the area-weighted mean square (rad²) of the angles between triangles, without those above `SHARP_ANGLE`.

    Each triangle has the same weight for its three edges.
    """
    _, sides, angle = edge_table(surface)
    smooth = angle < SHARP_ANGLE
    share = surface.areas[sides].sum(axis=1) / (3.0 * surface.areas.sum())
    return float(share[smooth] @ angle[smooth] ** 2)


def _quadrature_accuracy(surface: Surface, fidelity: AcousticsFidelity, engine: Engine) -> SoundAccuracy:
    """Return the closure error for needles, unresolved gaps or a too low `singular_order`; else nothing."""
    from nvhchain.acoustics.fused.closure_check import FAIR_ORDER, JOINT_SHARE, gap_cost, suspect_error

    rules = engine.rules(fidelity)
    narrow, width, needles, seconds, once = gap_cost(surface, fidelity)
    if engine.adapts and seconds > SLOW_SECONDS:
        gaps = f"{narrow} triangles face each other across gaps or walls down to {width:.2g} of their edge"
        slender = f"{needles} triangles are more than {fidelity.needle_aspect:g} times as long as high"
        warn_caller(
            f"{' and '.join(compress((gaps, slender), (narrow, needles)))}: a frequency takes about {seconds:.0f} s "
            f"of processor time more, {JOINT_SHARE * seconds:.0f} s where four are solved together, and the check of "
            "the "
            f"quadrature {once:.0f} s once; refine the surface there, close or widen gaps, and mesh fans of needles in "
            "rings",
            RuntimeWarning,
        )
    # all bodies together, for gaps between them, and each by itself, as the mean over all would dilute its error
    bodies = [body for _, body in split_bodies(surface)]
    found = [suspect_error(body, fidelity, rules) for body in {surface, *bodies}]
    error = max((error for error in found if error is not None), default=None)
    if error is None:
        return SoundAccuracy()
    return SoundAccuracy(
        quadrature_error=error,
        asked_quadrature_error=fidelity.quadrature_error,
        fair_singular_order=FAIR_ORDER if rules.singular_order < FAIR_ORDER else None,
    )
