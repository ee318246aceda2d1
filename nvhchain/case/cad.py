"""Housing from a STEP file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nvhchain import housing
from nvhchain.case.bodies import Extent
from nvhchain.case.housing import Housing, reduce_elements
from nvhchain.errors import require
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import ReducedHousing
from nvhchain.housing import CraigBampton
from nvhchain.housing.cad.survey import Survey
from nvhchain.housing.exchange.craig_bampton import exchange_model
from nvhchain.kinds import NAMES

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase


class Cad(housing.CadPart, Housing):
    """Casting in a STEP file (fields of `nvhchain.housing.CadPart`)."""

    @property
    def unused_knobs(self) -> frozenset[str]:
        """Empty: all knobs affect a casting."""
        return frozenset()

    def check(self, case: GearboxCase) -> None:
        """Raise `InputError` for seats of bearings that the case does not have."""
        unknown = sorted({seat.name for seat in self.seats} - set(case.seats))
        require(not unknown, f"housing.seats: {', '.join(unknown)} are no bearings: known {', '.join(case.seats)}")

    def check_support(self, case: GearboxCase) -> None:
        """Refuse a part without bolts."""
        require(
            bool(self.bolts) or self.bolt_diameter is not None,
            f"{case.name}: nothing holds the housing of {self.file}, whose rigid motion no bearing takes: give "
            "bolt_diameter_mm or bolts, or the run its bearing forces",
        )

    def survey(self, case: GearboxCase, knobs: HousingFidelity) -> Survey:
        """Read the part and find its seats and bolts."""
        return housing.survey(self, Path(case.folder), case.seats, knobs)

    def model(self, case: GearboxCase, knobs: HousingFidelity) -> tuple[SolidModel, tuple[RigidSet, ...]]:
        """Mesh the part; its seats follow."""
        return housing.cad_model(self, Path(case.folder), case.seats, f_max=case.band.high, fidelity=knobs)

    def extent(self, case: GearboxCase, knobs: HousingFidelity, *, driven: bool) -> Extent:
        """Return area and unknowns before the part is meshed; its seats and bolts are checked."""
        found = self.survey(case, knobs)
        size = found.element_size(self, case.band.high, knobs)
        words = f"{1e3 * size:.3g} mm elements in walls of {1e3 * found.wall:.2g} mm, {len(found.bolts)} bolts"
        return Extent(found.area / 2, words, unknowns=found.unknowns(knobs.element_size, size))

    def shape(self, case: GearboxCase, knobs: HousingFidelity) -> housing.HousingShape:
        """Return the surface with seats and bolts, for pictures."""
        return housing.cad_shape(housing.survey(self, Path(case.folder), case.seats, knobs, smooth=True))

    def read(self, case: GearboxCase, face_size: float) -> tuple[Any, ...]:
        """Return the file's bytes and the seats of the case."""
        path = Path(case.folder) / self.file
        require(path.is_file(), f"{path}: no such STEP file")
        return path.read_bytes(), case.seats

    def exchange(self, case: GearboxCase, modes_to: float, face_size: float, knobs: HousingFidelity) -> CraigBampton:
        """Mesh the part and return its Craig–Bampton matrices."""
        return exchange_model(*self.model(case, knobs), f_top=modes_to)

    def reduce(
        self, case: GearboxCase, contents: tuple[Any, ...], face_size: float, knobs: HousingFidelity, progress: Any
    ) -> ReducedHousing:
        """Mesh the part and reduce it."""
        return reduce_elements(self, case, self.model(case, knobs), face_size, knobs, progress)


NAMES[Cad] = "an nvhchain.case.Cad"
