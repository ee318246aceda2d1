"""Valid files of every format that is read, small, for damaging."""

from __future__ import annotations

import json
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from benchmarks.hostile.valid_decks import abaqus_frame, nastran_frame
from nvhchain.case import Topography, load_case
from nvhchain.case.rexs import export_rexs
from nvhchain.conventions import Material
from nvhchain.fem.mesh_files import read_mesh
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces, FieldPressure, ForceSpectrum, Surface, SurfaceVelocity
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.interop import (
    read_abaqus,
    read_bearing_forces,
    read_modal_model,
    read_nastran,
    write_abaqus,
    write_bearing_forces,
    write_modal_hdf5,
    write_modal_uff,
    write_nastran,
)
from nvhchain.interop.rexs import read_rexs
from nvhchain.interop.solids.nastran_faces import read_nastran_faces
from nvhchain.sound import Sound, read_wav, write_wav
from nvhchain.study import load_study

Reader = Callable[[Path], Any]

CASES = Path(__file__).parents[2] / "cases"

BALL = pyvista.Icosphere(radius=0.1, nsub=1)
POINTS, TRIANGLES = np.asarray(BALL.points, dtype=float), BALL.faces.reshape(-1, 4)[:, 1:].astype(int)
BY_MESHIO: dict[str, tuple[str, dict[str, Any]]] = {
    "binary.stl": ("stl", {"binary": True}),
    "text.stl": ("stl", {"binary": False}),
    "a.obj": ("obj", {}),
    "binary.ply": ("ply", {"binary": True}),
    "text.ply": ("ply", {"binary": False}),
    "a.off": ("off", {}),
    "binary5.vtk": ("vtk51", {"binary": True}),
    "text5.vtk": ("vtk51", {"binary": False}),
    "binary4.vtk": ("vtk42", {"binary": True}),
    "text4.vtk": ("vtk42", {"binary": False}),
    "zlib.vtu": ("vtu", {"compression": "zlib"}),
    "lzma.vtu": ("vtu", {"compression": "lzma"}),
    "plain.vtu": ("vtu", {"compression": None}),
    "text.vtu": ("vtu", {"binary": False}),
    "a.inp": ("abaqus", {}),
    "a.med": ("med", {}),
    "binary2.msh": ("gmsh22", {"binary": True}),
    "text2.msh": ("gmsh22", {"binary": False}),
    "binary4.msh": ("gmsh", {"binary": True}),
    "text4.msh": ("gmsh", {"binary": False}),
}


def write_meshes(folder: Path) -> None:
    """Write the ball in every format of surface meshes."""
    mesh = meshio.Mesh(POINTS, [("triangle", TRIANGLES)], point_data={"bore": (POINTS[:, 2] > 0).astype(np.int32)})
    bare = meshio.Mesh(POINTS, mesh.cells)
    for name, (form, options) in BY_MESHIO.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of meshio, about formats that keep less than it holds
            meshio.write(folder / name, mesh if form[:3] in ("vtk", "vtu") else bare, file_format=form, **options)
    _write_appended(folder / "raw.vtu", raw=True)
    _write_appended(folder / "base64.vtu", raw=False)
    BALL.save(folder / "binary.vtp")
    BALL.save(folder / "polygons.vtk")
    lines = [f"GRID,{i},,{x:.9g},{y:.9g},{z:.9g}" for i, (x, y, z) in enumerate(POINTS, 1)]
    lines += [f"CTRIA3,{i},1,{a},{b},{c}" for i, (a, b, c) in enumerate(TRIANGLES + 1, 1)]
    (folder / "a.bdf").write_text("\n".join(lines) + "\nENDDATA\n")


def _write_appended(path: Path, *, raw: bool) -> None:
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(BALL.cast_to_unstructured_grid())
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.SetEncodeAppendedData(not raw)
    writer.SetBlockSize(256)
    writer.Write()


def write_others(folder: Path) -> dict[str, Reader]:
    """Write records of forces, solid models, modes and hand-offs; returns what reads each, by the name of the file."""
    readers: dict[str, Reader] = {}
    forces = _forces()
    for ending in ("csv", "mat", "h5", "uff"):
        name = f"forces.{ending}"
        channels = write_bearing_forces(forces, folder / name)
        readers[name] = lambda path, channels=channels: read_bearing_forces(
            path, channels, positions=dict(zip(forces.names, map(tuple, forces.positions), strict=True))
        )
    write_nastran(_bricks(), folder / "solid.bdf", units="m-kg-s")
    write_abaqus(_bricks(), folder / "solid.inp", units="m-kg-s")
    readers["solid.bdf"] = lambda path: read_nastran(path, units="m-kg-s")
    readers["solid.inp"] = lambda path: read_abaqus(path, units="m-kg-s")
    write_modal_uff(_modes(), folder / "modes.unv")
    write_modal_hdf5(_modes(), folder / "modes.h5")
    readers["modes.unv"] = readers["modes.h5"] = read_modal_model
    (folder / "frame.bdf").write_text(nastran_frame())
    (folder / "frame.inp").write_text(abaqus_frame())
    readers["frame.bdf"] = lambda path: _matrices(read_nastran(path, units="mm-t-s"))
    readers["frame.inp"] = lambda path: _matrices(read_abaqus(path, units="mm-t-s"))
    write_wav(Sound(np.sin(np.arange(800) / 3.0), 8000), folder / "sound.wav")
    readers["sound.wav"] = read_wav
    export_rexs(load_case(CASES / "small" / "catalogue_bearings.toml"), folder / "unit.rexs")
    readers["unit.rexs"] = read_rexs
    with zipfile.ZipFile(folder / "unit.rexsz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(folder / "unit.rexs", "unit.rexs")
    readers["unit.rexsz"] = read_rexs
    places = [(profile, face) for profile in (0, 0.5, 1) for face in (0, 1)]
    table = [f"{tooth},{profile},{face},{tooth - 2 * profile + face}" for tooth in range(3) for profile, face in places]
    (folder / "flanks.csv").write_text("\n".join(["tooth,profile,face,deviation_um", *table, ""]))
    readers["flanks.csv"] = lambda path: Topography(str(path)).read()
    (folder / "study.toml").write_text(_STUDY.format(case=CASES / "small" / "single_stage.toml"))
    readers["study.toml"] = load_study
    return readers


def _matrices(model: SolidModel) -> tuple[Any, ...]:
    """Stored numbers of stiffness and mass."""
    return tuple(matrix.data for matrix in constrained(sound_mesh(model)[0])[:2])


_STUDY = """case = "{case}"
speeds_rpm = [1500, 1800]
plan = "latin_hypercube"
designs = 8
seed = 3
targets = {{ level = 65 }}

[[parameters]]
name = "torque"
path = "operation.input_torque"
low = 40
high = 60

[[parameters]]
name = "relief"
path = "gears.pinion.geometry.x"
mean = 0.1
deviation = 0.01
"""


def mesh_reader(name: str) -> Reader:
    """Function that reads a file of `write_meshes`."""
    return read_nastran_faces if name.endswith(".bdf") else read_mesh


def write_hand_offs(folder: Path) -> None:
    """Write hand-offs of several kinds."""
    surface = Surface(POINTS, TRIANGLES)
    frequency = np.array([100.0, 200.0, 400.0])
    velocity = np.ones((3, len(TRIANGLES))) * (1 + 1j)
    hdf5.save(_forces(), folder / "bearing_forces.h5")
    hdf5.save(ForceSpectrum(frequency, np.ones((3, 2, 3)) * 1j, ("A", "B"), 9.0), folder / "force_spectrum.h5")
    hdf5.save(surface, folder / "surface.h5")
    hdf5.save(SurfaceVelocity(frequency, velocity, surface), folder / "velocity.h5")
    hdf5.save(FieldPressure(frequency, [[0.0, 0, 1]], np.ones((3, 1)) * 1j, 9.0), folder / "pressure.h5")


def _forces() -> BearingForces:
    push = np.random.default_rng(1).normal(size=(40, 2, 3))
    return BearingForces(np.arange(40) / 1e3, push, ("A", "B"), [[0.0, 0, 0], [0.1, 0, 0]], 9.0)


def _bricks() -> SolidModel:
    """Three bricks in a row, held at one end."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    layers = np.array([(x, y, z) for x in range(4) for y in range(2) for z in range(2)], dtype=float)
    number = {tuple(place): i for i, place in enumerate(layers.astype(int))}
    bricks = np.array([[number[x + a, b, c] for a, b, c in corners] for x in range(3)])
    block = ElementBlock("hex8", bricks, Material(210e9, 0.3, 7850.0), np.arange(1, 4), "BEAM")
    return SolidModel(
        nodes=0.02 * layers,
        labels=np.arange(1, len(layers) + 1),
        blocks=(block,),
        rigid_sets=(),
        held=np.repeat(layers[:, :1] == 0, 3, axis=1),
    )


def _modes() -> ModalModel:
    shapes = np.random.default_rng(2).normal(size=(3, len(POINTS), 3))
    return ModalModel(
        nodes=POINTS,
        labels=np.arange(1, len(POINTS) + 1),
        triangles=TRIANGLES,
        two_sided=False,
        frequency=np.array([100.0, 220.0, 500.0]),
        damping=np.full(3, 0.02),
        shapes=shapes,
        groups={"seats": np.arange(4)},
        source="ball",
    )


def write_summary(folder: Path) -> Path:
    """Write what `report` makes a page of."""
    path = folder / "summary.json"
    whole = {
        "fidelity": "draft",
        "field_point": {"name": "here", "position_m": [0, 0, 1]},
        "configurations": {"a": {"overall_dBA": 60.0, "error_band_dBA": [59.0, 61.0]}},
    }
    path.write_text(json.dumps(whole, indent=1))
    return path
