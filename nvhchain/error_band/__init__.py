"""How wrong an answer may be, line by line and overall: what the knobs of every stage leave open, put together.

Every source of error gives an amplitude at each line and place. Sources are independent of each other: their
amplitudes add in quadrature. The constants are fitted at `draft` and `standard` against `reference`; what they hold of
gear sets, speeds, torques, blanks, housings and field points they were not fitted to is counted in
docs/measured/chain/error_band.md, what single knobs do in docs/measured/chain/error_band_knobs.md.

The knobs that the band looks at: layers, slices, angles, tolerances of load patterns, elements of blanks and `bodies`
of the gears; time step and settling; element size, modes, their truncation and residual; what the acoustics say of
surface mesh, coarser surfaces, points, quadrature, masters, and the levels of radiation. Others turned coarser than
any preset has them (mesh_level, reaches, contact residuals, orders of single quadrature rules) widen nothing: on the
small gearbox what they do lies within what the rest leaves open. Models beyond the presets (flexible shafts,
gyroscopic terms, points across the face) are no error of theirs and none here. Resonances of shafts on bearings that
the housing's mesh moves are seen in the mean only: where the strongest line lies on one, forces have been 3 dB off
where 1.3 were said.
"""

from nvhchain.error_band.band import COVERAGE, ErrorBand, format_level, format_limits
from nvhchain.error_band.files import save_error_bands
from nvhchain.error_band.of_run import BANDS
from nvhchain.error_band.quantities import error_band, force_band, power_band, velocity_band
from nvhchain.error_band.run_up import RunUpBand, run_up_band, run_up_force_band

__all__ = [
    "BANDS",
    "COVERAGE",
    "ErrorBand",
    "RunUpBand",
    "error_band",
    "force_band",
    "format_level",
    "format_limits",
    "power_band",
    "run_up_band",
    "run_up_force_band",
    "save_error_bands",
    "velocity_band",
]
