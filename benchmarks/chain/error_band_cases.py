"""Gearboxes on which the error band is tried: those its constants were fitted to, and others that were held out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, pi, radians
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from nvhchain.case import FieldPoint, GearboxCase, Options, Ramp
from nvhchain.conventions import STEEL
from nvhchain.gear import Flank, Holes, MicroGeometry, Misalignment, Relief, Slots, ThinRim
from nvhchain.handoff import RigidPlane

CASES = Path(__file__).parents[2] / "cases"
RPM = pi / 30
FOUR_SLOTS = Slots(4, 0.021, 0.033, 0.8, 0.003)


def fitted() -> Iterator[GearboxCase]:
    """One thing after the other is changed: speed, torque, blank, points, housing; two gear sets of large overlap, one
    of them slotted; and the two-stage gearboxes."""
    base = loaded("small/single_stage.toml")
    yield base
    for rpm in (1300, 2300, 2900):
        yield at(base, f"{rpm} rpm", rpm)
    for torque in (20.0, 150.0):
        yield replace(base, name=f"{torque:g} N m", operation=replace(base.operation, input_torque=torque))
    blanks = {
        "5 slots": Slots(5, 0.022, 0.031, 0.7, 0.003),
        "3 slots": Slots(3, 0.02, 0.03, 1.2, 0.004),
        "6 holes": Holes(6, 0.0265, 0.005),
        "thin rim": ThinRim(0.005, 0.02, 0.032),
    }
    for name, blank in blanks.items():
        yield with_blank(replace(base, name=name), blank)
    yield with_blank(at(base, "5 slots 2300 rpm", 2300), blanks["5 slots"])
    yield replace(base, name="beside", field_points=(FieldPoint("beside", (0.035, 0.9, 0.08)),))
    yield replace(
        with_blank(base, blanks["3 slots"]),
        name="3 slots near",
        field_points=(FieldPoint("near", (0.0, -0.2, 0.1)), FieldPoint("oblique", (0.8, 0.5, 0.6))),
    )
    yield replace(base, name="wall 4 mm", housing=replace(base.housing, wall=0.004, end_wall=0.004))
    yield replace(base, name="damping 0.01", housing=replace(base.housing, modal_damping=0.01))
    ribbed = replace(base.housing, spokes=6, side_ribs=8, wall=0.006)
    yield replace(with_blank(base, blanks["5 slots"]), name="ribbed and 5 slots", housing=ribbed)
    slotted = with_blank(coarse(), FOUR_SLOTS)
    for rpm in (2100, 1100):
        yield at(slotted, f"17-23 with 4 slots {rpm} rpm", rpm)
    for rpm in (1900, 1300):
        yield at(fine(), f"32-47 at 27 deg {rpm} rpm", rpm)
    for name in ("solid", "slotted"):
        yield replace(loaded(f"gearbox/{name}.toml"), name=f"two stages {name}")


def held_out() -> Iterator[GearboxCase]:
    """Nothing was fitted to these: a spur gear set, other slots in the first set, a wheel without slots in the second,
    all gear sets at other speeds."""
    base = loaded("small/single_stage.toml")
    spur = with_gears(base, teeth=(24, 41), module=2e-3, helix=0.0, width=0.014)
    for rpm in (1800, 1500, 1200):
        yield at(spur, f"spur 24-41 {rpm} rpm", rpm)
    for rpm in (1500, 2300):
        yield at(coarse(), f"17-23 of 26 mm {rpm} rpm", rpm)
    yield at(with_blank(coarse(), FOUR_SLOTS), "17-23 with 4 slots 1700 rpm", 1700)
    yield at(fine(), "32-47 at 27 deg 2600 rpm", 2600)
    uneven = with_blank(base, Slots(6, 0.022, 0.0305, 0.5, 0.002))
    uneven = replace(uneven, operation=replace(uneven.operation, input_torque=100.0))
    for rpm in (2050, 1550, 2700):
        yield at(uneven, f"6 slots 100 N m {rpm} rpm", rpm)
    for name in ("solid", "slotted"):
        rpm = {"solid": 1900, "slotted": 2300}[name]
        yield at(loaded(f"gearbox/{name}.toml"), f"two stages {name} {rpm} rpm", rpm)


def speeds() -> Iterator[GearboxCase]:
    """The single stage at speeds up to 4500 rpm, closely where the mesh order passes the resonance of its shafts on
    bearings and seats, heard from six sides."""
    places = (
        (0.02, -0.01, 0.62), (0.5, 0.3, 0.1), (-0.4, 0.0, 0.05), (0.0, 0.35, 0.2), (0.03, 0.1, -0.5), (1.5, -2.0, 1.0),
    )  # fmt: skip
    points = tuple(FieldPoint(f"{n}", place) for n, place in enumerate(places))
    base = replace(loaded("small/single_stage.toml"), field_points=points)
    for rpm in sorted({*range(500, 4501, 100), *range(3200, 3281, 20)}):
        yield at(base, f"{rpm} rpm from six sides", rpm)


def options() -> Iterator[GearboxCase]:
    """The single stage heard from six sides under what the other cases leave out: back flanks, friction, shuttling,
    tilt, bending shafts, a floor, light load.  Nothing was fitted to these either."""
    base = next(speeds())

    def with_options(name: str, rpm: float, torque: float, **switched_on: Any) -> GearboxCase:
        case = at(base, name, rpm)
        operation = replace(case.operation, input_torque=torque)
        return replace(case, operation=operation, options=replace(case.options, **switched_on))

    yield with_options("coasting 1700 rpm", 1700, -50.0)
    yield with_options("friction 1900 rpm", 1900, 60.0, friction=0.06)
    yield with_options("shuttling 2500 rpm", 2500, 80.0, shuttling=True)
    yield with_options("tilt and bending shafts 2100 rpm", 2100, 60.0, flexible_shafts=True, tilt=True)
    yield with_options("bending shafts that spin 3100 rpm", 3100, 120.0, flexible_shafts=True, gyroscopic=True)
    yield with_options("misaligned by the load 1450 rpm", 1450, 90.0, loaded_misalignment=True)
    yield with_options("rigid housing 3240 rpm", 3240, 60.0, rigid_housing=True)
    yield with_options("light load 2200 rpm", 2200, 8.0)
    floor = RigidPlane((0.0, -0.25, 0.0), (0.0, 1.0, 0.0))
    above = tuple(point for point in base.field_points if floor.height(np.array([point.position]))[0] > 0)
    yield replace(with_options("above a floor 2700 rpm", 2700, 30.0), reflecting_plane=floor, field_points=above)


def far() -> Iterator[GearboxCase]:
    """The single stage heard from five sides, far from the other cases in one thing each: damping, walls, bearings,
    load, speed, relief, misalignment, helix, blank, distance, band.  They were chosen after the bands, by somebody
    else."""
    places = ((0.03, 0.0, 0.7), (0.6, -0.2, 0.1), (-0.5, 0.4, 0.3), (0.0, -0.45, -0.1), (0.9, 1.1, -0.6))
    points = tuple(FieldPoint(f"p{n}", place) for n, place in enumerate(places))
    base = replace(loaded("small/single_stage.toml"), field_points=points)

    def walled(name: str, rpm: float, **walls: Any) -> GearboxCase:
        return at(replace(base, housing=replace(base.housing, **walls)), name, rpm)

    def borne(name: str, rpm: float, **bearing: float) -> GearboxCase:
        return at(replace(base, bearings=tuple(replace(one, **bearing) for one in base.bearings)), name, rpm)

    def relieved(name: str, rpm: float, **flank: Any) -> GearboxCase:
        micro = MicroGeometry(drive=Flank(**flank))
        gears = tuple(replace(gear, geometry=replace(gear.geometry, micro=micro)) for gear in base.gears)
        return at(replace(base, gears=gears), name, rpm)

    def loaded_with(name: str, rpm: float, torque: float) -> GearboxCase:
        case = at(base, name, rpm)
        return replace(case, operation=replace(case.operation, input_torque=torque))

    yield walled("thin steel undamped 1650", 1650, wall=0.0035, end_wall=0.004, material=STEEL, modal_damping=0.003)
    yield walled("undamped 0.004 2150", 2150, modal_damping=0.004)
    yield borne("undamped bearings 1250", 1250, radial_damping=60.0, axial_damping=30.0)
    yield borne("soft bearings 2650", 2650, radial_stiffness=3e7, axial_stiffness=1e7)
    yield at(base, "fast 6000", 6000)
    yield at(base, "slow 350", 350)
    yield loaded_with("400 Nm 2050", 2050, 400.0)
    yield loaded_with("rattle 1 Nm 1650", 1650, 1.0)
    yield relieved("relief 1750", 1750, lead_crowning=6e-6, tip_relief=Relief(20e-6, 2.5e-3))
    yield relieved("linear relief 30 um 1450", 1450, tip_relief=Relief(30e-6, 2e-3, "linear"), profile_crowning=4e-6)
    skewed = replace(base.stages[0], misalignment=Misalignment(in_plane=4e-4))
    yield at(replace(base, stages=(skewed,)), "misaligned 400 urad 1900", 1900)
    spur = with_gears(base, teeth=(24, 41), module=2e-3, helix=0.0, width=0.02)
    yield at(spur, "spur of 20 mm 2200", 2200)
    wide = with_gears(base, teeth=(26, 38), module=1.8e-3, helix=33.0, width=0.03)
    yield at(wide, "helix 33 wide 30 mm 1700", 1700)
    yield at(with_blank(base, Holes(12, 0.0265, 0.0035)), "12 holes 1350", 1350)
    yield at(with_blank(base, Slots(2, 0.021, 0.0305, 1.6, 0.004)), "2 slots 2250", 2250)
    near = ((0.03, 0.0, 0.15), (0.03, 0.09, 0.07), (-0.08, 0.0, 0.08), (0.14, 0.0, 0.06))
    beside = tuple(FieldPoint(f"n{n}", place) for n, place in enumerate(near))
    yield at(replace(base, field_points=beside), "very near 1550", 1550)
    for name, high in (("band to 2000", 2000.0), ("band to 6000", 6000.0)):
        yield at(replace(base, band=replace(base.band, high=high)), name, 1900)


def undecided() -> Iterator[GearboxCase]:
    """Gearboxes that leave their options to the program: strong shuttling, soft shafts and a thin web, at two speeds
    each."""
    base = replace(loaded("small/single_stage.toml"), options=Options())
    shuttling = with_gears(base, teeth=(26, 38), module=1.8e-3, helix=33.0, width=0.03)
    thin = (replace(each, outer_diameter=0.016) for shaft in base.shafts for each in shaft.segments[:1])
    soft = tuple(replace(shaft, segments=(each,)) for shaft, each in zip(base.shafts, thin, strict=True))
    bored = tuple(replace(gear, geometry=replace(gear.geometry, bore_radius=0.0081)) for gear in base.gears)
    web = with_blank(base, ThinRim(0.0035, 0.021, 0.0335))
    kinds = {"wide helical gears": shuttling, "soft shafts": replace(base, shafts=soft, gears=bored), "thin web": web}
    for name, case in kinds.items():
        for rpm in (1450, 2300):
            yield at(case, f"{name} {rpm}", rpm)


def run_ups() -> Iterator[GearboxCase]:
    """The same, while the speed changes."""
    _, undamped, *_ = far()
    base = replace(undamped, housing=loaded("small/single_stage.toml").housing)
    ramps = {
        "up 900-3600": (base, 900, 3600, 8.0, 60.0),
        "down 3600-900": (base, 3600, 900, 8.0, 60.0),
        "up 200-1200": (base, 200, 1200, 5.0, 60.0),
        "up undamped": (undamped, 1500, 3000, 6.0, 60.0),
        "light up": (base, 900, 3600, 8.0, 5.0),
        "short": (base, 2000, 2600, 0.6, 60.0),
    }
    for name, (case, first, last, seconds, torque) in ramps.items():
        operation = replace(case.operation, input_torque=torque, ramp=Ramp(last * RPM, seconds))
        yield at(replace(case, operation=operation, quantities=("pressure", "bearing_forces")), name, first)


def coarse() -> GearboxCase:
    """17 and 23 teeth of 26 mm, overlap 0.81, in a housing with ribs, heard above and far away."""
    case = with_gears(loaded("small/single_stage.toml"), teeth=(17, 23), module=3.5e-3, helix=20.0, width=0.026)
    return replace(
        case,
        operation=replace(case.operation, input_torque=110.0),
        housing=replace(case.housing, spokes=4, wall=0.006),
        field_points=(FieldPoint("above", (0.03, 0.6, 0.1)), FieldPoint("far", (-1.2, 0.4, 0.9))),
    )


def fine() -> GearboxCase:
    """32 and 47 teeth of 20 mm, overlap 1.65, in a housing with more damping and a thinner end wall."""
    case = with_gears(loaded("small/single_stage.toml"), teeth=(32, 47), module=1.75e-3, helix=27.0, width=0.02)
    return replace(
        case,
        operation=replace(case.operation, input_torque=80.0),
        housing=replace(case.housing, modal_damping=0.03, end_wall=0.0045),
        field_points=(FieldPoint("rear", (0.2, 0.1, 0.5)),),
    )


def loaded(path: str) -> GearboxCase:
    """A case of the repository."""
    case = nvh.load_case(CASES / path)
    assert isinstance(case, GearboxCase)
    return case


def at(case: GearboxCase, name: str, rpm: float) -> GearboxCase:
    """The case at another speed."""
    return replace(case, name=name, operation=replace(case.operation, input_speed=rpm * RPM))


def with_blank(case: GearboxCase, blank: Slots | Holes | ThinRim) -> GearboxCase:
    """The case with another blank of its wheel."""
    pinion, wheel = case.gears
    return replace(case, gears=(pinion, replace(wheel, blank=blank)))


def with_gears(case: GearboxCase, *, teeth: tuple[int, int], module: float, helix: float, width: float) -> GearboxCase:
    """The single stage with another gear set, its second shaft where that puts it.  Lengths: m, helix: degrees."""
    distance = module / cos(radians(helix)) * sum(teeth) / 2
    gears = tuple(
        replace(
            gear,
            geometry=replace(
                gear.geometry,
                teeth=count,
                normal_module=module,
                helix_angle=way * radians(helix),
                face_width=width,
            ),
        )
        for gear, count, way in zip(case.gears, teeth, (1, -1), strict=True)
    )
    first, second = case.shafts
    bores = tuple(
        replace(bore, centre=(distance, *bore.centre[1:])) if bore.name.startswith(second.name) else bore
        for bore in case.housing.bores
    )
    spaces = (case.housing.gear_spaces[0], replace(case.housing.gear_spaces[1], centre=(distance, 0.0)))
    return replace(
        case,
        gears=gears,
        stages=(replace(case.stages[0], centre_distance=distance),),
        shafts=(first, replace(second, axis=(distance, 0.0))),
        housing=replace(case.housing, bores=bores, gear_spaces=spaces),
    )
