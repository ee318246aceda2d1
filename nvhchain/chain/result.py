"""Result of a run: its hand-offs, the level at the field points and confidence limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from nvhchain import levels
from nvhchain.case import Case, GearboxCase
from nvhchain.chain.display import ResultPlots, html, summary
from nvhchain.error_band import BANDS, COVERAGE, INHERITED, ErrorBand, RunUpBand
from nvhchain.errors import require
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import (
    BearingForces,
    Directivity,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    LoadDistribution,
    MeshLaw,
    NoiseTransferFunctions,
    PressureHistory,
    RadiationEfficiency,
    RadiationResistance,
    ReducedHousing,
    SoundPower,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.runtime.threads import one_blas_thread
from nvhchain.scene import Modelling, Scene, modelled
from nvhchain.scene.inputs import unknown_effects
from nvhchain.scene.linear_level import OrderError

EXCLUDED_OPTIONS = "excluded options"
"""Source of error of the options that the program excluded."""


@one_blas_thread
def _band(quantity: str, result: Result) -> ErrorBand | RunUpBand:
    """Return the confidence limits of a quantity, without excluded options and inputs."""
    return BANDS[quantity](result)


@dataclass(frozen=True, repr=False)
class Result:
    """Hand-offs that a run computed or was supplied with; those that the case does not need are None or empty.

    Parameters
    ----------
    case : Case
        Case of the run.
    fidelity : Fidelity
        Fidelity of the run.
    mesh_laws : tuple of MeshLaw
        One per stage.
    load_distributions : tuple of LoadDistribution
        One per stage.
    bearing_forces : BearingForces, optional
        Hand-off of its step (`nvhchain.scene.steps`).
    force_spectrum : ForceSpectrum, optional
        Hand-off of its step.
    housing : ReducedHousing, optional
        Hand-off of its step.
    surface_velocity : SurfaceVelocity, optional
        Hand-off of its step.
    transfer_vectors : TransferVectors, optional
        Hand-off of its step.
    pressure : FieldPressure, optional
        Hand-off of its step.
    noise_transfer_functions : NoiseTransferFunctions, optional
        Hand-off of its step.
    pressure_history : PressureHistory, optional
        Hand-off of its step.
    radiation_resistance : RadiationResistance, optional
        Hand-off of its step.
    sound_power : SoundPower, optional
        Hand-off of its step.
    radiation_efficiency : RadiationEfficiency, optional
        Hand-off of its step.
    directivity : Directivity, optional
        Hand-off of its step.
    supplied : tuple of str
        Names of supplied hand-offs.
    decision : Modelling, optional
        Decision of the options that the case left open; None where it left none.
    """

    case: Case
    fidelity: Fidelity
    mesh_laws: tuple[MeshLaw, ...] = ()
    load_distributions: tuple[LoadDistribution, ...] = ()
    bearing_forces: BearingForces | None = None
    force_spectrum: ForceSpectrum | None = None
    housing: ReducedHousing | None = None
    surface_velocity: SurfaceVelocity | None = None
    transfer_vectors: TransferVectors | None = None
    pressure: FieldPressure | None = None
    noise_transfer_functions: NoiseTransferFunctions | None = None
    pressure_history: PressureHistory | None = None
    radiation_resistance: RadiationResistance | None = None
    sound_power: SoundPower | None = None
    radiation_efficiency: RadiationEfficiency | None = None
    directivity: Directivity | None = None
    supplied: tuple[str, ...] = ()
    decision: Modelling | None = field(default=None, compare=False)

    @property
    def overall(self) -> FloatArray:
        """Level (n_point,) in dB(A) at the field points, over the lines or over the record of a run-up.

        InputError without a sound pressure.
        """
        self._check_field_points()
        if self.pressure_history is not None:
            time = self.pressure_history.time
            rate = (len(time) - 1) / float(time[-1] - time[0])
            return levels.equivalent(self.pressure_history.pressure, sample_rate=rate)
        assert self.pressure is not None
        return levels.overall(self.pressure.frequency, self.pressure.pressure)

    @cached_property
    def error_band(self) -> ErrorBand | RunUpBand:
        """Confidence limits of the sound pressure (`nvhchain.error_band`): per line, or over the speed, and overall.

        Supplied mesh laws, forces and housings count as exact. InputError without a sound pressure.
        """
        self._check_field_points()
        return self._widened(_band("pressure", self))

    @cached_property
    def error_bands(self) -> dict[str, ErrorBand | RunUpBand]:
        """Confidence limits of every quantity that the case asks for, by its name.

        Radiation efficiency and directivity inherit those of sound power and pressure.
        """
        parts = [part for quantity in self.case.quantities for part in INHERITED.get(quantity, (quantity,))]
        return {
            part: self.error_band if part == "pressure" else self._widened(_band(part, self))
            for part in dict.fromkeys(parts)
        }

    def _widened(self, band: ErrorBand | RunUpBand) -> ErrorBand | RunUpBand:
        """Return a band with the options that the program excluded, and the spread of inputs that a case states.

        Options that the case itself excludes do not count.
        """
        for source, error in self._order_errors.items():
            if isinstance(band, RunUpBand) or self.force_spectrum is None or not self.force_spectrum.input_speed:
                band = band.widened(source, error.mean)
            else:
                band = band.widened(source, error.errors(2 * np.pi * band.frequency / self.force_spectrum.input_speed))
        return band

    @cached_property
    def _order_errors(self) -> dict[str, OrderError]:
        """Source of error → its relative error by orders; the ends of a spread are those of the band."""
        found, left, case = dict[str, OrderError](), self.decision, self.case
        if left is not None and left.excluded_distance_db > 0.0:
            found[EXCLUDED_OPTIONS] = left.excluded_error
        if isinstance(case, GearboxCase) and self._computes_forces:
            found |= {f"input: {each.name}": each.error.divided(COVERAGE) for each in unknown_effects(case)}
        return found

    @cached_property
    def modelling(self) -> Modelling | None:
        """Options that were modelled or excluded, each with its estimate; None where the forces are supplied."""
        if self.decision is not None or not isinstance(self.case, GearboxCase):
            return self.decision
        return modelled(self.case, self.fidelity) if self._computes_forces else None

    @property
    def _computes_forces(self) -> bool:
        return self.decision is not None or Scene(self.case, self.fidelity, self.supplied).computes_forces

    @property
    def plot(self) -> ResultPlots:
        """Figures of the result, such as `plot.spectrum()`."""
        return ResultPlots(self)

    def __repr__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        return html(self)

    def _check_field_points(self) -> None:
        require(
            self.pressure is not None or self.pressure_history is not None,
            f"{self.case.name}: quantities = {list(self.case.quantities)} leave out the sound pressure: take "
            "`error_bands`, or ask for `pressure`",
        )
