"""Reader of mesh files: points, cells and tags, with the format by the ending."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree.ElementTree import ParseError

from nvhchain.errors import FileFormatError
from nvhchain.fem.mesh_files.contents import Damaged, MeshFile, clip
from nvhchain.fem.mesh_files.facets import read_obj, read_off, read_stl
from nvhchain.fem.mesh_files.inp import read_inp
from nvhchain.fem.mesh_files.med import read_med
from nvhchain.fem.mesh_files.msh import read_msh
from nvhchain.fem.mesh_files.ply import read_ply
from nvhchain.fem.mesh_files.vtk import read_vtk
from nvhchain.fem.mesh_files.vtk_xml import read_vtk_xml

_READERS: dict[str, tuple[str, Callable[[Path], MeshFile]]] = {
    ".stl": ("STL", lambda path: read_stl(path.read_bytes())),
    ".obj": ("OBJ", lambda path: read_obj(path.read_bytes())),
    ".ply": ("PLY", lambda path: read_ply(path.read_bytes())),
    ".off": ("OFF", lambda path: read_off(path.read_bytes())),
    ".vtk": ("legacy VTK", lambda path: read_vtk(path.read_bytes())),
    ".vtu": ("VTU", lambda path: read_vtk_xml(path.read_bytes())),
    ".vtp": ("VTP", lambda path: read_vtk_xml(path.read_bytes())),
    ".msh": ("Gmsh MSH", lambda path: read_msh(path.read_bytes())),
    ".med": ("MED", read_med),
    ".inp": ("Abaqus input", read_inp),
}

FORMATS = tuple(_READERS)
"""Endings of the files that `read_mesh` reads."""

_LARGEST = 4 << 30
"""Largest size of a file (bytes)."""


def read_mesh(path: str | Path, *, others: Mapping[str, Callable[[Path], MeshFile]] | None = None) -> MeshFile:
    """Read the mesh in a file.

    path: file; its ending (`FORMATS`) gives the format.
    others: readers of other formats by ending, which raise FileFormatError themselves.
    """
    path, others = Path(path), others or {}
    if path.suffix.lower() in others:
        return others[path.suffix.lower()](path)
    if path.suffix.lower() not in _READERS:
        raise FileFormatError(
            f"{path}: meshes with the ending {clip(path.suffix)} are not read: convert it to one of "
            f"{', '.join([*FORMATS, *others])}"
        )
    name, reader = _READERS[path.suffix.lower()]
    try:
        size = path.stat().st_size
        if not 0 < size <= _LARGEST:
            raise Damaged(f"the file has {size} bytes, 1…{_LARGEST} are read")
        return reader(path).checked()
    except Damaged as error:
        why = str(error)
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read ({error.strerror or type(error).__name__})") from None
    except MemoryError:
        why = "it needs more memory than there is"
    except (ValueError, IndexError, KeyError, TypeError, OverflowError, struct.error, zlib.error, ParseError) as error:
        why = clip(error) if isinstance(error, (KeyError, IndexError, TypeError)) else str(error).splitlines()[0]
    raise FileFormatError(f"{path}: not a mesh in the {name} format ({why}): export it again") from None
