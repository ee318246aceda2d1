"""Meshes in files of other programs: read with checks, written as VTU and Abaqus input."""

from nvhchain.fem.mesh_files.closing import closed_surface
from nvhchain.fem.mesh_files.contents import MeshFile
from nvhchain.fem.mesh_files.read import FORMATS, read_mesh
from nvhchain.fem.mesh_files.triangulation import triangulated
from nvhchain.fem.mesh_files.write import vtu_content, write_inp, write_vtu

__all__ = [
    "FORMATS",
    "MeshFile",
    "closed_surface",
    "read_mesh",
    "triangulated",
    "vtu_content",
    "write_inp",
    "write_vtu",
]
