"""Check of an imported mesh for the bending waves of its walls, before anything is solved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff.base import Doubt
from nvhchain.housing.imported.structure import shell_resolution
from nvhchain.housing.skin.skin import Skin
from nvhchain.housing.skin.thin_walls import edges, longest_for_their_wall, stiffening, wall_thickness, worst_quarter

_NYQUIST = 1.0
"""Quadratic elements per wavelength below which a mesh carries no such wave: two node spacings."""


def resolution(model: SolidModel, skin: Skin, f_max: float, least: float) -> list[Doubt]:
    """Return warnings of a mesh that is too coarse for bending waves at f_max (Hz) on a quarter of its skin.

    least : required elements per wavelength.

    A wall without a near other side gets the mean thickness of all walls, 2 V / A. Of several materials the one with
    the shortest waves counts. Tetrahedra too long for thin walls give a warning, too.

    Raises InputError for a mesh that carries no such waves. The message estimates the number of modes of plates as
    large as its walls: N = Σ S f/2 √(ρt/B) (Cremer, Heckl & Petersson, Structure-Borne Sound).
    """
    doubts = shell_resolution(model, f_max, least)
    if not model.blocks:
        return doubts
    is_sheet = np.broadcast_to(skin.sheets, len(skin.facets))
    if is_sheet.any():
        skin = replace(skin, facets=skin.facets[~is_sheet], sheets=False)
    wall = wall_thickness(skin)
    stiff = stiffening(longest_for_their_wall(model, skin, wall))
    if stiff:
        doubts.append(Doubt("elements stiff in thin walls", f"{model.source}: tetrahedra are {stiff}"))
    corners = skin.nodes[skin.facets[:, :3]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    volume = float(np.einsum("ka,ka->", corners.mean(axis=1), cross)) / 6
    wall = np.where(np.isfinite(wall), wall, 2 * volume / float(area.sum()))
    edge = edges(skin).mean(axis=1)
    worst = worst_quarter(skin, edge / np.sqrt(wall))
    materials = [block.material for block in model.blocks]
    # √(B/ρt) over the thickness
    stiffness = np.sqrt(min(m.young / (12 * (1 - m.poisson**2) * m.density) for m in materials))
    wave = float(2 * np.pi * np.sqrt(stiffness * wall[worst] / (2 * np.pi * f_max)))
    count = wave / edge[worst]
    if count >= least:
        return doubts
    message = (
        f"{model.source}: elements of {1e3 * edge[worst]:.3g} mm give {count:.2g} per bending wavelength of walls of "
        f"{1e3 * wall[worst]:.2g} mm at {f_max:g} Hz, {least:g} are needed: valid to "
        f"{f_max * (count / least) ** 2:.4g} Hz"
    )
    modes = f_max / 4 * float((area / wall).sum()) / stiffness  # half of the skin is the other side
    require(
        count >= _NYQUIST,
        f"{message}; about {modes:.2g} modes lie below {f_max:g} Hz, most of which it does not have: lower the "
        f"frequency or refine to {1e3 * wave / least:.2g} mm",
    )
    return [*doubts, Doubt("mesh coarse for bending waves", message)]
