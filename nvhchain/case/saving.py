"""Cases as files: TOML that reads back to the same numbers, or REXS."""

from __future__ import annotations

from pathlib import Path

from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.case.toml import write_toml
from nvhchain.errors import InputError, require, warn_caller
from nvhchain.kinds import checked

_OTHERS = (".rexsj", ".rexsz", ".json", ".xml", ".zip", ".yaml", ".yml")
"""Suffixes of files that no case is written to."""


@checked
def save_case(case: GearboxCase | RadiatorCase, path: str | Path) -> Path:
    """Write a case into a commented file that `load_case` reads back to an equal case, or as REXS.

    Parameters
    ----------
    case : Case
        Gearbox or radiator, also one that was built in Python.
    path : str or Path
        TOML file, or one that ends in .rexs; an existing one is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If a value cannot be written, or a radiator is to be written as REXS.
    WriteError
        If the file cannot be written.

    Notes
    -----
    Fields at their default are left out. Lengths, angles and speeds are written in the unit with the shortest digits
    that read back exactly. Files of the case, such as a mesh, stay where they are. Their paths become relative to the
    new file. `folder` of the case that is read back is the folder of the new file.

    REXS 1.4 holds shafts, gears, stages, bearings and the load. A `UserWarning` names the parts of the case that it
    does not hold, such as the housing.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    require(suffix not in _OTHERS, f"{path}: cases are written as TOML or REXS: end the name in .toml or .rexs")
    if suffix != ".rexs":
        return write_toml(case, path)
    if not isinstance(case, GearboxCase):
        raise InputError(f"{path}: {case.name} is a radiator, which REXS does not hold: end the name in .toml")
    from nvhchain.case.rexs import export_rexs  # the format is loaded where it is asked for

    left = export_rexs(case, path)
    if left:
        warn_caller(f"{path}; not in it: {', '.join(left)}", UserWarning)
    return path
