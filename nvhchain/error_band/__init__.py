"""How wrong an answer may be, line by line and overall: what the knobs of every stage leave open, put together.

Every source of error gives an amplitude at each line and place. Sources are independent of each other: their
amplitudes add in quadrature. The constants are fitted at `draft` and `standard` against `reference`; what they hold of
gear sets, speeds, torques, blanks, housings and field points they were not fitted to is counted in
docs/measured/error_band.md. Those of the bearing forces (`AMPLIFICATION`, `SEAT_SHARE`) were fitted with all of these
in sight: nothing was held out from them.

The knobs that the band looks at: layers, slices, angles, tolerances of load patterns and `bodies` of the gears; time
step and settling; element size, modes and their truncation; what the acoustics say of surface mesh, points, quadrature,
masters, and the levels of radiation. Other knobs turned coarser than any preset has them (mesh_level, reaches,
profile elements, contact residuals, orders of single quadrature rules) widen nothing; models beyond the presets
(flexible shafts, gyroscopic terms, points across the face) are no error of theirs and none here.
"""

from nvhchain.error_band.band import COVERAGE, ErrorBand, format_limits
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
    "format_limits",
    "power_band",
    "run_up_band",
    "run_up_force_band",
    "velocity_band",
]
