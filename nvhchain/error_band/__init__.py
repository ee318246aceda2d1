"""Error band: confidence limits of a result, line by line and overall, from the settings of every step.

Every source of error gives an amplitude at each line and place. Sources are independent of each other: their amplitudes
add in quadrature. The constants are fitted at `draft` and `standard` against `reference`. They were not fitted to other
gear sets, speeds, torques, blanks, housings and field points. The page docs/measured/chain/error_band.md counts the
cases of these that they hold. docs/measured/chain/error_band_knobs.md lists the effect of single knobs.

Knobs in the band:

- gears: layers, slices, angles, tolerances of load patterns, elements of blanks and `bodies`;
- dynamics: time step, settling and contact loss;
- housing: element size, modes, their truncation and residual;
- acoustics: the expected errors of surface mesh, coarser surfaces, points, quadrature, master frequencies and radiation
  levels.

Other knobs (mesh_level, reaches, contact residuals, orders of single quadrature rules) widen nothing, even where they
are coarser than in every preset. On the small gearbox their effect lies within the error of the rest. Models beyond the
presets (flexible shafts, gyroscopic terms, points across the face) are no error of the presets and are not counted.
Resonances of shafts on bearings that move with the housing's FE mesh are covered in the mean only. Where the strongest
line lay on one, forces have been 3 dB off with limits of 1.3 dB.
"""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.error_band.band import (
        COVERAGE,
        LIMITS,
        NUMERICAL,
        ErrorBand,
        format_level,
        format_limits,
        format_parts,
        remedy,
    )
    from nvhchain.error_band.difference import (
        SHARED,
        difference_limits,
        pass_probability,
        shared_inputs,
        shared_sources,
    )
    from nvhchain.error_band.files import save_error_bands
    from nvhchain.error_band.quantities import Origin, error_band, force_band, power_band, velocity_band
    from nvhchain.error_band.run_bands import BANDS, INHERITED
    from nvhchain.error_band.run_up import RunUpBand, limit_causes, limit_parts, run_up_band, run_up_force_band
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = ["ErrorBand", "format_limits"]
