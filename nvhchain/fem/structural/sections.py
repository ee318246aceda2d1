"""Constants of the usual beam cross-sections, in the order of dimensions of Nastran's PBARL.

Open thin walls twist with J = Σ b t³ / 3, closed ones by Bredt's formula, a rectangle by Saint-Venant's series. Fillets
are neglected. Shapes that are not symmetric are given about their centroid; the shear centre is taken there, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import pi, tanh
from types import MappingProxyType

from nvhchain.errors import InputError, require
from nvhchain.fem.structural.model import BeamSection


def section(kind: str, dimensions: Sequence[float]) -> BeamSection:
    """Return the section of a kind of `KINDS` with its dimensions (m).

    Raises InputError for another kind or impossible dimensions.
    """
    if kind not in _SHAPES:
        raise InputError(f"beam section {kind!r} is not read: use {', '.join(_SHAPES)}, or state area and moments")
    count, make = _SHAPES[kind]
    require(
        len(dimensions) >= count and min(dimensions[:count]) >= 0 and dimensions[0] > 0,
        f"beam section {kind} with dimensions {list(dimensions)}: {count} positive ones are needed",
    )
    return make(*dimensions[:count])


def rectangle(width: float, height: float) -> BeamSection:
    """Return a full rectangle, `height` along the y axis of the section and `width` along z."""
    a, b = max(width, height), min(width, height)
    series = sum(tanh(n * pi * a / (2 * b)) / n**5 for n in range(1, 40, 2))
    torsion = a * b**3 * (1 / 3 - 64 * b / (pi**5 * a) * series)
    return BeamSection(width * height, width * height**3 / 12, height * width**3 / 12, torsion, 0.0, 5 / 6, 5 / 6)


def round_tube(outer: float, inner: float = 0.0) -> BeamSection:
    """Return a tube, or a rod without an inner radius (m)."""
    require(0 <= inner < outer, f"tube of radii {outer:g} and {inner:g} m: the inner one must be smaller")
    second, ratio = pi * (outer**4 - inner**4) / 4, inner / outer
    # Cowper's shear factor for ν = 0.3 (J. Appl. Mech. 33, 1966)
    shear = 6 * 1.3 * (1 + ratio**2) ** 2 / ((7 + 1.8) * (1 + ratio**2) ** 2 + (20 + 3.6) * ratio**2)
    return BeamSection(pi * (outer**2 - inner**2), second, second, 2 * second, 0.0, shear, shear)


def _box(width: float, height: float, level: float, upright: float) -> BeamSection:
    require(2 * level < height and 2 * upright < width, "beam section BOX: its walls are thicker than the box")
    inside = (width - 2 * upright) * (height - 2 * level)
    area = width * height - inside
    bending_y = (width * height**3 - (width - 2 * upright) * (height - 2 * level) ** 3) / 12
    bending_z = (height * width**3 - (height - 2 * level) * (width - 2 * upright) ** 3) / 12
    b, h = width - upright, height - level
    torsion = 2 * (b * h) ** 2 / (b / level + h / upright)
    return BeamSection(area, bending_y, bending_z, torsion, 0.0, 2 * upright * h / area, 2 * level * b / area)


def _strips(*strips: tuple[float, float, float, float]) -> BeamSection:
    """Return an open section of rectangles, each by centre y, z and size along y and z."""
    area = sum(b * h for *_, h, b in strips)
    y0, z0 = (sum(strip[axis] * strip[2] * strip[3] for strip in strips) / area for axis in range(2))
    bending_y = sum(b * h**3 / 12 + b * h * (y - y0) ** 2 for y, _, h, b in strips)
    bending_z = sum(h * b**3 / 12 + b * h * (z - z0) ** 2 for _, z, h, b in strips)
    product = sum(b * h * (y - y0) * (z - z0) for y, z, h, b in strips)
    torsion = sum(max(h, b) * min(h, b) ** 3 / 3 for *_, h, b in strips)
    upright, level = (sum(h * b for *_, h, b in strips if (h >= b) is tall) / area for tall in (True, False))
    return BeamSection(area, bending_y, bending_z, torsion, product, upright, level)


def _i(height: float, lower: float, upper: float, web: float, below: float, above: float) -> BeamSection:
    return _strips(
        (below / 2, 0.0, below, lower),
        ((height + below - above) / 2, 0.0, height - below - above, web),
        (height - above / 2, 0.0, above, upper),
    )


def _channel(width: float, height: float, web: float, flange: float) -> BeamSection:
    return _strips(
        (0.0, web / 2, height - 2 * flange, web),
        ((height - flange) / 2, width / 2, flange, width),
        (-(height - flange) / 2, width / 2, flange, width),
    )


def _t(width: float, height: float, flange: float, web: float) -> BeamSection:
    return _strips((0.0, 0.0, flange, width), (-height / 2, 0.0, height - flange, web))


def _l(width: float, height: float, level: float, upright: float) -> BeamSection:
    return _strips((0.0, width / 2, level, width), (height / 2, upright / 2, height - level, upright))


def _tube_by_wall(outer: float, wall: float) -> BeamSection:
    return round_tube(outer, outer - wall)


def _i_by_overhang(overhang: float, web: float, inside: float, height: float) -> BeamSection:
    flange, width = (height - inside) / 2, overhang + web
    return _i(height, width, width, web, flange, flange)


def _channel_by_overhang(overhang: float, web: float, inside: float, height: float) -> BeamSection:
    return _channel(overhang + web, height, web, (height - inside) / 2)


_SHAPES: Mapping[str, tuple[int, Callable[..., BeamSection]]] = MappingProxyType(
    {
        "ROD": (1, round_tube),
        "TUBE": (2, round_tube),
        "BAR": (2, rectangle),
        "BOX": (4, _box),
        "I": (6, _i),
        "CHAN": (4, _channel),
        "T": (4, _t),
        "T2": (4, _t),
        "TUBE2": (2, _tube_by_wall),
        "I1": (4, _i_by_overhang),
        "CHAN1": (4, _channel_by_overhang),
        "L": (4, _l),
    }
)
KINDS: Mapping[str, int] = MappingProxyType({kind: count for kind, (count, _) in _SHAPES.items()})
"""Kind of section → number of its dimensions."""
