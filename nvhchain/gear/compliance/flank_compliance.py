"""Compliance of the flanks of a gear under loads on nearby flanks, without the indentation under the load itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from nvhchain.conventions import Progress
from nvhchain.errors import InputError, is_whole, require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.body_flexibility import body_flexibility
from nvhchain.gear.compliance.imported_compliance import imported_compliance
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, condensed_tooth
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.elements.finer_tooth import finer_tooth
from nvhchain.gear.elements.gear_mesh import gear_mesh
from nvhchain.handoff import FlankFlexibility, FloatArray, IntArray
from nvhchain.kinds import checked

USUAL_REACH = 3
"""Coupled neighbours on either side. A pair of contact ratio ε_γ loads teeth up to ⌈ε_γ⌉ − 1 pitches apart."""

_EXCESS = 2.0
"""Admissible size of a harmonic of openings, over the first one times its decay. Slots meshed six times as finely reach
1.4."""

_SPRINGS = 0.01
"""Stiffness of the springs of `load_patterns`, relative to the mean diagonal stiffness of the tooth; about that of the
rim beneath."""


@dataclass(frozen=True, eq=False)
class FlankCompliance:
    """Compliance of the flanks of one gear on a grid of radius and axial position, bore held.

    radius (n_p,): radii from the form circle to the tip circle (m), rising.
    axial (n_w,): axial positions from −b/2 to +b/2 (m), rising.
    tooth_count: teeth of the gear.
    sector: teeth after which the body repeats; 1 if all are alike.
    blocks (sector, reach + 1, 2, n_p, n_w, 2, n_p, n_w): compliance (m/N) by tooth, distance in teeth, flank and grid
        point.
    held: teeth of the sector that `blocks` contains, rising; all by default.  `select_teeth` selects them.
    friction (sector, 2 reach + 1, 2, n_p n_w, n_p n_w): compliance under friction (m/N) by tooth, distance in teeth and
        flank.
    tooth_axial (n_a,): axial positions of the points of `own` (m), among them those of the grid.
    own (2, n_p n_a, n_p n_a): part of the compliance of a tooth at more points, by flank (m/N).
    own_friction (2, n_p n_a, n_p n_a): the same of `friction`.

    Raises InputError if the shape of `blocks` or `own`, the places of `own` or the sector do not fit.

    Frame: z along the shaft; angles count counter-clockwise about +z.  Tooth k has its centre line at 2π k /
    tooth_count in the mid-width plane z = 0.  The blank's phase is measured in the same plane.

    Flank 0 faces +φ (counter-clockwise), flank 1 faces −φ.  Flank 0 is the drive flank of *both* gears of a pair whose
    driving pinion turns counter-clockwise about +z.  For the other sense it is flank 1 of both.

    blocks[t, d, f, i, j, g, k, l] is the normal displacement of flank f of tooth t at (radius[i], axial[j]), positive
    into the tooth.  The load is a unit force along the inward normal on flank g of tooth t + d at (radius[k],
    axial[l]).  Normals are the true ones of the helicoid, with axial component sin β_b.

    friction[t, reach + d, f] is the normal displacement of flank f of tooth t, into the tooth.  The loads are unit
    forces on the same flank of tooth t + d, in the transverse plane along the profile, towards the tip.

    On the same tooth (d = 0) the displacement of the same mesh with the tooth held on its centre-line surface is
    subtracted, in `blocks` and `friction`.  The rest is smooth over the flank and does not depend on the mesh size.
    The local part is computed by the contact (Weber–Banaschek with depth `GearGeometry.depth_to_centre_line`).

    A tooth's own part, with its foot held, changes over shorter distances along the axis than what passes through the
    foot. `blocks` and `friction` contain it at the points of the grid. Between them it is read from `own` and
    `own_friction`, where these are given.

    Teeth t and t + sector are alike, and C(t, u) = C(u, t)ᵀ; `block` therefore serves any two teeth within reach.
    """

    radius: FloatArray
    axial: FloatArray
    tooth_count: int
    sector: int
    blocks: FloatArray
    held: tuple[int, ...] | None = None
    friction: FloatArray | None = None
    tooth_axial: FloatArray | None = None
    own: FloatArray | None = None
    own_friction: FloatArray | None = None

    def __post_init__(self) -> None:
        n_p, n_w = len(self.radius), len(self.axial)
        shape = np.shape(self.blocks)
        tail = (2, n_p, n_w, 2, n_p, n_w)
        require(
            len(shape) == 8 and shape[0] == len(self.teeth_held) and shape[2:] == tail,
            f"FlankCompliance.blocks has shape {shape}, but {(len(self.teeth_held), 'reach + 1', *tail)} is needed",
        )
        require(
            self.sector >= 1 and self.tooth_count % self.sector == 0,
            f"FlankCompliance.sector = {self.sector} must divide the {self.tooth_count} teeth",
        )
        require(
            (self.own is None) == (self.tooth_axial is None),
            "FlankCompliance.own and tooth_axial belong together: give both or neither",
        )
        if self.own is not None and self.tooth_axial is not None:
            points, parts = n_p * len(self.tooth_axial), (len(self.tooth_axial) - 1) // max(n_w - 1, 1)
            require(
                np.shape(self.own) == (2, points, points)
                and np.array_equal(self.tooth_axial[:: max(parts, 1)], self.axial),
                f"FlankCompliance.own has shape {np.shape(self.own)}: {(2, points, points)} is needed, and its places "
                "along the axis must divide every interval of the grid alike",
            )

    @property
    def reach(self) -> int:
        """Teeth to either side of a loaded tooth whose displacement is contained."""
        return int(np.shape(self.blocks)[1]) - 1

    @property
    def teeth_held(self) -> tuple[int, ...]:
        """Teeth of the sector that `blocks` contains."""
        return tuple(range(self.sector)) if self.held is None else self.held

    def select_teeth(self, teeth: IntArray) -> FlankCompliance:
        """Return the part for contact of `teeth` (any integers) only; it is smaller to send to another process."""
        held = sorted({int(t) % self.sector for t in teeth})
        indices = [self.teeth_held.index(t) for t in held]
        friction = None if self.friction is None else self.friction[indices]
        return replace(self, blocks=self.blocks[indices], held=tuple(held), friction=friction)

    def block(self, tooth: int, loaded: int) -> FloatArray:
        """Return the displacement of `tooth` under forces on tooth `loaded` (any integers).

        Returns (2, n_p, n_w, 2, n_p, n_w): compliance (m/N).
        """
        z = self.tooth_count
        offset = (loaded - tooth + z // 2) % z - z // 2
        if abs(offset) > self.reach:
            raise InputError(
                f"teeth {tooth} and {loaded} are {abs(offset)} pitches apart, but the compliance reaches "
                f"{self.reach}: ask flank_compliance for a larger reach"
            )
        if offset >= 0:
            return self.blocks[self.teeth_held.index(tooth % self.sector), offset]
        return np.moveaxis(self.blocks[self.teeth_held.index(loaded % self.sector), -offset], (3, 4, 5), (0, 1, 2))


@checked
def flank_compliance(
    body: GearBody,
    fidelity: GearFidelity,
    *,
    reach: int = USUAL_REACH,
    friction: bool = False,
    progress: Progress | None = None,
) -> FlankCompliance:
    """Compute the compliance of all flanks of one symmetric sector of a gear, bore rigid and held.

    reach: coupled teeth on either side of the loaded one, fewer than the teeth of the gear. Wide helical pinions of
    few teeth need up to that.
    friction: include forces along the profile, which friction needs; a third more work.
    progress: called with (teeth done, teeth of the sector).
    Returns compliance on the grid of the elements' nodes.
    """
    _check_reach(body, reach)
    if isinstance(body.blank, VolumeMesh):
        radius, axial, blocks, friction_blocks = imported_compliance(
            body, body.blank, fidelity, reach=reach, friction=friction, progress=progress
        )
        return FlankCompliance(
            radius, axial + body.offset, body.geometry.teeth, body.sector, blocks, friction=friction_blocks
        )
    if not friction:
        return compliance_at_points(flank_flexibility(body, fidelity, reach=reach, progress=progress))
    found, sliding, own = _solved(body, fidelity, reach, friction, progress)
    shape = 2, len(found.radius), len(found.tooth_axial)
    own = own.reshape(*shape, *shape)
    return replace(
        compliance_at_points(found),
        friction=_friction(found.share, sliding, found.response, _thinned(own, found.parts)),
        own_friction=_same_flank(own) if found.parts > 1 else None,
    )


def flank_flexibility(
    body: GearBody, fidelity: GearFidelity, *, reach: int = USUAL_REACH, progress: Progress | None = None
) -> FlankFlexibility:
    """Compute the flexibility of one symmetric sector of a gear without friction, in a form that is small to keep."""
    _check_reach(body, reach)
    return _solved(body, fidelity, reach, False, progress)[0]


def compliance_at_points(found: FlankFlexibility) -> FlankCompliance:
    """Return the compliance between all points of the flanks."""
    sector, distances = found.response.shape[:2]
    n_p, n_w = len(found.radius), len(found.axial)
    blocks = found.share.T @ found.response @ found.share
    n_a, parts = len(found.tooth_axial), found.parts
    own = found.own.reshape(2, n_p, n_a, 2, n_p, n_a)
    blocks[:, 0] += _thinned(own, parts)
    return FlankCompliance(
        radius=found.radius,
        axial=found.axial,
        tooth_count=found.teeth,
        sector=sector,
        blocks=blocks.reshape(sector, distances, 2, n_p, n_w, 2, n_p, n_w),
        tooth_axial=found.tooth_axial if parts > 1 else None,
        own=_same_flank(own) if parts > 1 else None,
    )


def _thinned(own: FloatArray, parts: int) -> FloatArray:
    """Return the compliance (n, n) at every `parts`-th place along the axis, of `own` (2, n_p, n_a, 2, n_p, n_a)."""
    there = own[:, :, ::parts, :, :, ::parts]
    return there.reshape(there[0, 0, 0].size, -1)


def _same_flank(own: FloatArray) -> FloatArray:
    """Return the compliance (2, n, n) of each flank under loads on it, of `own` (2, n_p, n_a, 2, n_p, n_a)."""
    return np.stack([own[flank, :, :, flank].reshape(own[0, :, :, 0, 0, 0].size, -1) for flank in (0, 1)])


def _check_reach(body: GearBody, reach: int) -> None:
    """Refuse a number of coupled teeth that the gear does not have."""
    teeth = body.geometry.teeth
    require(
        is_whole(reach) and 0 <= reach < teeth,
        f"reach = {reach} must be a whole number from 0 to {teeth - 1}: the gear has {teeth} teeth, and each can be in "
        "contact at one place at a time; make the face narrower or the helix angle smaller",
    )


def _solved(
    body: GearBody, fidelity: GearFidelity, reach: int, friction: bool, progress: Progress | None
) -> tuple[FlankFlexibility, FloatArray, FloatArray]:
    """Return the flexibility, and under forces along the profile the shares of patterns and a tooth's own compliance.

    Without `friction` the last two are empty.
    """
    mesh = gear_mesh(body, fidelity)
    finer = finer_tooth(body, mesh, fidelity.tooth_layers(body.geometry.relative_width))
    tooth = condensed_tooth(body.geometry, mesh, body.material, friction=friction, finer=finer)
    patterns, share, strength = load_patterns(tooth, fidelity.load_pattern_tolerance)
    shape = len(tooth.radius), len(tooth.axial)
    share = share.reshape(len(share), -1, *shape)[..., :: finer.parts].reshape(len(share), -1)
    n = share.shape[1] // 2 if friction else share.shape[1]
    response = body_flexibility(
        mesh,
        tooth,
        body.material,
        (patterns, strength),
        far_tolerance=fidelity.far_pattern_tolerance,
        sector=body.sector,
        reach=reach,
        progress=progress,
    )
    found = FlankFlexibility(
        radius=tooth.radius,
        axial=tooth.axial[:: finer.parts] + body.offset,
        teeth=body.geometry.teeth,
        response=_limited_harmonics(body, fidelity, share, response),
        share=share[:, :n],
        tooth_axial=tooth.axial + body.offset,
        own=tooth.own,
    )
    return found, share[:, n:], np.empty((0, 0)) if tooth.own_friction is None else tooth.own_friction


def _limited_harmonics(body: GearBody, fidelity: GearFidelity, share: FloatArray, response: FloatArray) -> FloatArray:
    """Return the response (sector, reach + 1, r, r) with no more of each harmonic of openings than reaches the teeth.

    Openings that do not match the columns of the mesh are each meshed in another way.  The n-th harmonic of N equal
    openings falls by (outer radius of the openings / root radius)^(n N) on its way to the teeth.  What exceeds that by
    far is an error of the mesh: sidebands at other multiples of the shaft's speed.
    """
    cut, count, teeth = body.blank.cutouts, body.blank.symmetry, body.geometry.teeth
    if cut is None or 2 * fidelity.transverse_refinement * teeth % count == 0:
        return response
    turns = count * body.sector // teeth  # of openings in a sector
    harmonic = np.arange(body.sector // 2 + 1) * pow(turns, -1, body.sector) % body.sector
    harmonic = np.minimum(harmonic, body.sector - harmonic)
    spectrum, loads = np.fft.rfft(response, axis=0), share @ share.T
    power = np.einsum("ndab,ndab->n", spectrum.conj(), loads @ spectrum @ loads).real
    size = np.sqrt(np.maximum(power, 0.0))
    felt = (cut.outer_radius / body.geometry.root_radius) ** (count * (harmonic - 1.0))
    most = _EXCESS * size[harmonic == 1] * felt
    wrong = (harmonic > 1) & (size > most)
    spectrum[wrong] *= (most[wrong] / size[wrong])[:, None, None, None]
    return np.asarray(np.fft.irfft(spectrum, body.sector, axis=0))


def _friction(normal: FloatArray, sliding: FloatArray, flexibility: FloatArray, own: FloatArray) -> FloatArray:
    """Return `FlankCompliance.friction` from the shares (r, n) of normal forces and of forces along the profile."""
    sector, reach, n = len(flexibility), flexibility.shape[1] - 1, own.shape[0] // 2
    total = np.empty((sector, 2 * reach + 1, 2, n, n))
    for t in range(sector):
        for d in range(-reach, reach + 1):
            answer = flexibility[t, d] if d >= 0 else flexibility[(t + d) % sector, -d].T
            for f, flank in enumerate((slice(0, n), slice(n, 2 * n))):
                total[t, reach + d, f] = normal[:, flank].T @ answer @ sliding[:, flank]
                if d == 0:
                    total[t, reach, f] += own[flank, flank]
    return total


def load_patterns(tooth: CondensedTooth, tolerance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the few patterns of force by which a tooth passes its flank loads on.

    tolerance: singular values below this part of the largest are dropped.
    Returns patterns (3 n_i, r): forces on the shared nodes (N). shares (r, n): share of each pattern in each flank
    load. strength (r,): singular values over the largest.

    patterns · shares = tooth.passed, and passed_friction beside it, less the dropped part. Patterns are ordered by the
    energy they store in the tooth itself on weak springs.  Forces balanced within the tooth reach no neighbour
    (Saint-Venant); forces that move it as a whole do.
    """
    springs = _SPRINGS * np.diag(tooth.stiffness).mean() * np.eye(len(tooth.stiffness))
    root = np.linalg.cholesky(tooth.stiffness + springs)
    passed = tooth.passed if tooth.passed_friction is None else np.hstack([tooth.passed, tooth.passed_friction])
    left, strength, right = np.linalg.svd(solve_triangular(root, passed, lower=True), full_matrices=False)
    kept = strength > tolerance * strength[0]
    return root @ left[:, kept], strength[kept, None] * right[kept], strength[kept] / strength[0]
