"""Sound pressure at any point outside the enclosing sphere, from the waves that carry the sound power."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.interpolation.nodes import line_batches
from nvhchain.acoustics.radiation.efficiency import positions
from nvhchain.acoustics.radiation.modal_power import check_resistance, modal_velocity, node_waves, waves_nodes
from nvhchain.acoustics.waves.multipoles import frame, wave_reach, waves_from_middle
from nvhchain.acoustics.waves.outgoing import OutgoingWaves
from nvhchain.errors import require, warn_caller
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    RadiationResistance,
    ReducedHousing,
    RigidPlane,
    SoundAccuracy,
    Surface,
    warn_of,
)
from nvhchain.kinds import checked

_TRUNCATION = 10 ** (0.1 / 20) - 1.0
"""Share of the highest degree in the peak pressure of a point above which a warning is given: 0.1 dB."""


@checked
def wave_pressure(
    resistance: RadiationResistance,
    housing: ReducedHousing,
    force_spectrum: ForceSpectrum,
    points: ArrayLike,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
) -> FieldPressure:
    """Compute sound pressure at field points from spherical waves, without another boundary element solution.

    resistance: waves of this housing's shapes (`housing_shapes`), with its reflecting plane.
    housing: modes and residual motions of the housing.
    force_spectrum: bearing forces (N), within the masters of `resistance`.
    points (n_point, 3): field points (m) outside the sphere that encloses the housing (`enclosing_sphere`).
    Returns pressure (Pa) at the lines that carry force. The accuracy states the estimated error of interpolation.

    The waves are summed at every line and interpolated between the masters as for `power_from_waves`. Outside of the
    sphere p = −jk Σ j^−l h_l(kr) a_lm Y_lm holds exactly.  Source: Williams, Fourier Acoustics, ch. 6.
    """
    check_resistance(resistance, housing)
    places = check_outside(housing.surface, resistance.plane, points)
    frequency, velocity = modal_velocity(resistance, housing, force_spectrum)
    lines = np.flatnonzero(velocity.any(axis=1) & (frequency > 0))
    nodes = waves_nodes(resistance, fidelity)
    outgoing = OutgoingWaves(housing.surface, resistance.plane, places, _order(resistance, housing.surface))
    summed = _few_pressures if outgoing.few else _many_pressures
    pressure = np.zeros((len(frequency), len(places)), dtype=complex)
    error, last = np.zeros(pressure.shape), np.zeros(pressure.shape)
    waves: dict[int, ComplexArray] = {}
    for piece in (lines[batch] for batch in line_batches(len(lines))):
        sets = np.stack([nodes.weights(frequency[piece]), *nodes.error_weights(frequency[piece])])
        for node in np.flatnonzero(sets.any(axis=(0, 1))).tolist():
            if node not in waves:
                scaled_waves = np.sqrt(resistance.air.impedance) * node_waves(resistance, nodes, node)
                waves[node] = outgoing.degree_sums(scaled_waves) if outgoing.few else scaled_waves
        k = 2 * np.pi / resistance.air.speed_of_sound * frequency[piece]
        (pressure[piece], *errors), highest = summed(outgoing, k, velocity[piece], sets, waves)
        last[piece], error[piece] = np.abs(highest), np.abs(errors).max(axis=0)
    peak = np.abs(pressure).max(axis=0, initial=0.0)
    peak = np.where(peak > 0, peak, 1.0)
    told = SoundAccuracy(
        interpolation_error=error.max(axis=0, initial=0.0) / peak,
        interpolation_frequency=float(frequency[(error / peak).max(axis=1).argmax()]),
        asked_interpolation_error_db=fidelity.master_tolerance_db,
    )
    warn_of(told)
    near = last.max(axis=0, initial=0.0) / peak
    if near.max(initial=0.0) > _TRUNCATION:
        worst = int(near.argmax())
        warn_caller(
            f"field point {worst} at {places[worst].tolist()} m is so near that waves of the highest degree are "
            f"{100 * near[worst]:.2g} % of its pressure: take a point farther away, or more multipole_digits",
            kind="near field point",
        )
    expected = resistance.accuracy.expected_error_db
    return FieldPressure(
        frequency,
        places,
        pressure,
        force_spectrum.input_speed,
        SoundAccuracy(expected_error_db=expected) | told,
        provenance={"stage": "acoustics.wave_pressure", "fidelity": repr(fidelity)},
    )


def _few_pressures(
    outgoing: OutgoingWaves,
    wavenumber: FloatArray,
    velocity: ComplexArray,
    sets: ComplexArray,
    waves: Mapping[int, ComplexArray],
) -> tuple[ComplexArray, ComplexArray]:
    """Return pressures (n_set, n_k, n_point), and the part of the highest degree in those of the first set.

    waves: node → sums over the orders of each degree at the points (`OutgoingWaves.degree_sums`). Only they depend on
    the node, so that the waves themselves are never summed.
    """
    top = np.zeros(len(wavenumber), dtype=int)
    for node, sums in waves.items():
        used = np.flatnonzero(sums.any(axis=(0, 1)))
        top[sets[0, :, node] != 0] = np.maximum(top[sets[0, :, node] != 0], used[-1] if len(used) else 0)
    radial = outgoing.radial(wavenumber, top)
    count, points, degrees = radial.shape
    total, highest = np.zeros((len(sets), count, points), dtype=complex), np.zeros((count, points), dtype=complex)
    for node in np.flatnonzero(sets.any(axis=(0, 1))).tolist():
        part = (velocity @ waves[node].reshape(len(waves[node]), -1)).reshape(count, points, degrees) * radial
        total += sets[:, :, node, None] * part.sum(axis=2)
        highest += sets[0, :, node, None] * part[np.arange(count), :, top]
    return total, highest


def _many_pressures(
    outgoing: OutgoingWaves,
    wavenumber: FloatArray,
    velocity: ComplexArray,
    sets: ComplexArray,
    waves: Mapping[int, ComplexArray],
) -> tuple[ComplexArray, ComplexArray]:
    """Return the same as `_few_pressures`; `waves` holds node → waves (n_row, n_column)."""
    used = np.flatnonzero(sets.any(axis=(0, 1))).tolist()
    total = np.zeros((len(sets), len(wavenumber), max(len(waves[node]) for node in used)), dtype=complex)
    for node in used:
        total[:, :, : len(waves[node])] += sets[:, :, node, None] * (velocity @ waves[node].T)
    pressure, highest = outgoing.pressure(wavenumber, total)
    return pressure, highest[0]


@checked
def enclosing_sphere(surface: Surface, *, plane: RigidPlane | None = None) -> tuple[FloatArray, float]:
    """Return the sphere outside of which `wave_pressure` holds.

    Returns centre (3,): centre (m): the middle of the surface, or its foot on a plane that is near. radius: distance
    (m) of the farthest vertex from the centre.
    """
    return frame(surface, plane)[0], wave_reach(surface, plane)


def check_outside(surface: Surface, plane: RigidPlane | None, points: ArrayLike) -> FloatArray:
    """Return field points (n_point, 3) m; InputError for points inside the enclosing sphere or behind the plane."""
    places = positions(points, "field points")
    centre, radius = enclosing_sphere(surface, plane=plane)
    distance = np.linalg.norm(places - centre, axis=1)
    nearest = int(distance.argmin())
    require(
        float(distance[nearest]) > radius,
        f"field point {places[nearest].tolist()} m lies {distance[nearest]:.4g} m from {np.round(centre, 4).tolist()} "
        f"m, inside the sphere of {radius:.4g} m around the body: waves hold outside of it; add the point to "
        "field_points of the case and run it again",
    )
    if plane is not None:
        height = plane.height(places)
        lowest = int(height.argmin())
        require(
            float(height[lowest]) >= -1e-9 * radius,
            f"field point {places[lowest].tolist()} m lies {-height[lowest]:.4g} m behind the reflecting plane: move "
            "it to the side of the plane's normal",
        )
    return places


def _order(resistance: RadiationResistance, surface: Surface) -> int:
    """Return the highest order of the rows; about the foot on a plane, they are half."""
    rows, plane = resistance.waves.shape[1], resistance.plane
    every = 2 if plane is not None and not waves_from_middle(surface, plane) else 1
    return int(np.ceil(np.sqrt(every * rows))) - 1 if every == 1 else int(np.ceil(np.sqrt(2 * rows + 0.25) - 1.5))
