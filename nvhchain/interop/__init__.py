"""Files of other programs: import and export of hand-offs."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.interop.forces.channels import Record
    from nvhchain.interop.forces.force_channels import BearingChannels, ForceChannels
    from nvhchain.interop.forces.forces import read_bearing_forces, read_record, write_bearing_forces
    from nvhchain.interop.forces.uff58 import write_pressure_uff, write_spectrum_uff
    from nvhchain.interop.gltf_files import write_glb
    from nvhchain.interop.matrices.reduced import MatrixNames, SuperelementFiles, read_superelement
    from nvhchain.interop.models import read_modal_model, read_solid_model
    from nvhchain.interop.modes.modal_hdf5 import read_modal_hdf5, write_modal_hdf5
    from nvhchain.interop.modes.modal_uff import read_modal_uff
    from nvhchain.interop.modes.modal_uff_out import write_modal_uff
    from nvhchain.interop.notation.units import UNIT_SYSTEMS
    from nvhchain.interop.rexs import read_rexs
    from nvhchain.interop.solids.abaqus import read_abaqus
    from nvhchain.interop.solids.nastran import read_nastran
    from nvhchain.interop.solids.writers import write_abaqus, write_nastran
    from nvhchain.interop.superelement import write_craig_bampton
    from nvhchain.interop.vtk_files import write_gear_field_vtu, write_modes_vtkhdf, write_velocity_vtkhdf, write_vtu
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = [
    "read_bearing_forces",
    "read_modal_model",
    "read_record",
    "read_rexs",
    "read_solid_model",
    "write_abaqus",
    "write_bearing_forces",
    "write_modal_uff",
    "write_vtu",
]
