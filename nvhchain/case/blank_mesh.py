"""Imported mesh of a gear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nvhchain.errors import require
from nvhchain.gear import VolumeMesh, read_gear_mesh

UNITS = {"m": 1.0, "mm": 1e-3, "in": 0.0254}
"""Length in m of every unit."""


@dataclass(frozen=True)
class Mesh:
    """Quadratic tetrahedra or bricks of a whole gear with its teeth, from a file (`nvhchain.fem.mesh_files.FORMATS`).

    The z axis of the mesh is that of the shaft, from mid-width. Tooth 0 lies on its x axis there.

    Parameters
    ----------
    file : str
        Path of the mesh, relative to the case.
    units : str
        Unit of length in the file.
    bore, flanks : str
        Names of the node sets, node arrays or groups of surface cells of the fixed bore and of all flanks.
    symmetry : int
        Order of the rotational symmetry of the body, such as its number of slots; 1 for none.
    """

    file: str
    units: Literal["m", "mm", "in"]
    bore: str = "bore"
    flanks: str = "flanks"
    symmetry: int = 1

    def __post_init__(self) -> None:
        require(bool(self.file), "file is empty: give the path of the mesh")
        require(self.symmetry >= 1, f"symmetry = {self.symmetry} must be at least 1: the order of the body, 1 for none")
        require(self.bore != self.flanks, f"bore and flanks are both {self.bore!r}: name two tags")

    def read(self) -> VolumeMesh:
        """Read the mesh; raises FileFormatError and InputError like `read_gear_mesh`."""
        tags = (self.bore, self.flanks)
        return read_gear_mesh(self.file, scale=UNITS[self.units], order=self.symmetry, tags=tags)
