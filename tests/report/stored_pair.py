"""Small stored results of a comparison at one speed, for tests of its page."""

import base64
import json

import numpy as np

from nvhchain.acoustics import sphere
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, ForceSpectrum, SurfaceVelocity

SPEED = 2 * np.pi * 50.0
ORDERS = np.arange(1.0, 41.0)
BEARINGS, SEATS = ("A", "B"), np.zeros((2, 3))


def steady(folder, louder):
    """A run with 40 orders at one field point; order 20 is the loudest."""
    frequency = ORDERS * 50.0
    size = 1e-3 * np.where(ORDERS == 20, 10.0 * louder, 0.1)
    hdf5.save(FieldPressure(frequency, [[0.0, 0.0, 1.0]], size[:, None] + 0j, SPEED), folder / "pressure.h5")
    body = sphere(0.1, 1)
    hdf5.save(
        SurfaceVelocity(frequency, 1e-3 * size[:, None] * np.ones(len(body.triangles)), body),
        folder / "surface_velocity.h5",
    )
    force = size[:, None, None] * np.ones((1, 2, 3))
    hdf5.save(ForceSpectrum(frequency, force + 0j, BEARINGS, SPEED), folder / "force_spectrum.h5")


def case(folder, name, **values):
    record = {
        "name": name,
        "fidelity": "draft",
        "field_points": [{"name": "rear", "position_m": [0, 0, 1]}],
        "mesh_orders": {"stage1": 20.0},
        "slot_orders": {},
        "values": {"gears.wheel.face_width_mm": 22.0} | values,
    }
    folder.mkdir(exist_ok=True)
    (folder / "case.json").write_text(json.dumps(record))


def summary(levels, **more):
    configurations = {
        name: {
            "input_speed_rpm": 3000.0,
            "overall_dBA": level,
            "error_band_dBA": [level - 2.0, level + 3.0],
            "points": [{"name": "rear", "position_m": [0, 0, 1], "level_dBA": level, "limits_dBA": [None, level + 3]}],
            "orders": [{"order": order, "frequency_hz": 50.0 * order, "level_db": level} for order in (20, 40)],
            "limit_parts": [{"source": "housing", "share": 0.9, "frequency_hz": 1000.0}],
            "mesh_orders": {"stage1": 20.0},
            "transmission_errors": {"stage1": {"wheel_angle_rad": [0.0, 0.1, 0.2], "error_um": [1.0, 3.0, 2.0]}},
        }
        for name, level in levels.items()
    }
    point = {"name": "rear", "position_m": [0, 0, 1]}
    return {"fidelity": "draft", "field_point": point, "configurations": configurations} | more


def unpacked(packed):
    """Numbers of an array as a page keeps it."""
    return np.frombuffer(base64.b64decode(packed["bdata"]), "<" + packed["dtype"])
