"""Figures of a comparison; this module opens matplotlib, which takes half a second."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nvhchain import levels, plots
from nvhchain.case import GearboxCase
from nvhchain.chain import Result, SteadyMap
from nvhchain.error_band import ErrorBand
from nvhchain.plots.files import save
from nvhchain.report.marks import order_marks
from nvhchain.report.pictures.names import RUN_UP, STEADY, SURFACE
from nvhchain.report.run_up import curve_title, curves_of, run_up_maps

_RANGE = 45.0
"""Range of the figure of levels over speed (dB) below the highest level."""

_RPM = 30.0 / pi


@contextmanager
def surface_pictures(results: Mapping[str, Result], out: Path) -> Iterator[None]:
    """Render pictures of the surfaces, which take seconds each, in a thread, and save them at the end.

    They show the line that is loudest in dB(A) at the first field point.
    """
    moving = {name: result for name, result in results.items() if result.surface_velocity is not None}
    lines = {name: _loudest_line(result) for name, result in moving.items()}
    with ThreadPoolExecutor(max_workers=1) as executor:
        pictures = {
            name: executor.submit(plots.rendered_surface, result.surface_velocity, line=lines[name])  # type: ignore[arg-type]
            for name, result in moving.items()
        }
        try:
            yield
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise
        for name, picture in pictures.items():
            velocity, image = results[name].surface_velocity, picture.result()
            assert velocity is not None
            axes = plots.surface_velocity(velocity, line=lines[name], name=name, image=image, engine="matplotlib")
            save([axes], out / SURFACE.format(name))


def _loudest_line(result: Result) -> int | None:
    """Return the line of the surface velocity that is loudest in dB(A) at the first field point."""
    velocity, pressure = result.surface_velocity, result.pressure
    assert velocity is not None
    if pressure is None:
        return None
    weighted = levels.decibel(pressure.pressure[:, 0]) + levels.a_weighting(pressure.frequency)
    return int(np.abs(velocity.frequency - pressure.frequency[weighted.argmax()]).argmin())


def run_up_figures(results: Mapping[str, Result], out: Path) -> None:
    """Draw waterfalls and curves over speed at the first field point."""
    marks = order_marks([result.case for result in results.values()])
    histories = {name: result.pressure_history for name, result in results.items() if result.pressure_history}
    band = max(result.case.band.high for result in results.values() if isinstance(result.case, GearboxCase))
    maps = run_up_maps(histories, marks, high=band)
    *pictures, levels_picture = RUN_UP
    for number, picture in enumerate(pictures):
        drawn = {name: waterfalls[number] for name, waterfalls in maps.items()}
        save(plots.waterfall_maps(drawn, unit="Pa", marks=marks), out / picture)
    profiles = {
        name: {curve_title(curve): (curve.speed, curve.level) for curve in curves}
        for name, curves in curves_of(maps, marks).items()
    }
    save(plots.levels_over_speed(profiles), out / levels_picture)


def steady_figures(results: Mapping[str, Result], curves: Mapping[str, Mapping[str, Any]], out: Path) -> None:
    """Draw sound, forces and transmission errors.

    curves: name of a result → its transmission errors by stage.
    """
    spectrum, history, bearings, transmission = (out / name for name in STEADY)
    pressures = {name: result.pressure for name, result in results.items() if result.pressure is not None}
    marks = order_marks([result.case for result in results.values()])
    bands = {name: band for name in pressures if isinstance(band := results[name].error_band, ErrorBand)}
    save(plots.pressure_spectrum(pressures, marks=marks, bands=bands), spectrum)
    steady = {name: pressure for name, pressure in pressures.items() if pressure.input_speed}
    if steady:
        save(plots.pressure_history(steady), history)
    spectra = {name: r.force_spectrum for name, r in results.items() if r.force_spectrum is not None}
    if spectra:
        save(plots.bearing_force_spectra(spectra, marks=marks), bearings)
    errors: dict[str, dict[str, Any]] = {}
    for name, stage_curves in curves.items():
        for stage, curve in stage_curves.items():
            errors.setdefault(stage, {})[name] = curve
    if errors:
        save(plots.transmission_errors(errors), transmission)


def states_figure(maps: Mapping[str, SteadyMap], results: Mapping[str, Result], file: Path) -> None:
    """Draw levels over speed, and beside them the A-weighted spectra at the speed of the cases."""
    figure = Figure(figsize=(15.0, 5.0), layout="constrained")
    speed_axes, spectrum = figure.subplots(1, 2, width_ratios=(0.42, 0.58))
    place = next(iter(results.values())).case.field_points[0].name
    title = f"A-weighted sound pressure level at {place}, with 95 % limits, dB(A) re 20 µPa"
    plots.levels_over_speed(
        {name: {title: (steady.speed, steady.level[0, :, 0])} for name, steady in maps.items()},
        dynamic_range=_RANGE,
        limits={name: {title: steady.limits[0, :, 0]} for name, steady in maps.items()},
        axes=[speed_axes],
    )
    pressures = {name: result.pressure for name, result in results.items() if result.pressure is not None}
    bands = {name: band for name in pressures if isinstance(band := results[name].error_band, ErrorBand)}
    plots.pressure_spectrum(
        pressures,
        marks=order_marks([result.case for result in results.values()]),
        bands=bands,
        weighted=True,
        axes=[spectrum],
    )
    speeds = sorted({_RPM * pressure.input_speed for pressure in pressures.values()})
    for speed in speeds:
        speed_axes.axvline(speed, color="#8C8C8C", linestyle=":", zorder=0)
    speed_text = " and ".join(f"{speed:.6g}" for speed in speeds)
    spectrum.set_title(f"A-weighted lines at {speed_text} rpm (dotted on the left)", loc="left")
    save([speed_axes, spectrum], file)
