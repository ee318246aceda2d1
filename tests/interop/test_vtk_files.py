"""VTKHDF, VTU and glTF are read back by VTK's own readers, which are ParaView's."""

import numpy as np
import pytest
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOGeometry import vtkGLTFReader
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.errors import InputError
from nvhchain.handoff import GearField, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.interop.gltf_files import write_glb
from nvhchain.interop.notation.surface_motion import vertex_motion
from nvhchain.interop.vtk_files import write_gear_field_vtu, write_modes_vtkhdf, write_velocity_vtkhdf, write_vtu
from nvhchain.testing.elements import brick

OCTAHEDRON = Surface(
    np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float),
    np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]),
)


def read(path, step):
    """The unstructured grid of one step, and the values of all steps."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    assert reader.CanReadFile(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(reader.GetExecutive().TIME_STEPS())
    reader.SetStep(step)
    reader.Update()
    return reader.GetOutputDataObject(0), times


def test_modes_are_steps_at_their_natural_frequencies(tmp_path):
    shapes = np.random.default_rng(1).standard_normal((3, 8))
    housing = ReducedHousing(
        natural_frequency=np.array([100.0, 250.0, 260.0]),
        modal_damping=np.full(3, 0.01),
        seat_shapes=np.zeros((3, 1, 3)),
        normal_shapes=shapes,
        seat_residual=np.zeros((1, 3, 1, 3)),
        face_residual=np.zeros((1, 3, 8)),
        names=("A",),
        positions=np.zeros((1, 3)),
        surface=OCTAHEDRON,
    )
    path = write_modes_vtkhdf(housing, tmp_path / "modes.vtkhdf")
    for step in (0, 2):
        grid, times = read(path, step)
        assert list(times) == [100.0, 250.0, 260.0]
        assert grid.GetNumberOfCells() == 8
        corners = [[grid.GetCell(i).GetPointId(j) for j in range(3)] for i in range(8)]
        assert corners == OCTAHEDRON.triangles.tolist()
        assert vtk_to_numpy(grid.GetPoints().GetData()) == pytest.approx(OCTAHEDRON.vertices)
        assert vtk_to_numpy(grid.GetCellData().GetArray("normal_shape")) == pytest.approx(shapes[step], rel=1.3e-4)
        found = vtk_to_numpy(grid.GetPointData().GetArray("shape"))
        assert found == pytest.approx(vertex_motion(OCTAHEDRON, shapes[step]), rel=1.3e-4, abs=1e-12)


def test_housing_without_modes_is_refused_in_one_line(tmp_path):
    housing = ReducedHousing(
        natural_frequency=np.zeros(0),
        modal_damping=np.zeros(0),
        seat_shapes=np.zeros((0, 1, 3)),
        normal_shapes=np.zeros((0, 8)),
        seat_residual=np.zeros((1, 3, 1, 3)),
        face_residual=np.zeros((1, 3, 8)),
        names=("A",),
        positions=np.zeros((1, 3)),
        surface=OCTAHEDRON,
    )
    with pytest.raises(InputError, match="no modes to write: its band ends below the first one"):
        write_modes_vtkhdf(housing, tmp_path / "modes.vtkhdf")
    assert not list(tmp_path.iterdir())


def test_operating_shapes_are_steps_at_their_lines(tmp_path):
    v = np.random.default_rng(2).standard_normal((3, 8, 2)) @ [1, 1j] * np.array([[1e-4], [1e-9], [1e-4]])
    path = write_velocity_vtkhdf(SurfaceVelocity(np.array([50.0, 60.0, 75.0]), v, OCTAHEDRON), tmp_path / "v.vtkhdf")
    grid, times = read(path, 1)
    assert list(times) == [50.0, 75.0]  # 60 Hz lies 100 dB lower
    found = vtk_to_numpy(grid.GetCellData().GetArray("normal_velocity_imaginary"))
    assert found == pytest.approx(v[2].imag, rel=1.3e-4)
    assert (found != v[2].imag.astype(np.float32)).any()  # rounded, which halves the file
    level = 20 * np.log10(np.abs(v[2]) / np.sqrt(2) / REFERENCE_VELOCITY)
    assert vtk_to_numpy(grid.GetCellData().GetArray("level")) == pytest.approx(level, abs=0.02)


def test_single_state_as_vtu(tmp_path):
    path = write_vtu(OCTAHEDRON, tmp_path / "s.vtu", cells={"a": np.arange(8.0)}, points={"u": np.ones((6, 3))})
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("a")).tolist() == list(range(8))
    assert reader.GetOutput().GetPointData().GetArray("u").GetNumberOfComponents() == 3


def test_vertices_of_a_pulsating_octahedron_move_outward():
    motion = vertex_motion(OCTAHEDRON, np.ones(8))
    assert motion == pytest.approx(OCTAHEDRON.vertices / np.sqrt(3))


def test_displacement_and_stress_of_a_gear_lie_at_the_nodes_of_its_elements(tmp_path):
    nodes, elements = brick((1, 1, 1), (2.0, 1.0, 1.0))
    moved = 1e-6 * nodes[:, ::-1]
    point, force = [[2.0, 1.0, 0.9], [2.0, 1.0, 1.1]], [[1.0, 2.0, 3.0], [3.0, 2.0, 1.0]]
    field = GearField(
        nodes, elements, moved, np.arange(20.0), "wheel", 0.0, 18, 2e-3, 0.0, 0.0, [0, 0], point, force, [0.0, 0.0]
    )
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(write_gear_field_vtu(field, tmp_path / "gear.vtu")))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetCellType(0) == 25  # quadratic hexahedron
    assert [grid.GetCell(0).GetPointId(j) for j in range(20)] == elements[0].tolist()
    arrays = {name: vtk_to_numpy(grid.GetPointData().GetArray(name)) for name in ("displacement", "von_mises", "force")}
    assert arrays["displacement"] == pytest.approx(moved)
    assert arrays["von_mises"] == pytest.approx(np.arange(20.0))
    corner = int(np.flatnonzero((nodes == [2.0, 1.0, 1.0]).all(axis=1))[0])
    assert arrays["force"][corner].tolist() == [4.0, 4.0, 4.0]
    assert np.abs(arrays["force"]).sum() == 12.0


def test_a_moving_surface_is_read_back_in_phase_by_the_reader_of_gltf(tmp_path):
    motion = np.random.default_rng(2).standard_normal((6, 3)) * 0.1 * np.exp(0.7j)
    path = write_glb(OCTAHEDRON, motion, np.tile([1.0, 0.5, 0.0], (6, 1)), tmp_path / "a.glb")
    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.ApplyDeformationsToGeometryOn()
    reader.SetFrameRate(12)
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    for phase in (0.0, np.pi / 2, np.pi):
        reader.UpdateInformation()
        reader.UpdateTimeStep(2.0 * phase / (2 * np.pi))
        surface = reader.GetOutputDataObject(0)
        while not hasattr(surface, "GetPoints"):
            surface = surface.GetBlock(0)
        moved = OCTAHEDRON.vertices + (motion * np.exp(1j * phase)).real
        assert vtk_to_numpy(surface.GetPoints().GetData()) == pytest.approx(moved, abs=1e-6)
    assert vtk_to_numpy(surface.GetPointData().GetArray("COLOR_0"))[0][:3] == pytest.approx([1.0, 0.5, 0.0], abs=3e-3)
