"""A gear that another program has meshed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nvhchain.errors import require
from nvhchain.gear import VolumeMesh, read_gear_mesh

UNITS = {"m": 1.0, "mm": 1e-3, "in": 0.0254}
"""m per unit of length."""


@dataclass(frozen=True)
class Mesh:
    """Quadratic tetrahedra or bricks of a whole gear with its teeth, from a file (`nvhchain.fem.mesh_files.FORMATS`).

    Its z axis is that of the shaft, from mid-width, and tooth 0 lies on its x axis there.
    file: path, beside the case.  units: of length in the file.  bore, flanks: names of the node sets, node arrays or
    groups of surface cells of the bore, which is held, and of all flanks.
    symmetry: order of the rotational symmetry of the body, such as its number of slots; 1 for none.
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
        """The mesh.  Raises FileFormatError and InputError as `read_gear_mesh`."""
        tags = (self.bore, self.flanks)
        return read_gear_mesh(self.file, scale=UNITS[self.units], order=self.symmetry, tags=tags)
