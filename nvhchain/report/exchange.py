"""Housing of a case as a file for other programs."""

from __future__ import annotations

from pathlib import Path

from nvhchain import acoustics, interop
from nvhchain.case import Case, GearboxCase
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.housing import CraigBampton
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
    face_size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    made = case.housing.exchange(case, modes_to, face_size, fidelity.housing)
    interop.write_craig_bampton(made, path)
    return made
