"""Imported mesh of a whole gear: quadratic solid elements with tagged bore and flanks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.fem.elements import reference_element
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray, IntArray

ELEMENT_NODES = {"tet10": 10, "hex20": 20}

FLANK_LIMIT = 0.05
"""Largest distance of flank nodes from the drawn involute (normal modules); covers micro-geometry and chords of
elements."""

_LOPSIDED = 0.01
"""Largest part of the polar moment of inertia in a pattern that `order` excludes; above the scatter of tetrahedra and
balancing holes, below any openings that bend a rim."""

_UNIT = 1.5
"""Largest ratio of meshed to drawn tip radius, or its inverse; beyond it the unit is wrong."""


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """Imported mesh of a gear; takes the place of the blank in a `GearBody`, whose geometry describes the teeth.

    nodes (n, 3): positions (m).
    elements (m, k): node numbers in the order of VTK.
    kind: kind of element, 'tet10' or 'hex20'.
    bore, flanks: nodes of the held bore and of all flanks.
    order: order of the rotational symmetry of the body, 1 for none; only teeth of one sector are computed.

    Raises InputError if elements are inverted, tags are missing or node numbers are out of range.

    The frame is that of `FlankCompliance`: z along the shaft from mid-width, tooth 0 on the x axis at z = 0.
    """

    nodes: FloatArray
    elements: IntArray
    kind: str
    bore: IntArray
    flanks: IntArray
    order: int = 1

    def __post_init__(self) -> None:
        require(
            self.kind in ELEMENT_NODES,
            f"elements of kind {self.kind!r}: quadratic ones are needed, tet10 or hex20; raise the order of the mesh",
        )
        require(self.order >= 1, f"order = {self.order} of the rotational symmetry must be at least 1 (none)")
        shape, count = np.shape(self.elements), len(self.nodes)
        require(
            len(shape) == 2 and shape[1] == ELEMENT_NODES[self.kind] and shape[0] > 0,
            f"elements have shape {shape}: (m, {ELEMENT_NODES[self.kind]}) is needed for {self.kind}",
        )
        for name in ("elements", "bore", "flanks"):
            numbers = np.asarray(getattr(self, name))
            require(numbers.size > 0, f"the mesh has no {name}: tag the nodes of the bore and of all flanks")
            require(
                bool(numbers.min() >= 0 and numbers.max() < count),
                f"{name} refer to nodes {numbers.min()}…{numbers.max()}, but there are {count}",
            )
        require(bool(np.isfinite(self.nodes).all()), "the mesh has nodes that are not finite")
        bad = np.flatnonzero((self._volumes <= 0).any(axis=1))
        if len(bad):
            raise InputError(
                f"{len(bad)} of {shape[0]} elements are inverted or without volume, first {bad[0]}: repair the mesh or "
                "its node order"
            )

    @property
    def symmetry(self) -> int:
        """Order of the rotational symmetry."""
        return self.order

    @property
    def web(self) -> None:
        """Web: None, as it is part of the mesh."""

    @property
    def cutouts(self) -> None:
        """Openings: None, as they are part of the mesh."""

    @cached_property
    def _volumes(self) -> FloatArray:
        """Volumes of the quadrature points (m, q), m³."""
        reference = reference_element(self.kind)
        jacobian = np.einsum("mna,qnb->mqab", self.nodes[self.elements], reference.mass_gradient, optimize=True)
        return np.asarray(np.linalg.det(jacobian) * reference.mass_weight)

    @property
    def _points(self) -> FloatArray:
        """Quadrature points (3, m, q), m."""
        points = np.einsum("qn,mna->mqa", reference_element(self.kind).mass_shape, self.nodes[self.elements])
        return np.moveaxis(points, -1, 0)

    def moments(self) -> tuple[float, float, float, float]:
        """Return ∫dV (m³), ∫(x² + y²)dV (m⁵), ∫z dV (m⁴) and ∫z² dV (m⁵)."""
        (x, y, z), volume = self._points, self._volumes
        values = (np.ones(volume.shape), x**2 + y**2, z, z**2)
        return tuple(float((volume * value).sum()) for value in values)  # type: ignore[return-value]

    def check(self, gear: GearGeometry) -> None:
        """Refuse a mesh that does not belong to the gear.

        Checked are unit, position, flanks, bore and the symmetry `order`.
        """
        tip = float(np.hypot(*self.nodes[:, :2].T).max())
        ratio = tip / gear.tip_circle_radius
        require(
            1 / _UNIT < ratio < _UNIT,
            f"the mesh reaches to r = {tip:.4g} m, the drawn tip circle to {gear.tip_circle_radius:.4g} m: give the "
            f"unit of its coordinates, scale = {1 / ratio:.3g} or so",
        )
        bore = np.hypot(*self.nodes[self.bore, :2].T)
        require(
            bool(np.abs(bore - gear.bore_radius).max() < FLANK_LIMIT * gear.normal_module),
            f"bore nodes lie at r = {1e3 * bore.min():.4g}…{1e3 * bore.max():.4g} mm, the drawn bore at "
            f"{1e3 * gear.bore_radius:.4g} mm: tag the bore alone or correct bore_radius",
        )
        radius, _, offset, _ = self.places(gear)
        on = self.flanks[radius[self.flanks] > gear.form_radius * (1 - 1e-9)]
        off = radius[on] * np.abs(np.abs(offset[on]) - gear.half_tooth_angle(radius[on]))
        require(
            len(on) > 0 and float(off.max()) < FLANK_LIMIT * gear.normal_module,
            f"flank nodes lie up to {1e3 * float(off.max(initial=0.0)):.3g} mm off the drawn involutes, "
            f"{1e3 * FLANK_LIMIT * gear.normal_module:.3g} mm at most: put tooth 0 on the x axis at mid-width, z along "
            "the shaft, and check teeth, module, helix and profile shift",
        )

        share, pattern = self._lopsided(gear.teeth)
        require(
            share < _LOPSIDED,
            f"order = {self.order} of the rotational symmetry is not that of the mesh: {100 * share:.2g} % of its "
            f"polar moment of inertia lies in a {pattern}-fold pattern: give the order that all openings have, or 1",
        )

    def _lopsided(self, teeth: int) -> tuple[float, int]:
        """Return the largest |∫ r² e^{ikφ} dV| over ∫ r² dV of the patterns k < z excluded by `order`, and its k."""
        x, y, _ = self._points
        weight = self._volumes * (x**2 + y**2)
        once = (x + 1j * y) / np.hypot(x, y)
        total, turned, worst = weight.sum(), weight.astype(complex), (0.0, 0)
        for k in range(1, teeth if self.order > 1 else 0):
            turned = turned * once
            if k % self.order:
                worst = max(worst, (float(abs(turned.sum())) / total, k))
        return worst

    def places(self, gear: GearGeometry) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
        """Return the positions of all nodes relative to the teeth.

        Returns radius (n,): radius (m). tooth (n,) int array: nearest tooth, 0 … z − 1. angle (n,): angle from the
        tooth's centre line (rad). axial (n,): axial position (m).
        """
        x, y, z = self.nodes.T
        straight = np.arctan2(y, x) - gear.twist * z
        tooth = np.round(straight / gear.pitch_angle).astype(np.int64)
        return np.hypot(x, y), tooth % gear.teeth, straight - tooth * gear.pitch_angle, z
