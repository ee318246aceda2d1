"""Protocol of housings: every kind reads, reduces, measures and checks itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from nvhchain.case.bodies import Extent
from nvhchain.errors import InputError, require
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import ReducedHousing, Surface
from nvhchain.housing import CraigBampton, HousingShape, RadiatingFaces, reduce_model
from nvhchain.housing.casting.contributions import Panels

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase

ELEMENT_KNOBS = frozenset({"element_size", "elements_per_turn"})
"""Knobs of the finite elements of a casting."""

_MODES_AT_6_KHZ = 60
"""Estimate of the modes below 6.25 kHz, fitted to the runs in docs/measured/chain/plan.md."""

_USUAL_WAVELENGTH = 0.244
"""Bending wavelength (m) at 1 kHz of 6 mm of aluminium."""


class Housing(Protocol):
    """A kind of housing that a gearbox can have; defaults are those of a housing from a file."""

    @property
    def unused_knobs(self) -> frozenset[str]:
        """Fields of `HousingFidelity` without effect on this kind."""
        return ELEMENT_KNOBS

    @property
    def states_surface(self) -> bool:
        """True where the radiating surface is supplied, with its elements."""
        return False

    def check(self, case: GearboxCase) -> None:
        """Raise `InputError` where the housing does not fit the rest of the case; a file is read later, by `extent`."""

    def overlaps(self, case: GearboxCase) -> Iterable[tuple[float, str]]:
        """Return overlaps (m) of gears and shafts with the housing, each with its message; none by default."""
        return ()

    def check_knobs(self, case: GearboxCase, knobs: HousingFidelity) -> None:
        """Raise `InputError`, or warn, where the knobs are too coarse for the band."""

    def check_support(self, case: GearboxCase) -> None:
        """Raise `InputError` where the case shows that nothing holds the driven housing."""

    def face_size(self, wanted: float) -> float:
        """Return the edge length (m) of the radiating triangles; `wanted` is enough for the waves in air."""
        return wanted

    def modes_in_reach(self, case: GearboxCase, knobs: HousingFidelity) -> float:
        """Estimate the number of modes up to the limit of the reduction, which grows about with frequency."""
        return _MODES_AT_6_KHZ * knobs.mode_ratio * case.band.high / 6250.0

    def walls(self, case: GearboxCase) -> tuple[float, float]:
        """Estimate outer area (m²) and lowest frequency (Hz) of the walls, before any file is read.

        The housing is a box around shafts and gears with walls of cast aluminium, 6 mm thick. A wall is a
        simply supported plate of a sixth of the area A: its lowest bending wave has λ² = A/3.
        """
        reach = max(gear.geometry.pitch_radius for gear in case.gears)
        x, y = ([shaft.axis[i] for shaft in case.shafts] for i in (0, 1))
        z = [bearing.z for bearing in case.bearings]
        sides = [max(x) - min(x) + 2 * reach, max(y) - min(y) + 2 * reach, max(z) - min(z)]
        area = 2.0 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0])
        return area, lowest_wall_frequency(area, _USUAL_WAVELENGTH)

    def extent(self, case: GearboxCase, knobs: HousingFidelity, *, driven: bool) -> Extent:
        """Return the size of the housing; its file is read and checked against the case.

        If `driven`, the gears drive the housing and something must hold it.
        """

    def shape(self, case: GearboxCase, knobs: HousingFidelity) -> HousingShape:
        """Return the surface with seats and supports, for pictures."""

    def read(self, case: GearboxCase, face_size: float) -> tuple[Any, ...]:
        """Return the contents of all files of the housing, which `reduce` takes."""

    def included_content(self, case: GearboxCase) -> Any:
        """Return what files hold that the file of the housing includes; None by default."""
        return None

    def bending_wavelength(self, frequency: float) -> float | None:
        """Return the bending wavelength (m) of the thinnest wall; None where the case does not state the walls."""
        return None

    def panels(self, case: GearboxCase, surface: Surface) -> Panels | None:
        """Return the named parts of the radiating surface; None where it has none."""
        return None

    def exchange(self, case: GearboxCase, modes_to: float, face_size: float, knobs: HousingFidelity) -> CraigBampton:
        """Return the Craig–Bampton matrices with modes up to `modes_to` (Hz).

        face_size: edge length (m) of the radiating triangles that the waves in air need.
        """
        raise InputError(
            f"{case.name}: modes from a file have no mass and stiffness at the seats: give the model itself"
        )

    def reduce(
        self, case: GearboxCase, contents: tuple[Any, ...], face_size: float, knobs: HousingFidelity, progress: Any
    ) -> ReducedHousing:
        """Reduce the housing to its modes at the bearing seats and on the radiating surface."""


def reduce_elements(
    given: Any,
    case: GearboxCase,
    parts: tuple[SolidModel, Sequence[RigidSet]],
    face_size: float,
    knobs: HousingFidelity,
    progress: Any,
) -> ReducedHousing:
    """Return the reduced finite elements and seats of a housing with the opening and damping that it states."""
    model, seats = parts
    reduced = reduce_model(
        model,
        [replace(seat, motions=case.seat_motions) for seat in seats],
        f_max=case.band.high,
        faces=RadiatingFaces(face_size, mounting_plane=given.mounting_plane, opening=given.opening),
        modal_damping=given.modal_damping,
        fidelity=knobs,
        progress=progress,
    )
    return reduced.replace(structural_damping=given.structural_damping)


def lowest_wall_frequency(area: float, wavelength: float) -> float:
    """Return the lowest frequency (Hz) of walls of an outer area (m²) from their bending wavelength (m) at 1 kHz."""
    return 3e3 * wavelength**2 / area


def require_support(case: GearboxCase, why: str, supported: bool) -> None:
    """Raise `InputError` unless the driven housing is held."""
    require(
        supported,
        f"{case.name}: {why}: nothing holds the housing, whose rigid motion no bearing takes: hold it where it is "
        "bolted, or give the run its bearing forces",
    )
