"""Gear pairs with one degree of freedom: response to sweeps, backbone, orders of an error; responses of the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.lumped import GearPair, PeriodicResponse, SweepResponse, backbone_frequency
from nvhchain.plots._style import colour, panels, styled

MICRO = 1e6


@styled
def sweep_responses(
    rising: SweepResponse, falling: SweepResponse, names: Sequence[str], *, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw the RMS of the oscillating error within mesh cycles over mesh frequency, one curve per pair and direction.

    rising, falling: sweeps of the same pairs with rising and falling speed.
    axes: one; that of a new figure by default.

    A bar below the curves spans the speeds at which contact is lost during rising speed.
    """
    require(
        len(names) == rising.rms.shape[1] == falling.rms.shape[1],
        f"{len(names)} names for {rising.rms.shape[1]} and {falling.rms.shape[1]} pairs: one name per pair",
    )
    (ax,) = panels(1, axes, height=5.2)
    highest = MICRO * float(max(rising.cycle_rms.max(), falling.cycle_rms.max()))
    for i, name in enumerate(names):
        ax.plot(1e-3 * rising.mesh_frequency, MICRO * rising.cycle_rms[:, i], color=colour(i), label=name)
        ax.plot(1e-3 * falling.mesh_frequency, MICRO * falling.cycle_rms[:, i], color=colour(i), linestyle=(0, (4, 2)))
        lost = np.where(rising.loses_contact[:, i], -0.02 * (i + 1) * highest, np.nan)
        ax.plot(1e-3 * rising.mesh_frequency, lost, color=colour(i), linewidth=3.0, solid_capstyle="butt")
    ax.set_ylim(-0.02 * (len(names) + 1.5) * highest, 1.06 * highest)
    ax.set_xlabel("mesh frequency / kHz")
    ax.set_ylabel("RMS of dynamic error / µm")
    ax.margins(x=0.0)
    ways = [
        Line2D([], [], color="black", label="rising speed"),
        Line2D([], [], color="black", linestyle=(0, (4, 2)), label="falling speed"),
        Line2D([], [], color="black", linewidth=3.0, label="contact lost, rising"),
    ]
    # outside the axes: a resonance may lie anywhere inside
    ax.legend(handles=[*ax.lines[0 : 3 * len(names) : 3], *ways], loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return [ax]


@styled
def backbone_curves(
    curves: Mapping[str, tuple[GearPair, PeriodicResponse]], *, axes: Sequence[Axes] | None = None
) -> list[Axes]:
    """Draw periodic responses of pairs and the backbone of their contact loss: largest deflection against speed.

    Parameters
    ----------
    curves : mapping of str to (GearPair, PeriodicResponse)
        Name → pair and its response.
    axes : sequence of Axes, optional
        One; that of a new figure by default.

    Returns
    -------
    list of Axes
        One.

    Notes
    -----
    Deflection is over the static one, mesh frequency over the natural one. The unstable part between two folds is
    dotted.
    """
    require(len(curves) > 0, "no response given: at least one is needed")
    (ax,) = panels(1, axes, height=5.0)
    top = 1.0
    for index, (name, (pair, response)) in enumerate(curves.items()):
        static = pair.force / pair.mean_stiffness
        amplitude = (response.highest - pair.half_backlash) / static - 1.0
        speed = response.mesh_frequency / pair.natural_frequency
        # back along the curve: against its initial direction
        back = np.gradient(speed) * np.sign(speed[-1] - speed[0]) < 0
        ax.plot(speed, np.where(back, np.nan, amplitude), color=colour(index), label=name)
        ax.plot(speed, np.where(back, amplitude, np.nan), color=colour(index), linestyle=(0, (1, 1.5)))
        top = max(top, float(amplitude.max()))
    ratio = np.linspace(0.0, 1.05 * top, 400)
    ax.plot(backbone_frequency(ratio), ratio, color="black", linestyle=(0, (6, 2)), label="backbone, exact")
    ax.set_xlabel("mesh frequency / natural frequency")
    ax.set_ylabel("amplitude / static deflection")
    ax.margins(x=0.0)
    ax.legend(loc="upper right")
    return [ax]


@styled
def order_spectra(
    spectra: Mapping[str, tuple[FloatArray, FloatArray]],
    *,
    mesh_order: float,
    spacing: float = 0.0,
    sidebands: int = 3,
    highest: float | None = None,
    decades: float = 5.0,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw the peak amplitude of every order of an error, one panel per spectrum.

    spectra mapping of str to (array, array): title → orders per turn and amplitudes (m).
    spacing: distance (orders) of marked sidebands of mesh_order; 0 for none.
    sidebands: number of marked sidebands on each side.
    highest: last drawn order; 2.2 times mesh_order by default.
    axes: one per spectrum; those of a new figure by default.
    """
    require(len(spectra) > 0, "no spectrum given: at least one is needed")
    last = 2.2 * mesh_order if highest is None else highest
    drawn = panels(len(spectra), axes, height=2.8)
    for index, (ax, (title, (orders, amplitude))) in enumerate(zip(drawn, spectra.items(), strict=True)):
        shown = (orders > 0) & (orders <= last)
        top = MICRO * float(amplitude[shown].max())
        floor = top * 10.0**-decades
        size = np.maximum(MICRO * amplitude[shown], floor)
        ax.set_yscale("log")
        ax.vlines(orders[shown], floor, size, colors=colour(index), linewidth=1.4)
        if spacing > 0.0:
            for n in range(-sidebands, sidebands + 1):
                ax.axvline(mesh_order + n * spacing, color="#8C8C8C", linestyle=(0, (2, 2)), linewidth=0.8, zorder=0.5)
        ax.set_ylim(floor, 3.0 * top)
        ax.set_xlim(0.0, last)
        ax.grid(False, axis="x")
        ax.set_title(title, loc="left", fontweight="bold")
        ax.set_ylabel("amplitude / µm")
    drawn[-1].set_xlabel("order of rotation")
    return drawn


@styled
def rig_responses(
    frequency: FloatArray,
    responses: Mapping[str, ComplexArray],
    *,
    base_radius: float | None = None,
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw magnitudes of mesh twists per torque over frequency, or of transmission errors per mesh force.

    frequency (n_f,): frequencies (Hz).
    responses mapping of str to (n_f,) complex array: name → twist per torque (rad/Nm).
    base_radius: of both meshes (m), which turns twists per torque into transmission errors per force.
    axes: one; that of a new figure by default.
    """
    require(len(responses) > 0, "no response given: at least one is needed")
    (ax,) = panels(1, axes, height=4.4)
    scale = 1.0 if base_radius is None else 1e3 * base_radius**2
    for index, (name, response) in enumerate(responses.items()):
        ax.semilogy(frequency, MICRO * scale * np.abs(response), color=colour(index), label=name)
    ax.set_xlabel("frequency / Hz")
    ax.set_ylabel(
        "twist per torque / (µrad/Nm)" if base_radius is None else "transmission error per mesh force / (µm/kN)"
    )
    ax.margins(x=0.0)
    ax.legend()
    return [ax]
