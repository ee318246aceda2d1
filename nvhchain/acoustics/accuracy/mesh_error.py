"""What is known beforehand about the error of a boundary element result, said where it exceeds what was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress, permutations

import numpy as np

from nvhchain.acoustics.surfaces.bodies import separate
from nvhchain.acoustics.surfaces.clearance import clearances
from nvhchain.acoustics.surfaces.needles import REMESHING_ERROR
from nvhchain.acoustics.surfaces.openings import SHIFT, resonance_shift
from nvhchain.acoustics.surfaces.surface import (
    LOCAL_COARSENING,
    MESH_ERROR,
    MESH_SCATTER,
    NEEDLE_SHARE,
    SHARP_ANGLE,
    check_mesh,
    edges_between,
    element_sizes,
    needle_share,
    width_to_length,
)
from nvhchain.acoustics.systems.engines import FUSED, Engine
from nvhchain.conventions import Air
from nvhchain.errors import warn_caller
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, RigidPlane, Surface

FACETS = 0.32
"""Error at field points relative to their peak, over the mean square of the angle (rad) under which neighbouring
triangles meet: what facets do to a round body whose own velocity they are given. Measured
(docs/measured/acoustics/surfaces.md): 0.13 where the facets enclose the body's volume, up to 1.1 where their corners
lie on it."""

COARSENESS = 0.03
"""Error at low frequency relative to the peak at field points, over the square of the mean edge in radii of the sphere
of equal area, less what the body is longer than wide: 0.002 for monopoles, 0.07 for dipoles in the same measurements.
Strips 1 to 16 times as long as wide with four edges across: 0.12 to 0.19 dB."""

NEAR_POINT = 0.5
"""Clearance in element edges below which a field point sees the single elements."""

NEAR_FACTOR = 2.0
"""Growth of the error from far field points to those next to the surface: 1.3 to 2.4 in the same measurements."""

NEAR_FLOOR = 0.005
"""Relative error next to the surface at low frequency, from the velocity that is constant on each element: 0.3 to 1.3 %
in the same measurements."""

BESIDE = 0.015
"""Error of the sound of a small body that shakes towards another one, relative to its peak, over the square of the
longest edge there in distances from the small body's middle, less one: 0.39 to 4.2 times what was found; a tenth of
that where it shakes along the other body, less where it pulsates (docs/measured/acoustics/small_bodies.md)."""

QUADRATURE_GROWTH = 2.0
"""Error at field points, over that of constant and linear pressures on the surface: 0.01 to 0.5 in
docs/measured/acoustics/quadrature.md; at the coarse edges of wedges of 5 and 20 degrees one to ten, the mesh's own
included."""

NEEDLES = 2.5
"""Growth of the error where needles take more than `NEEDLE_SHARE` of the area: point sources in cylinders of
64 needles, 300 to 1000 Hz: 0.2 to 2.2 times what is stated of other meshes with the same edges."""

SLOW = 10.0
"""s of processor time per frequency spent on narrow gaps and needles above which that is said."""


def expected_accuracy(
    surface: Surface,
    points: FloatArray | None,
    f_max: float,
    air: Air,
    fidelity: AcousticsFidelity,
    engine: Engine = FUSED,
    plane: RigidPlane | None = None,
) -> dict[str, float]:
    """Provenance of what the mesh and the field points let expect at the upper frequency `f_max` (Hz).

    elements_per_wavelength: there.  expected_error_dB: at the loudest field points.  Part of it: expected_error_low_dB,
    at any frequency however low; of that, faceting_error_dB, from facets in the place of round faces (triangles that
    meet at more than 40° form an edge of the body), and expected_error_beside_dB, from triangles that are coarse for a
    small body beside them (`beside_ratio`), and remeshing_error_dB, of a surface meshed anew.  Not part of it:
    resonance_shift, the frequency by which the air in openings resonates elsewhere, relative to its own
    (`resonance_shift`); levels there err by as much as that makes of them, which `radiate` and `waves_power` state
    (`resonance_error_dB`).  With a point nearer than half an element edge also clearance: in edges, and
    expected_error_nearest_dB: there, at its own pressure, of motions that neighbouring
    elements share (a single one that moves errs by 2.7 dB next to it, by 0.6 half an edge away).
    With needles, edges sharper than 60°, gaps narrower than the engine resolves (`bempp` cuts no triangles), or a
    singular_order below 3, also quadrature_error: of constant and linear pressures on the surface, relative; other
    pressures there err by up to eight times as much, sixty where all triangles are needles, their sound far less
    (docs/measured/acoustics/quadrature.md), and twice that is part of expected_error_low_dB.
    With triangles longer than all but a twentieth of the area may be (`LOCAL_COARSENING`): coarse_share of the area,
    coarse_elements_per_wavelength of the longest one, and their error (`patch_error`) as part of expected_error_dB;
    expected_error_patch_dB bounds the error of sound that comes from behind them alone, wherever it is heard, and that
    of the nearest points counts as if they lay next to the longest one.
    Gives an AccuracyWarning where the mesh is coarser than `fidelity.elements_per_wavelength` asks for or, for its own
    size, as coarse as that, for such triangles with less than `fidelity.coarsest_elements_per_wavelength` on their
    longest edge, for a point that near, and for a quadrature error above `fidelity.quadrature_error`;
    a RuntimeWarning for gaps so narrow, and so many needles, that they cost more than `SLOW`.
    Of several bodies the worst counts: one of them may be all that is heard.
    An error of e dB means a factor 10^(e/20) in either direction; silent directions are worse, and so are motions whose
    parts cancel each other: `radiate`, `solve_direct` and `sound_power` tell of them (`cancellation_error_dB`).  Both
    together are an estimate, no bound: boxes at 4.5 elements per wavelength erred by up to twice as much.
    Raises what `check_mesh` raises.
    """
    if f_max <= 0:
        return {}
    check_mesh(surface, f_max, air, fidelity)
    bodies, wavelength = [body for _, body in separate(surface)], air.speed_of_sound / f_max
    sizes = [element_sizes(body) for body in bodies]
    size = max(max(mean / MESH_SCATTER, coarsest / LOCAL_COARSENING) for mean, coarsest in sizes)
    per_wavelength = wavelength / size
    facets = [FACETS * mean_square_angle(body) for body in bodies]
    shapes = [
        of + COARSENESS * mean**2 * 4.0 * np.pi / _compact_area(body)
        for body, of, (mean, _) in zip(bodies, facets, sizes, strict=True)
    ]
    worst = int(np.argmax(shapes))
    faceting, coarse, mean = facets[worst], shapes[worst], sizes[worst][0]
    quadrature = _quadrature_accuracy(surface, fidelity, engine)
    ratio = beside_ratio(bodies)
    beside = min(BESIDE * max(ratio**2 - 1.0, 0.0), 1.0)
    remeshing = float(surface.provenance.get(REMESHING_ERROR, 0.0))
    low = coarse + beside + remeshing + QUADRATURE_GROWTH * quadrature.get("quadrature_error", 0.0)
    patch, at_longest = (max(of) for of in zip(*(patch_error(body, size, wavelength) for body in bodies), strict=True))
    growth = NEEDLES if max(map(needle_share, bodies)) > NEEDLE_SHARE else 1.0
    low *= growth
    error = growth * MESH_ERROR / per_wavelength**2 + low + patch
    expected = {
        "elements_per_wavelength": per_wavelength,
        "expected_error_dB": _decibel(error),
        "expected_error_low_dB": _decibel(low),
    }
    if patch > 0:
        expected |= _told_patch(surface, size, wavelength, error, NEAR_FACTOR * (error + at_longest), fidelity)
    if faceting > 0:
        expected["faceting_error_dB"] = _decibel(faceting)
    if beside > 0:
        expected["expected_error_beside_dB"] = _decibel(beside)
    if remeshing > 0:
        expected["remeshing_error_dB"] = _decibel(remeshing)
    shift = resonance_shift(surface, plane)
    if shift > 0:
        expected["resonance_shift"] = shift
    asked = fidelity.elements_per_wavelength
    expected |= quadrature
    if coarse > MESH_ERROR / asked**2:
        warn_caller(
            f"mesh of {len(bodies[worst].triangles)} triangles with edges of {1e3 * mean:.3g} mm is coarse for the "
            f"body: expect errors of about {_decibel(low):.2g} dB at any frequency; refine it"
        )
    if beside > MESH_ERROR / asked**2:
        warn_caller(
            f"a small body lies beside triangles {ratio:.2g} times as long as they are away from its middle: expect "
            f"errors of about {_decibel(beside):.2g} dB of its sound at any frequency; refine them as many times there"
        )
    if per_wavelength < asked:
        warn_caller(
            f"mesh has {per_wavelength:.3g} elements per wavelength at {f_max:.4g} Hz, {asked:g} asked: expect errors "
            f"of about {_decibel(error):.2g} dB there; refine to {1e3 * air.speed_of_sound / (f_max * asked):.3g} mm "
            "or lower the upper frequency"
        )
    clearance = np.inf if points is None else clearances(surface, points, NEAR_POINT).min()
    if clearance < NEAR_POINT:
        near = _decibel(NEAR_FACTOR * (error + at_longest) + NEAR_FLOOR)
        expected |= {"clearance": float(clearance), "expected_error_nearest_dB": near}
        warn_caller(
            f"a field point is {clearance:.2g} element edges from the surface: expect errors of about {near:.2g} dB "
            "there, up to 3 dB where the velocity changes from one element to the next; refine the mesh near it or "
            "move it away"
        )
    return expected


def needle_seconds(surface: Surface, fidelity: AcousticsFidelity) -> tuple[float, float]:
    """Processor time, s, that needles and narrow gaps add in the fused engine: at every frequency, and once."""
    from nvhchain.acoustics.fused.closure_check import gap_cost

    *_, seconds, once = gap_cost(surface, fidelity)
    return seconds, once


def beside_ratio(bodies: Sequence[Surface]) -> float:
    """Longest edge of a triangle over its distance from the middle of another body or, where that is more, over the
    radius of the sphere of that body's area (of as much of its length as it is wide); the largest of all bodies."""
    radii = [np.sqrt(_compact_area(body) / (4.0 * np.pi)) for body in bodies]
    worst = 0.0
    for (small, radius), (large, _) in permutations(zip(bodies, radii, strict=True), 2):
        most = float(large.longest_edges.max() / radius)
        if most > max(worst, 1.0):
            middle = small.areas @ small.centroids / small.areas.sum()
            worst = max(worst, 1.0 / max(1.0 / most, clearances(large, middle[None])[0]))
    return worst


def _compact_area(body: Surface) -> float:
    """Area (m²) of a body, of as much of its length as it is wide."""
    area = float(body.areas.sum())
    return area * float(width_to_length(body.centroids, body.areas[:, None] / area)[0])


def patch_error(surface: Surface, size: float, wavelength: float) -> tuple[float, float]:
    """Error at field points, relative to their peak, that triangles much coarser than the rest add: (of all of them, of
    the longest one by itself).

    size: m, for which the mesh counts.  wavelength: m.  A triangle longer than `LOCAL_COARSENING` sizes errs by
    `MESH_ERROR` (longest edge/wavelength)² of what it radiates, less what the longest edge admitted would; sound of
    irregular phase takes the root of the area-weighted mean square of that.  Zero for even meshes.  Sources inside a
    sphere with a cap of 4.7 % at 3 and 1.5 elements per wavelength of the cap: 0.029 and 0.115 stated with the rest of
    the mesh, 0.030 and 0.154 found 0.4 radii behind the cap, 2.3 times as much at a quarter, 4.8 times at a tenth of
    the radius, always less than what is stated for the cap alone.  Velocities are means over the faces: those at the
    centroids of the cap alone would add up to 0.3 at any frequency.
    """
    squares = (surface.longest_edges**2 - (LOCAL_COARSENING * size) ** 2).clip(0.0)
    errors = MESH_ERROR * squares / wavelength**2
    return float(np.sqrt(surface.areas @ errors**2 / surface.areas.sum())), float(errors.max())


def _told_patch(
    surface: Surface, size: float, wavelength: float, error: float, alone: float, fidelity: AcousticsFidelity
) -> dict[str, float]:
    """Provenance of triangles much coarser than the rest, with a warning where they carry no wave.

    error, alone: of the whole, and of sound that comes from behind these triangles alone.
    """
    longest = float(surface.longest_edges.max())
    share = float(surface.areas[surface.longest_edges > LOCAL_COARSENING * size].sum() / surface.areas.sum())
    least = fidelity.coarsest_elements_per_wavelength
    if wavelength < least * longest:
        warn_caller(
            f"{100 * share:.2g} % of the area has triangles up to {1e3 * longest:.3g} mm long, "
            f"{wavelength / longest:.2g} elements per wavelength at the upper frequency, where {least:g} carry a wave: "
            f"expect errors of about {_decibel(error):.2g} dB, up to {_decibel(alone):.2g} dB of sound from behind "
            f"them alone; refine them to {1e3 * LOCAL_COARSENING * size:.3g} mm"
        )
    return {
        "coarse_share": share,
        "coarse_elements_per_wavelength": wavelength / longest,
        "expected_error_patch_dB": _decibel(alone),
    }


def told_interpolation(
    error: FloatArray, frequency: FloatArray, of: str, fidelity: AcousticsFidelity
) -> dict[str, float]:
    """Provenance of the largest of the errors (n,) that interpolation between masters is estimated to make of `of`, dB.

    frequency: (n,) Hz, where each is made.  Gives an AccuracyWarning where it exceeds `fidelity.master_tolerance_db`.
    """
    worst = int(error.argmax())
    largest = _decibel(float(error[worst]))
    if largest > fidelity.master_tolerance_db:
        warn_caller(
            f"interpolation between master frequencies errs by an estimated {largest:.2g} dB of {of} at "
            f"{frequency[worst]:.4g} Hz, {fidelity.master_tolerance_db:g} dB asked: take more masters, or let the "
            "engine choose them"
        )
    return {"interpolation_error_dB": largest}


def told_resonances(
    shift: float,
    poles: int,
    frequency: FloatArray,
    amplitude: FloatArray,
    change: FloatArray,
    fidelity: AcousticsFidelity,
) -> dict[str, float]:
    """Provenance of resonances that the mesh may miss by `shift` of their frequency; nothing where it misses none.

    The largest error of lines (n_f,) Hz beside one, dB, and where, Hz; where interpolation looks for no poles, which
    would show where they are, the shift alone.
    poles: that are looked for.  amplitude, change: (n_f,), what was found and what it changes by.  Gives an
    AccuracyWarning where the error is larger than that of a mesh with `fidelity.elements_per_wavelength`, and without
    poles for openings narrower than half an edge.
    """
    if shift == 0:
        return {}
    if poles == 0:
        if shift > 2.0 * SHIFT:
            warn_caller(
                f"the air in openings of the body may resonate up to {100 * shift:.2g} % elsewhere than on this mesh, "
                "and these masters do not show where: lines that near to a resonance err by several decibels; "
                "interpolate by rational functions between four masters or more, or refine the surface in its openings"
            )
        return {"resonance_shift": shift}
    error = change / np.where(amplitude > 0, amplitude, np.inf)
    worst = int(error.argmax())
    largest, at = _decibel(float(error[worst])), float(frequency[worst])
    asked = MESH_ERROR / fidelity.elements_per_wavelength**2
    if error[worst] > asked:
        warn_caller(
            f"the air in openings of the body resonates, and the mesh misses by how much: expect errors up to "
            f"{largest:.2g} dB, at {at:.4g} Hz, and more than {_decibel(asked):.2g} dB at "
            f"{np.count_nonzero(error > asked)} lines; refine the surface in its openings"
        )
    return {"resonance_error_dB": largest, "resonance_frequency": at}


def mean_square_angle(surface: Surface) -> float:
    """Mean square (rad²) over the area of the angles under which triangles meet, but for those above `SHARP_ANGLE`.

    Each triangle counts its three edges alike.
    """
    _, sides, angle = edges_between(surface)
    smooth = angle < SHARP_ANGLE
    share = surface.areas[sides].sum(axis=1) / (3.0 * surface.areas.sum())
    return float(share[smooth] @ angle[smooth] ** 2)


def _quadrature_accuracy(surface: Surface, fidelity: AcousticsFidelity, engine: Engine) -> dict[str, float]:
    """Closure error of a surface with needles or gaps that are not resolved, and of any with a `singular_order` that is
    too low; nothing for any other."""
    from nvhchain.acoustics.fused.closure_check import FAIR_ORDER, TOGETHER, gap_cost, suspect_error

    rules = engine.rules(fidelity)
    remedy = "raise singular_order and gap_halvings" if engine.adapts else f"use engine {FUSED.name}"
    narrow, width, needles, seconds, once = gap_cost(surface, fidelity)
    if engine.adapts and seconds > SLOW:
        gaps = f"{narrow} triangles face each other across gaps or walls down to {width:.2g} of their edge"
        slender = f"{needles} triangles are more than {fidelity.needle_aspect:g} times as long as high"
        warn_caller(
            f"{' and '.join(compress((gaps, slender), (narrow, needles)))}: a frequency takes about {seconds:.0f} s "
            f"of processor time more, {TOGETHER * seconds:.0f} s where four are solved together, and the check of the "
            f"quadrature {once:.0f} s once; refine the surface there, close or widen gaps, and mesh fans of needles in "
            "rings",
            RuntimeWarning,
        )
    # all bodies together, for gaps between them, and every one by itself: the others share its error in the mean
    bodies = [body for _, body in separate(surface)]
    found = [suspect_error(body, fidelity, rules) for body in {surface, *bodies}]
    error = max((error for error in found if error is not None), default=None)
    if error is None:
        return {}
    if error > fidelity.quadrature_error:
        cause = "needles, sharp edges or thin gaps of the mesh leave"
        remedy = f"make triangles less than {fidelity.needle_aspect:g} times as long as high, or {remedy}"
        if rules.singular_order < FAIR_ORDER:
            cause = f"singular_order = {rules.singular_order} leaves"
            remedy = f"raise it to {FAIR_ORDER} or more"
        warn_caller(
            f"{cause} a relative quadrature error of {error:.2g} on the surface, {fidelity.quadrature_error:g} asked, "
            f"and pressures there err by several times as much: {remedy}"
        )
    return {"quadrature_error": error}


def _decibel(relative_error: float) -> float:
    return float(20.0 * np.log10(1.0 + relative_error))
