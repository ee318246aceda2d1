"""Case files (TOML) as frozen, validated cases: the question, not its accuracy."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.case.blank_mesh import Mesh
    from nvhchain.case.bodies import Extent, Sphere, SurfaceFile
    from nvhchain.case.cad import Cad
    from nvhchain.case.casting import Casting
    from nvhchain.case.deviations import Deviations, GhostOrder, StageTolerances, Topography
    from nvhchain.case.fluctuation import (
        SpeedHarmonic,
        SpeedHarmonics,
        SpeedRecord,
        TorqueHarmonic,
        TorqueHarmonics,
        TorqueRecord,
    )
    from nvhchain.case.gearbox import GearboxCase
    from nvhchain.case.gears import Gear, Stage
    from nvhchain.case.housing_model import HousingModel, ModalResults, Seat, SeatNode, Superelement
    from nvhchain.case.operation import (
        FIELD_POINT_QUANTITIES,
        RADIATED,
        Band,
        FieldPoint,
        Operation,
        Quantity,
        Ramp,
        TorqueRamp,
    )
    from nvhchain.case.options import AUTO, DECIDABLE, LOADED, OFF, ON, PLAIN, Options, Spread
    from nvhchain.case.radiator import RadiatorCase
    from nvhchain.case.save import save_case
    from nvhchain.case.sound import BackgroundLevels, RecordedBackground, Target
    from nvhchain.case.toml.load import Case, load_case, load_channels
    from nvhchain.case.toml.schema import case_schema
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = [
    "PLAIN",
    "Band",
    "Casting",
    "FieldPoint",
    "Gear",
    "GearboxCase",
    "HousingModel",
    "Operation",
    "Options",
    "RadiatorCase",
    "Ramp",
    "Sphere",
    "Stage",
    "SurfaceFile",
]
