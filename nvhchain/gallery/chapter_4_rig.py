"""Chapter 4, torsional test rig: its modes and the response of the test pair."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain import plots
from nvhchain.gallery.figures import write_bars
from nvhchain.gallery.item import Item, Numbers, Place, Stated
from nvhchain.lumped import BASE_RADIUS, FITTED_RIG, mesh_cross_response, rig_modes
from nvhchain.plots.files import save

FREQUENCY = np.linspace(10.0, 3000.0, 3000)
"""Frequencies (Hz) of the response."""

PRINTED_STIFFNESS = 1.6e6
"""Stiffness of the test mesh in the thesis (Nm/rad)."""

SIDES = ("test", "reaction")


def amplitudes(place: Place) -> Numbers:
    """Draw the amplitudes of the four gears in each mode, relative to the largest."""
    modes = rig_modes(FITTED_RIG)
    shapes = np.abs(modes.shapes) / np.abs(modes.shapes).max(axis=0)
    bars = {
        f"{f:.0f} Hz": {f"gear {gear + 1}": float(shapes[gear, i]) for gear in range(4)}
        for i, f in enumerate(modes.frequency)
    }
    write_bars(bars, place.picture, label="amplitude / largest")
    other = [min(shapes[:2, i].max(), shapes[2:, i].max()) for i in range(3)]
    found: Numbers = {f"mode {i + 1} / Hz": float(f) for i, f in enumerate(modes.frequency)}
    for i in (1, 2):
        found[f"other side's gears in mode {i + 1} / %"] = 100.0 * float(other[i])
    return found


def data(_: Place) -> Numbers:
    """Return the last mode with the printed stiffness of the test mesh, and with the fitted one."""
    printed = rig_modes(replace(FITTED_RIG, test_mesh=PRINTED_STIFFNESS))
    return {
        "test mesh / (10⁶ Nm/rad)": 1e-6 * FITTED_RIG.test_mesh,
        "mode 3 with the printed stiffness / Hz": float(printed.frequency[2]),
        "mode 3 with the fitted stiffness / Hz": float(rig_modes(FITTED_RIG).frequency[2]),
    }


def response(place: Place) -> Numbers:
    """Draw the transmission error of the test pair per mesh force of either pair."""
    responses = {
        f"test mesh due to {source} mesh": mesh_cross_response(FITTED_RIG, FREQUENCY, mesh="test", due_to=source)
        for source in SIDES
    }
    save(plots.rig_responses(FREQUENCY, responses, base_radius=BASE_RADIUS), place.picture)
    own, cross = (np.abs(value) for value in responses.values())
    return {
        "largest response to the own mesh force / (µm/kN)": 1e9 * BASE_RADIUS**2 * float(own.max()),
        "largest response to the other pair / % of the own": 100.0 * float(cross.max() / own.max()),
        "at / Hz": float(FREQUENCY[cross.argmax()]),
    }


ITEMS = (
    Item(
        "table 4.2",
        "Data of the test rig",
        "Contradicts itself: the printed stiffness of the test mesh gives 2319 Hz for the last mode, stated at 1968 "
        "Hz; 1.1444·10⁶ Nm/rad gives all three stated frequencies.",
        data,
        {"test mesh / (10⁶ Nm/rad)": Stated(1.6, 0.3), "mode 3 with the fitted stiffness / Hz": Stated(1968.0, 1e-3)},
        "Which table holds the data of the rig is not recorded.",
        ours={"mode 3 with the printed stiffness / Hz": Stated(2319.0, 1e-3)},
        drawn=False,
    ),
    Item(
        "4.7",
        "Modal amplitudes of the rig's four gears",
        "Agrees: 3.2 and 0.17 % of the largest amplitude are left to the gears of the other pair; the stiffness of the "
        "test mesh is fitted to the frequencies, as the printed one gives 2319 Hz for the last mode.",
        amplitudes,
        {
            "mode 1 / Hz": Stated(280.0, 1e-3),
            "mode 2 / Hz": Stated(680.0, 1e-3),
            "mode 3 / Hz": Stated(1968.0, 1e-3),
            "other side's gears in mode 2 / %": Stated(3.0, 0.06),
            "other side's gears in mode 3 / %": Stated(0.2, 0.15),
        },
        "The thesis's 3 and 0.2 % are taken as amplitudes of the other pair's gears, not as shares of twist.",
    ),
    Item(
        "4.8",
        "Response of the test pair to both mesh forces",
        "Ours alone, as the project records no level of the thesis's curve: the other pair's mesh force causes 1.5 % "
        "of the response to the own one at most, so that the rig measures the test pair alone.",
        response,
        reading="Transmission error per mesh force, on the base circle of the gears of chapter 3.",
        ours={"largest response to the other pair / % of the own": Stated(1.5, 0.02)},
    ),
)
