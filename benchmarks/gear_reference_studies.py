"""Pairs, blanks and meshes of `gear_reference.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import nvhchain as nvh
from nvhchain.case import GearboxCase
from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import (
    SOLID,
    Blank,
    GearBody,
    GearGeometry,
    GearPair,
    Holes,
    Slots,
    ThinRim,
    mass_properties,
)
from nvhchain.gear.reference import ReferenceResolution

ROOT = Path(__file__).parents[1]
TORQUES = (50.0, 150.0, 350.0)
"""N m, of the pinion."""

CORNER_GAPS = (0.0, 30e-6)
"""m, of the hybrid contact."""

Record = dict[str, Any]


@dataclass(frozen=True)
class Study:
    """A pair, blanks of its wheel with the mesh periods at which they are looked at, and what is solved with."""

    pair: GearPair
    blanks: dict[str, tuple[Blank, tuple[int, ...]]]
    angles: int
    fidelity: GearFidelity
    resolution: ReferenceResolution = ReferenceResolution()  # noqa: RUF009 (frozen)

    def angle(self, number: int) -> float:
        """Wheel angle, rad."""
        return number / self.angles * self.pair.mesh_period


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
HUB, RIM = 30e-3, 63e-3


def fitted(blank: Callable[[float], Blank], low: float, high: float, mass: float) -> Blank:
    """`blank(x)` of the spur gear with the mass (kg) asked for, low < x < high."""
    return blank(brentq(lambda x: mass_properties(GearBody(SPUR, blank(x))).mass - mass, low, high))


def spur() -> Study:
    """The pairs of the thesis, ch. 3: a solid gear drives a lightweight one, pure involutes."""
    web = {"web_thickness": 12e-3, "hub_radius": HUB, "rim_radius": RIM}
    return Study(
        GearPair(GearBody(SPUR), GearBody(SPUR), 0.15),
        {
            "solid": (SOLID, (0,)),
            "thin rim": (fitted(lambda x: ThinRim(x, HUB, RIM), 2e-3, 20e-3, 1.72), (0,)),
            "8 holes": (fitted(lambda x: Holes(8, 46.5e-3, x, **web), 5e-3, 14e-3, 1.72), (0, 4)),
            "3 slots": (
                fitted(lambda x: Slots(3, 34e-3, 60e-3, x, 4e-3, **web), np.radians(20.0), np.radians(110.0), 1.68),
                (0, 9),
            ),
        },
        angles=24,
        fidelity=replace(STANDARD.gear, width_layers=6),
    )


def stage1() -> Study:
    """First stage of the gearbox, helical; wheel solid or with five slots."""
    case = nvh.load_case(ROOT / "cases" / "gearbox" / "slotted.toml")
    assert isinstance(case, GearboxCase)
    pair = case.pairs[0]
    return Study(
        pair,
        {"solid": (SOLID, (0,)), "5 slots": (pair.wheel.blank, (0, 5))},
        angles=12,
        fidelity=replace(STANDARD.gear, width_layers=8),
        resolution=ReferenceResolution(contact_element=25e-6, growth=0.45),
    )


STUDIES = {"spur": spur, "stage1": stage1}


VARIANTS: dict[str, tuple[Record, Record]] = {
    "as used": ({}, {}),
    "cells and flank elements halved": ({}, {"contact_element": 7e-6, "fine_zone": 60e-6, "growth": 0.2}),
    "root, rim and blank halved": (
        {"transverse_refinement": 2, "row_aspect": 1.0},
        {"root_rows": 12, "space_columns": 10, "rim_rows": 12},
    ),
    "10 layers": ({"width_layers": 10}, {}),
}
"""What is changed of the coarse model and of the refinement."""

VARIED = (0.0, 0.4)
"""Mesh periods: one and two pairs of spur teeth in contact."""
