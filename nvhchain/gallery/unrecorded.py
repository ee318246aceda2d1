"""Figures whose captions are not on record: subjects of the chapter's text that no other figure shows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nvhchain import plots
from nvhchain.gallery.chapter_3_gears import TIP_EDGES, TORQUE, static_error
from nvhchain.gallery.chapter_3_lumped import titles
from nvhchain.gallery.chapter_4_gears import NAMES, meshed, transmission_error
from nvhchain.gallery.chapter_4_roots import PASSAGE, passage
from nvhchain.gallery.figures import Curves, write_curves
from nvhchain.gallery.gears import BLANKS, FRICTION, orders
from nvhchain.gallery.item import Item, Numbers, Place, Stated
from nvhchain.gear import loaded_mesh
from nvhchain.handoff import FloatArray
from nvhchain.lumped import FITTED_RIG, order_lines, rig_modes
from nvhchain.plots.files import save

RING = (0, 1, 3, 2, 0)
"""Gears of the rig around its ring: test mesh 1–2, shaft 2–4, reaction mesh 4–3, shaft 3–1."""


SHARE, PRESSURE = "share of the load / %", "largest pressure / MPa"


def pair_errors(place: Place) -> Numbers:
    """Draw the static transmission errors of the four pairs of table 3.2 over their periods."""
    found: Numbers = {}
    panels: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {}
    for name, title in zip(BLANKS, titles(), strict=True):
        curves = panels.setdefault(f"{title}, {TORQUE:g} Nm", {})
        for label in TIP_EDGES:
            curve = static_error(name, place.fidelity.gear, bool(label))
            curves[f"tip edges {'excluded' if label else 'in contact'}"] = curve
            found[f"{name}: peak to peak{label} / µm"] = 1e6 * float(np.ptp(curve[1]))
    save(plots.transmission_errors(panels), place.picture)
    return found


def deflection_parts(place: Place) -> Numbers:
    """Draw the global and local part of the deflection of gear 2 over a mesh period at 300 Nm."""
    touching = meshed(2, place.fidelity.gear)
    force, count = touching.pair.normal_force(300.0), touching.fidelity.angles_per_mesh
    share = np.arange(-count // 2, count // 2 + 1) / count
    rows, guess = [], 1e-5
    for position in share:
        loaded = loaded_mesh(touching, position * touching.pair.mesh_period, force, guess=guess)
        lines, guess, weight = loaded.lines, loaded.deflection, loaded.force / loaded.force.sum()
        local = touching.local_law(lines).deflection(loaded.force / lines.length)
        parts = touching.compliance(lines) @ loaded.force, local, touching.gap(lines)
        rows.append([loaded.deflection, *(float(weight @ part) for part in parts)])
    mean_parts = 1e6 * np.array(rows).T
    names = ("deflection", "global part, finite elements", "local part, Weber and Banaschek", "gap of the flanks")
    curves: Curves = {name: (share, values) for name, values in zip(names, mean_parts, strict=True)}
    labels = ("position / mesh periods from the pitch point", "mean over the load / µm")
    write_curves({f"{NAMES[2]}, 300 Nm": curves}, place.picture, labels=labels)
    pitch = loaded_mesh(touching, 0.0, force, guess=guess)
    middle = int(np.argmax(pitch.force))
    load = pitch.force[middle] / pitch.lines.length[middle]
    return {
        "half width of the contact at the pitch point / mm": 2e3 * float(load / (np.pi * pitch.pressure[middle])),
        "local part at the pitch point / %": 100.0 * float(mean_parts[2, count // 2] / mean_parts[0, count // 2]),
    }


def ring_modes(place: Place) -> Numbers:
    """Draw the modes of the rig's four inertias around the ring."""
    modes = rig_modes(FITTED_RIG)
    shapes = modes.shapes / np.abs(modes.shapes).max(axis=0)
    panels: dict[str, Curves] = {
        f"{f:.0f} Hz": {"rotation": (np.arange(5.0), shapes[RING, i])} for i, f in enumerate(modes.frequency)
    }
    names = [f"gear {gear + 1}" for gear in RING]
    write_curves(panels, place.picture, labels=("around the ring", "rotation / largest"), ticks=names)
    found: Numbers = {f"mode {i + 1} / Hz": float(f) for i, f in enumerate(modes.frequency)}
    for i, spring in enumerate(("shafts", "reaction mesh", "test mesh")):
        energy = modes.energy[2:, i].sum() if spring == "shafts" else modes.energy[int(spring == "reaction mesh"), i]
        found[f"energy of mode {i + 1} in the {spring} / %"] = 100.0 * float(energy)
    return found


def load_shares(place: Place) -> Numbers:
    """Draw the share of the load and the pressure on a tooth of gears 2 and 3 while it passes."""
    panels: dict[str, dict[str, tuple[FloatArray, FloatArray]]] = {SHARE: {}, PRESSURE: {}}
    found: Numbers = {}
    for gear, torque in ((2, 50.0), (2, 300.0), (3, 300.0)):
        touching, name = meshed(gear, place.fidelity.gear), f"{NAMES[gear]}, {torque:g} Nm"
        passed = passage(touching, 0, torque, PASSAGE, 0.0)
        share = np.array([each.load_share().get(0, 0.0) for each in passed])
        pressure = [float(each.pressure[each.lines.tooth[1] == 0].max(initial=0.0)) for each in passed]
        panels[SHARE][name] = PASSAGE, 100.0 * share
        panels[PRESSURE][name] = PASSAGE, 1e-6 * np.array(pressure)
        found[f"{name}: largest pressure / MPa"] = 1e-6 * max(pressure)
        found[f"{name}: tooth carries load over / pitches"] = float((share > 0.0).sum() * (PASSAGE[1] - PASSAGE[0]))
    write_curves(panels, place.picture, labels=("position of the tooth / pitches", ""))
    return found


def error_orders(place: Place) -> Numbers:
    """Draw the orders of the transmission error of gear 3 at 300 Nm, with and without friction."""
    drawn: dict[str, tuple[FloatArray, FloatArray]] = {}
    found: Numbers = {}
    for friction in (0.0, FRICTION):
        pair = meshed(3, place.fidelity.gear).pair
        _, error = transmission_error(3, 300.0, friction, place.fidelity.gear)
        title = f"{NAMES[3]}, 300 Nm, friction {friction:g}"
        drawn[title] = order_lines(error, pair.meshes_per_body_period, pair.wheel.geometry.teeth)
        lines = orders(error, pair)
        for order in (3, 54, 57, 60, 114):
            found[f"friction {friction:g}: order {order} / µm"] = 1e6 * lines[order]
    save(plots.order_spectra(drawn, mesh_order=57.0, spacing=3.0), place.picture)
    return found


def _item(
    number: str,
    title: str,
    verdict: str,
    make: Callable[[Place], Numbers],
    ours: dict[str, Stated],
    stated: dict[str, Stated] | None = None,
    uses: tuple[str, ...] = ("gear", "plots"),
) -> Item:
    some = "these figures" if "-" in number else "this figure"
    reading = f"The caption of {some} is not on record; a subject of the text around it is shown."
    return Item(number, title, verdict, make, stated or {}, reading, uses, ours)


_OURS = "Ours alone, as no number of this subject is on record: "

ITEMS = (
    _item(
        "3.3",
        "Static transmission errors of the four pairs at 350 Nm",
        f"{_OURS}a and c repeat with every tooth, the holes of b add half as much, d swings by 26 µm, four times as "
        "far as a.",
        pair_errors,
        {
            f"{name}: peak to peak / µm": Stated(swing, 0.02)
            for name, swing in (("a", 6.49), ("b", 9.71), ("c", 6.83), ("d", 26.4))
        },
        uses=("gear", "lumped", "plots"),
    ),
    _item(
        "4.1-4.2",
        "Hybrid contact: global and local part of the deflection of gear 2 at 300 Nm",
        "Contradicts itself: the half width of the contact is stated as 0.190 mm, its formula gives 0.174 mm at the "
        "pitch point, 9 % less. Of the deflection there 15 % are the local part.",
        deflection_parts,
        {"local part at the pitch point / %": Stated(15.3, 0.03)},
        {"half width of the contact at the pitch point / mm": Stated(0.190, 0.1)},
    ),
    _item(
        "4.4-4.6",
        "Modes of the test rig's four inertias around the ring",
        "Agrees in the stated frequencies: the shafts turn in mode 1, the reaction mesh in mode 2 and the test mesh "
        "in mode 3.",
        ring_modes,
        {},
        {f"mode {i} / Hz": Stated(f, 1e-3) for i, f in ((1, 280.0), (2, 680.0), (3, 1968.0))},
        ("lumped",),
    ),
    _item(
        "4.9-4.11",
        "Share of the load and pressure on a tooth of gears 2 and 3 while it passes",
        f"{_OURS}crowning lets a tooth of gear 2 carry load over 1.2 pitches at 50 Nm and 1.7 at 300 Nm, with 300 and "
        "720 MPa; over a slot it is alike.",
        load_shares,
        {
            f"{NAMES[gear]}, {torque}: {quantity}": Stated(value, 0.02)
            for gear, torque, quantity, value in (
                (2, "50 Nm", "tooth carries load over / pitches", 1.19),
                (2, "300 Nm", "tooth carries load over / pitches", 1.69),
                (2, "50 Nm", "largest pressure / MPa", 300.0),
                (2, "300 Nm", "largest pressure / MPa", 722.0),
                (3, "300 Nm", "largest pressure / MPa", 717.0),
            )
        },
    ),
    _item(
        "4.14",
        "Orders of the transmission error of gear 3 at 300 Nm, with and without friction",
        f"{_OURS}the slots put sidebands 3 orders apart beside the mesh order, 4 % of it without friction and 10 % "
        "with it.",
        # at the angle where spur teeth touch at the pitch point alone, friction has no sense; it had one by rounding
        # in 7 of 19 mesh periods, which made order 57 with friction 3.60 µm and order 60 0.345 µm
        error_orders,
        {
            "friction 0: order 57 / µm": Stated(1.64, 0.02),
            "friction 0: order 60 / µm": Stated(0.071, 0.05),
            "friction 0.3: order 57 / µm": Stated(3.65, 0.02),
            "friction 0.3: order 60 / µm": Stated(0.325, 0.05),
        },
        uses=("gear", "lumped", "plots"),
    ),
)
