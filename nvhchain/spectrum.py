"""Spectra and waterfalls of bearing forces: single-sided complex peak amplitudes, x(t) = Re(X e^{jωt})."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, gcd, isfinite, lcm
from typing import NotRequired, TypedDict, Unpack

import numpy as np
from scipy.fft import rfft
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import make_interp_spline

from nvhchain.errors import InputError, require
from nvhchain.handoff import BearingForces, ComplexArray, FloatArray, ForceSpectrum
from nvhchain.handoff.forces import force_and_moment
from nvhchain.kinds import checked

__all__ = ["force_spectrum", "order_cut", "sweep_waterfall", "waterfall"]

BAND_MARGIN = 2.56
"""Smallest ratio of sampling rate to highest frequency.

The limit of the sampling theorem is 2. Signal analysers usually take 2.56, which leaves room between the band and the
aliased frequencies.
"""

SPLINE_DEGREE = 7
"""Degree of the interpolation from equal times to equal angles.

The amplitude error is below 1e-4 at five samples per period, the smallest number of a run-up, and below 1e-6 at ten
(tests).
"""

ANGLE_OVERSAMPLING = 2.0
"""Ratio of samples in angle to samples in time, mean over a window.

No aliasing occurs while the input speed stays above half its mean over the window.
"""


@checked
def amplitude_spectrum(signal: FloatArray, sample_rate: float, *, periodic: bool) -> tuple[FloatArray, ComplexArray]:
    """Return single-sided complex peak amplitudes of a signal.

    signal (n_t, …): samples at equal times, any unit.
    sample_rate: sampling rate (Hz).
    periodic: True if the record covers whole periods; selects the rectangular window. Otherwise the mean is removed
    and a Hann window applied, amplitude-corrected by its mean.
    Returns frequency (n_f,): frequencies (Hz). amplitude (n_f, …) complex array: peak amplitudes, unit of `signal`.

    The line at 0 Hz is the mean value.  It is not doubled, nor is the line at half the sampling rate, which exists for
    an even number of samples.
    """
    signal = np.asarray(signal, dtype=float)
    require(signal.size > 0 and signal.ndim > 0, f"a signal of shape {signal.shape} has no spectrum: give samples")
    n = len(signal)
    if periodic:
        amplitude = rfft(signal, axis=0) / n
    else:
        window = _hann(n).reshape((n,) + (1,) * (signal.ndim - 1))
        mean = (window * signal).sum(axis=0)
        amplitude = rfft(window * (signal - mean), axis=0)
        amplitude[0] = mean
    last = -1 if n % 2 == 0 else None
    amplitude[1:last] *= 2.0
    return np.arange(len(amplitude), dtype=float) * (sample_rate / n), np.asarray(amplitude, dtype=complex)


@checked
def force_spectrum(
    bearing_forces: BearingForces,
    *,
    low: float,
    high: float,
    resolution: float | None = None,
    orders: Sequence[float] | None = None,
) -> ForceSpectrum:
    """Return the spectrum of all bearing forces in a frequency band.

    Parameters
    ----------
    bearing_forces : BearingForces
        Record of forces (N) at constant or changing speed.
    low, high : float
        Limits of the band (Hz), both included.
    resolution : float, optional
        Required resolution (Hz): the line spacing, or 1.5 line spacings with the Hann window, its noise bandwidth.
    orders : sequence of float, optional
        Orders of the input shaft to keep; others are dropped.  The speed must be constant, and each order must fall on
        a line of the record.

    Returns
    -------
    ForceSpectrum
        Peak amplitudes (N) of the lines in the band.

    Raises
    ------
    InputError
        If the sampling rate is below 2.56 `high`, the record is too short for band or resolution, or an order falls
        between lines.

    Notes
    -----
    The window is rectangular for records of whole common periods, and a Hann window with amplitude correction
    otherwise.
    """
    require(0.0 <= low < high, f"band {low:g}…{high:g} Hz: low must not be negative and high must lie above low")
    rate, n = bearing_forces.sample_rate, len(bearing_forces.time)
    require(
        rate >= BAND_MARGIN * high * (1.0 - 1e-9),
        f"sampling rate {rate:g} Hz is below {BAND_MARGIN} × {high:g} Hz, what the band needs: sample at "
        f"{BAND_MARGIN * high:g} Hz or "
        f"lower the band to {rate / BAND_MARGIN:g} Hz",
    )
    spacing = rate / n
    reached = spacing * (1.0 if bearing_forces.periodic else 1.5)
    require(
        resolution is None or reached <= resolution * (1.0 + 1e-9),
        f"the record of {n / rate:.4g} s resolves {reached:.4g} Hz, but {resolution} Hz is asked for: record "
        f"{reached / spacing / (resolution or 1.0):.4g} s",
    )
    frequency, amplitude = amplitude_spectrum(bearing_forces.wrench, rate, periodic=bearing_forces.periodic)
    # a line at a limit is included in spite of rounding
    inside = np.flatnonzero((frequency >= low - 1e-6 * spacing) & (frequency <= high + 1e-6 * spacing))
    speed = bearing_forces.input_speed
    constant = bool(np.ptp(speed) <= 1e-9 * np.abs(speed).max())
    if orders is not None:
        require(constant, "an order cut needs constant input speed, but the speed varies over the record")
        inside = _lines_of(orders, float(speed[0]) / (2.0 * np.pi), spacing, inside)
    require(
        len(inside) > 0,
        f"no line of the record (spacing {spacing:.4g} Hz) lies in {low:g}…{high:g} Hz: record longer or widen "
        f"the band",
    )
    return ForceSpectrum(
        frequency=frequency[inside],
        **force_and_moment(amplitude[inside]),
        names=bearing_forces.names,
        input_speed=float(speed[0]) if constant else 0.0,
    )


def _lines_of(orders: Sequence[float], turns_per_second: float, spacing: float, limits: np.ndarray) -> np.ndarray:
    """Return the indices of the lines at `orders` that lie in the band; an order between lines is an InputError."""
    place = np.unique(np.asarray(orders, dtype=float)) * turns_per_second / spacing
    off = np.abs(place - np.round(place))
    if len(place) and off.max() > 1e-3:
        worst = float(place[int(np.argmax(off))] * spacing / turns_per_second)
        raise InputError(
            f"order {worst:g} falls between the lines of the record (spacing {spacing / turns_per_second:.4g} "
            f"orders): "
            "record whole periods of it"
        )
    return np.intersect1d(np.round(place).astype(int), limits)


def _hann(n: int) -> FloatArray:
    """Return the periodic Hann window (n,), normalised to the sum 1."""
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
    return np.asarray(window / window.sum())


@dataclass(frozen=True, eq=False)
class Waterfall:
    """Spectra along a record: single-sided complex peak amplitudes of successive windows.

    time (n_window,): middles of the windows (s).
    input_speed (n_window,): mean input speed in each window (rad/s).
    axis (n_line,): frequencies (Hz), or orders of the input if `has_orders`.
    amplitude (n_window, n_line, …): peak amplitudes, unit of the signal.  The phase refers to e^{jωt} from the window's
        start, or to e^{j order angle} from the input's angle at the record's start.
    has_orders: True if `axis` holds orders.
    """

    time: FloatArray
    input_speed: FloatArray
    axis: FloatArray
    amplitude: ComplexArray
    has_orders: bool


class WindowedRecord(TypedDict):
    """Keyword arguments shared by `waterfall` and `order_waterfall`.

    sample_rate: sampling rate (Hz).
    input_speed (n_t,): input speed (rad/s).
    resolution: required resolution: Hz in `waterfall`, orders in `order_waterfall`.  It equals 1.5 line spacings, the
        noise bandwidth of the Hann window.
    high: last line (Hz or order).
    overlap: overlap of successive windows, 0 … 1; 0.75 by default.
    """

    sample_rate: float
    input_speed: FloatArray
    resolution: float
    high: float
    overlap: NotRequired[float]


@checked
def waterfall(signal: FloatArray, **record: Unpack[WindowedRecord]) -> Waterfall:
    """Return short-time spectra against frequency: Hann windows, amplitude-corrected.

    Parameters
    ----------
    signal : (n_t, …) array
        Samples, such as `BearingForces.force`.
    **record : WindowedRecord
        Sampling rate, input speed, resolution and last line (Hz), overlap.

    Returns
    -------
    Waterfall
        One spectrum per window.

    Raises
    ------
    InputError
        If the sampling rate is below 2.56 `high`, or the record is shorter than a window.

    Notes
    -----
    A line is smeared where it sweeps by more than the resolution within a window.  `order_waterfall` avoids this.
    """
    signal, sample_rate, input_speed, resolution, high, overlap = _checked(signal, record)
    require(
        sample_rate >= BAND_MARGIN * high * (1.0 - 1e-9),
        f"sampling rate {sample_rate:g} Hz is below {BAND_MARGIN} × {high:g} Hz, what the band needs: lower the band "
        f"to {sample_rate / BAND_MARGIN:g} Hz",
    )
    width = ceil(1.5 * sample_rate / resolution * (1.0 - 1e-9))
    require(
        width <= len(signal),
        f"the record of {len(signal) / sample_rate:.4g} s is shorter than a window of {width / sample_rate:.4g} s: "
        "record longer or resolve less",
    )
    first = np.arange(0, len(signal) - width + 1, max(1, round(width * (1.0 - overlap))))
    kept = int(high * width / sample_rate * (1.0 + 1e-9)) + 1
    spectra = [
        amplitude_spectrum(signal[begin : begin + width], sample_rate, periodic=False)[1][:kept] for begin in first
    ]
    return Waterfall(
        time=np.asarray((first + 0.5 * (width - 1)) / sample_rate, dtype=float),
        input_speed=np.array([input_speed[begin : begin + width].mean() for begin in first]),
        axis=np.arange(kept, dtype=float) * (sample_rate / width),
        amplitude=np.array(spectra),
        has_orders=False,
    )


@checked
def order_waterfall(signal: FloatArray, **record: Unpack[WindowedRecord]) -> Waterfall:
    """Return short-angle spectra against order of the input (computed order tracking).

    signal (n_t, …): samples at equal times.
    **record: sampling rate, input speed (not negative), resolution and last line (orders), overlap.
    Returns one spectrum per window; windows last 1.5 / resolution turns of the input.

    The signal is interpolated to equal angles, so that an order stays on its line at any speed.  The angle is the
    integral of the input speed.  Lines above the band of the record (sampling rate / 2.56) are set to 0.

    Source: K. R. Fyfe, E. D. S. Munck, Mech. Syst. Signal Process. 11 (1997) 187–205.
    """
    signal, sample_rate, input_speed, resolution, high, overlap = _checked(signal, record)
    require(bool((input_speed >= 0.0).all()), "the input turns backwards: orders need a speed that is not negative")
    time = np.arange(len(signal)) / sample_rate
    turned = cumulative_trapezoid(input_speed / (2.0 * np.pi), dx=1.0 / sample_rate, initial=0.0)
    moving = np.concatenate([[True], np.diff(turned) > 0.0])
    turns = 1.5 / resolution
    require(
        turns <= turned[-1] * (1.0 + 1e-9),
        f"the input turns {turned[-1]:.4g} times in the record, but a window takes {turns:.4g} turns: record longer or "
        "resolve less",
    )
    begins = np.arange(0.0, turned[-1] * (1.0 + 1e-9) - turns, max(1e-9, turns * (1.0 - overlap)))
    curve = make_interp_spline(time, signal, k=SPLINE_DEGREE)
    kept = int(high * turns * (1.0 + 1e-9)) + 1
    axis = np.arange(kept) / turns
    spectra, middle, speed = [], [], []
    for begin in begins:
        edges = np.interp([begin, begin + turns], turned[moving], time[moving])
        count = max(2 * kept, ceil(ANGLE_OVERSAMPLING * (edges[1] - edges[0]) * sample_rate))
        instants = np.interp(begin + turns * np.arange(count) / count, turned[moving], time[moving])
        _, amplitude = amplitude_spectrum(np.asarray(curve(instants)), count / turns, periodic=False)
        fastest = float(np.interp(instants, time, input_speed).max()) / (2.0 * np.pi)
        amplitude = amplitude[:kept] * _broadcastable(np.exp(-2j * np.pi * axis * begin), amplitude.ndim)
        amplitude[axis * fastest > sample_rate / BAND_MARGIN] = 0.0
        spectra.append(amplitude)
        middle.append(0.5 * (edges[0] + edges[1]))
        speed.append(2.0 * np.pi * turns / (edges[1] - edges[0]))
    return Waterfall(np.array(middle), np.array(speed), axis, np.array(spectra), True)


@checked
def sweep_waterfall(records: Sequence[BearingForces], quantity: str = "force", *, high: float) -> Waterfall:
    """Return the orders of steady records over their speeds: a waterfall without windows.

    Parameters
    ----------
    records : sequence of BearingForces
        Periodic records at different constant speeds, such as those of `dynamics.bearing_forces`.
    quantity : str
        Name of a quantity of `BearingForces.recorded`.
    high : float
        Last order.

    Returns
    -------
    Waterfall
        One spectrum per record, in rising speed.

    Raises
    ------
    InputError
        If records are not periodic, change their speed, repeat a speed or are sampled too coarsely.

    Notes
    -----
    The lines are those common to all records: multiples of one over the turns of their common period.  Phases refer to
    e^{j order angle} from each record's start.  `Waterfall.time` counts as if the records followed each other.
    """
    require(
        len(records) > 0 and high > 0.0, f"{len(records)} records to order {high:g}: give one, and an order above 0"
    )
    for record in records:
        speed = record.input_speed
        require(
            record.periodic and float(speed[0]) > 0.0 and float(np.ptp(speed)) <= 1e-9 * float(speed[0]),
            "a sweep of steady speeds takes periodic records at constant speed above 0: use order_waterfall for others",
        )
    ordered = sorted(records, key=lambda record: float(record.input_speed[0]))
    speeds = np.array([float(record.input_speed[0]) for record in ordered])
    require(bool((np.diff(speeds) > 0.0).all()), f"speeds repeat: {speeds} rad/s; give every speed once")
    durations = np.array([len(record.time) / record.sample_rate for record in ordered])
    turns = speeds / (2.0 * np.pi) * durations
    repeats = _whole_multiples(turns)
    count = int(high * turns[0] / repeats[0] * (1.0 + 1e-9)) + 1
    amplitudes = []
    for record, repeat, turned in zip(ordered, repeats, turns, strict=True):
        require(
            len(record.time) / turned >= BAND_MARGIN * high * (1.0 - 1e-9),
            f"the record at {record.input_speed[0]:g} rad/s has {len(record.time) / turned:.4g} samples per turn, "
            f"below {BAND_MARGIN} × order {high:g}: lower `high` to {len(record.time) / turned / BAND_MARGIN:.4g}",
        )
        amplitude = amplitude_spectrum(record.recorded(quantity), record.sample_rate, periodic=True)[1]
        amplitudes.append(amplitude[: (count - 1) * repeat + 1 : repeat])
    return Waterfall(
        time=np.cumsum(durations) - 0.5 * durations,
        input_speed=speeds,
        axis=np.arange(count) * (repeats[0] / turns[0]),
        amplitude=np.array(amplitudes),
        has_orders=True,
    )


def _whole_multiples(turns: FloatArray) -> list[int]:
    """Return the ratios of `turns` to their greatest common divisor; turns without one are an InputError."""
    ratios = [Fraction(float(t / turns[0])).limit_denominator(1000) for t in turns]
    require(
        all(abs(float(r) * turns[0] / t - 1.0) <= 1e-6 for r, t in zip(ratios, turns, strict=True)),
        f"records over {turns} turns of the input have no common period: they are not of one gearbox",
    )
    common = Fraction(gcd(*(r.numerator for r in ratios)), lcm(*(r.denominator for r in ratios)))
    return [int(r / common) for r in ratios]


@checked
def order_cut(waterfall: Waterfall, orders: Sequence[float]) -> ComplexArray:
    """Return the amplitudes of single orders along an order waterfall.

    Parameters
    ----------
    waterfall : Waterfall
        Waterfall of orders.
    orders : sequence of float
        Orders to pick; each must be a line of the waterfall.

    Returns
    -------
    (n_window, n_order, …) complex array
        Peak amplitudes, in the order of `orders`.

    Raises
    ------
    InputError
        If the waterfall has no order axis, or an order is not one of its lines.
    """
    require(waterfall.has_orders, "an order cut needs a waterfall of orders: make it with order_waterfall")
    spacing = float(waterfall.axis[1]) if len(waterfall.axis) > 1 else 1.0
    found = _lines_of(orders, 1.0, spacing, np.arange(len(waterfall.axis)))
    require(
        len(found) == len(np.unique(np.asarray(orders))),
        f"orders {list(orders)} reach beyond the waterfall's last, {waterfall.axis[-1]:g}: raise its `high`",
    )
    return np.asarray(waterfall.amplitude[:, np.round(np.asarray(orders) / spacing).astype(int)])


def _broadcastable(line: ComplexArray, dimensions: int) -> ComplexArray:
    """Append axes to `line` (n,) for multiplication along the first axis of an array of `dimensions` axes."""
    return line.reshape((-1,) + (1,) * (dimensions - 1))


def _checked(signal: FloatArray, record: WindowedRecord) -> tuple[FloatArray, float, FloatArray, float, float, float]:
    """Check a windowed record; return signal, sampling rate, input speed, resolution, last line and overlap."""
    signal, input_speed = np.asarray(signal, dtype=float), np.asarray(record["input_speed"], dtype=float)
    sample_rate, resolution, high = record["sample_rate"], record["resolution"], record["high"]
    overlap = record.get("overlap", 0.75)
    require(
        signal.ndim > 0 and input_speed.shape == (len(signal),) and len(signal) > SPLINE_DEGREE,
        f"a signal of shape {signal.shape} and speeds of shape {input_speed.shape}: give the same number of samples, "
        f"more than {SPLINE_DEGREE}",
    )
    for name, values in (("signal", signal), ("input_speed", input_speed)):
        bad = np.argwhere(~np.isfinite(values))
        require(
            len(bad) == 0, f"{name} is not finite in sample {bad[0][0] if len(bad) else 0}: repair or cut the record"
        )
    require(0.0 <= overlap < 1.0, f"overlap = {overlap} must be at least 0 and below 1")
    for name, value in (("sample_rate", sample_rate), ("resolution", resolution), ("high", high)):
        require(isfinite(value) and value > 0.0, f"{name} = {value} must be positive and finite")
    require(resolution <= high, f"resolution = {resolution:g} is coarser than the whole band to {high:g}: resolve more")
    return signal, sample_rate, input_speed, resolution, high, overlap
