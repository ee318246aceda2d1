"""Gearbox case whose scene as a whole is rotated, mirrored or scaled, and a housing for it made of formulas."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from nvhchain.acoustics import sphere
from nvhchain.case import GearboxCase
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import FloatArray, ReducedHousing, Surface
from nvhchain.housing import Casting

_CASTING_LENGTHS = (
    "wall", "end_wall", "depth", "bell_depth", "draft", "chamfer", "boss_thickness", "cover_thickness", "flange_width",
    "flange_thickness", "bolt_radius", "lug_radius", "rib_height", "rib_thickness",
)  # fmt: skip


def scaled(case: GearboxCase, fidelity: Fidelity, s: float) -> tuple[GearboxCase, Fidelity]:
    """Scale lengths and times of a case and its fidelity by `s`.

    The materials stay. Forces scale with s², torques with s³; pressures are the same.
    """
    gears = tuple(
        replace(
            gear,
            z=s * gear.z,
            blank=_blank(gear.blank, s),
            geometry=replace(
                gear.geometry,
                **{
                    name: s * getattr(gear.geometry, name)
                    for name in ("normal_module", "face_width", "bore_radius", "thickness_allowance")
                },
            ),
        )
        for gear in case.gears
    )
    shafts = tuple(
        replace(
            shaft,
            axis=(s * shaft.axis[0], s * shaft.axis[1]),
            segments=tuple(
                replace(
                    piece, start=s * piece.start, end=s * piece.end, outer_diameter=s * piece.outer_diameter,
                    inner_diameter=s * piece.inner_diameter,
                )
                for piece in shaft.segments
            ),
            coupled_inertia=s**5 * shaft.coupled_inertia,
        )
        for shaft in case.shafts
    )  # fmt: skip
    bearings = tuple(
        replace(
            bearing, z=s * bearing.z, radial_stiffness=s * bearing.radial_stiffness,
            axial_stiffness=s * bearing.axial_stiffness, radial_damping=s**2 * bearing.radial_damping,
            axial_damping=s**2 * bearing.axial_damping,
        )
        for bearing in case.bearings
    )  # fmt: skip
    casting = case.housing
    assert isinstance(casting, Casting)
    casting = replace(
        casting,
        **{name: s * getattr(casting, name) for name in _CASTING_LENGTHS},
        bores=tuple(replace(b, centre=_times(s, b.centre), radius=s * b.radius) for b in casting.bores),
        gear_spaces=tuple(replace(g, centre=_times(s, g.centre), radius=s * g.radius) for g in casting.gear_spaces),
    )
    operation, band = case.operation, case.band
    moved = replace(
        case,
        operation=replace(operation, input_speed=operation.input_speed / s, input_torque=s**3 * operation.input_torque),
        band=replace(band, low=band.low / s, high=band.high / s, resolution=band.resolution / s),
        gears=gears,
        stages=tuple(replace(stage, centre_distance=s * stage.centre_distance) for stage in case.stages),
        shafts=shafts,
        bearings=bearings,
        housing=casting,
        field_points=tuple(replace(point, position=_times(s, point.position)) for point in case.field_points),
    )
    knobs = replace(
        fidelity,
        gear=replace(fidelity.gear, corner_gap=s * fidelity.gear.corner_gap),
        dynamics=replace(fidelity.dynamics, time_step=s * fidelity.dynamics.time_step),
        housing=replace(fidelity.housing, element_size=s * fidelity.housing.element_size),
    )
    return moved, knobs


def mapped(case: GearboxCase, matrix: FloatArray) -> GearboxCase:
    """Map a case by an orthogonal matrix (3, 3) of the transverse plane.

    A mirror changes the hand of the gears and the sense of rotation.
    """
    hand = round(float(np.linalg.det(matrix)))

    def transform(place: Any) -> Any:
        return tuple((matrix[: len(place), : len(place)] @ np.array(place)).tolist())

    casting = case.housing
    assert isinstance(casting, Casting)
    return replace(
        case,
        gears=tuple(
            replace(gear, geometry=replace(gear.geometry, helix_angle=hand * gear.geometry.helix_angle))
            for gear in case.gears
        ),
        shafts=tuple(replace(shaft, axis=transform(shaft.axis)) for shaft in case.shafts),
        housing=replace(
            casting,
            bores=tuple(replace(bore, centre=transform(bore.centre)) for bore in casting.bores),
            gear_spaces=tuple(replace(space, centre=transform(space.centre)) for space in casting.gear_spaces),
        ),
        field_points=tuple(replace(point, position=transform(point.position)) for point in case.field_points),
        input_rotation=hand * case.input_rotation,
    )


def egg_housing(case: GearboxCase, s: float = 1.0, matrix: FloatArray | None = None) -> ReducedHousing:
    """Make up a housing of five modes on a lopsided body, with the seats of the case.

    matrix : orthogonal map of the body.
    """
    matrix, rng = np.eye(3) if matrix is None else matrix, np.random.default_rng(1)
    ball, count = sphere(0.1, 2), len(case.bearings)
    x, y, z = ball.vertices.T
    bulge = 1.0 + 1.5 * z + 20.0 * x * y
    vertices = np.stack([1.3 * x * bulge, y * bulge, 0.8 * z + 0.2 * x], axis=1)
    seats = 0.3 * rng.standard_normal((5, count, 3))
    shapes = rng.standard_normal((5, 4)) @ np.vstack([np.ones(len(ball.triangles)), 10 * ball.centroids.T])
    flexibility = rng.standard_normal((3 * count, 3 * count))
    residual = (1e-11 * flexibility @ flexibility.T).reshape(count, 3, count, 3)
    triangles = ball.triangles if np.linalg.det(matrix) > 0 else ball.triangles[:, ::-1]
    return ReducedHousing(
        natural_frequency=np.linspace(900.0, 3800.0, 5) / s,
        modal_damping=np.full(5, 0.02),
        seat_shapes=seats @ matrix.T / s**1.5,
        normal_shapes=shapes / s**1.5,
        seat_residual=np.einsum("ai,bicj,dj->bacd", matrix, residual, matrix) / s,
        face_residual=np.zeros((count, 3, len(triangles))),
        names=tuple(bearing.name for bearing in case.bearings),
        positions=np.array(list(case.seats.values())),
        surface=Surface(s * vertices @ matrix.T, triangles),
    )


def _blank(blank: Any, s: float) -> Any:
    lengths = [f.name for f in fields(blank) if f.name.endswith(("radius", "thickness", "offset", "fillet"))]
    return replace(blank, **{name: s * getattr(blank, name) for name in lengths if getattr(blank, name) is not None})


def _times(s: float, place: Any) -> Any:
    return tuple(s * x for x in place)
