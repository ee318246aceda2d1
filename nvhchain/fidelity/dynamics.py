"""Knobs of the time integration of the gearbox."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.fidelity.knob import Knobs, Sweep, knob

_LIMIT = "a limit, beyond which the run is refused"

_MOVED = {
    "face_points": "options.tilt",
    "flexible_shafts": "options.flexible_shafts",
    "gyroscopic": "options.gyroscopic",
}


# fmt: off
@dataclass(frozen=True)
class DynamicsFidelity(Knobs, package="dynamics", moved=_MOVED):
    """Time integration of the gearbox.

    Notes
    -----
    Steps of 10 µs keep errors below 1e-4 of the peak while flanks stay in contact at the usual speeds (4e-4 at 10 000
    rpm). Flanks that separate and strike under load need 1 µs, or 5 µs with path_correction. Lightly loaded flanks that
    separate far need 0.25 µs, or 2 µs with path_correction (docs/measured/dynamics/cuts.md).
    """

    time_step: float = knob(low=1e-9, high=1e-2, unit="s", sweep=(30e-6, 20e-6, 10e-6),
        meaning="largest step of the integrator")
    settle_level: float = knob(1e-6, low=1e-12, high=0.5, sweep=(1e-2, 1e-4),
        meaning="start-up transient left when recording begins, relative to the swing of the bearing forces")
    settle_time: float = knob(40.0, high=1e5, unit="s", sweep=_LIMIT,
        meaning="time in which modes may settle; slower ones start from their periodic motion")
    samples_per_period: float = knob(8.0, low=2.0, high=1e4, sweep=_LIMIT,
        meaning="fewest steps in the shortest period of the band")
    angle_refinement: int = knob(4, low=1, high=64, sweep=(1, 2),
        meaning="interpolated rows per tabulated angle of a mesh law")
    contact_residual: float = knob(1e-12, low=1e-15, high=1e-3, sweep=(1e-6, 1e-9),
        meaning="admissible residual of the mesh forces in a step, relative to the largest tabulated force")
    contact_iterations: int = knob(100, high=10_000, sweep=_LIMIT, meaning="most iterations to that residual")
    stored_samples_per_period: float = knob(5.0, low=2.56, high=1e4, step="run-up", sweep=(2.56, 3.5),
        meaning="fewest samples of a run-up's record in the shortest period of the band")
    stopband_attenuation: float = knob(100.0, low=20.0, high=200.0, unit="dB", step="run-up", sweep=(40.0, 60.0),
        meaning="attenuation of signals that would alias into the band when a run-up is decimated")
    mesh_level: str = knob("table", choices=("table", "contact"), sweep=Sweep(("contact",), finer=True, hours=True),
        meaning="`table`: the mesh law F(θ, δ); `contact`: the contact problem in every step, its slow reference")
    gyroscopic_speeds: int = knob(16, low=1, high=1000, step="run-up", sweep="of a run-up with gyroscopic terms only",
        meaning="speeds of a run-up at which modes with gyroscopic terms are taken")
    shaft_element: float = knob(10e-3, low=1e-4, high=1.0, unit="m", sweep="of flexible shafts only",
        meaning="largest length of a beam element of flexible shafts")
    shaft_frequency: float = knob(10e3, high=1e6, unit="Hz", sweep="of flexible shafts only",
        meaning="upper limit of the kept modes of free flexible shafts; beyond it their statics is kept")
    path_correction: bool = knob(False, sweep=Sweep((True,), finer=True),
        meaning="fourth-order correction of the mesh force, for contact loss. Errors fall by ten and more, but energy "
                "is no longer exact. Steps in which small motions would grow are refused")
    # fmt: on
