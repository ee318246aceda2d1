"""Gearbox housing, a casting, CAD part or imported model: modes, residual flexibility, forced response."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.housing.cad.part import CadBolt, CadPart, CadSeat
    from nvhchain.housing.cad.solid import cad_model
    from nvhchain.housing.cad.survey import cad_shape, survey
    from nvhchain.housing.casting.casting import Bore, Casting, GearSpace, InnerWall
    from nvhchain.housing.casting.drawn import DrawnCasting, DrawnDisc, DrawnSeat, draw_casting
    from nvhchain.housing.casting.extent import encloses, envelope_area, face_size, room_around
    from nvhchain.housing.casting.shape import casting_shape
    from nvhchain.housing.exchange.craig_bampton import CraigBampton, craig_bampton
    from nvhchain.housing.exchange.exported_modes import exported_modes
    from nvhchain.housing.exchange.modal_model import modal_model
    from nvhchain.housing.imported.modal_results import check_modes, has_rigid_motion, housing_from_modes, modal_extent
    from nvhchain.housing.imported.seats import bearing_seats, seat_rows
    from nvhchain.housing.imported.shape import model_shape, modes_shape
    from nvhchain.housing.imported.solid_model import model_extent, reduce_model
    from nvhchain.housing.modes.damping import DampingCurve
    from nvhchain.housing.modes.mounting_plane import MountingPlane
    from nvhchain.housing.modes.response import respond
    from nvhchain.housing.modes.truncation import truncation_errors
    from nvhchain.housing.reduction import reduce_housing
    from nvhchain.housing.skin.envelope import RadiatingFaces
    from nvhchain.housing.skin.shape import HousingShape
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = ["Bore", "DampingCurve", "GearSpace", "bearing_seats", "modal_model"]
