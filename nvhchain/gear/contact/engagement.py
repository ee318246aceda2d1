"""Loaded mesh at one position: contact lines, compliance of both gears between them, and slice forces.

Tip edges beyond the path of contact close under load. The farther an edge is from the path, the farther it is from the
mating flank. Where edges at the limit `GearFidelity.corner_gap` stay open, those beyond it stay open too. Where one of
them carries, the limit is raised to the approach of the flanks. An edge with a larger gap cannot close.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, sin, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nvhchain.errors import InputError, SolverError, require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.analytic import SliceCompliance
from nvhchain.gear.compliance.flank_compliance import FlankCompliance, flank_compliance
from nvhchain.gear.compliance.flank_splines import FlankSplines, FlankWeights, flank_splines
from nvhchain.gear.contact.contact_lines import (
    ContactLines,
    contact_lines,
    mesh_order,
    separation,
    sliding_sense,
    wheel_angle,
    wheel_angles,
)
from nvhchain.gear.contact.local_law import LocalLaw, half_space_compliance, local_law, strip_half_width
from nvhchain.gear.contact.slice_forces import complementarity_residual, slice_forces
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.kinds import check_fields

PLACES = 8
"""Number of places over the face width, each on another tooth of the body period, at which edges are put at the
limit."""

_PART = 0.05
"""Part of a slice that remains where the limit cuts it; its middle is then nearly at the limit."""

_KEPT = 1024
"""Largest number of phases kept, of some 0.1 MB each; a mesh law has two for each angle of a mesh period."""

_KEPT_BYTES = 2.0**26
"""Largest memory (bytes) of the common compliances of phases."""

_PHASES = 2**40
"""Phases of a mesh period that are told apart: equal ones of different mesh periods differ by rounding."""

_Key = tuple[int, int]
"""Number of a phase among `_PHASES`, and flank."""

FRICTION_ROUNDS = 60
"""Largest number of iterations on the deflection due to friction; a dozen is usual, more means failure."""


def engaged_reach(pair: GearPair, corner_gap: float = 0.0) -> int:
    """Return the largest distance in teeth between two tooth pairs in contact at once.

    corner_gap: unloaded gap up to which tip edges beyond the path count (m), `GearFidelity.corner_gap`.
    """
    return ceil(pair.total_contact_ratio + sum(pair.extensions(corner_gap)) / pair.base_pitch) - 1


def slice_count(pair: GearPair, fidelity: GearFidelity) -> int:
    """Return the number of slices of the face width.

    fidelity: `slices` per face width, or per axial pitch where the face is wider.

    A contact line enters and leaves within a pitch.  With 32 slices over 6 pitches the variation of the deflection over
    a mesh period was 2.8 times too large.
    """
    return ceil(fidelity.slices * max(1.0, pair.overlap_ratio))


@dataclass(frozen=True, eq=False)
class _Phase:
    """Contact lines at a phase of the mesh, with their unloaded gap, local law and weights in the compliances."""

    lines: ContactLines
    gap: FloatArray
    law: LocalLaw
    weights: tuple[FlankWeights | None, ...]


@dataclass(frozen=True, eq=False)
class Engagement:
    """Gear pair with the flank compliances of both gears, ready for contact at any angle.

    pair: gear pair.
    compliances: compliances of pinion and wheel.
    fidelity: slices, contact residual and corner gap.
    deviations: deviations of every flank from the drawing; by default there are none.

    Raises InputError if a compliance belongs to another gear, reaches over too few teeth or does not cover the face
        width.
    """

    pair: GearPair
    compliances: tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance]
    fidelity: GearFidelity
    deviations: PairDeviations | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.deviations is not None:
            self.deviations.check(self.pair)
        slices = self.fidelity.slices
        require(slices >= 1, f"slices = {slices}: at least 1 is needed")
        for name, body, c in zip(
            ("pinion", "wheel"), (self.pair.pinion, self.pair.wheel), self.compliances, strict=True
        ):
            if isinstance(c, SliceCompliance):
                continue
            require(
                c.tooth_count == body.geometry.teeth and c.sector == body.sector,
                f"compliance of the {name} is for {c.tooth_count} teeth in sectors of {c.sector}, the gear has "
                f"{body.geometry.teeth} in sectors of {body.sector}: compute it for this gear",
            )
            reach = engaged_reach(self.pair, self.fidelity.corner_gap)
            require(
                c.reach >= reach,
                f"compliance of the {name} reaches over {c.reach} teeth, {reach} are in contact beside each other: "
                "compute it with a larger reach",
            )
            half = self.pair.face_width / 2 * (1 - 1e-9)
            require(
                c.axial[0] <= -half and c.axial[-1] >= half,
                f"compliance of the {name} covers z = {1e3 * c.axial[0]:.3g}…{1e3 * c.axial[-1]:.3g} mm, the common "
                f"face width needs ±{1e3 * half:.3g} mm",
            )

    @cached_property
    def _phases(self) -> dict[_Key, _Phase]:
        return {}

    @cached_property
    def _common_compliances(self) -> dict[_Key, FloatArray]:
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without what is kept of phases, which other processes compute themselves."""
        return {name: value for name, value in self.__dict__.items() if name not in ("_phases", "_common_compliances")}

    @cached_property
    def _splines(self) -> tuple[FlankSplines | SliceCompliance, ...]:
        return tuple(c if isinstance(c, SliceCompliance) else flank_splines(c) for c in self.compliances)

    @property
    def slices(self) -> int:
        """Number of slices, `slice_count`."""
        return slice_count(self.pair, self.fidelity)

    def lines(self, angle: float, flank: int = DRIVE) -> ContactLines:
        """Return the contact lines at wheel `angle` (rad), cut into `slices`."""
        return contact_lines(self.pair, angle, slices=self.slices, flank=flank, corner_gap=self.fidelity.corner_gap)

    def gap(self, lines: ContactLines) -> FloatArray:
        """Return the unloaded gap (n,) in m of every slice, deviations included."""
        gap = separation(self.pair, lines)
        return gap if self.deviations is None else gap + self.deviation_gap(lines, 0)

    def deviation_gap(self, lines: ContactLines, later: IntArray | int) -> FloatArray:
        """Return the part (n_later, n) or (n,) in m of the gap by deviations, `later` mesh periods on."""
        if self.deviations is None:
            return np.zeros((*np.shape(later), len(lines.length)))
        travel = wheel_angles(self.pair, lines)
        order = mesh_order(self.pair, lines)
        return self.deviations.removed(self.pair, lines.flank, order, lines.radius, lines.axial, travel, later)

    def compliance(self, lines: ContactLines) -> FloatArray:
        """Return C (n, n) in m/N: normal approach at every slice under a unit normal force at each, both gears."""
        weights = self._weights(lines)
        return self._completed(self._common(lines, weights), lines, weights)

    def _common(self, lines: ContactLines, weights: tuple[FlankWeights | None, ...]) -> FloatArray:
        """Return the part (n, n) of `compliance` in m/N that is the same in all mesh periods."""
        n = len(lines.length)
        total = np.zeros((n, n))
        for tooth, radius, body_compliance, own in zip(lines.tooth, lines.radius, self._splines, weights, strict=True):
            if isinstance(body_compliance, SliceCompliance):
                body_compliance.add(total, radius, lines.length)
            else:
                assert own is not None
                body_compliance.add_common(total, lines.side, tooth, own)
        return total

    def _completed(
        self, common: FloatArray, lines: ContactLines, weights: tuple[FlankWeights | None, ...]
    ) -> FloatArray:
        """Return `compliance`: its common part, and the one of the teeth in contact."""
        total = common.copy()
        for tooth, body_compliance, own in zip(lines.tooth, self._splines, weights, strict=True):
            if isinstance(body_compliance, FlankSplines):
                assert own is not None
                body_compliance.add_particular(total, lines.side, tooth, own)
        return total

    def _weights(self, lines: ContactLines) -> tuple[FlankWeights | None, ...]:
        """Return the weights of every slice in the compliances of both gears; None for closed forms."""
        return tuple(
            None if isinstance(body_compliance, SliceCompliance) else body_compliance.weights(radius, lines.axial)
            for body_compliance, radius in zip(self._splines, lines.radius, strict=True)
        )

    def _phase(self, angle: float, flank: int) -> tuple[_Key, int, _Phase]:
        """Return the phase of the mesh at an angle and its key, and the number of mesh periods before it."""
        meshes, phase = divmod(round(angle / self.pair.mesh_period * _PHASES), _PHASES)
        found = self._phases.get((phase, flank))
        if found is None:
            lines = self.lines(phase / _PHASES * self.pair.mesh_period, flank)
            found = _Phase(lines, separation(self.pair, lines), self.local_law(lines), self._weights(lines))
            if len(self._phases) < _KEPT:
                self._phases[phase, flank] = found
        return (phase, flank), meshes, found

    def problem(self, angle: float, flank: int = DRIVE) -> ContactProblem:
        """Return the contact problem at wheel `angle` (rad); other mesh periods load other teeth."""
        key, meshes, phase = self._phase(angle, flank)
        later = meshes * self.pair.sense * np.array([[-1], [1]])
        lines = replace(phase.lines, tooth=phase.lines.tooth + later)
        gap = phase.gap if self.deviations is None else phase.gap + self.deviation_gap(lines, 0)
        return ContactProblem(self, lines, gap, phase.law, phase.weights, key)

    def _common_of(self, problem: ContactProblem) -> FloatArray:
        """Return `_common` of a problem, which is kept for its phase as long as there is room."""
        found = None if problem.key is None else self._common_compliances.get(problem.key)
        if found is None:
            found, kept = self._common(problem.lines, problem.weights), self._common_compliances
            if problem.key is not None and len(kept) < min(_KEPT, _KEPT_BYTES / max(found.nbytes, 1)):
                kept[problem.key] = found
        return found

    def friction_compliance(self, lines: ContactLines) -> FloatArray:
        """Return the normal approach (n, n) in m/N at every slice under unit friction at each, both gears.

        The sign follows the sense of sliding.  Friction pushes both flanks towards their tips where the pinion's flank
        slides ahead of the wheel's, and towards their roots before the pitch point.
        """
        n = len(lines.length)
        total = np.zeros((n, n))
        for tooth, radius, body_compliance in zip(lines.tooth, lines.radius, self._splines, strict=True):
            if isinstance(body_compliance, SliceCompliance) or body_compliance.friction is None:
                raise InputError("friction needs the compliance along the profile: flank_compliance(…, friction=True)")
            total += body_compliance.friction_compliance(lines.side, tooth, radius, lines.axial)
        return total * (sliding_sense(self.pair, lines) * (1.0 if lines.flank == DRIVE else -1.0))

    def select_angles(self, angles: FloatArray) -> Engagement:
        """Return the same pair with only the compliances needed at these wheel `angles` (rad)."""
        teeth = np.hstack(
            [
                contact_lines(self.pair, angle, slices=1, flank=flank, corner_gap=self.fidelity.corner_gap).tooth
                for angle in angles
                for flank in (DRIVE, BACK)
            ]
        )
        pinion, wheel = (
            c if isinstance(c, SliceCompliance) else c.select_teeth(t)
            for c, t in zip(self.compliances, teeth, strict=True)
        )
        return replace(self, compliances=(pinion, wheel))

    def forces(
        self,
        angle: float,
        approach: FloatArray,
        *,
        flank: int = DRIVE,
        separation: FloatArray | None = None,
        friction: float = 0.0,
    ) -> tuple[ContactLines, FloatArray]:
        """Return contact lines and slice forces at one wheel angle.

        angle: wheel angle (rad).
        approach (n_case,): approach of the flanks along their normal (m).
        separation (n,): unloaded gap of every slice beyond that of aligned pure involutes (m); by default that of the
        pair's micro-geometry and misalignment.
        friction: coefficient of friction μ in the deflection of the teeth along their profile.
        Returns force (n_case, n): slice forces (N).
        """
        problem = self.problem(angle, flank)
        gap = problem.gap if separation is None else separation
        return problem.lines, problem.forces(np.asarray(approach, float)[:, None] - gap, friction)

    def local_law(self, lines: ContactLines) -> LocalLaw:
        """Return the local deflection law of every slice."""
        materials = (self.pair.pinion.material, self.pair.wheel.material)
        pinion, wheel = (not isinstance(c, SliceCompliance) for c in self.compliances)
        depths = (lines.depth[0], lines.depth[1])
        return local_law(lines.curvature, depths, materials, edges=lines.edges, held=(pinion, wheel))

    def forces_on(self, lines: ContactLines, approach: FloatArray, *, friction: float = 0.0) -> FloatArray:
        """Return `ContactProblem.forces` (n_case, n) in N on given lines."""
        return self._problem_on(lines).forces(approach, friction)

    def _problem_on(self, lines: ContactLines) -> ContactProblem:
        return ContactProblem(self, lines, self.gap(lines), self.local_law(lines), self._weights(lines))

    def mesh_force(self, angle: float, deflection: FloatArray) -> FloatArray:
        """Return F(θ, δ) (n_defl,) in N: > 0 on the drive flank, 0 in the backlash gap, < 0 on the back flank."""
        deflection = np.asarray(deflection, float)
        force = np.zeros(len(deflection))
        for flank, sign in ((DRIVE, 1.0), (BACK, -1.0)):
            approach = deflection if flank == DRIVE else -(deflection + self.pair.backlash)
            problem = self.problem(angle, flank)
            closed = np.flatnonzero(approach > problem.gap.min(initial=np.inf))
            closed = closed[np.argsort(approach[closed])]  # each solution starts the next one
            if len(closed):
                force[closed] += sign * problem.forces(approach[closed, None] - problem.gap).sum(axis=1)
        return force

    def first_contact(self, angle: float, flank: int = DRIVE) -> float:
        """Return the approach (m) at which the flanks first touch at wheel `angle` (rad).

        It is 0 without micro-geometry and misalignment.
        """
        return float(self.problem(angle, flank).gap.min())


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Contact at one wheel angle on one flank.

    engagement: the pair.
    lines: contact lines.
    gap (n,): unloaded gap of every slice, deviations included (m).
    law: local law of every slice.
    weights: those of the slices in the compliances of both gears.
    key: key of the mesh's phase; None for lines that were made alone.
    """

    engagement: Engagement
    lines: ContactLines
    gap: FloatArray
    law: LocalLaw
    weights: tuple[FlankWeights | None, ...]
    key: _Key | None = None

    @cached_property
    def compliance(self) -> FloatArray:
        """`Engagement.compliance` (n, n) in m/N."""
        return self.engagement._completed(self.engagement._common_of(self), self.lines, self.weights)

    @cached_property
    def friction_compliance(self) -> FloatArray:
        """`Engagement.friction_compliance` (n, n) in m/N."""
        return self.engagement.friction_compliance(self.lines)

    def residual(self, approach: float, force: FloatArray, friction: float = 0.0) -> float:
        """Return the largest violation of the contact conditions (m) by slice forces (n,) in N at an approach (m)."""
        compliance = self.compliance + (friction * self.friction_compliance if friction else 0.0)
        return complementarity_residual(compliance, approach - self.gap, self.lines.length, self.law, force)

    def forces(self, approach: FloatArray, friction: float = 0.0) -> FloatArray:
        """Return the slice forces (n_case, n) in N for the approach (n_case, n) in m of every slice, less its gap.

        With friction the problem is not that of a minimum.  The deflection due to friction is put on the right-hand
        side and iterated.  Each iteration reduces the change by a factor of about μ tan α.
        """
        lines, pair, tolerance = self.lines, self.engagement.pair, self.engagement.fidelity.contact_residual

        def solved(approach: FloatArray) -> FloatArray:
            return slice_forces(self.compliance, approach, lines.length, self.law, tolerance=tolerance)

        forces = solved(approach)
        if friction:
            friction_compliance = friction * self.friction_compliance
            for _ in range(FRICTION_ROUNDS):
                friction_approach = friction_compliance @ forces.T
                forces = solved(approach - friction_approach.T)
                change = np.abs(friction_compliance @ forces.T - friction_approach).max(initial=0.0)
                if change <= tolerance * np.abs(approach).max(initial=0.0):
                    break
            else:
                raise SolverError(
                    f"friction = {friction:g}: slice forces still move the flanks by {1e6 * change:.3g} µm after "
                    f"{FRICTION_ROUNDS} rounds: lower the coefficient"
                )
        a = sum(half_space_compliance(body.material) for body in (pair.pinion, pair.wheel))
        width = strip_half_width(forces / lines.length, lines.curvature, lines.edges.angle, a)
        excess = width - lines.depth.min(axis=0)
        if (excess > 0).any():
            worst = np.unravel_index(np.argmax(excess), excess.shape)
            raise SolverError(
                f"contact half width reaches {1e3 * width[worst]:.3g} mm where the tooth's centre line lies "
                f"{1e3 * lines.depth.min(axis=0)[worst[1]]:.3g} mm deep: too much for the local law; lower the load or "
                "drive_reach (a mesh law goes to that times the next power of two of the force), or make the tips "
                "thicker (tip_radius, addendum)"
            )
        return forces


def close_edges(engagement: Engagement, drive: float, back: float = 0.0) -> Engagement:
    """Return an engagement whose `corner_gap` includes all edges that close at given approaches of the flanks.

    drive, back: approach of the drive and of the back flanks (m).
    Returns `engagement` itself, or one with a larger `corner_gap`.

    Compliances that reach over too few teeth are computed anew.  A `corner_gap` of 0 stays.
    """
    gap = engagement.fidelity.corner_gap
    closed, needed = False, gap
    for flank, approach in ((DRIVE, drive), (BACK, back)):
        if not 0 < gap < approach:
            continue
        for lines, limit_slices in _edges_at_limit(engagement, flank):
            parted = separation(engagement.pair, lines)
            needed = max(needed, float((approach - parted + lines.corner).max(initial=0.0)))
            if not closed and (approach > parted[limit_slices]).any():
                closed = bool(engagement.forces_on(lines, approach - parted[None])[0, limit_slices].any())
    return _reaching(engagement, needed) if closed else engagement


def _edges_at_limit(engagement: Engagement, flank: int) -> Iterator[tuple[ContactLines, NDArray[np.bool_]]]:
    """Yield contact lines that end at the limit, before and after the path, and which of their slices (n,) do."""
    pair, fidelity = engagement.pair, engagement.fidelity
    before, after = pair.extensions(fidelity.corner_gap)
    tangent = pair.sense * tan(pair.base_helix_angle) * (1 if flank == DRIVE else -1)
    width = pair.face_width / engagement.slices
    for limit, inwards in ((pair.path[0] - before, 1.0), (pair.path[1] + after, -1.0)):
        for i in range(PLACES):
            # the inner end of a slice; the limit cuts its other end off
            bound = (i * engagement.slices // PLACES + (inwards * tangent > 0)) * width - pair.face_width / 2
            axial = bound - np.sign(inwards * tangent) * _PART * width
            mesh = i * pair.meshes_per_body_period // PLACES
            touch = limit + inwards * 1e-6 * (before + after)
            lines = engagement.lines(wheel_angle(pair, touch, float(axial), mesh, flank), flank)
            travel = 0.5 * lines.length * abs(sin(pair.base_helix_angle)) + 1e-5 * (before + after)
            yield lines, np.abs(lines.position - limit) <= travel


def _reaching(engagement: Engagement, gap: float) -> Engagement:
    """Return the engagement with the `corner_gap` `gap` (m) and compliances of sufficient reach."""
    pair, fidelity = engagement.pair, replace(engagement.fidelity, corner_gap=gap)
    reach = engaged_reach(pair, gap)
    pinion, wheel = (
        c
        if isinstance(c, SliceCompliance) or c.reach >= reach
        else flank_compliance(body, fidelity, reach=reach, friction=c.friction is not None)
        for c, body in zip(engagement.compliances, (pair.pinion, pair.wheel), strict=True)
    )
    return Engagement(pair, (pinion, wheel), fidelity, engagement.deviations)
