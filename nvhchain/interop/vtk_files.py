"""Surfaces and gears for ParaView: VTKHDF with one step per mode or line, VTU for a single state.

VTKHDF is HDF5 of a fixed layout (VTK File Formats, "VTKHDF", version 2.2) and is written here through h5py.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.errors import require
from nvhchain.fem import mesh_files
from nvhchain.fem.mesh_files import MeshFile
from nvhchain.files.atomic_write import content_of, write_output
from nvhchain.handoff import FloatArray, GearField, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.interop.notation.surface_motion import vertex_motion
from nvhchain.levels import decibel

TRIANGLE = 5
"""Number of the cell type."""

RANGE = 80.0
"""Range (dB) of the lines of operating shapes that are written, below the line that moves most."""

MANTISSA = 12
"""Bits of the mantissa that are written: values are within 1.3e-4 of themselves (0.001 dB)."""


def write_modes_vtkhdf(housing: ReducedHousing, path: str | Path) -> Path:
    """Write mode shapes on the radiating surface, one step per mode with its natural frequency (Hz) as value.

    Cells hold normal_shape (kg^-½); points hold the vectors shape for Warp By Vector.
    """
    housing = housing.drop_ritz_vectors()
    require(
        len(housing.natural_frequency) > 0,
        "the housing has no modes to write: its band ends below the first one; raise f_max or mode_ratio",
    )
    shapes = housing.normal_shapes
    vectors = np.stack([vertex_motion(housing.surface, shape) for shape in shapes])
    return _write(housing.surface, housing.natural_frequency, {"normal_shape": shapes}, {"shape": vectors}, path)


def write_velocity_vtkhdf(velocity: SurfaceVelocity, path: str | Path) -> Path:
    """Write operating shapes, one step per line with its frequency (Hz) as value.

    Cells hold the normal velocity (m/s; real, imaginary) and its level (dB re 1 nm/s); points hold the velocity as
    vectors. Lines more than `RANGE` below the line that moves most (mean square over the area) are excluded.
    """
    energy = np.abs(velocity.normal_velocity) ** 2 @ velocity.surface.areas
    kept = energy >= 10 ** (-RANGE / 10) * energy.max(initial=0.0)
    v = velocity.normal_velocity[kept]
    vectors = np.stack([vertex_motion(velocity.surface, line) for line in v])
    cells = {
        "normal_velocity_real": v.real,
        "normal_velocity_imaginary": v.imag,
        "level": np.maximum(decibel(v, REFERENCE_VELOCITY), -200.0),
    }
    points = {"velocity_real": vectors.real, "velocity_imaginary": vectors.imag}
    return _write(velocity.surface, velocity.frequency[kept], cells, points, path)


def write_vtu(
    surface: Surface, path: str | Path, *, cells: Mapping[str, FloatArray], points: Mapping[str, FloatArray]
) -> Path:
    """Write one state of a surface.

    Parameters
    ----------
    surface : Surface
        Surface.
    path : str or Path
        VTU file.
    cells : mapping of str to (n_face, …) array
        Data of the faces.
    points : mapping of str to (n_v, …) array
        Data of the vertices.

    Returns
    -------
    Path
        Path of the file.
    """
    mesh = MeshFile(surface.vertices, [("triangle", surface.triangles)])
    return write_output(Path(path), mesh_files.vtu_content(mesh, points=points, cells=cells))


def write_gear_field_vtu(field: GearField, path: str | Path) -> Path:
    """Write displacement and stress of a gear.

    Points hold the vectors displacement (m) for Warp By Vector, von_mises (Pa), and force (N), the sum of the slice
    forces at the nearest node.  Cells are the quadratic elements.
    """
    nearest = [int(((field.nodes - point) ** 2).sum(axis=1).argmin()) for point in field.slice_point]
    force = np.zeros(field.nodes.shape)
    np.add.at(force, nearest, field.slice_force)
    kind = {"hex20": "hexahedron20", "tet10": "tetra10"}[field.kind]
    points = {"displacement": field.displacement, "von_mises": field.von_mises, "force": force}
    content = mesh_files.vtu_content(MeshFile(field.nodes, [(kind, field.elements)]), points=points)
    return write_output(Path(path), content)


def _write(
    surface: Surface,
    steps: FloatArray,
    cells: Mapping[str, FloatArray],
    points: Mapping[str, FloatArray],
    path: str | Path,
) -> Path:
    """Write one mesh for all steps; data (n_step, n, …) are stacked along the first axis."""
    count, faces, vertices = len(steps), len(surface.triangles), len(surface.vertices)
    require(count > 0, "nothing to write: no modes or lines")

    def write(memory: BytesIO) -> None:
        with h5py.File(memory, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = np.array([2, 2], dtype=np.int64)
            root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
            root["NumberOfPoints"] = np.array([vertices], dtype=np.int64)
            root["NumberOfCells"] = np.array([faces], dtype=np.int64)
            root["NumberOfConnectivityIds"] = np.array([3 * faces], dtype=np.int64)
            root["Points"] = surface.vertices
            root["Connectivity"] = surface.triangles.ravel()
            root["Offsets"] = 3 * np.arange(faces + 1, dtype=np.int64)
            root["Types"] = np.full(faces, TRIANGLE, dtype=np.uint8)
            time = root.create_group("Steps")
            time.attrs["NSteps"] = np.int64(count)
            time["Values"] = np.asarray(steps, dtype=float)
            for name in ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"):
                time[name] = np.zeros(count, dtype=np.int64)
            time["NumberOfParts"] = np.ones(count, dtype=np.int64)
            for kind, data, size in (("CellData", cells, faces), ("PointData", points, vertices)):
                _stack(root, time, kind, data, size, count)

    return write_output(Path(path), content_of(write))


def _stack(root: Any, time: Any, kind: str, data: Mapping[str, FloatArray], size: int, count: int) -> None:
    group, offsets = root.create_group(kind), time.create_group(f"{kind}Offsets")
    for name, values in data.items():
        stacked = _rounded(values.reshape(count * size, *values.shape[2:]))
        group.create_dataset(name, data=stacked, compression="gzip", shuffle=True)
        offsets[name] = size * np.arange(count, dtype=np.int64)


def _rounded(values: FloatArray) -> Any:
    """Return single precision with `MANTISSA` bits; the zeros behind them are compressed to nothing."""
    dropped = 23 - MANTISSA
    bits = np.ascontiguousarray(values, dtype=np.float32).view(np.uint32)
    return ((bits + (1 << dropped - 1)) >> dropped << dropped).astype(np.uint32).view(np.float32)
