"""Cast housing, described by its dimensions."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist, hypot, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from nvhchain import housing
from nvhchain.case.bodies import Extent
from nvhchain.case.checks.fit import radius_at
from nvhchain.case.checks.names import nearest
from nvhchain.case.housing import Housing, lowest_wall_frequency
from nvhchain.errors import InputError, check_all, require, require_all
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import ReducedHousing, Surface
from nvhchain.housing import CraigBampton
from nvhchain.housing.casting.contributions import Panels, casting_panels
from nvhchain.housing.exchange.craig_bampton import exchange_casting
from nvhchain.housing.reduction import bending_wavelength, check_bending_resolution, check_thin_walls
from nvhchain.kinds import NAMES

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase

SEAT_TOLERANCE = 1e-5
"""Largest distance (m) of a bearing from the centre of its bore."""

# Estimates, fitted to the runs in docs/measured/chain/plan.md and docs/measured/chain/plan_knobs.md.
_UNKNOWNS_PER_AREA = 1.3e3
_UNKNOWNS_EXPONENT = 1.4
_EDGES_OF_PLAIN_WALLS, _EDGES_OF_RIBBED_WALLS = 4.3, 6.6


class Casting(housing.Casting, Housing):
    """Cast housing of a gearbox (fields of `nvhchain.housing.Casting`)."""

    @property
    def unused_knobs(self) -> frozenset[str]:
        """Empty: all knobs affect a casting."""
        return frozenset()

    def check(self, case: GearboxCase) -> None:
        """Raise `InputError` for field points inside, bearings outside their bores and walls behind the floor."""
        places = np.array([point.position for point in case.field_points], dtype=float).reshape(-1, 3)
        inside = (
            f"field point {point.name!r} at {point.position} m lies inside the housing: move it out"
            for point, enclosed in zip(case.field_points, housing.encloses(self, places), strict=True)
            if enclosed
        )
        check_all(
            lambda: require_all(inside), lambda: self._check_floor(case), lambda: require_all(self._misplaced(case))
        )

    def _misplaced(self, case: GearboxCase) -> Iterator[str]:
        """Yield bearings without a bore or beside it, and bores without a bearing."""
        bores = {bore.name: bore.centre for bore in self.bores}
        for name, seat in case.seats.items():
            if name not in bores:
                yield f"bearing {name!r}: the housing has no such bore; {nearest(name, list(bores))}"
            elif (gap := dist(seat, bores[name])) >= SEAT_TOLERANCE:
                yield f"bearing {name} is {1e3 * gap:.3f} mm away from the centre of its bore: move one of them"
        unused = sorted(set(bores) - set(case.seats))
        if unused:
            yield f"housing.bores: {', '.join(unused)} carry no bearing: remove them or add the bearing"

    def _check_floor(self, case: GearboxCase) -> None:
        """Refuse gear spaces that reach through the reflecting plane; the rest is checked on the surface."""
        plane = case.reflecting_plane
        for number, space in enumerate(self.gear_spaces if plane is not None else ()):
            assert plane is not None
            ends = np.array([[*space.centre, 0.0], [*space.centre, self.depth]])
            reach = hypot(*plane.normal[:2]) * (space.radius + self.wall)
            lowest = float(plane.height(ends).min()) - reach
            require(
                lowest > 0,
                f"reflecting_plane: gear space {number} of the housing reaches {-1e3 * lowest:.4g} mm "
                "behind the plane: move the plane away or turn its normal into the air",
            )

    def overlaps(self, case: GearboxCase) -> Iterator[tuple[float, str]]:
        """Yield overlaps (m) of gears with the walls around them and of shafts with the bores of their bearings."""
        shafts = {shaft.name: shaft for shaft in case.shafts}
        low, high = self.bell_depth + self.end_wall, self.depth - self.end_wall
        for gear in case.gears:
            tip, face = gear.geometry.tip_circle_radius, 0.5 * gear.geometry.face_width
            room = housing.room_around(self, shafts[gear.shaft].axis)
            wall = f"{1e3 * room:.5g} mm from shaft {gear.shaft}" if room > 0 else f"shaft {gear.shaft} lies outside"
            yield (
                tip - room,
                f"gear {gear.name}: its tip radius of {1e3 * tip:.5g} mm reaches into the wall, {wall}: enlarge the "
                "housing's gear_spaces or make it smaller",
            )
            yield (
                max(low - (gear.z - face), gear.z + face - high),
                f"gear {gear.name}: z = {1e3 * gear.z:g} mm with face_width = {2e3 * face:g} mm is outside the "
                f"housing, {1e3 * low:g}…{1e3 * high:g} mm between its end walls",
            )
            ends = gear.z - face, gear.z + face
            yield from self._overlaps_of_inner_walls(gear.name, *ends, tip, shafts[gear.shaft].axis)
        bores = {bore.name: bore for bore in self.bores}
        for bearing in case.bearings:
            bore = bores.get(bearing.name)
            if bore is None:
                continue
            shaft_radius = radius_at(shafts[bearing.shaft], bearing.z, radius=bore.radius)
            yield (
                shaft_radius - bore.radius,
                f"housing.bores: {bore.name}: radius = {1e3 * bore.radius:g} mm is smaller than shaft {bearing.shaft}, "
                f"of outer_diameter {2e3 * shaft_radius:g} mm there: enlarge it",
            )

    def _overlaps_of_inner_walls(
        self, name: str, start: float, end: float, tip: float, axis: tuple[float, float]
    ) -> Iterator[tuple[float, str]]:
        """Yield overlaps (m) of a gear with the inner walls, through whose openings it may pass."""
        for wall in self.inner_walls:
            low, high = wall.z - wall.thickness / 2, wall.z + wall.thickness / 2
            free = max((hole.radius - dist(hole.centre, axis) for hole in wall.openings), default=0.0)
            yield (
                min(end - low, high - start, tip - free),
                f"gear {name}: its tip radius of {1e3 * tip:.5g} mm meets the inner wall at z = {1e3 * wall.z:g} mm, "
                f"whose opening there is {1e3 * max(free, 0.0):.5g} mm: move the wall or enlarge its opening",
            )

    def check_knobs(self, case: GearboxCase, knobs: HousingFidelity) -> None:
        """Refuse, or warn of, elements too large for the bending waves and the thickness of the walls."""
        check_bending_resolution(self, case.band.high, knobs)
        check_thin_walls(self, knobs)

    def check_support(self, case: GearboxCase) -> None:
        """Refuse a casting without bolts."""
        if self.bolts == 0:
            raise InputError(
                f"{case.name}: housing bolts = 0: nothing holds the casting, whose rigid motion no bearing takes: "
                "give it bolts, or the run its bearing forces"
            )

    def face_size(self, wanted: float) -> float:
        """Return `wanted` (m), or less where the shape needs smaller triangles."""
        return housing.face_size(self, wanted)

    def modes_in_reach(self, case: GearboxCase, knobs: HousingFidelity) -> float:
        """Estimate the modes of a plate with the area of the outer walls.

        Notes
        -----
        Source: H. Weyl 1911. The number is π A/λ², less a part in proportion to the length of the fixed edges over the
        wavelength.
        """
        free = pi * housing.envelope_area(self) / bending_wavelength(self, knobs.mode_ratio * case.band.high) ** 2
        ribbed = self.side_ribs > 0 or self.spokes > 0
        return max(1.0, free - (_EDGES_OF_RIBBED_WALLS if ribbed else _EDGES_OF_PLAIN_WALLS) * sqrt(free))

    def walls(self, case: GearboxCase) -> tuple[float, float]:
        """Return outer area (m²) and lowest frequency (Hz) of the walls, as plates of a sixth of the area."""
        area = housing.envelope_area(self)
        return area, lowest_wall_frequency(area, bending_wavelength(self, 1e3))

    def extent(self, case: GearboxCase, knobs: HousingFidelity, *, driven: bool) -> Extent:
        """Estimate area and unknowns before anything is meshed."""
        area = housing.envelope_area(self)
        unknowns = _UNKNOWNS_PER_AREA * area / knobs.element_size**_UNKNOWNS_EXPONENT
        return Extent(area, f"{1e3 * knobs.element_size:g} mm elements", unknowns=unknowns)

    def shape(self, case: GearboxCase, knobs: HousingFidelity) -> housing.HousingShape:
        """Return the surface with seats and bolts, for pictures."""
        return housing.casting_shape(self, knobs)

    def bending_wavelength(self, frequency: float) -> float:
        """Return the bending wavelength (m) of the thinner wall."""
        return bending_wavelength(self, frequency)

    def panels(self, case: GearboxCase, surface: Surface) -> Panels:
        """Return walls and mounting plane of the radiating surface."""
        return casting_panels(self, surface)

    def exchange(self, case: GearboxCase, modes_to: float, face_size: float, knobs: HousingFidelity) -> CraigBampton:
        """Mesh the casting and return its Craig–Bampton matrices."""
        size = self.face_size(face_size)
        return exchange_casting(self, f_max=case.band.high, f_top=modes_to, surface_size=size, fidelity=knobs)

    def read(self, case: GearboxCase, face_size: float) -> tuple[Any, ...]:
        """Return nothing: a casting has no files."""
        return ()

    def reduce(
        self, case: GearboxCase, contents: tuple[Any, ...], face_size: float, knobs: HousingFidelity, progress: Any
    ) -> ReducedHousing:
        """Mesh the casting and reduce it."""
        return housing.reduce_housing(
            self,
            f_max=case.band.high,
            surface_size=self.face_size(face_size),
            fidelity=knobs,
            progress=progress,
            motions=case.seat_motions,
        )


NAMES[Casting] = "an nvhchain.case.Casting"
