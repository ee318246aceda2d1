"""Housing of a case as a file for other programs."""

from __future__ import annotations

from pathlib import Path

from nvhchain import acoustics, housing, interop
from nvhchain.case import Cad, Case, GearboxCase, HousingModel
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.housing import Casting, CraigBampton
from nvhchain.housing.exchange.craig_bampton import exchange_casting, exchange_model
from nvhchain.interop.superelement import check_craig_bampton_path


def export_craig_bampton(
    case: Case, path: str | Path, *, modes_to: float, fidelity: Fidelity = STANDARD
) -> CraigBampton:
    """Write the Craig–Bampton matrices of a case's housing.

    case: gearbox with a casting or a finite-element model as housing.
    path: file to write, .mat or .bdf (`write_craig_bampton`).
    modes_to: highest natural frequency (Hz) of the modes with fixed seats.

    Four times the band leave an error of about 4 % in the motion of the faces of a small casting.
    """
    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} has no housing")
    require(
        case.band.high <= modes_to <= 20 * case.band.high,
        f"modes_to = {modes_to:g} Hz must lie between the band's upper limit of {case.band.high:g} Hz and 20 times "
        "that",
    )
    check_craig_bampton_path(path)
    given = case.housing
    if isinstance(given, Casting):
        wanted = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
        size = housing.face_size(given, wanted)
        made = exchange_casting(
            given, f_max=case.band.high, f_top=modes_to, surface_size=size, fidelity=fidelity.housing
        )
    elif isinstance(given, HousingModel):
        model = interop.read_solid_model(Path(case.folder) / given.file, units=given.units, spc=given.spc)
        names = {seat.name: seat.nodes for seat in given.seats}
        made = exchange_model(model, housing.bearing_seats(model, case.seats, names), f_top=modes_to)
    elif isinstance(given, Cad):
        made = exchange_model(*given.model(case, fidelity.housing), f_top=modes_to)
    else:
        raise InputError(
            f"{case.name}: modes from a file have no mass and stiffness at the seats: give the model itself"
        )
    interop.write_craig_bampton(made, path)
    return made
