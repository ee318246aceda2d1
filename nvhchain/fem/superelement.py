"""Structure reduced to its seats, in the form in which other programs import it."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.handoff import FloatArray

_SEAT_FREEDOMS = 6


@dataclass(frozen=True, eq=False)
class CraigBampton:
    """Reduced matrices of a housing with m modes and b = 6 unknowns per seat.

    The unknowns of a seat are three translations (m) and three rotations (rad) about x, y, z. The modal coordinates
    follow, mass-normalised.

    Parameters
    ----------
    stiffness, mass : (b + m, b + m) array
        Matrices (N/m and kg; with rotations N, N m, kg m, kg m²).
    interface_frequency : (m,) array
        Natural frequencies with the seats fixed (Hz).
    motion : (n_out, b + m) array
        Output motions per unknown (normal motion of the radiating faces).
    names : tuple of str
        Names of the seats.
    positions : (n_seat, 3) array
        Reference points of the seats (m).
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
        return slice(0, _SEAT_FREEDOMS * len(self.names))
