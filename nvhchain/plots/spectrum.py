"""Line spectra: sound pressure at a field point and forces at the bearings, several configurations on one axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from nvhchain import levels
from nvhchain.errors import require
from nvhchain.handoff import FieldPressure, FloatArray, ForceSpectrum, SoundPower
from nvhchain.plots._style import colour, figure_of, panels, styled
from nvhchain.plots.marks import OrderMarks, matching
from nvhchain.plots.waterfall import add_order_axis, draw_mesh_orders

if TYPE_CHECKING:
    from nvhchain.error_band import ErrorBand

STEM_DISTANCE = 1.6
"""Distance (points) between the stems of two configurations at the same frequency."""

HEADROOM = 12.0
"""Space (dB) above the strongest line for the overall levels."""

SILENCE = 1e-300
"""Least energy over that of 0 dB; it stands for silence."""

LIMITED = 20.0
"""Range (dB) of lines with limits below the strongest line of a configuration; more would hide the rest."""


@styled
def pressure_spectrum(
    pressures: Mapping[str, FieldPressure],
    *,
    marks: OrderMarks | None = None,
    point: int = 0,
    dynamic_range: float = 70.0,
    bands: Mapping[str, ErrorBand] | None = None,
    weighted: bool | None = None,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw the sound pressure level of every line, unweighted above and A-weighted below.

    Parameters
    ----------
    pressures : mapping of str to FieldPressure
        Configuration → pressure.
    marks : OrderMarks, optional
        Orders to mark, if all configurations have one input speed.
    point : int
        Index of the field point.
    dynamic_range : float
        Range (dB) below the strongest line.
    bands : mapping of str to ErrorBand, optional
        Configuration → error band, for the limits of its strong lines and of its level in dB(A).
    weighted : bool, optional
        True for A-weighted levels alone, False for unweighted ones alone.
    axes : sequence of Axes, optional
        Two, or one for one kind of levels; those of a new figure by default.

    Returns
    -------
    list of Axes
        As many.
    """
    heard = {name: (field.frequency, levels.decibel(field.pressure[:, point])) for name, field in pressures.items()}
    limits = {
        name: (np.stack([band.lower[:, point], band.upper[:, point]], axis=1), band.overall[point])
        for name, band in (bands or {}).items()
    }
    speed = _common_input_frequency(pressures)
    kinds = (False, True) if weighted is None else (weighted,)
    return _plain_and_weighted(heard, ("p", "20 µPa"), speed, marks, dynamic_range, axes, limits, kinds)


@styled
def power_spectrum(
    powers: Mapping[str, SoundPower],
    *,
    marks: OrderMarks | None = None,
    dynamic_range: float = 70.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw the sound power level of every line, unweighted above and A-weighted below.

    powers: configuration → sound power.
    """
    lines = {name: (power.frequency, levels.power_level(power.power)) for name, power in powers.items()}
    return _plain_and_weighted(lines, ("W", "1 pW"), _common_input_frequency(powers), marks, dynamic_range, axes)


def _plain_and_weighted(
    plain: Mapping[str, tuple[FloatArray, FloatArray]],
    quantity: tuple[str, str],
    input_frequency: float,
    marks: OrderMarks | None,
    dynamic_range: float,
    axes: Sequence[Axes] | None,
    limits: Mapping[str, tuple[FloatArray, FloatArray]] | None = None,
    kinds: tuple[bool, ...] = (False, True),
) -> list[Axes]:
    """Draw panels of levels, configuration → (frequency (n_f,) Hz, level (n_f,) dB), without and with A-weighting.

    quantity : index of the level and reference, for the vertical axis.
    limits : configuration → limits of the lines (n_f, 2) dB, and of the overall level (2,) dB(A).
    kinds : panels from above: True with A-weighting.
    """
    limits, (symbol, reference) = limits or {}, quantity
    require(len(plain) > 0, "nothing is given to draw: at least one configuration is needed")
    drawn = panels(len(kinds), axes, share="x")
    for ax, weighted in zip(drawn, kinds, strict=True):
        unit = "dB(A)" if weighted else "dB"
        lines = {
            name: (frequency, level + levels.a_weighting(frequency) if weighted else level)
            for name, (frequency, level) in plain.items()
        }
        highest = max(level.max() for _, level in lines.values())
        ax.set_ylim(5.0 * np.ceil(highest / 5.0) + HEADROOM - dynamic_range, 5.0 * np.ceil(highest / 5.0) + HEADROOM)
        ax.set_ylabel(f"$L_{{{symbol}{'A' if weighted else ''}}}$ / {unit} re {reference}")
        weight = {name: lines[name][1] - plain[name][1] for name in limits}
        handles = _draw(
            ax, lines, input_frequency, marks, {n: bounds[0] + weight[n][:, None] for n, bounds in limits.items()}
        )
        overall = [Line2D([], [], color=colour(index), linewidth=3.0) for index in range(len(lines))]
        values = [
            f"{name}: overall {10.0 * np.log10(max((10.0 ** (level / 10.0)).sum(), SILENCE)):.1f} {unit}"
            + (f" ({_limits_text(limits[name][1])})" if weighted and name in limits else "")
            for name, (_, level) in lines.items()
        ]
        ax.legend(overall, values, loc="upper right", ncols=len(lines))
        if input_frequency > 0.0 and not weighted:
            add_order_axis(ax, input_frequency)
    for ax in drawn[:-1]:
        ax.set_xlabel("")
    _legend_below(drawn[-1], handles[len(lines) :])
    return drawn


def _limits_text(limits: FloatArray) -> str:
    from nvhchain.error_band import format_limits

    return format_limits([float(limit) for limit in limits])


@styled
def bearing_force_spectra(
    spectra: Mapping[str, ForceSpectrum],
    *,
    marks: OrderMarks | None = None,
    decades: float = 4.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw the force on the housing at every bearing, one panel each: √(|F_x|² + |F_y|² + |F_z|²), N peak.

    spectra: configuration → spectrum, all with the same bearings.
    axes: one per bearing; those of a new figure by default.
    Returns one per bearing.
    """
    require(len(spectra) > 0, "no force spectrum given: at least one configuration is needed")
    names = next(iter(spectra.values())).names
    for label, spectrum in spectra.items():
        require(spectrum.names == names, f"{label!r} has bearings {spectrum.names}, not {names}: plot them apart")
    drawn = panels(len(names), axes, columns=2, height=2.6, width=13.0)
    input_frequency = _common_input_frequency(spectra)
    size = {label: np.linalg.norm(s.force, axis=2) for label, s in spectra.items()}
    highest = max(float(s[spectra[label].frequency > 0.0].max()) for label, s in size.items())
    for index, (ax, bearing) in enumerate(zip(drawn, names, strict=True)):
        ax.set_yscale("log")
        ax.set_ylim(highest * 10.0 ** (0.5 - decades), highest * 10.0**0.5)
        ax.set_ylabel("force / N" if index % 2 == 0 else "")
        handles = _draw(
            ax, {label: (s.frequency, size[label][:, index]) for label, s in spectra.items()}, input_frequency, marks
        )
        ax.set_xlabel("frequency / Hz" if index >= len(names) - 2 else "")
        ax.text(
            0.01,
            0.97,
            bearing,
            transform=ax.transAxes,
            fontweight="bold",
            verticalalignment="top",
            backgroundcolor="white",
        )
        if input_frequency > 0.0 and index < 2:
            add_order_axis(ax, input_frequency)
    _legend_below(drawn[0], handles)
    return drawn


def _common_input_frequency(
    handoffs: Mapping[str, FieldPressure] | Mapping[str, ForceSpectrum] | Mapping[str, SoundPower],
) -> float:
    """Return the turns of the input shaft per second, 0 if the configurations have different ones."""
    speeds = {round(h.input_speed, 9) for h in handoffs.values()}
    return speeds.pop() / (2.0 * np.pi) if len(speeds) == 1 else 0.0


def _draw(
    ax: Axes,
    lines: Mapping[str, tuple[FloatArray, FloatArray]],
    input_frequency: float,
    marks: OrderMarks | None,
    limits: Mapping[str, FloatArray] | None = None,
) -> list[Line2D]:
    """Draw stems of all configurations side by side with heads at the marked orders; return the legend's entries.

    limits : configuration → (n_f, 2) in the unit of its lines, drawn at those within `LIMITED` of the strongest.
    """
    floor = ax.get_ylim()[0]
    ax.set_xlim(0.0, 1.01 * max(frequency[-1] for frequency, _ in lines.values()))
    ax.set_xlabel("frequency / Hz")
    ax.grid(False, axis="x")
    marked = marks is not None and input_frequency > 0.0
    handles = [Line2D([], [], color=colour(index), linewidth=3.0, label=name) for index, name in enumerate(lines)]
    if marks is not None and marked:
        draw_mesh_orders(ax, marks, input_frequency)
        handles += [line for line in ax.lines if not str(line.get_label()).startswith("_")]
    heads: dict[str, Line2D] = {}
    for index, (name, (frequency, value)) in enumerate(lines.items()):
        aside = STEM_DISTANCE * (index - (len(lines) - 1) / 2.0) / 72.0
        shifted = ax.transData + ScaledTranslation(aside, 0.0, figure_of(ax).dpi_scale_trans)
        seen = (value > floor) & (frequency > 0.0)
        ax.vlines(
            frequency[seen], floor, value[seen], colors=colour(index), linewidth=1.2, transform=shifted, label=name
        )
        if limits and name in limits:
            loud = seen & (value >= value.max() - LIMITED)
            low, high = np.clip(limits[name][loud].T, *ax.get_ylim())
            ax.vlines(frequency[loud], low, high, colors="black", linewidth=0.9, transform=shifted, zorder=3)
            ends = np.tile(frequency[loud], 2), np.concatenate([low, high])
            ax.plot(*ends, "_", color="black", markersize=4.0, transform=shifted, label=f"_{name} limits")
            heads["limits"] = Line2D(
                [], [], marker="|", markersize=9.0, linestyle="none", color="black", label="limits"
            )
        if marks is None or not marked:
            continue
        orders = frequency / input_frequency
        kinds: list[tuple[str, FloatArray, str, float, str | None]]
        kinds = [("mesh order", marks.mesh_orders(orders[-1]), "o", 5.5, None)]
        if marks.slotted is None or name in marks.slotted:
            kinds.append(("slot sideband", marks.sideband_orders(orders[-1]), "D", 4.5, "white"))
        for kind, wanted, marker, size, fill in kinds:
            matched = seen & matching(orders, wanted)
            if matched.any():
                style: dict[str, Any] = {"marker": marker, "markersize": size, "linestyle": "none"}
                hue = colour(index)
                ax.plot(
                    frequency[matched],
                    value[matched],
                    color=hue,
                    markerfacecolor=fill or hue,
                    transform=shifted,
                    label=f"_{name} {kind}",
                    **style,
                )
                heads[kind] = Line2D([], [], color="black", markerfacecolor=fill or "black", label=kind, **style)
    return handles + list(heads.values())


def _legend_below(ax: Axes, handles: list[Line2D]) -> None:
    """Add one legend for the whole figure outside the axes, where it hides no lines."""
    if handles:
        figure_of(ax).legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
