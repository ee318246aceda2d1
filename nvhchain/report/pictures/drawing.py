"""Figure of hand-offs of one kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nvhchain import plots, spectrum
from nvhchain.errors import InputError, require
from nvhchain.files import hdf5
from nvhchain.gear import quasi_static_transmission_error
from nvhchain.handoff import (
    BearingForces,
    Directivity,
    FieldPressure,
    ForceSpectrum,
    GearField,
    HandOff,
    MeshLaw,
    PressureHistory,
    RadiationEfficiency,
    ReducedHousing,
    SoundPower,
    SurfaceVelocity,
)
from nvhchain.interop import write_gear_field_vtu
from nvhchain.names import printable
from nvhchain.plots.files import check_format, save
from nvhchain.report.pictures.housing import SUFFIXES, draw_housings, draw_velocities, write_motion
from nvhchain.report.run_up import constant_speed, input_frequency_waterfall, input_order_waterfall, sample_rate
from nvhchain.spectrum import BAND_MARGIN

HIGHEST_ORDER = 100.0
"""Highest order of the input in maps against order."""


RECORDED = {
    "force": ("N", 1.0),
    "transmission_error": ("µm", 1e6),
    "mesh_deflection": ("µm", 1e6),
    "output_lag": ("µrad", 1e6),
}
"""Quantities in records of bearing forces, each with the unit of the figures and its factor."""


WORDS = {
    "transmission_error": "transmission error",
    "output_lag": "transmission error",
    "mesh_deflection": "mesh deflection",
}
"""Name of a quantity in titles, before the shafts."""


def draw(
    files: list[Path],
    picture: Path,
    *,
    orders: bool = False,
    frequency: Sequence[float] = (),
    quantity: str = "force",
    angle: bool = False,
) -> None:
    """Draw hand-offs of one kind as PNG, SVG or PDF, or write their motion.

    files: HDF5 files, all of one kind.
    picture: figure to write: .png, .svg or .pdf. A path that ends in .gif, .glb, .vtu, .vtkhdf, .unv or .csv holds the
    motion of a housing or surface (`write_motion`). The suffix .vtu also holds displacement and stress of a gear.
    orders: draw maps of records against order of the input instead of frequency. Steady records of several speeds then
    make one map.
    frequency: frequencies (Hz) of the modes or lines to draw.
    quantity: quantity of records of bearing forces, one of `RECORDED`; of a gear, "displacement" colours it by its
    displacement instead of its stress.
    angle: draw transmission errors of records over the angle of the input, over its first turn.
    """
    hand_offs: dict[str, HandOff] = dict(zip(_names(files), (hdf5.load(path) for path in files), strict=True))
    kinds = {type(hand_off) for hand_off in hand_offs.values()}
    require(len(kinds) == 1, f"{', '.join(sorted(k.__name__ for k in kinds))} do not go into one figure: draw one kind")
    (kind,) = kinds
    require(
        not frequency or kind in (ReducedHousing, SurfaceVelocity, Directivity),
        f"{kind.__name__} is drawn whole: leave `at` out",
    )
    require(
        quantity == "force" or kind is (GearField if quantity == "displacement" else BearingForces),
        f"{kind.__name__} has no {quantity}: leave `quantity` out",
    )
    require(
        not angle or (kind is BearingForces and quantity in ("transmission_error", "output_lag")),
        "`angle` is for transmission errors of records of bearing forces: give quantity = transmission_error with it, "
        "or leave it out",
    )
    if kind is GearField and picture.suffix == ".vtu":
        write_gear_field_vtu(_single(hand_offs)[1], picture)
        return
    if picture.suffix in SUFFIXES:
        write_motion(hand_offs, picture, frequency)
        return
    check_format(picture, SUFFIXES if kind in (ReducedHousing, SurfaceVelocity) else ())
    known: dict[type[HandOff], Callable[[Mapping[str, Any], bool], list[Axes]]] = {
        MeshLaw: _mesh_laws,
        BearingForces: lambda forces, orders: (
            plots.transmission_error_history(forces) if angle else _bearing_forces(forces, orders, quantity)
        ),
        ForceSpectrum: lambda spectra, _: plots.bearing_force_spectra(spectra),
        GearField: lambda fields, _: _gear_field(fields, quantity),
        ReducedHousing: lambda housings, _: draw_housings(housings, frequency),
        SurfaceVelocity: lambda velocities, _: draw_velocities(velocities, frequency),
        FieldPressure: lambda pressures, _: plots.pressure_spectrum(pressures),
        SoundPower: lambda powers, _: plots.power_spectrum(powers),
        RadiationEfficiency: lambda efficiencies, _: [plots.efficiency_spectrum(efficiencies)],
        Directivity: lambda directivities, _: [
            plots.directivity_polar(directivities, frequency)
            if frequency
            else plots.directivity_spectrum(directivities)
        ],
        PressureHistory: lambda histories, orders: _maps(
            {name: p.pressure for name, p in histories.items()}, histories, "Pa", orders
        ),
    }
    if kind not in known:
        raise InputError(f"{kind.__name__} has no figure: choose from {', '.join(k.__name__ for k in known)}")
    save(known[kind](hand_offs, orders), picture)


def _gear_field(fields: Mapping[str, GearField], quantity: str) -> list[Axes]:
    """Draw one gear."""
    name, field = _single(fields)
    return plots.gear_field(field, name=name, quantity="displacement" if quantity == "displacement" else "von_mises")


def _single(fields: Mapping[str, Any]) -> tuple[str, Any]:
    """Return name and field of the only gear."""
    require(len(fields) == 1, f"{len(fields)} gears: a figure shows one")
    return next(iter(fields.items()))


def _names(files: list[Path]) -> list[str]:
    """Short names that differ: of the files, of their folders, their paths, or numbered paths."""
    for names in (
        [path.stem for path in files],
        [path.absolute().parent.name for path in files],
        [str(path) for path in files],
    ):
        if len(set(names)) == len(files):
            break
    else:
        names = [f"{number}: {path}" for number, path in enumerate(files, start=1)]
    return [printable(name).replace("$", r"\$") for name in names]  # no formulae


def _mesh_laws(laws: Mapping[str, MeshLaw], orders: bool) -> list[Axes]:
    """Draw the map of one law, or the transmission errors of several.

    Several laws are compared at half of the largest force that all of them cover.
    """
    if len(laws) == 1:
        return plots.mesh_law_map(next(iter(laws.values())))
    force = 0.5 * min(float(law.force.max(axis=1).min()) for law in laws.values())
    curves = {name: quasi_static_transmission_error(law, force) for name, law in laws.items()}
    return plots.transmission_errors({f"{force:.0f} N": curves})


def _bearing_forces(forces: Mapping[str, BearingForces], orders: bool, quantity: str) -> list[Axes]:
    """Draw lines of steady records, maps of run-ups and of steady records at several speeds, mean spectra of others."""
    unit, factor = RECORDED[quantity]
    if not all(record.periodic for record in forces.values()):
        signals = {
            name + _titled(record, quantity): factor * record.recorded(quantity) for name, record in forces.items()
        }
        return _maps(signals, dict(zip(signals, forces.values(), strict=True)), unit, orders)
    if orders and len({float(record.input_speed[0]) for record in forces.values()}) == len(forces) > 1:
        samples_per_turn = [2 * np.pi * record.sample_rate / float(record.input_speed[0]) for record in forces.values()]
        high = min(HIGHEST_ORDER, min(samples_per_turn) / BAND_MARGIN)
        sweep = spectrum.sweep_waterfall(list(forces.values()), quantity, high=high)
        swept = replace(sweep, amplitude=factor * sweep.amplitude)
        title = f"{len(forces)} steady speeds" + _titled(next(iter(forces.values())), quantity)
        return plots.waterfall_maps({title: swept}, unit=unit)
    if quantity != "force":
        return _steady_orders(forces, quantity)
    lines = {
        name: spectrum.force_spectrum(record, low=0.0, high=record.sample_rate / BAND_MARGIN)
        for name, record in forces.items()
    }
    last = max(_last_line(line_spectrum) for line_spectrum in lines.values())
    return plots.bearing_force_spectra(
        {name: line_spectrum.select(slice(last)) for name, line_spectrum in lines.items()}
    )


def _titled(record: BearingForces, quantity: str) -> str:
    """Title of a map of transmission errors, behind the name of its record."""
    if quantity == "force":
        return ""
    meshes, train = plots.mesh_names(record)
    ends = train if quantity == "output_lag" else " and ".join(meshes)
    return f": {WORDS[quantity]} {ends}"


def _steady_orders(forces: Mapping[str, BearingForces], quantity: str) -> list[Axes]:
    """Draw the orders of every mesh, one panel each."""
    require(
        quantity != "output_lag",
        "lines of output_lag have no figure: draw a run-up, or steady speeds with --orders, or its history with "
        "--angle",
    )
    found = {}
    for name, record in forces.items():
        high = min(HIGHEST_ORDER, 2 * np.pi * record.sample_rate / float(record.input_speed[0]) / BAND_MARGIN)
        sweep = spectrum.sweep_waterfall([record], quantity, high=high)
        for mesh, line in zip(plots.mesh_names(record)[0], np.abs(sweep.amplitude[0]).T, strict=True):
            found[f"{name}: {WORDS[quantity]} {mesh}"] = sweep.axis, line
    return plots.order_spectra(found, mesh_order=0.0, highest=max(float(axis[-1]) for axis, _ in found.values()))


def _last_line(spectrum: ForceSpectrum) -> int:
    """Return the number of lines up to the last one within 80 dB of the strongest non-static line."""
    size = np.abs(spectrum.force[1:]).max(axis=(1, 2))
    return 2 + int(np.flatnonzero(size >= 1e-4 * size.max())[-1])


def _maps(signals: Mapping[str, Any], records: Mapping[str, Any], unit: str, orders: bool) -> list[Axes]:
    """Draw maps of run-ups, and mean spectra of records at constant speed."""
    constant = {constant_speed(record.input_speed) for record in records.values()}
    require(len(constant) == 1, "some records are run-ups, some are at constant speed: draw them apart")
    maps = {}
    for name, record in records.items():
        rate = sample_rate(record)
        if orders:
            maps[name] = input_order_waterfall(signals[name], rate, record.input_speed, high=HIGHEST_ORDER)
        else:
            maps[name] = input_frequency_waterfall(signals[name], rate, record.input_speed, high=rate / BAND_MARGIN)
    return plots.mean_spectra(maps, unit=unit) if constant == {True} else plots.waterfall_maps(maps, unit=unit)
