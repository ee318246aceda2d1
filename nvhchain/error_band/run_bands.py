"""Error bands of the results of a run, from its hand-offs; supplied hand-offs count as exact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, get_args

from nvhchain.case.operation import Quantity
from nvhchain.error_band.band import ErrorBand
from nvhchain.error_band.quantities import Origin, error_band, force_band, power_band, velocity_band
from nvhchain.error_band.run_up import RunUpBand, run_up_band, run_up_force_band
from nvhchain.handoff import ForceAccuracy

if TYPE_CHECKING:
    from nvhchain.chain.result import Result


def forces_band(run: Result) -> ErrorBand | RunUpBand:
    """Return the error band of the bearing forces, at lines or over the speed."""
    if run.force_spectrum is not None:
        return force_band(_origin(run), run.force_spectrum)
    assert run.bearing_forces is not None
    return run_up_force_band(_origin(run), run.bearing_forces)


def surface_band(run: Result) -> ErrorBand:
    """Return the error band of the surface velocity."""
    assert run.surface_velocity is not None
    return velocity_band(_origin(run), run.surface_velocity)


def pressure_band(run: Result) -> ErrorBand | RunUpBand:
    """Return the error band of the sound pressure, at lines or over the speed."""
    if run.pressure_history is not None:
        assert run.bearing_forces is not None
        assert run.transfer_vectors is not None
        assert run.housing is not None
        return run_up_band(_origin(run), run.pressure_history, run.bearing_forces, run.transfer_vectors, run.housing)
    assert run.pressure is not None
    assert run.surface_velocity is not None
    return error_band(_origin(run), run.pressure, run.surface_velocity, transfer_vectors=run.transfer_vectors)


def sound_power_band(run: Result) -> ErrorBand:
    """Return the error band of the sound power."""
    assert run.sound_power is not None
    return power_band(
        _origin(run),
        run.sound_power,
        velocity=run.surface_velocity,
        radiation_resistance=run.radiation_resistance,
        surface=run.housing.surface if run.housing is not None else None,
    )


def _origin(run: Result) -> Origin:
    """Return the computed hand-offs; no mesh laws for supplied forces."""
    given = not {"bearing_forces", "force_spectrum"}.isdisjoint(run.supplied)
    return Origin(
        run.case,
        run.fidelity,
        housing=None if "housing" in run.supplied else run.housing,
        force_spectrum=run.force_spectrum,
        mesh_laws=() if given else run.mesh_laws,
        laws_are_exact="mesh_laws" in run.supplied,
        force_accuracy=ForceAccuracy() if given or run.bearing_forces is None else run.bearing_forces.accuracy,
    )


BANDS: Mapping[str, Callable[[Result], ErrorBand | RunUpBand]] = MappingProxyType(
    {
        "bearing_forces": forces_band,
        "surface_velocity": surface_band,
        "pressure": pressure_band,
        "sound_power": sound_power_band,
    }
)
"""Quantity of a case → function that returns its band."""

INHERITED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"radiation_efficiency": ("sound_power",), "directivity": ("pressure", "sound_power")}
)
"""Quantities without confidence limits of their own → the quantities from which they inherit them."""

if unlimited := {*get_args(Quantity)} - {*BANDS, *INHERITED}:
    raise TypeError(
        f"{', '.join(unlimited)}: no confidence limits: add a function to BANDS, or quantities to INHERITED"
    )
