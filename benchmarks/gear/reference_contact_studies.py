"""Pairs, blanks, alignments and meshes of `reference_contact.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import nvhchain as nvh
from benchmarks.gear.reference import ReferenceResolution
from nvhchain.case import GearboxCase
from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import (
    SOLID,
    Blank,
    Flank,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    MicroGeometry,
    Misalignment,
    Relief,
    Slots,
    ThinRim,
    mass_properties,
)

ALIGNED = Misalignment()
ROOT = Path(__file__).parents[2]
TORQUES = (50.0, 150.0, 350.0)
"""N m, of the pinion."""

CORNER_GAPS = (0.0, STANDARD.gear.corner_gap)
"""m, of the hybrid contact."""

Record = dict[str, Any]


@dataclass(frozen=True)
class Condition:
    """What a pair is looked at with.

    blank: of the wheel, by name.  shifts: mesh periods by which its teeth have moved on, one curve for each.
    misalignment: of its axis.  lead_slope: m, of the wheel's drive flanks.
    torques: N m, of the pinion, up to where pressure reaches the last cells that are looked at.
    """

    blank: str
    shifts: tuple[int, ...] = (0,)
    misalignment: Misalignment = ALIGNED
    lead_slope: float = 0.0
    torques: tuple[float, ...] = TORQUES

    @property
    def aligned(self) -> bool:
        """Whether the gaps are those of the drawn pair."""
        return self.misalignment == ALIGNED and self.lead_slope == 0


@dataclass(frozen=True)
class Study:
    """A pair with pure involutes, blanks of its wheel, what it is looked at with, and what is solved with.

    angles: of one mesh period.
    """

    pair: GearPair
    blanks: dict[str, Blank]
    conditions: dict[str, Condition]
    angles: int
    fidelity: GearFidelity
    resolution: ReferenceResolution = ReferenceResolution()  # noqa: RUF009 (frozen)

    def angle(self, number: int) -> float:
        """Wheel angle, rad."""
        return number / self.angles * self.pair.mesh_period

    def pair_under(self, condition: Condition) -> GearPair:
        """The pair with blank, misalignment and lead slope of a condition."""
        wheel = self.pair.wheel
        geometry = wheel.geometry
        if condition.lead_slope:
            sloped = MicroGeometry(drive=Flank(lead_slope=condition.lead_slope))
            geometry = replace(geometry, micro=sloped)
        wheel = replace(wheel, geometry=geometry, blank=self.blanks[condition.blank])
        return replace(self.pair, wheel=wheel, misalignment=condition.misalignment)


MODULE, SHIFT = 2.6e-3, 0.3614
SPUR = GearGeometry(
    teeth=57,
    normal_module=MODULE,
    normal_pressure_angle=np.radians(20.0),
    helix_angle=0.0,
    face_width=23e-3,
    bore_radius=20e-3,
    profile_shift=SHIFT,
    dedendum=(148.2e-3 - 141.7e-3) / 2 / MODULE + SHIFT,
    tip_radius=154.5e-3 / 2,
    thickness_allowance=50e-6,
)
THICK_TEETH = (
    "The spur pair is not that of S. Shweiki's thesis: 57/57 teeth with profile shift x = 0.36 on both gears, bore 40 "
    "mm, web 12 mm under holes and slots. The gears of the thesis, x = 0, are those of "
    "`benchmarks/gear/reference_pairs.py`."
)
"""Note beside the results of the spur pair."""

HUB, RIM = 30e-3, 63e-3


def fitted(blank: Callable[[float], Blank], low: float, high: float, mass: float) -> Blank:
    """`blank(x)` of the spur gear with the mass (kg) asked for, low < x < high."""
    return blank(brentq(lambda x: mass_properties(GearBody(SPUR, blank(x))).mass - mass, low, high))


def spur() -> Study:
    """Spur pairs with `THICK_TEETH`: a solid gear drives a lightweight one, pure involutes."""
    web = {"web_thickness": 12e-3, "hub_radius": HUB, "rim_radius": RIM}
    return Study(
        GearPair(GearBody(SPUR), GearBody(SPUR), 0.15),
        {
            "solid": SOLID,
            "thin rim": fitted(lambda x: ThinRim(x, HUB, RIM), 2e-3, 20e-3, 1.72),
            "8 holes": fitted(lambda x: Holes(8, 46.5e-3, x, **web), 5e-3, 14e-3, 1.72),
            "3 slots": fitted(
                lambda x: Slots(3, 34e-3, 60e-3, x, 4e-3, **web), np.radians(20.0), np.radians(110.0), 1.68
            ),
        },
        {
            "solid": Condition("solid"),
            "thin rim": Condition("thin rim"),
            "8 holes": Condition("8 holes", (0, 4)),
            "3 slots": Condition("3 slots", (0, 9)),
        },
        angles=24,
        fidelity=STANDARD.gear.even_layers(6),
    )


def stage1() -> Study:
    """First stage of the gearbox, helical; wheel solid or with five slots, aligned, tilted or with sloped flanks."""
    case = nvh.load_case(ROOT / "cases" / "gearbox" / "slotted.toml")
    assert isinstance(case, GearboxCase)
    pair = case.pairs[0]
    return Study(
        pair,
        {"solid": SOLID, "5 slots": pair.wheel.blank},
        {
            "solid": Condition("solid"),
            "5 slots": Condition("5 slots", (0, 5)),
            "solid, −1 mrad": Condition("solid", misalignment=Misalignment(in_plane=-1e-3)),
            "5 slots, 0.5 mrad": Condition("5 slots", misalignment=Misalignment(in_plane=0.5e-3)),
            "5 slots, −1 mrad": Condition("5 slots", misalignment=Misalignment(in_plane=-1e-3)),
            "5 slots, 2 mrad": Condition("5 slots", misalignment=Misalignment(in_plane=2e-3), torques=TORQUES[:2]),
            "5 slots, −2 mrad": Condition("5 slots", misalignment=Misalignment(in_plane=-2e-3), torques=TORQUES[:2]),
            "5 slots, lead slope 15 µm": Condition("5 slots", lead_slope=15e-6),
        },
        angles=12,
        fidelity=STANDARD.gear.even_layers(16),
        resolution=replace(SLANTED, largest_gap=110e-6),
    )


SLANTED = ReferenceResolution(contact_element=25e-6, growth=0.45)
"""Of contact that runs across the teeth or ends within their width."""

WIDE = 0.5e-3
"""m, `reach` where one end of the face carries most of a heavy load."""


def stage1_wide() -> Study:
    """The same tilted by 2 mrad at 350 N m, where the pressure at the end of the face is wider than `reach` there.

    With layers enough from 150 N m on.
    """
    drawn = stage1()
    conditions = {
        name: replace(drawn.conditions[name], torques=TORQUES[2:]) for name in ("5 slots, 2 mrad", "5 slots, −2 mrad")
    }
    resolution = replace(drawn.resolution, reach=WIDE)
    return replace(drawn, conditions=conditions, fidelity=FEW_LAYERS, resolution=resolution)


FEW_LAYERS = STANDARD.gear.even_layers(8)


def stage1_apart() -> Study:
    """The same stage 0.3 mm farther apart, a parallel error of its axes, and tilted besides."""
    drawn = stage1()
    pair = replace(drawn.pair, centre_distance=drawn.pair.centre_distance + 0.3e-3)
    conditions = {name: drawn.conditions[name] for name in ("solid", "5 slots", "5 slots, −1 mrad")}
    conditions["5 slots, −1 mrad"] = replace(conditions["5 slots, −1 mrad"], torques=TORQUES[:2])
    return replace(drawn, pair=pair, conditions=conditions, fidelity=FEW_LAYERS, resolution=SLANTED)


def spur_tilted() -> Study:
    """The spur pair with its wheel's axis tilted: teeth refined over their full width."""
    drawn = spur()
    by = {"0.5 mrad": Misalignment(in_plane=0.5e-3), "1 mrad": Misalignment(in_plane=1e-3)}
    torques = {"0.5 mrad": TORQUES, "1 mrad": TORQUES[:2]}  # the pressure at the end of the face is wider at 350 N m
    return replace(
        drawn,
        pair=replace(drawn.pair, misalignment=by["1 mrad"]),
        conditions={
            f"{blank}, {tilt}": Condition(blank, misalignment=by[tilt], torques=torques[tilt])
            for blank in TILTED
            for tilt in by
        },
        angles=12,
        fidelity=FEW_LAYERS,
        resolution=SLANTED,
    )


TILTED = ("solid", "3 slots")
"""Blanks of the spur wheel that is tilted."""


def spur_tilted_wide() -> Study:
    """The same at 1 mrad and 350 N m, where the pressure at the end of the face is wider than `reach` there."""
    drawn = spur_tilted()
    conditions = {
        name: replace(drawn.conditions[name], torques=TORQUES[2:]) for name in ("solid, 1 mrad", "3 slots, 1 mrad")
    }
    return replace(drawn, conditions=conditions, resolution=replace(drawn.resolution, reach=WIDE))


STUDIES = {
    "spur": spur,
    "spur tilted": spur_tilted,
    "spur tilted wide": spur_tilted_wide,
    "stage1": stage1,
    "stage1 wide": stage1_wide,
    "stage1 apart": stage1_apart,
}


@dataclass(frozen=True)
class Convergence:
    """What finer meshes do to a study's pair.

    condition: under which it is looked at.  places: mesh periods, by what is in contact there.
    variants: changes of the coarse model and of the refinement; the first has none.
    """

    condition: str
    places: dict[str, float]
    variants: dict[str, tuple[Record, Record]]


CONVERGENCE = {
    "spur": Convergence(
        "solid",
        {"one pair": 0.0, "an incoming edge": 0.24, "two pairs": 0.4},
        {
            "as used": ({}, {}),
            "cells and flank elements halved": ({}, {"contact_element": 7e-6, "fine_zone": 60e-6, "growth": 0.2}),
            "root, rim and blank halved": (
                {"transverse_refinement": 2, "row_aspect": 1.0},
                {"root_rows": 12, "space_columns": 10, "rim_rows": 12},
            ),
            "10 layers": ({"width_layers": 10}, {}),
        },
    ),
    "spur tilted": Convergence(
        "solid, 1 mrad",
        {"one pair": 0.0, "two pairs": 0.5},
        {"as used": ({}, {}), "16 layers": ({"width_layers": 16}, {})},
    ),
    "stage1": Convergence(
        "solid",
        {"both edges, late": 11 / 12, "no edge": 0.5},
        {
            "as used": ({}, {}),
            "8 layers": ({"width_layers": 8}, {}),
            "24 layers": ({"width_layers": 24}, {}),
        },
    ),
}


@dataclass(frozen=True)
class Relieved:
    """Tip relief of both gears of the spur pair with a solid wheel, looked at where a tip comes in.

    place: in mesh periods.  torque: N m, of the pinion.
    """

    relief: Relief
    place: float
    torque: float


RELIEVED = {
    "20 µm parabolic": Relieved(Relief(20e-6, 1.75e-3), 0.32, 350.0),
    "15 µm linear, short": Relieved(Relief(15e-6, 0.6e-3, "linear"), 0.30, 150.0),
    "10 µm linear": Relieved(Relief(10e-6, 1.2e-3, "linear"), 0.30, 350.0),
}
RELIEVED_LAYERS = 2
RELIEVED_RESOLUTION = ReferenceResolution(contact_element=20e-6, reach=0.8e-3, fine_zone=0.2e-3)
