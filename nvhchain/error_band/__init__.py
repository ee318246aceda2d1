"""How wrong an answer may be, line by line and overall: what the knobs of every stage leave open, put together.

Every source of error gives an amplitude at each line and place. Sources are independent of each other: their
amplitudes add in quadrature. The constants are fitted at `draft` and `standard` against `reference` and hold for
gear sets, speeds, torques, blanks, housings and field points they were not fitted to (docs/measured/error_band.md).
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
