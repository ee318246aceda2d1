"""Level of a gearbox linearised at its mean load, with any set of options, in fractions of a second.

It stands for the sound before anything long is computed. It is the A-weighted power of all alternating bearing forces
in the band, as walls radiate it. docs/decisions/0017-options-decide-themselves.md has its reasons and limits.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from nvhchain import dynamics, gear, levels
from nvhchain.bearings import StiffnessMatrix
from nvhchain.case import PLAIN, GearboxCase, Options
from nvhchain.case.gearbox import Support
from nvhchain.dynamics import Gearbox, LoadCentre, MeshFriction, VibratingBody
from nvhchain.errors import SolverError
from nvhchain.fidelity import STANDARD, GearFidelity
from nvhchain.gear import SOLID, GearPair
from nvhchain.handoff import FloatArray, MeshLaw, MeshPeriod
from nvhchain.runtime.threads import one_blas_thread
from nvhchain.scene.body_modes import vibrating_bodies
from nvhchain.scene.kept import kept
from nvhchain.scene.loaded_tilt import ANGLES, SLICES, balanced_tilts, tilted

TEETH = GearFidelity(
    profile_elements=4,
    width_layers=8,
    slices=16,
    angles_per_mesh=32,
    deflections_per_doubling=3,
    bodies="analytic",
)
"""Knobs of the meshes: closed-form slices, fifteen harmonics, a tenth of a second a stage."""

COARSE_TEETH = replace(TEETH, slices=SLICES, angles_per_mesh=ANGLES)
"""Knobs of the meshes for their tilt under load."""

LOADS = (0.1, 0.5, 1.0, 1.8, 3.0)
"""Loads, over the mean one, between which deflections of unevenly loaded faces are interpolated."""

SPEEDS = 12
"""Number of speeds that stand for a run-up."""

MICRORADIAN = 6
"""Decimal digits of the tilt of gears under load (rad)."""

SAME_ORDER = 1e-6
"""Relative difference of orders that count as equal."""

WEAK = 1e-4
"""Power of a line over that of the strongest below which its change does not count."""

ERROR_DECIMALS = 4
"""Decimal digits of relative errors."""

LARGEST_ERROR = 10.0
"""Largest relative error of an order."""


@dataclass(eq=False)
class LinearGearbox:
    """Gearbox of a case on rigid seats, linearised at its mean load.

    case: case; its own options do not count.
    steady: steady speeds of the input (rad/s) in place of the case's own.
    orders (n_order,): orders of the input, known from the first power on.
    """

    case: GearboxCase
    steady: tuple[float, ...] = ()
    orders: FloatArray = field(default_factory=lambda: np.zeros(0), init=False)
    _found_tilts: dict[tuple[bool, bool], FloatArray] = field(default_factory=dict, init=False)

    @cached_property
    def _gearbox(self) -> Gearbox:
        return self.case.gearbox_on_rigid_seats

    @cached_property
    def gear_bodies(self) -> tuple[VibratingBody, ...]:
        """Gears whose bodies vibrate in the band."""
        return vibrating_bodies(self.case)

    @cached_property
    def _softness(self) -> FloatArray:
        """Static compliance (n_mesh,) (m/N) of the modes of the gear bodies, which solid gears do not have."""
        if not self.gear_bodies:
            return np.zeros(len(self.case.stages))
        box = replace(self._gearbox, gear_bodies=self.gear_bodies)
        return dynamics.body_compliance(box, self.case.straight_laws)

    def scaled(self, *, stiffness: float = 1.0, damping: float = 1.0) -> LinearGearbox:
        """Return the gearbox with other stiffness and damping of its bearings.

        stiffness: factor on the stiffness of all bearings.
        damping: factor on the damping of bearings and of elastic modes of shafts.
        """
        other, gearbox = LinearGearbox(self.case, self.steady), self._gearbox
        other.__dict__["gear_bodies"] = self.gear_bodies
        shafts = (replace(each, modal_damping=min(0.5, damping * each.modal_damping)) for each in gearbox.shafts)
        other.__dict__["_gearbox"] = replace(
            gearbox,
            shafts=tuple(shafts),
            bearings=tuple(_scaled(each, stiffness, damping) for each in gearbox.bearings),
            shaft_bearings=tuple(_scaled(each, stiffness, damping) for each in gearbox.shaft_bearings),
        )
        return other

    @cached_property
    def speeds(self) -> tuple[float, ...]:
        """Speeds of the input (rad/s)."""
        start, ramp = self.case.operation.input_speed, self.case.ramp
        if ramp is None or self.steady:
            return self.steady or (start,)
        steps = (np.arange(SPEEDS) + 0.5) / SPEEDS
        return tuple((start + (ramp.end_speed - start) * steps).tolist())

    @one_blas_thread
    def power(self, options: Options) -> FloatArray:
        """Return the A-weighted power that stands for the sound with some options.

        Returns (n_speed, n_order): sum over bearings and directions (N²), weighted by the walls; 0 outside the band.
        """
        evenly = options.loaded_misalignment is True
        tilts = self._tilts(options.flexible_shafts is True, options.gear_body_modes is True) if evenly else None
        gearbox, laws, deflections = self._model(options, tilts)
        if options.tilt is True and not evenly:
            deflections = self._tilted_deflections(gearbox, laws, deflections)
        operation, band = self.case.operation, self.case.band
        found = dynamics.order_forces(
            gearbox,
            laws,
            None,
            deflections,
            input_torque=operation.input_torque,
            input_speeds=self.speeds,
            fidelity=STANDARD.dynamics,
        )
        self.orders = found.order
        frequency = np.outer(self.speeds, found.order) / (2.0 * np.pi)
        inside = (frequency >= band.low) & (frequency <= band.high)
        weight = 10.0 ** (0.1 * levels.a_weighting(np.where(inside, frequency, 1e3))) * self._walls(frequency)
        return np.asarray((np.abs(found.force) ** 2).sum(axis=2) * np.where(inside, weight, 0.0))

    def _tilted_deflections(
        self, gearbox: Gearbox, laws: list[MeshLaw], deflections: list[FloatArray | None]
    ) -> list[FloatArray | None]:
        """Return the deflections (n_point, n_angle) of points across faces that tilt loads unevenly.

        Each is that of a face which is loaded everywhere as at the point; a point without load does not push.
        """
        torque, found = self.case.operation.input_torque, list[FloatArray | None]()
        pressed = [_one_sided(law, force) for law, force in zip(laws, self.case.mesh_forces, strict=True)]
        try:
            loads = dynamics.face_loads(gearbox, pressed, input_torque=torque, fidelity=STANDARD.dynamics)
        except SolverError:  # an estimate stops no run: faces are loaded evenly
            return deflections
        for pair, force, deflection, own in zip(
            self.case.pairs, self.case.mesh_forces, deflections, loads, strict=True
        ):
            if deflection is None:
                found.append(None)
                continue
            key, place = _key(_solid_pair(pair)), own / force
            below = np.clip(np.searchsorted(LOADS, place) - 1, 0, len(LOADS) - 2)
            part = np.clip((place - np.take(LOADS, below)) / np.diff(LOADS)[below], 0.0, 1.0)[:, None]
            low, high = (
                np.array([_period(key, LOADS[each] * abs(force), (0.0, 0.0)).deflection for each in indices])
                for indices in (below, below + 1)
            )
            bent = (1.0 - part) * low + part * high
            found.append(np.where(place[:, None] > 0.0, bent, 0.0))
        return found

    def _walls(self, frequency: FloatArray) -> FloatArray:
        """Return the power that walls radiate per squared force, relative to large walls above their first mode.

        Below their first mode walls are springs: velocity rises with frequency. A body small against the wavelength
        radiates little: the efficiency is that of a pulsating sphere of the same area.
        """
        area, lowest = self.case.housing.walls(self.case)
        small = np.pi * frequency**2 * area / self.case.air.speed_of_sound**2  # (k a)² of the sphere
        return np.asarray(np.minimum(1.0, frequency / lowest) ** 2 * small / (1.0 + small))

    def _tilts(self, flexible_shafts: bool, gear_body_modes: bool) -> FloatArray:
        """Return the tilt (n_mesh, 2) (rad) of every mesh under load; no other option has a part in it."""
        if (flexible_shafts, gear_body_modes) not in self._found_tilts:
            moving = replace(PLAIN, flexible_shafts=flexible_shafts, gear_body_modes=gear_body_modes)
            self._found_tilts[flexible_shafts, gear_body_modes] = self._balanced(*self._model(moving)[:2])
        return self._found_tilts[flexible_shafts, gear_body_modes]

    def _balanced(self, gearbox: Gearbox, laws: list[MeshLaw]) -> FloatArray:
        case, torque = self.case, self.case.operation.input_torque
        forces = [0.0 if case.idles(each) else force for each, force in zip(case.stages, case.mesh_forces, strict=True)]
        pairs = [_solid_pair(pair) for pair in case.pairs]

        tilts = dynamics.opposed_misalignment(gearbox, laws, None, input_torque=torque, fidelity=STANDARD.dynamics)

        def loaded(number: int, pair: GearPair) -> MeshPeriod:
            return _kept_period(pair, forces[number], COARSE_TEETH)

        try:
            return balanced_tilts(pairs, forces, tilts, loaded)
        except SolverError:  # an estimate stops no run
            return tilts(np.zeros(len(pairs)))

    def _model(
        self, options: Options, tilts: FloatArray | None = None
    ) -> tuple[Gearbox, list[MeshLaw], list[FloatArray | None]]:
        """Return the gearbox with its options, its laws, and the deflection of every mesh; None where it idles."""
        meshes, laws, deflections = [], [], list[FloatArray | None]()
        for number, (stage, pair, force, mesh) in enumerate(
            zip(self.case.stages, self.case.pairs, self.case.mesh_forces, self._gearbox.meshes, strict=True)
        ):
            solid = _solid_pair(pair)
            tilt = (0.0, 0.0) if tilts is None else _rounded(tilts[number])
            period = _period(_key(solid), abs(force), tilt)
            stiffness = 1.0 / (1.0 / period.stiffness + self._softness[number])
            distribution, reach = period.distribution, max(1e-3, 3.0 * abs(force) / stiffness) * np.array([-1.0, 1.0])
            laws.append(
                gear.tabulated(solid, np.zeros(1), reach, stiffness * reach[None, :]).replace(
                    tilt_ratio=distribution.tilt_ratio
                )
            )
            deflections.append(None if self.case.idles(stage) else period.deflection)
            friction = options.coefficient
            meshes.append(
                replace(
                    mesh,
                    friction=MeshFriction(
                        friction, distribution.period, distribution.angle, distribution.sliding, distribution.arm
                    )
                    if friction
                    else None,
                    load_centre=LoadCentre(distribution.period, distribution.angle, distribution.offset)
                    if options.shuttling is True
                    else None,
                )
            )
        gearbox = replace(
            self._gearbox,
            meshes=tuple(meshes),
            flexible_shafts=options.flexible_shafts is True,
            gyroscopic=options.gyroscopic is True,
            face_points=options.face_points,
            gear_bodies=self.gear_bodies if options.gear_body_modes is True else (),
        )
        return gearbox, laws, deflections


def _one_sided(law: MeshLaw, force: float) -> MeshLaw:
    """Return a linear law that carries on the flank of its nominal force (N) alone."""
    low, high = law.deflection[0], law.deflection[-1]
    carried = [0.0, 0.0, law.force[0, -1]] if force >= 0.0 else [law.force[0, 0], 0.0, 0.0]
    return law.replace(deflection=np.array([low, 0.0, high]), force=np.array([carried]))


def _key(pair: GearPair) -> tuple[Any, ...]:
    """Return the fields of a pair."""
    return tuple(getattr(pair, part.name) for part in fields(pair))


@lru_cache(maxsize=64)
def _period(pair: tuple[Any, ...], force: float, tilt: tuple[float, float]) -> MeshPeriod:
    """Return the mesh period of a pair (its fields, which compared gearboxes share) that is tilted by its load."""
    return _kept_period(tilted(GearPair(*pair), tilt), force, TEETH)


def _kept_period(pair: GearPair, force: float, knobs: GearFidelity) -> MeshPeriod:
    """Return the mesh period of a pair under a force (N)."""
    return kept(
        "mesh_period",
        MeshPeriod,
        (pair, force, knobs),
        lambda: gear.mesh_period(pair, nominal_force=force, fidelity=knobs),
    )


def _scaled(bearing: Support, stiffness: float, damping: float) -> Support:
    """Return a bearing with other stiffness and damping; its damping does not follow its stiffness."""
    damped = replace(
        bearing,
        radial_damping=damping * bearing.radial_damping,
        axial_damping=damping * bearing.axial_damping,
        stiffness_damping=damping / stiffness * bearing.stiffness_damping,
        loss_factor=damping / stiffness * bearing.loss_factor,
    )
    if isinstance(bearing.model, StiffnessMatrix):
        matrix = tuple(tuple(stiffness * value for value in row) for row in bearing.model.matrix)
        return replace(damped, model=replace(bearing.model, matrix=matrix))
    return replace(
        damped,
        radial_stiffness=stiffness * bearing.radial_stiffness,
        axial_stiffness=stiffness * bearing.axial_stiffness,
    )


def _rounded(tilt: FloatArray) -> tuple[float, float]:
    plane_tilt, normal = (round(float(each), MICRORADIAN) for each in tilt)
    return plane_tilt, normal


def _solid_pair(pair: GearPair) -> GearPair:
    """Return a pair with solid blanks."""
    return replace(pair, pinion=replace(pair.pinion, blank=SOLID), wheel=replace(pair.wheel, blank=SOLID))


def level_change(before: FloatArray, after: FloatArray) -> float:
    """Return the change of the overall level (dB).

    Returns level of `after` over that of `before`.
    """
    return float(10.0 * np.log10(after.sum() / before.sum()))


def spectral_distance(before: FloatArray, after: FloatArray) -> float:
    """Return the distance of two spectra (dB).

    Returns level of the envelope of both over that of their common part.

    It is at least the change of the overall level, equal to it where all lines move the same way, and 0 only for equal
    spectra. Lines count by their power.
    """
    return float(10.0 * np.log10(np.maximum(before, after).sum() / np.minimum(before, after).sum()))


def largest_change(before: FloatArray, after: FloatArray) -> float:
    """Return the largest change of the level of a line (dB), among lines within `WEAK` of the strongest.

    before, after (n_speed, n_order): powers; lines are those of all speeds together.

    It is the measure of narrow resonances. How strongly walls radiate single lines is unknown before the housing is
    solved.
    """
    first, second = before.sum(axis=0), after.sum(axis=0)
    both = np.maximum(first, second)
    heard = (np.minimum(first, second) > 0.0) & (both >= WEAK * both.max())
    return float(np.abs(10.0 * np.log10(second[heard] / first[heard])).max(initial=0.0))


@dataclass(frozen=True)
class OrderError:
    """Relative errors of amplitudes at the orders of the meshes, and their mean.

    orders: order of the input and its relative error.
    mean: relative error of all other orders.
    """

    orders: tuple[tuple[float, float], ...]
    mean: float

    @classmethod
    def rounded(cls, orders: FloatArray, error: FloatArray, mean: float) -> OrderError:
        """Return the errors (n,) of orders (n,), rounded and limited."""
        capped = np.round(np.minimum(error, LARGEST_ERROR), ERROR_DECIMALS)
        return cls(tuple(zip(orders.tolist(), capped.tolist(), strict=True)), round(mean, ERROR_DECIMALS))

    def divided(self, divisor: float) -> OrderError:
        """Return the errors divided by a number."""
        return OrderError(tuple((order, error / divisor) for order, error in self.orders), self.mean / divisor)

    def errors(self, orders: FloatArray) -> FloatArray:
        """Return the relative errors (n,) of orders (n,)."""
        if not self.orders:
            return np.full(np.shape(orders), self.mean)
        known, error = np.array(self.orders).T
        nearest = np.abs(orders[:, None] - known).argmin(axis=1)
        return np.where(np.abs(orders - known[nearest]) < SAME_ORDER * orders, error[nearest], self.mean)


NO_ERROR = OrderError((), 0.0)
"""Error of a model that leaves nothing out."""
