"""Foreign files: hand-offs in and out of other programs' formats."""

from nvhchain.interop.force_channels import BearingChannels, ForceChannels, Record
from nvhchain.interop.forces import read_bearing_forces, read_record, write_bearing_forces
from nvhchain.interop.wav import write_history_wav, write_wav

__all__ = [
    "BearingChannels",
    "ForceChannels",
    "Record",
    "read_bearing_forces",
    "read_record",
    "write_bearing_forces",
    "write_history_wav",
    "write_wav",
]
