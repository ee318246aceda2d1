"""HDF5 save and load of any hand-off: schema version, units, provenance; files appear whole or not at all.

Complex arrays are stored with a trailing real axis of two (re, im), so that h5py, xarray and MATLAB read them.  The
user block, which they skip, holds a checksum of all that follows: HDF5 itself crashes or hangs on some damaged files.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from nvhchain.conventions import Air
from nvhchain.errors import FileFormatError, InputError
from nvhchain.files.whole import in_memory, write_whole
from nvhchain.handoff import HAND_OFFS, HandOff, RigidPlane

SCHEMA_VERSION = 1
CONVENTIONS = "e^{+j omega t}; outward normals; single-sided peak amplitudes; SI; frequency axes in Hz"

_BLOCK_BYTES = 512
"""User block, the least that HDF5 knows."""
_BEGIN = b"nvhchain hand-off: HDF5 after these 512 bytes, its SHA-256 "
_HDF5 = b"\x89HDF\r\n\x1a\n"
"""Begin of files without a user block, as hand-offs were saved before; of those a checksum of the arrays is held."""

H = TypeVar("H", bound=HandOff)

_META: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "MeshLaw.angle": ("rad", "wheel angle", ("angle",)),
    "MeshLaw.deflection": ("m", "mesh deflection along the flank normal", ("deflection",)),
    "MeshLaw.force": ("N", "mesh force along the flank normal", ("angle", "deflection")),
    "MeshLaw.period": ("rad", "wheel angle after which the law repeats", ()),
    "MeshLaw.teeth": ("1", "numbers of teeth, pinion and wheel", ("gear",)),
    "MeshLaw.base_radius": ("m", "base radii, pinion and wheel", ("gear",)),
    "MeshLaw.base_helix_angle": ("rad", "base helix angle", ()),
    "MeshLaw.working_pressure_angle": ("rad", "transverse working pressure angle", ()),
    "MeshLaw.centre_distance": ("m", "centre distance", ()),
    "MeshLaw.face_width": ("m", "common face width", ()),
    "MeshLaw.tilt_ratio": ("1", "resistance to tilt over that of slices side by side", ()),
    "LoadDistribution.angle": ("rad", "wheel angle", ("angle",)),
    "LoadDistribution.period": ("rad", "wheel angle after which the distribution repeats", ()),
    "LoadDistribution.sliding": ("1", "share of the force with the sense of its sliding", ("angle",)),
    "LoadDistribution.arm": ("m", "that share times its distance from the pinion's tangent point", ("angle",)),
    "LoadDistribution.offset": ("m", "centre of the load from mid-width", ("angle",)),
    "LoadDistribution.force": ("N", "mesh force along the flank normal", ()),
    "LoadDistribution.tilt_ratio": ("1", "resistance to tilt over that of slices side by side", ()),
    "BearingForces.time": ("s", "time", ("time",)),
    "BearingForces.force": ("N", "bearing force on the housing", ("time", "bearing", "axis")),
    "BearingForces.names": ("", "bearing names", ("bearing",)),
    "BearingForces.positions": ("m", "bearing seat centres", ("bearing", "axis")),
    "BearingForces.input_speed": ("rad/s", "speed of the input shaft", ("time",)),
    "BearingForces.periodic": ("1", "record covers whole periods of a steady state", ()),
    "BearingForces.mesh_deflection": ("m", "dynamic mesh deflection", ("time", "mesh")),
    "BearingForces.transmission_error": ("m", "dynamic transmission error of every mesh", ("time", "mesh")),
    "BearingForces.output_lag": ("rad", "transmission error of the gearbox, input to output", ("time",)),
    "ForceSpectrum.frequency": ("Hz", "frequency", ("frequency",)),
    "ForceSpectrum.force": ("N", "bearing force spectrum, peak", ("frequency", "bearing", "axis")),
    "ForceSpectrum.names": ("", "bearing names", ("bearing",)),
    "ForceSpectrum.input_speed": ("rad/s", "speed of the input shaft, 0 if it varies", ()),
    "Surface.vertices": ("m", "vertices", ("vertex", "axis")),
    "Surface.triangles": ("1", "vertex indices, counter-clockwise from outside", ("face", "corner")),
    "ReducedHousing.natural_frequency": ("Hz", "natural frequency", ("mode",)),
    "ReducedHousing.modal_damping": ("1", "fraction of critical damping", ("mode",)),
    "ReducedHousing.seat_shapes": ("kg-1/2", "mode shapes at the seats", ("mode", "bearing", "axis")),
    "ReducedHousing.normal_shapes": ("kg-1/2", "outward mode shapes of the faces", ("mode", "face")),
    "ReducedHousing.seat_residual": (
        "m/N",
        "residual flexibility of the seats",
        ("bearing", "axis", "loaded_bearing", "loaded_axis"),
    ),
    "ReducedHousing.face_residual": ("m/N", "residual flexibility of the faces", ("bearing", "axis", "face")),
    "ReducedHousing.names": ("", "bearing names", ("bearing",)),
    "ReducedHousing.structural_damping": ("", "damping is a loss factor of twice the fraction of critical", ()),
    "ReducedHousing.positions": ("m", "bearing seat centres", ("bearing", "axis")),
    "SurfaceVelocity.frequency": ("Hz", "frequency", ("frequency",)),
    "SurfaceVelocity.normal_velocity": ("m/s", "outward normal velocity, peak", ("frequency", "face")),
    "TransferVectors.frequency": ("Hz", "master frequency", ("frequency",)),
    "TransferVectors.points": ("m", "field points", ("point", "axis")),
    "TransferVectors.vectors": ("Pa s/m", "acoustic transfer vectors", ("frequency", "point", "face")),
    "TransferVectors.image_vectors": ("Pa s/m", "part by way of the plane", ("frequency", "point", "face")),
    "TransferVectors.breaks": ("Hz", "master that ends a piece of the band", ("break",)),
    "ModalTransferVectors.frequency": ("Hz", "frequency", ("frequency",)),
    "ModalTransferVectors.points": ("m", "field points", ("point", "axis")),
    "ModalTransferVectors.modes": ("Pa s m-1 kg-1/2", "pressure per modal velocity", ("frequency", "point", "mode")),
    "ModalTransferVectors.residual": (
        "Pa s/N",
        "pressure per rate of bearing force, residual flexibility",
        ("frequency", "point", "bearing", "axis"),
    ),
    "ModalTransferVectors.names": ("", "bearing names", ("bearing",)),
    "ModalTransferVectors.housing": ("", "content hash of the reduced housing", ()),
    "NoiseTransferFunctions.frequency": ("Hz", "frequency", ("frequency",)),
    "NoiseTransferFunctions.points": ("m", "field points", ("point", "axis")),
    "NoiseTransferFunctions.functions": (
        "Pa/N",
        "pressure per bearing force",
        ("frequency", "point", "bearing", "axis"),
    ),
    "NoiseTransferFunctions.names": ("", "bearing names", ("bearing",)),
    "RadiationResistance.frequency": ("Hz", "master frequency", ("frequency",)),
    "RadiationResistance.waves": ("", "spherical waves, W^1/2 per unit of a column", ("frequency", "wave", "column")),
    "RadiationResistance.plane_wave_resistance": (
        "N s/m",
        "radiation resistance at high frequency",
        ("column", "other_column"),
    ),
    "RadiationResistance.reach": ("m", "distance of the farthest vertex from the middle of the surface and image", ()),
    "RadiationResistance.housing": ("", "content hash of the reduced housing", ()),
    "RadiationResistance.cancellation": (
        "N s/m",
        "radiation resistance of the error of motions that cancel",
        ("frequency", "column", "other_column"),
    ),
    "RadiationResistance.wall_waves": (
        "N s/m",
        "plane wave resistance times mean edges per wave on the walls squared",
        ("column", "other_column"),
    ),
    "RadiationEfficiency.frequency": ("Hz", "frequency", ("frequency",)),
    "RadiationEfficiency.efficiency": ("1", "sound power over that of plane waves", ("frequency",)),
    "RadiationEfficiency.input_speed": ("rad/s", "speed of the input shaft, 0 if there is none", ()),
    "Directivity.frequency": ("Hz", "frequency", ("frequency",)),
    "Directivity.points": ("m", "field points", ("point", "axis")),
    "Directivity.index": ("dB", "directivity index", ("frequency", "point")),
    "Directivity.input_speed": ("rad/s", "speed of the input shaft, 0 if there is none", ()),
    "SolvedBand.frequency": ("Hz", "frequency", ("frequency",)),
    "SolvedBand.values": ("", "values of a stage", ("frequency", "value")),
    "SolvedBand.shape": ("1", "axes of the values of one frequency", ("axis",)),
    "FieldPressure.frequency": ("Hz", "frequency", ("frequency",)),
    "FieldPressure.points": ("m", "field points", ("point", "axis")),
    "FieldPressure.pressure": ("Pa", "sound pressure, peak", ("frequency", "point")),
    "FieldPressure.input_speed": ("rad/s", "speed of the input shaft, 0 if there is none", ()),
    "PressureHistory.time": ("s", "time", ("time",)),
    "PressureHistory.points": ("m", "field points", ("point", "axis")),
    "PressureHistory.pressure": ("Pa", "sound pressure", ("time", "point")),
    "PressureHistory.input_speed": ("rad/s", "speed of the input shaft", ("time",)),
    "SurfacePressure.frequency": ("Hz", "frequency", ("frequency",)),
    "SurfacePressure.pressure": ("Pa", "sound pressure at the vertices, peak", ("frequency", "vertex")),
    "SoundPower.frequency": ("Hz", "frequency", ("frequency",)),
    "SoundPower.power": ("W", "radiated sound power, time average", ("frequency",)),
    "SoundPower.input_speed": ("rad/s", "speed of the input shaft, 0 if there is none", ()),
}
"""Units, long name and axis labels of every stored field."""


def writable_folder(folder: str | Path, called: str) -> Path:
    """The folder, made where there is none.  InputError where it cannot take files: now, not when something is done."""
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=place).close()
    except (OSError, ValueError) as error:  # a NUL
        raise InputError(
            f"{called} = {str(folder)!r} cannot take files ({getattr(error, 'strerror', error)}): name another folder"
        ) from error
    return place


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8, whole or not at all."""
    write_whole(path, text.encode())


def save(hand_off: HandOff, path: str | Path) -> Path:
    """Write `hand_off` to `path`, whole or not at all.  Raises WriteError where the disk is full."""
    path = Path(path)

    def write(memory: BytesIO) -> None:
        with h5py.File(memory, "w", userblock_size=_BLOCK_BYTES) as file:
            file.attrs["nvhchain_schema"] = SCHEMA_VERSION
            file.attrs["conventions"] = CONVENTIONS
            _write(file, hand_off)

    content = in_memory(write)
    content[:_BLOCK_BYTES] = _user_block(hashlib.sha256(content[_BLOCK_BYTES:]).hexdigest())
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_whole(path, content)


def load(path: str | Path, kind: type[H] = HandOff) -> H:  # type: ignore[assignment]
    """Read the hand-off in `path`; its checksum and, if given, its `kind` are checked.

    Raises FileFormatError for a file that is missing, truncated, foreign, newer than this version or altered.
    """
    path = Path(path)
    sealed = _check_bytes(path)
    try:
        with h5py.File(path, "r") as file:
            schema = int(file.attrs.get("nvhchain_schema", 0))
            if schema == 0:
                raise FileFormatError(f"{path}: not an nvhchain hand-off (no schema): export it with nvhchain")
            if schema > SCHEMA_VERSION:
                raise FileFormatError(
                    f"{path}: schema {schema} is newer than {SCHEMA_VERSION}, the latest known: update nvhchain"
                )
            hand_off = _read(file, path)
            if not sealed and hand_off.content_hash != file.attrs["content_hash"]:
                raise FileFormatError(f"{path}: damaged or altered, its checksum is another: restore it from a copy")
    except (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, FileFormatError):
            raise
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FileFormatError(f"{path}: not readable by this version ({reason}): make it anew") from error
    if not isinstance(hand_off, kind):
        raise FileFormatError(f"{path}: holds {type(hand_off).__name__}, but {kind.__name__} is needed")
    return hand_off


def record(path: str | Path) -> tuple[str, dict[str, Any]]:
    """What the hand-off in `path` is and how it was made: the name of its class, its provenance.

    Raises FileFormatError for a file that is not a whole hand-off.
    """
    _check_bytes(Path(path))
    try:
        with h5py.File(path, "r") as file:
            kind, provenance = str(file.attrs["kind"]), json.loads(file.attrs["provenance"])
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise FileFormatError(f"{path}: not a whole hand-off ({error}): delete it or restore it from a copy") from error
    if kind not in HAND_OFFS or not isinstance(provenance, dict):
        raise FileFormatError(f"{path}: not a hand-off of this version (kind {kind[:60]!r}): delete it or make it anew")
    return kind, provenance


def _check_bytes(path: Path) -> bool:
    """Raise `FileFormatError` unless the bytes of a file are those that were saved; False where nothing tells."""
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file")
    try:
        with path.open("rb") as file:
            block = file.read(_BLOCK_BYTES)
            whole = block == _user_block(hashlib.file_digest(file, "sha256").hexdigest())
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read ({error.strerror or error})") from error
    if block.startswith(_HDF5):
        return False
    if not block.startswith(_BEGIN):
        raise FileFormatError(f"{path}: not an nvhchain hand-off (it does not begin as one): export it with nvhchain")
    if not whole:
        raise FileFormatError(
            f"{path}: damaged, truncated or altered, its checksum is another: delete it or restore it from a copy"
        )
    return True


def _user_block(digest: str) -> bytes:
    """First bytes of a file whose other bytes have this SHA-256."""
    return (_BEGIN + digest.encode() + b"\n").ljust(_BLOCK_BYTES, b"\0")


def _write(group: Any, hand_off: HandOff) -> None:
    kind = type(hand_off).__name__
    group.attrs["kind"] = kind
    group.attrs["content_hash"] = hand_off.content_hash
    group.attrs["provenance"] = json.dumps(hand_off.provenance, sort_keys=True)
    for f in dataclasses.fields(hand_off):
        if f.name == "provenance":
            continue
        value = getattr(hand_off, f.name)
        if value is None:
            continue
        if isinstance(value, HandOff):
            _write(group.create_group(f.name), value)
        elif isinstance(value, Air):
            air = group.create_group(f.name)
            air.attrs.update(dataclasses.asdict(value))
            air.attrs["units"] = "speed_of_sound m/s, density kg/m3"
        elif isinstance(value, RigidPlane):
            plane = group.create_group(f.name)
            plane.attrs.update(dataclasses.asdict(value))
            plane.attrs["units"] = "point m, unit normal into the air"
        else:
            _write_array(group, kind, f.name, value)


def _write_array(group: Any, kind: str, name: str, value: Any) -> None:
    units, long_name, axes = _META[f"{kind}.{name}"]
    if isinstance(value, str) or (isinstance(value, tuple) and value and isinstance(value[0], str)):
        value = np.array(value, dtype=h5py.string_dtype())
    array = np.asarray(value)
    is_complex = np.iscomplexobj(array)
    if is_complex:
        array = np.ascontiguousarray(array).view(np.float64).reshape(*array.shape, 2)
        axes = (*axes, "re, im")
    dataset = group.create_dataset(name, data=array)
    dataset.attrs["units"] = units
    dataset.attrs["long_name"] = long_name
    dataset.attrs["complex"] = is_complex
    for dimension, label in zip(dataset.dims, axes, strict=True):
        dimension.label = label


def _read(group: Any, path: Path) -> HandOff:
    kind = group.attrs["kind"]
    if kind not in HAND_OFFS:
        raise FileFormatError(f"{path}: unknown hand-off kind {str(kind)[:60]!r}")
    fields: dict[str, Any] = {"provenance": json.loads(group.attrs["provenance"])}
    if not isinstance(fields["provenance"], dict):
        raise FileFormatError(f"{path}: its record of how it was made is no table: make it anew")
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            fields[name] = _read_array(item)
        elif "kind" in item.attrs:
            fields[name] = _read(item, path)
        elif "normal" in item.attrs:
            fields[name] = RigidPlane(tuple(item.attrs["point"]), tuple(item.attrs["normal"]))
        else:
            fields[name] = Air(float(item.attrs["speed_of_sound"]), float(item.attrs["density"]))
    known = {f.name for f in dataclasses.fields(HAND_OFFS[kind])}
    return HAND_OFFS[kind](**{name: value for name, value in fields.items() if name in known})


def _read_array(dataset: Any) -> Any:
    if h5py.check_string_dtype(dataset.dtype) is not None:
        text = dataset.asstr()[()]
        return text if dataset.ndim == 0 else tuple(text)
    value = dataset[()]
    if dataset.attrs["complex"]:
        return value.view(np.complex128)[..., 0]
    return value.item() if value.ndim == 0 else value
