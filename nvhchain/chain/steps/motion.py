"""Reduced housing, line spectrum of the forces, and motion of the surface."""

from __future__ import annotations

from nvhchain import acoustics, housing, spectrum
from nvhchain.case import RadiatorCase
from nvhchain.chain.running import Run
from nvhchain.handoff import ForceSpectrum, ReducedHousing, SurfaceVelocity
from nvhchain.scene.steps import BEARING_FORCES, FORCE_SPECTRUM, HOUSING, SURFACE_VELOCITY


def reduced_housing(run: Run) -> ReducedHousing:
    """Reduce the housing to its seats and the radiating surface.

    Parameters
    ----------
    run : Run
        Run in progress.

    Returns
    -------
    ReducedHousing
        Modes and residual flexibility.
    """
    case, knobs = run.gearbox, run.fidelity.housing
    size = acoustics.required_element_size(case.band.high, case.air, run.fidelity.acoustics)
    contents = case.housing.read(case, size)
    inputs = (case.housing, case.band.high, size, *contents)
    made: ReducedHousing = run.cached(
        HOUSING, inputs, lambda progress: case.housing.reduce(case, contents, size, knobs, progress)
    )
    return made


def force_spectrum(run: Run) -> ForceSpectrum:
    """Lines of the bearing forces in the band."""
    forces, band = run[BEARING_FORCES], run.gearbox.band
    made: ForceSpectrum = run.cached(
        FORCE_SPECTRUM,
        (forces, band),
        lambda progress: spectrum.force_spectrum(forces, low=band.low, high=band.high, resolution=band.resolution),
    )
    return made


def surface_velocity(run: Run) -> SurfaceVelocity:
    """Velocity stated in the case, cached if it is asked for; else the forced response of the housing."""
    if isinstance(run.case, RadiatorCase):
        stated = run.case.surface_velocity(run.fidelity.acoustics)
        asked = "surface_velocity" in run.case.quantities
        return run.cached(SURFACE_VELOCITY, (stated,), lambda progress: stated) if asked else stated
    reduced, forces = run[HOUSING], run[FORCE_SPECTRUM]
    made: SurfaceVelocity = run.cached(
        SURFACE_VELOCITY, (reduced, forces), lambda progress: housing.respond(reduced, forces)
    )
    return made
