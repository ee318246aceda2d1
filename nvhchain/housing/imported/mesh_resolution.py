"""How far a foreign mesh carries the bending waves of its walls, found before anything is solved."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.solid_model import SolidModel
from nvhchain.housing.skin.skin import Skin
from nvhchain.housing.skin.thin_walls import edges, longest_for_their_wall, stiffening, wall_thickness, worst_quarter

_NYQUIST = 1.0
"""Quadratic elements per wavelength below which a mesh has no such wave: two distances of nodes."""


def resolution(model: SolidModel, skin: Skin, f_max: float, least: float) -> list[str]:
    """What is to be warned of where the mesh is too coarse for bending waves at f_max (Hz) on a quarter of its skin.

    least: elements per wavelength that are needed.  A wall with no other side near is taken as thick as walls are in
    the mean, 2 V / A. Of several materials that with the shortest waves counts. Tetrahedra too long for thin walls are
    warned of, too.
    Raises InputError for a mesh that has no such waves, with the number of modes that plates as large as its walls
    have: N = Σ S f/2 √(ρt/B) (Cremer, Heckl & Petersson, Structure-Borne Sound).
    """
    notes, wall = [], wall_thickness(skin)
    stiff = stiffening(longest_for_their_wall(model, skin, wall))
    if stiff:
        notes.append(f"{model.source}: tetrahedra are {stiff}")
    corners = skin.nodes[skin.facets[:, :3]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    volume = float(np.einsum("ka,ka->", corners.mean(axis=1), cross)) / 6
    wall = np.where(np.isfinite(wall), wall, 2 * volume / float(area.sum()))
    edge = edges(skin).mean(axis=1)
    at = worst_quarter(skin, edge / np.sqrt(wall))
    materials = [block.material for block in model.blocks]
    # √(B/ρt) over the thickness
    stiffness = np.sqrt(min(m.young / (12 * (1 - m.poisson**2) * m.density) for m in materials))
    wave = float(2 * np.pi * np.sqrt(stiffness * wall[at] / (2 * np.pi * f_max)))
    count = wave / edge[at]
    if count >= least:
        return notes
    message = (
        f"{model.source}: elements of {1e3 * edge[at]:.3g} mm give {count:.2g} per bending wavelength of walls of "
        f"{1e3 * wall[at]:.2g} mm at {f_max:g} Hz, {least:g} are needed: valid to {f_max * (count / least) ** 2:.4g} Hz"
    )
    modes = f_max / 4 * float((area / wall).sum()) / stiffness  # half of the skin is the other side
    require(
        count >= _NYQUIST,
        f"{message}; about {modes:.2g} modes lie below {f_max:g} Hz, most of which it does not have: lower the "
        f"frequency or refine to {1e3 * wave / least:.2g} mm",
    )
    return [*notes, message]
