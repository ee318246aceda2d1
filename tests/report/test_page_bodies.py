"""Bodies of the page: shafts move as their cross-sections do; teeth mesh without cutting into each other."""

import base64
import json

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.case import load_case
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, SurfaceVelocity
from nvhchain.report.case_record import gear_outlines
from nvhchain.report.page.sections.bodies.gears import _drawing, _turns
from nvhchain.report.page.sections.bodies.housing import blocks as housing_blocks
from nvhchain.report.page.sections.bodies.modes import _carried, _cylinder, blocks
from nvhchain.report.stored import Stored, StoredRun, stored_results
from nvhchain.report.surface_pressure import add_surface_pressure

CYLINDER = {"rotor": "A", "axis": [0.1, 0.2], "ends": [0.0, 0.4], "radii": [0.02, 0.03], "teeth": 9}
PLANES = [{"rotor": "A", "shaft": "A", "z": z} for z in (0.3, 0.1)]


def test_points_of_a_rigid_shaft_move_as_one_body():
    points, _ = _cylinder(CYLINDER)
    turn, shift = np.array([0.3, -0.2, 1.0 + 0.5j]), np.array([1.0, 2.0, 3.0])
    planes = np.array([[[*(shift + np.cross(turn, [0.1, 0.2, of["z"]])), *turn] for of in PLANES]])
    moved = _carried(points, CYLINDER, PLANES, planes)
    assert moved[0] == pytest.approx(shift + np.cross(turn, points), abs=1e-12)


def test_diagram_and_moving_modes_are_drawn(tmp_path):
    record = {
        "input_torque_Nm": 60.0, "nominal_rpm": 1000.0, "speed_rpm": [0.0, 1500.0],
        "over_speed_Hz": [[500.0], [510.0]], "over_speed_mesh_share": [[0.3], [0.3]], "orders": {"stage × 1": 20.0},
        "frequency_Hz": [505.0], "damping": [0.01], "strain": {"mesh stage": [0.7], "bearing A1": [0.3]},
        "kinetic": {"shaft A": [1.0]}, "planes": PLANES, "cylinders": [CYLINDER],
        "plane_motion": {"shape": [1, 2, 6], "real": [0.0, 0.0, 0.0, 0.0, 0.0, 1.0] * 2, "imag": [0.0] * 12},
        "housing_motion": {"shape": [1, 0], "real": [], "imag": []},
    }  # fmt: skip
    (tmp_path / "modes.json").write_text(json.dumps(record))
    run = StoredRun("box", tmp_path, {}, {})
    diagram, moving, table = blocks(Stored(tmp_path, {}, (run,)))
    assert diagram.data[0]["y"] == [0.0, 500.0]  # order 20 at 1500 rpm
    assert moving.data["lines"] == ["505.0 Hz, damping 1.00 %: strain mesh stage 70 %, bearing A1 30 %"]
    assert table.rows == [("505.0", "1.00", "mesh stage 70 %, bearing A1 30 %", "shaft A 100 %")]


def test_teeth_of_a_stage_lie_in_the_gaps_of_each_other(request):
    case = load_case(request.config.rootpath / "cases/small/single_stage.toml")
    drawn = gear_outlines(case)
    (pair,) = drawn["stages"].values()
    pinion, wheel = (
        _drawing(drawn["gears"][each["gear"]], each["place"], turn)
        for each, turn in zip(pair, _turns(drawn, pair), strict=True)
    )
    teeth = [of[: np.flatnonzero(np.isnan(of[:, 0]))[0]] for of in (pinion, wheel)]
    reach = [np.linalg.norm(of - np.array(each["place"]), axis=1).max() for of, each in zip(teeth, pair, strict=True)]
    apart = np.linalg.norm(np.subtract(pair[0]["place"], pair[1]["place"]))
    assert sum(reach) > apart + 2e-3  # they overlap by more than 2 mm in height
    assert not Outline(teeth[1]).contains_points(teeth[0]).any()
    assert not Outline(teeth[0]).contains_points(teeth[1]).any()
    gap = np.linalg.norm(teeth[0][:, None] - teeth[1][None], axis=2).min()
    assert gap < 0.3e-3


def test_pressure_on_the_housing_is_that_of_a_breathing_sphere(tmp_path):
    frequency, radius, speed = np.array([300.0, 600.0]), 0.1, 1e-3
    ball = sphere(radius, 2)
    vectors = transfer_vectors(ball, [[0.0, 0.0, 1.0]], frequency, fidelity=DRAFT.acoustics)
    velocity = SurfaceVelocity(frequency, np.full((2, len(ball.triangles)), speed), ball)
    for name, of in {"surface_velocity": velocity, "transfer_vectors": vectors}.items():
        hdf5.save(of, tmp_path / f"{name}.h5")
    hdf5.save(FieldPressure(frequency, vectors.points, np.array([[1e-3], [1e-2]])), tmp_path / "pressure.h5")
    (line,) = add_surface_pressure(tmp_path, 1)
    assert "at 1 lines" in line
    air = vectors.air
    ka = 2 * np.pi * frequency[1] / air.speed_of_sound * radius
    peak = air.density * air.speed_of_sound * speed * ka / np.hypot(1.0, ka)
    stored = stored_results(tmp_path)
    (drawn,) = housing_blocks(stored)
    assert [of["title"] for of in drawn.data["colours"]] == ["Normal velocity", "Pressure"]
    (run,) = drawn.data["runs"]
    packed = run["values"]["Pressure"]
    values = np.frombuffer(base64.b64decode(packed["values"]["bdata"]), dtype="i1").reshape(2, -1)
    level = values * np.frombuffer(base64.b64decode(packed["step"]["bdata"]), dtype="<f4")[:, None]
    assert (level[0] == 0).all()  # the fainter line was not solved
    assert level[1] == pytest.approx(20 * np.log10(peak / np.sqrt(2) / 20e-6), abs=0.5)
    with pytest.raises(InputError, match="ask for one or more"):
        add_surface_pressure(tmp_path, 0)
