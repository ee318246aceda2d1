"""Time axes of imported records: uniform ones pass, others are refused or resampled without aliases."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator, make_interp_spline

from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray

JITTER = 1e-4
"""Largest relative difference of a step from the mean step that counts as uniform (as in `BearingForces`)."""

GAP = 1.5
"""Least gap over the median step."""

USABLE_BAND = 1.0 / 2.56
"""Usable band over the new sampling rate: the band is kept, components that would fold into it are removed."""

STOP_BAND = 80.0
"""Attenuation (dB) of components that would fold into the usable band."""

OVERSAMPLING = 4.0
"""Least rate at which the record's spline is read before filtering, over the record's own rate."""

SPLINE_DEGREE = 5

FEWEST = 8
"""Least number of samples of a record, before and after resampling."""


def uniform_time(time: FloatArray, source: str) -> FloatArray:
    """Return `time` if it rises uniformly; InputError names the first step back, gap or the jitter otherwise."""
    step = _steps(time, source)
    mean = float(step.mean())
    gap = np.flatnonzero(step > GAP * np.median(step))
    if len(gap):
        first_gap = int(gap[0])
        raise InputError(
            f"{source}: gap of {step[first_gap]:.4g} s after t = {time[first_gap]:.6g} s in a record with steps of "
            f"{np.median(step):.4g} s ({len(gap)} gaps): cut the record there or give resample_rate"
        )
    jitter = float(np.abs(step - mean).max() / mean)
    require(
        jitter < JITTER,
        f"{source}: steps differ by up to {100 * jitter:.3g} % from their mean of {mean:.6g} s: give resample_rate, or "
        "sample_rate and no time_channel if the clock was steady and only its digits are few",
    )
    return time


def resampled(time: FloatArray, values: FloatArray, rate: float, source: str) -> tuple[FloatArray, FloatArray]:
    """Resample values (n, …) to `rate` Hz without aliases, by an interpolating spline and a linear-phase FIR filter.

    Components up to rate/2.56 are kept; those that would fold into that band lose 80 dB. The first and last few samples
    carry the filter's transient, with the ends continued at their values. A monotone cubic bridges gaps up to the new
    step, so no value beyond their ends appears. Oscillations in a gap are lost, and tones are wrong within a few new
    samples of it.

    Raises InputError if two samples lie further apart than the new step, because the record cannot carry the rate. It
    also refuses records of fewer than 8 samples, before or after.
    """
    step = _steps(time, source)
    widest = int(np.argmax(step))
    require(
        float(step[widest]) <= (1.0 + JITTER) / rate,
        f"{source}: {step[widest]:.4g} s without a sample after t = {time[widest]:.6g} s cannot carry resample_rate = "
        f"{rate:g} Hz: lower it to {1 / step[widest]:.4g} Hz or cut the record",
    )
    require(len(time) >= FEWEST, f"{source}: {len(time)} samples are too few to resample: {FEWEST} are needed")
    span = float(time[-1] - time[0])
    count = int(np.floor(span * rate * (1.0 + 1e-12))) + 1
    require(
        count >= FEWEST,
        f"{source}: resample_rate = {rate:g} Hz leaves {count} samples of {span:.4g} s, but {FEWEST} are needed: raise "
        f"it to {FEWEST / span:.4g} Hz or more",
    )
    own = (len(time) - 1) / span
    time, values = _bridged(time, values, step, max(float(np.median(step)), 1.0 / (OVERSAMPLING * own)))
    factor = int(np.ceil(OVERSAMPLING * own / rate))
    grid = np.minimum(time[0] + np.arange((count - 1) * factor + 1) / (rate * factor), time[-1])
    dense = make_interp_spline(time, values, k=SPLINE_DEGREE)(grid)
    from scipy.signal import firwin, kaiserord, upfirdn  # slow to import

    taps, beta = kaiserord(STOP_BAND, 2.0 * (1.0 - 2.0 * USABLE_BAND) / factor)
    half = taps // 2 + 1
    low_pass = firwin(2 * half + 1, 1.0 / factor, window=("kaiser", beta))
    padded = np.concatenate([np.repeat(dense[:1], half, axis=0), dense, np.repeat(dense[-1:], half, axis=0)])
    # leading zeros put the first kept sample, where the filter lies wholly inside, on a multiple of the factor
    lead = -2 * half % factor
    first = (2 * half + lead) // factor
    delayed = np.concatenate([np.zeros(lead), low_pass])
    filtered = upfirdn(delayed, padded, down=factor, axis=0)[first : first + count]
    return time[0] + np.arange(count) / rate, np.ascontiguousarray(filtered)


def _bridged(time: FloatArray, values: FloatArray, step: FloatArray, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Return the record with gaps filled, at most `spacing` (s) apart; the spline alone would oscillate there."""
    gaps = np.flatnonzero(step > GAP * np.median(step))
    if not len(gaps):
        return time, values
    missing = np.concatenate(
        [np.linspace(time[i], time[i + 1], int(np.ceil(step[i] / spacing)) + 1)[1:-1] for i in gaps]
    )
    whole = np.concatenate([time, missing])
    order = np.argsort(whole, kind="stable")
    return whole[order], np.concatenate([values, PchipInterpolator(time, values, axis=0)(missing)])[order]


def _steps(time: FloatArray, source: str) -> FloatArray:
    require(len(time) >= 2, f"{source}: {len(time)} samples: at least 2 are needed")
    step = np.diff(time)
    if not bool((step > 0).all()):
        sample = int(np.argmin(step > 0))
        raise InputError(
            f"{source}: time goes {time[sample]:.9g} → {time[sample + 1]:.9g} s after sample {sample}: it must "
            "increase strictly; remove repeated samples, or give sample_rate and no time_channel if only its digits "
            "are few"
        )
    return np.asarray(step)
