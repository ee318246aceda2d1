"""Error bands of the results of a run, from its hand-offs; supplied hand-offs count as exact."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol, TypedDict

from nvhchain.case import Case, GearboxCase
from nvhchain.error_band.band import ErrorBand
from nvhchain.error_band.quantities import error_band, force_band, power_band, velocity_band
from nvhchain.error_band.run_up import RunUpBand, run_up_band, run_up_force_band
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    ForceSpectrum,
    MeshLaw,
    PressureHistory,
    RadiationResistance,
    ReducedHousing,
    SoundPower,
    SurfaceVelocity,
    TransferVectors,
)


class Run(Protocol):
    """Hand-offs that a run computed or was supplied with; None if the case needs none."""

    @property
    def case(self) -> Case: ...
    @property
    def fidelity(self) -> Fidelity: ...
    @property
    def mesh_laws(self) -> tuple[MeshLaw, ...]: ...
    @property
    def bearing_forces(self) -> BearingForces | None: ...
    @property
    def force_spectrum(self) -> ForceSpectrum | None: ...
    @property
    def housing(self) -> ReducedHousing | None: ...
    @property
    def surface_velocity(self) -> SurfaceVelocity | None: ...
    @property
    def transfer_vectors(self) -> TransferVectors | None: ...
    @property
    def pressure(self) -> FieldPressure | None: ...
    @property
    def pressure_history(self) -> PressureHistory | None: ...
    @property
    def radiation_resistance(self) -> RadiationResistance | None: ...
    @property
    def sound_power(self) -> SoundPower | None: ...
    @property
    def supplied(self) -> tuple[str, ...]: ...


def forces_band(run: Run) -> ErrorBand | RunUpBand:
    """Return the error band of the bearing forces, at lines or over the speed."""
    assert isinstance(run.case, GearboxCase)
    if run.force_spectrum is not None:
        return force_band(run.case, run.fidelity, run.force_spectrum, housing=_computed_housing(run), **_laws(run))
    assert run.bearing_forces is not None
    return run_up_force_band(run.case, run.fidelity, run.bearing_forces, housing=_computed_housing(run), **_laws(run))


def surface_band(run: Run) -> ErrorBand:
    """Return the error band of the surface velocity."""
    assert run.surface_velocity is not None
    return velocity_band(
        run.case,
        run.fidelity,
        run.surface_velocity,
        housing=_computed_housing(run),
        force_spectrum=run.force_spectrum,
        **_laws(run),
    )


def pressure_band(run: Run) -> ErrorBand | RunUpBand:
    """Return the error band of the sound pressure, at lines or over the speed."""
    if run.pressure_history is not None:
        assert isinstance(run.case, GearboxCase)
        assert run.bearing_forces is not None
        assert run.transfer_vectors is not None
        assert run.housing is not None
        return run_up_band(
            run.case,
            run.fidelity,
            run.pressure_history,
            run.bearing_forces,
            run.transfer_vectors,
            run.housing,
            housing_is_exact="housing" in run.supplied,
            **_laws(run),
        )
    assert run.pressure is not None
    assert run.surface_velocity is not None
    return error_band(
        run.case,
        run.fidelity,
        run.pressure,
        run.surface_velocity,
        transfer_vectors=run.transfer_vectors,
        housing=_computed_housing(run),
        force_spectrum=run.force_spectrum,
        **_laws(run),
    )


def sound_power_band(run: Run) -> ErrorBand:
    """Return the error band of the sound power."""
    assert run.sound_power is not None
    return power_band(
        run.case,
        run.fidelity,
        run.sound_power,
        velocity=run.surface_velocity,
        radiation_resistance=run.radiation_resistance,
        housing=_computed_housing(run),
        force_spectrum=run.force_spectrum,
        **_laws(run),
        surface=run.housing.surface if run.housing is not None else None,
    )


def _computed_housing(run: Run) -> ReducedHousing | None:
    return None if "housing" in run.supplied else run.housing


class _Laws(TypedDict):
    mesh_laws: tuple[MeshLaw, ...]
    laws_are_exact: bool


def _laws(run: Run) -> _Laws:
    """Return the mesh laws that the forces were made from; none for supplied forces."""
    given = not {"bearing_forces", "force_spectrum"}.isdisjoint(run.supplied)
    return {"mesh_laws": () if given else run.mesh_laws, "laws_are_exact": "mesh_laws" in run.supplied}


BANDS: Mapping[str, Callable[[Run], ErrorBand | RunUpBand]] = MappingProxyType(
    {
        "bearing_forces": forces_band,
        "surface_velocity": surface_band,
        "pressure": pressure_band,
        "sound_power": sound_power_band,
    }
)
"""Quantity of a case → function that returns its band."""
