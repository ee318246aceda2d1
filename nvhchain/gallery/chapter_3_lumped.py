"""Chapter 3, gear pairs with one degree of freedom: run-ups, sweeps, waterfalls, spectra and the harmonic study."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial

import numpy as np

from nvhchain import plots
from nvhchain.gallery.item import Item, Numbers, Place, Stated
from nvhchain.handoff import FloatArray
from nvhchain.lumped import (
    BASE_RADIUS,
    THESIS_PAIRS,
    GearPair,
    SweepResponse,
    order_lines,
    pair_from_error,
    run_up,
    static_transmission_error,
    steady_motion,
    steady_sweep,
    thesis_pair,
)
from nvhchain.plots.files import save
from nvhchain.spectrum import waterfall

SPAN = "3.5-3.16"
ORDER_UNKNOWN = "The order of the figures in the span is not recorded; the parts follow the text of the chapter."

TOP = 5000.0 / 60.0 * 57.0
"""Mesh frequency (Hz) at 5000 rpm."""

YES, NO = Stated(1.0), Stated(0.0)

DURATION = 200.0
"""Duration (s) of the run-up."""

CYCLES_SHOWN = 475
"""Mesh cycles averaged to one point of the figure of a run-up."""

SWEPT = np.arange(500.0, 4751.0, 5.0)
STUDY_STEP = 5.0
STUDIED = np.arange(1500.0, 4500.0, STUDY_STEP)
"""Mesh frequencies (Hz) of the sweeps of the four pairs, and of the study."""

HYSTERESIS = 1e-6
"""Difference of sweeps up and down (m) from which a pair jumps."""

JUMP = 1.5e-6
"""Rise (m) within 5 Hz from which a response jumps."""

FOOT_TO_TOP = 20.0
"""Distance (Hz) from a jump within which its foot and its top lie."""

Harmonics = tuple[float, float, float]
"""STE_av, STE_m and STE_h in µm."""


@cache
def _swept_pairs() -> tuple[SweepResponse, SweepResponse]:
    """Return the sweeps of the four pairs up and down."""
    pairs = [thesis_pair(name) for name in THESIS_PAIRS]
    return steady_sweep(pairs, SWEPT), steady_sweep(pairs, SWEPT[::-1])


def titles() -> list[str]:
    """Return the names of the four pairs."""
    return [f"({name}) {data.blank}" for name, data in THESIS_PAIRS.items()]


def _thinned(response: SweepResponse) -> SweepResponse:
    """Return the quadratic mean of `CYCLES_SHOWN` cycles at a time."""
    count = len(response.mesh_frequency) // CYCLES_SHOWN * CYCLES_SHOWN

    def blocks(values: FloatArray) -> FloatArray:
        return values[:count].reshape(-1, CYCLES_SHOWN, *values.shape[1:])

    rms = np.sqrt(np.square(blocks(response.cycle_rms)).mean(axis=1))
    return SweepResponse(
        blocks(response.mesh_frequency).mean(axis=1),
        rms,
        rms,
        blocks(response.mean).mean(axis=1),
        blocks(response.lowest).min(axis=1),
        blocks(response.highest).max(axis=1),
        response.half_backlash,
    )


def run_ups(place: Place) -> Numbers:
    """Run the four pairs up and down, 0 to 5000 rpm in 200 s."""
    pairs = [thesis_pair(name) for name in THESIS_PAIRS]
    up, down = (
        _thinned(run_up(pairs, start=a, stop=b, duration=DURATION).response) for a, b in ((0.0, TOP), (TOP, 0.0))
    )
    save(plots.sweep_responses(up, down, titles()), place.picture)
    found: Numbers = {}
    for i, name in enumerate(THESIS_PAIRS):
        peak = int(np.argmax(up.rms[:, i]))
        found[f"peak of {name} / µm"] = 1e6 * float(up.rms[peak, i])
        found[f"peak of {name} at / Hz"] = float(up.mesh_frequency[peak])
    return found


def sweeps(place: Place) -> Numbers:
    """Sweep the four pairs up and down in steady steps of 5 Hz."""
    up, down = _swept_pairs()
    save(plots.sweep_responses(up, down, titles()), place.picture)
    apart = np.abs(up.cycle_rms - down.cycle_rms[::-1]).max(axis=0)
    found: Numbers = {f"{name} jumps / yes": float(apart[i] > HYSTERESIS) for i, name in enumerate(THESIS_PAIRS)}
    for i, name in enumerate(THESIS_PAIRS):
        found[f"up against down, {name} / µm"] = 1e6 * float(apart[i])
    return found


def pair_waterfall(place: Place, name: str) -> Numbers:
    """Map the run-up of one pair over speed and frequency."""
    rate = 50e3
    passed = run_up([thesis_pair(name)], start=0.0, stop=TOP, duration=DURATION, sample_rate=rate)
    speed = 2.0 * np.pi / 57.0 * passed.mesh_frequency
    error = 1e6 * (passed.error - passed.error.mean())
    mapped = waterfall(error, sample_rate=rate, input_speed=speed, resolution=30.0, high=8e3, overlap=0.0)
    title = f"({name}) {THESIS_PAIRS[name].blank}, dynamic transmission error"
    marks = plots.OrderMarks(mesh={"mesh": 57.0})
    save(plots.waterfall_maps({title: mapped}, unit="µm", marks=marks, dynamic_range=80.0), place.picture)
    return {"largest line / µm": float(np.abs(mapped.amplitude[:, 1:]).max())}


def spectra(place: Place) -> Numbers:
    """Draw the orders of pairs b and d at 96 % of their resonance."""
    up, _ = _swept_pairs()
    drawn: dict[str, tuple[FloatArray, FloatArray]] = {}
    found: Numbers = {}
    for i, name in enumerate(THESIS_PAIRS):
        if name not in ("b", "d"):
            continue
        speed = 0.96 * float(up.mesh_frequency[np.argmax(up.cycle_rms[:, i])])
        motion = steady_motion([thesis_pair(name)], speed)
        orders, lines = order_lines(motion.error[:, 0], motion.mesh_cycles, 57)
        drawn[f"({name}) {THESIS_PAIRS[name].blank}, mesh frequency {speed:.0f} Hz"] = orders, lines
        blank = THESIS_PAIRS[name].blank_order
        for order in (57, 57 - blank, 57 + blank):
            found[f"{name}, order {order} / µm"] = 1e6 * float(lines[np.argmin(np.abs(orders - order))])
        found[f"{name} has sidebands / yes"] = float(found[f"{name}, order {57 - blank} / µm"] > 0.01)
    save(plots.order_spectra(drawn, mesh_order=57.0), place.picture)
    return found


def study_pair(harmonics: Harmonics) -> GearPair:
    """Return a pair of the harmonic study: N_t = 57, N_h = 8, 350 Nm, 6 % damping."""
    average, mesh, blank = (1e-6 * value for value in harmonics)
    error, cycles = static_transmission_error(average=average, mesh=mesh, blank=blank, teeth=57, blank_order=8)
    return pair_from_error(
        error, force=350.0 / BASE_RADIUS, mass=0.65, mesh_cycles=cycles, damping_ratio=0.06, half_backlash=50e-6
    )


def jumps(rms: FloatArray) -> FloatArray:
    """Return the mesh frequencies (n,) in Hz beyond which a response of the study jumps."""
    rise = np.abs(np.diff(rms))
    peak = (rise > JUMP) & (rise >= np.roll(rise, 1)) & (rise >= np.roll(rise, -1))
    return np.asarray(STUDIED[:-1][peak])


def jump_height(rms: FloatArray, frequency: float) -> float:
    """Return the height (m) of a jump of the study from foot to top; steps of 1 and 5 Hz give the same within 2 %."""
    return float(np.ptp(rms[np.abs(STUDIED - frequency) <= FOOT_TO_TOP]))


def study(place: Place, rows: Sequence[Harmonics], varied: int) -> Numbers:
    """Sweep pairs with given harmonics of the static transmission error up and down.

    rows: STE_av, STE_m and STE_h of each pair (µm).
    varied: place in the rows of the amplitude that is varied.
    """
    pairs = [study_pair(row) for row in rows]
    up, down = steady_sweep(pairs, STUDIED), steady_sweep(pairs, STUDIED[::-1])
    titles = [f"av {average:g}, mesh {mesh:g}, blank {blank:g} µm" for average, mesh, blank in rows]
    save(plots.sweep_responses(up, down, titles), place.picture)
    found: Numbers = {}
    responses = {"rising": up.rms, "falling": down.rms[::-1]}
    for i, row in enumerate(rows):
        label = f"{('STE_av', 'STE_m', 'STE_h')[varied]} {row[varied]:g}"
        found[f"{label}: contact lost over, rising / Hz"] = STUDY_STEP * float(up.loses_contact[:, i].sum())
        for way, rms in responses.items():
            jump_frequencies = jumps(rms[:, i])
            found[f"{label}: peak, {way} / µm"] = 1e6 * float(rms[:, i].max())
            found[f"{label}: peak at, {way} / Hz"] = float(STUDIED[rms[:, i].argmax()])
            found[f"{label}: jumps, {way} / count"] = float(len(jump_frequencies))
            if len(jump_frequencies):
                # main jump: that of the mesh order; sidebands meet the resonance above it
                found[f"{label}: main jump, {way} / Hz"] = float(jump_frequencies[0])
                found[f"{label}: height of main jump, {way} / µm"] = 1e6 * jump_height(
                    rms[:, i], float(jump_frequencies[0])
                )
    return found


def stiffness_orders(place: Place) -> Numbers:
    """Draw the orders of an error and of the stiffness F/STE that follows from it."""
    average, mesh, blank = 28e-6, 4e-6, 5e-6
    error, cycles = static_transmission_error(average=average, mesh=mesh, blank=blank, teeth=57, blank_order=8)
    orders, error_lines = order_lines(error, cycles, 57)
    _, stiffness_lines = order_lines(average**2 / error, cycles, 57)
    drawn = {
        "static transmission error": (orders, error_lines),
        "its inverse, as in the stiffness F/STE, times STE_av²": (orders, stiffness_lines),
    }
    save(plots.order_spectra(drawn, mesh_order=57.0, spacing=8.0, highest=130.0), place.picture)
    sides = [int(np.argmin(np.abs(orders - order))) for order in (49.0, 65.0)]
    return {
        "STE, order 57 / µm": 1e6 * float(error_lines[np.argmin(np.abs(orders - 57.0))]),
        "STE, orders 49 and 65 / µm": 1e6 * float(error_lines[sides].max()),
        "1/STE, order 49 / µm": 1e6 * float(stiffness_lines[sides[0]]),
        "1/STE, order 65 / µm": 1e6 * float(stiffness_lines[sides[1]]),
    }


AVERAGES: tuple[Harmonics, ...] = ((18, 4, 0), (22, 4, 0), (25, 4, 0), (28, 4, 0), (38, 4, 0))
MESH: tuple[Harmonics, ...] = ((22, 2, 0), (22, 3, 0), (22, 4, 0), (22, 6, 0))
BLANK: tuple[Harmonics, ...] = ((18, 4, 0), (18, 4, 2.5), (18, 4, 5), (18, 4, 10))
BOTH: tuple[Harmonics, ...] = ((18, 3.8, 10), (22, 3.8, 10), (28, 3.8, 10), (38, 3.8, 10))


def _part(
    letter: str,
    title: str,
    make: Callable[[Place], Numbers],
    stated: Mapping[str, Stated],
    verdict: str,
    ours: Mapping[str, Stated] | None = None,
) -> Item:
    return Item(f"{SPAN}{letter}", title, verdict, make, stated, ORDER_UNKNOWN, ours=ours or {})


ITEMS = (
    Item(
        "3.14",
        "Transmission errors with STE_h = 10 µm and STE_m = 3.8 µm, swept up and down, over STE_av",
        "Ours alone, as the project records no number of this figure: a larger STE_av lowers the resonance, and only "
        "18 µm leave jumps.",
        partial(study, rows=BOTH, varied=0),
        reading="10 µm is taken as STE_h, 3.8 µm as STE_m; STE_av takes the values of the study.",
    ),
    _part(
        "a",
        "Run-up of the four pairs of table 3.2, 0 to 5000 rpm in 200 s, and back",
        run_ups,
        {},
        "Ours alone, as the project records no height of the thesis's curves: pairs a, b and c jump, d does "
        "not, and a jumps on the way up within 10 Hz of where its periodic motion folds back, 3013 Hz.",
        {"peak of a at / Hz": Stated(3013.0, 10.0 / 3013.0)},
    ),
    _part(
        "b",
        "Steady sweeps of the four pairs up and down",
        sweeps,
        {f"{name} jumps / yes": YES if name != "d" else NO for name in THESIS_PAIRS},
        "Agrees: a, b and c jump at their resonance and d does not, although its blank order is the largest.",
    ),
    _part(
        "c",
        "Waterfall of pair b, 8 holes",
        partial(pair_waterfall, name="b"),
        {},
        "Ours alone, as the project records no level of the thesis's map: the mesh order and its harmonics meet the "
        "resonance, with sidebands at n times 8 orders.",
    ),
    _part(
        "d",
        "Waterfall of pair d, 3 slots",
        partial(pair_waterfall, name="d"),
        {},
        "Ours alone, as the project records no level of the thesis's map: sidebands 3 orders apart crowd about the "
        "mesh order.",
    ),
    _part(
        "e",
        "Spectra of pairs b and d just below resonance",
        spectra,
        {"b has sidebands / yes": YES, "d has sidebands / yes": YES},
        "Agrees: sidebands stand at 57 ± 8 and 57 ± 3, and those of d reach 70 % of its mesh order.",
    ),
    _part(
        "f",
        "Harmonic study: STE_av 18 to 38 µm, STE_m 4 µm",
        partial(study, rows=AVERAGES, varied=0),
        {},
        "Agrees in part: a larger STE_av lowers the resonance and narrows contact loss. It raises the peak for rising "
        "speed, up to 25 µm only, by 9 %; for falling speed the peak falls throughout, by 1.3 % at 38 µm. The main "
        "jump becomes lower and is gone at 28 µm.",
        {
            f"STE_av {average}: peak, {way} / µm": Stated(peak, 4e-3)
            for way, peaks in (
                ("rising", (21.72, 23.37, 23.79, 23.70, 23.58)),
                ("falling", (23.89, 23.86, 23.79, 23.70, 23.58)),
            )
            for (average, _, _), peak in zip(AVERAGES, peaks, strict=True)
        },
    ),
    _part(
        "g",
        "Harmonic study: STE_m 2 to 6 µm, STE_av 22 µm",
        partial(study, rows=MESH, varied=1),
        {},
        "Agrees: a larger STE_m scales the linear part of the curve and widens contact loss; where contact is lost the "
        "peak moves down, from 2975 to 2660 Hz.",
    ),
    _part(
        "h",
        "Harmonic study: STE_h 0 to 10 µm, STE_av 18 µm, STE_m 4 µm",
        partial(study, rows=BLANK, varied=2),
        {},
        "Agrees in part: STE_h leaves the main jump in place within 1.5 % for rising speed, but moves it 6.3 % up for "
        "falling speed; it adds a jump where a sideband meets the resonance. The main jump keeps its height within "
        "3 % up to 5 µm and loses 20 % at 10 µm for rising speed; for falling speed it loses half.",
        {
            "STE_h 0: main jump, rising / Hz": Stated(3020.0, 3e-3),
            "STE_h 10: main jump, rising / Hz": Stated(3065.0, 3e-3),
            "STE_h 0: main jump, falling / Hz": Stated(2860.0, 3e-3),
            "STE_h 10: main jump, falling / Hz": Stated(3040.0, 3e-3),
            "STE_h 0: height of main jump, rising / µm": Stated(8.7, 0.03),
            "STE_h 5: height of main jump, rising / µm": Stated(8.7, 0.03),
            "STE_h 10: height of main jump, rising / µm": Stated(7.0, 0.03),
            "STE_h 0: height of main jump, falling / µm": Stated(14.2, 0.03),
            "STE_h 10: height of main jump, falling / µm": Stated(7.0, 0.03),
        },
    ),
    _part(
        "i",
        "Orders of an STE and of the stiffness F/STE",
        stiffness_orders,
        {"STE, orders 49 and 65 / µm": Stated(0.0, 1e-6)},
        "Agrees: the stiffness has sidebands at 57 ± 8, which the transmission error itself does not have.",
    ),
)
