"""A structure reduced to some of its points, in the form in which other codes take it."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.handoff import FloatArray

_PER_SEAT = 6


@dataclass(frozen=True, eq=False)
class CraigBampton:
    """Reduced matrices of a housing.

    stiffness, mass: (b + m, b + m) N/m and kg (and with rotations N, N m, kg m, kg m²), b = 6 per seat: three
    translations (m) and three rotations (rad) about x, y, z; then m modal coordinates, mass-normalised.
    interface_frequency: (m,) Hz of the modes with the seats held.
    motion: (n_out, b + m), output motions (normal motion of the radiating faces) per unknown.
    names: of the seats.  positions: (n_seat, 3) m, their reference points.
    """

    stiffness: FloatArray
    mass: FloatArray
    interface_frequency: FloatArray
    motion: FloatArray
    names: tuple[str, ...]
    positions: FloatArray

    @property
    def seats(self) -> slice:
        """Unknowns of the seats."""
        return slice(0, _PER_SEAT * len(self.names))
