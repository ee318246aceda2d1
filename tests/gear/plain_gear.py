"""One gear of round numbers, for tests of its drawing."""

import numpy as np

from nvhchain.gear import GearGeometry

MODULE = 3e-3


def gear(teeth=25, helix=0.0, **changes):
    """Normal module of 3 mm and 20°, 20 mm wide; helix angle in degrees, `changes` of fields of the geometry."""
    data = {
        "teeth": teeth,
        "normal_module": MODULE,
        "normal_pressure_angle": np.radians(20.0),
        "helix_angle": np.radians(helix),
        "face_width": 20e-3,
        "bore_radius": 5e-3,
    }
    return GearGeometry(**(data | changes))
