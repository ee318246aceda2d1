"""Case of a gearbox in its housing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from math import ceil, hypot, pi
from typing import TypeVar

import numpy as np

from nvhchain import acoustics
from nvhchain.case.bodies import Extent
from nvhchain.case.cad import Cad
from nvhchain.case.casting import Casting
from nvhchain.case.checks.doubts import doubtful_places, yielding_bearings
from nvhchain.case.checks.fit import check_fit
from nvhchain.case.checks.names import unknown_names
from nvhchain.case.checks.root_stress import breaking_teeth
from nvhchain.case.gears import Gear, Stage, set_backlashes
from nvhchain.case.housing_model import HousingModel, ModalResults, Superelement
from nvhchain.case.operation import (
    RADIATED,
    Band,
    EngineName,
    FieldPoint,
    Operation,
    Quantity,
    TorqueRamp,
    check_case_name,
    check_plane,
    check_quantities,
)
from nvhchain.case.options import LOADED, Options, Spread
from nvhchain.case.sound import BackgroundLevels, RecordedBackground, Target
from nvhchain.conventions import Air
from nvhchain.dynamics import Bearing, Equilibrium, Gearbox, LooseGear, Mesh, Shaft, ShaftBearing
from nvhchain.dynamics import equilibrium as balanced
from nvhchain.dynamics.model.assembly import input_inertia
from nvhchain.dynamics.model.shaft_beam import covered_places
from nvhchain.dynamics.runs.ramp import Ramp as SpeedRamp
from nvhchain.errors import InputError, check_all, concerning, counted, require, require_all, warn_caller
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.gear import (
    GearPair,
    Misalignment,
    PairDeviations,
    tabulated,
)
from nvhchain.gear.drawing.pair import LEAST_SHARE, common_face, offset_bodies
from nvhchain.handoff import MeshLaw, RigidPlane
from nvhchain.kinds import check_fields
from nvhchain.names import check_names

_CENTRE_TOLERANCE = 1e-5
"""Largest difference (m) of a stage's centre distance and the distance of its shafts."""

Support = TypeVar("Support", bound=Bearing)

USUAL_DAMPING = 1.25e-5
"""Damping per stiffness (s) of a bearing without damping in its case, the default of the rotor program ROSS.

E. Krämer, *Dynamics of Rotors and Foundations* (Springer 1993), has 0.25 to 2.5 times 1e-5 s for rolling bearings.
"""

_TRIANGLES_PER_AREA, _TRIANGLES_PER_BORE = 2.83, 100
"""Estimates, fitted to the runs in docs/measured/chain/plan.md."""


@dataclass(frozen=True)
class GearboxCase:
    """Gearbox in its housing at constant or changing speed.

    Parameters
    ----------
    name : str
        Name, also of its folder.
    operation : Operation
        Speed and load.
    band : Band
        Frequency band.
    gears : tuple of Gear
        Gears.
    stages : tuple of Stage
        Gear stages.
    shafts : tuple of Shaft
        Shafts.
    bearings : tuple of Bearing
        Bearings.
    input_shaft, output_shaft : str
        Names of the shafts.
    housing : Casting, HousingModel, ModalResults, Superelement or Cad
        Housing.
    field_points : tuple of FieldPoint
        Microphones.
    input_rotation : int
        +1 where the input turns by the right-hand rule about +z, else −1.
    quantities : tuple of str
        `bearing_forces`, `surface_velocity`, `pressure`, `sound_power`, `radiation_efficiency`, `directivity`.
    air : Air
        Air around the housing.
    engine : str
        Boundary element engine, `fused` or `bempp`.
    reflecting_plane : RigidPlane, optional
        Rigid plane beside the housing, such as the floor; without one the field is free.
    options : Options
        Additions to the plain dynamic model, such as friction.
    spread : Spread, optional
        Ranges of inputs that are rarely known, which the limits then include.
    shaft_bearings : tuple of ShaftBearing
        Bearings between coaxial shafts; they have no seat in the housing.
    assumptions : tuple of str
        Sentences printed beside every level, such as that the housing was drawn by rule.
    background : RecordedBackground or BackgroundLevels, optional
        Background to listen to beside the gearbox, such as road noise.
    targets : tuple of Target
        Largest levels.
    folder : str
        Folder of the case file.
    """

    name: str
    operation: Operation
    band: Band
    gears: tuple[Gear, ...]
    stages: tuple[Stage, ...]
    shafts: tuple[Shaft, ...]
    bearings: tuple[Bearing, ...]
    input_shaft: str
    output_shaft: str
    housing: Casting | HousingModel | ModalResults | Superelement | Cad
    field_points: tuple[FieldPoint, ...] = ()
    input_rotation: int = 1
    quantities: tuple[Quantity, ...] = ("pressure",)
    air: Air = Air()  # noqa: RUF009 (frozen)
    engine: EngineName = "fused"
    reflecting_plane: RigidPlane | None = None
    options: Options = Options()  # noqa: RUF009 (frozen)
    spread: Spread | None = None
    shaft_bearings: tuple[ShaftBearing, ...] = ()
    assumptions: tuple[str, ...] = ()
    background: RecordedBackground | BackgroundLevels | None = None
    targets: tuple[Target, ...] = ()
    folder: str = "."

    def __post_init__(self) -> None:
        check_fields(self)
        check_all(
            lambda: check_case_name(self.name),
            lambda: check_quantities(self.quantities, self.field_points),
            self._check_run_up,
            lambda: check_plane(self.reflecting_plane, self.field_points),
            lambda: check_names([target.name for target in self.targets], "targets"),
            self._check_names,
        )
        object.__setattr__(self, "gears", set_backlashes(self.gears, self.stages))
        check_all(
            *(partial(self._check_reach, shaft) for shaft in self.shafts),
            lambda: self.housing.check(self),
            self._check_load,
            self._check_train,
            lambda: check_fit(self),
        )
        for text in doubtful_places(self):
            warn_caller(text, kind="place")

    def __repr__(self) -> str:
        parts = f"{counted(len(self.stages), 'stage')}, {counted(len(self.bearings), 'bearing')}"
        speed = "run-up" if self.operation.ramp else f"{self.operation.input_speed * 30 / pi:.4g} rpm"
        return f"GearboxCase({self.name}: {parts}; {speed}, {self.operation.input_torque:.4g} N m)"

    def _check_run_up(self) -> None:
        require(
            self.operation.ramp is None or not {"surface_velocity", *RADIATED}.intersection(self.quantities),
            "quantities: a run-up is followed in time, its surface velocity and sound power have no lines: ask for "
            "`bearing_forces` or `pressure`",
        )

    def _check_names(self) -> None:
        """Refuse missing, repeated and unknown names of gears, stages and shafts."""
        for kind in ("shafts", "gears", "stages"):
            require(len(getattr(self, kind)) > 0, f"{kind}: at least one is needed")
            check_names([item.name for item in getattr(self, kind)], kind)
        require_all(unknown_names(self))

    def _check_reach(self, shaft: Shaft) -> None:
        """Refuse a drawn shaft with a gap, or that ends before what stands on it; one that is stated rigid may."""
        if shaft.segments and self.options.flexible_shafts is not False:
            on = {f"bearing {b.name}": b.z for b in self.bearings if b.shaft == shaft.name}
            on |= {f"bearing {b.name}": b.z for b in self.shaft_bearings if shaft.name in (b.shaft, b.outer_shaft)}
            on |= {f"gear {g.name}": g.z for g in self.gears if g.shaft == shaft.name and not g.loose}
            on |= {f"load {number}": load.z for number, load in enumerate(shaft.loads)}
            covered_places(shaft, list(on.values()), list(on))

    def _check_load(self) -> None:
        """Refuse torques that do not fit the options or idle gears."""
        require(
            self.operation.input_torque > 0 or not any(map(self.options.models, LOADED)),
            f"options: friction and shuttling act on drive flanks under load, but input_torque = "
            f"{self.operation.input_torque:g} N m: leave them out, or give a driving torque",
        )
        idle = [stage.name for stage in self.stages if self.idles(stage)]
        require(
            self.operation.mesh_torque is None or self.operation.input_torque == 0 or bool(idle),
            f"mesh_torque = {self.operation.mesh_torque or 0.0:g} N m with input_torque = "
            f"{self.operation.input_torque:g} N m: it belongs to idle gears; under load leave it out",
        )
        require(
            not idle or self.operation.mesh_torque is not None,
            f"stage {', '.join(idle)}: a loose gear carries no more than its drag; how far its mesh law must reach is "
            "open: give mesh_torque, N m at the input, about that of the hardest impacts",
        )

    def _check_train(self) -> None:
        """Refuse gears that cannot mesh, teeth that break, and a train that does not turn as asked."""
        apart = list(self._apart())
        unmeshed = any("write centre_distance_mm" in text for text in apart)
        check_all(lambda: require_all(apart), *([] if unmeshed else [self._check_teeth]))
        if self.ramp is not None:
            self.band.check_record(self.ramp.duration)
        self._check_fluctuation()

    def _check_teeth(self) -> None:
        """Refuse gears that do not mesh, and teeth that break."""
        _ = self.pairs, self.gearbox
        require_all(breaking_teeth(self))
        require_all(yielding_bearings(self))

    def _apart(self) -> Iterator[str]:
        """Yield the mistakes in places of gears that mesh."""
        gears = {gear.name: gear for gear in self.gears}
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        for stage in self.stages:
            pinion, wheel = gears[stage.pinion], gears[stage.wheel]
            widths = pinion.geometry.face_width, wheel.geometry.face_width
            low, high = common_face((pinion.z, wheel.z), widths)
            if high - low < LEAST_SHARE * min(widths):
                yield (
                    f"stage {stage.name}: {stage.pinion} at z = {1e3 * pinion.z:g} mm and {stage.wheel} at "
                    f"{1e3 * wheel.z:g} mm share {1e3 * max(high - low, 0.0):.4g} mm of face, of "
                    f"{1e3 * LEAST_SHARE * min(widths):.4g} mm at least: move one of their mid-planes"
                )
            (x1, y1), (x2, y2) = axes[pinion.shaft], axes[wheel.shaft]
            distance = hypot(x2 - x1, y2 - y1)
            if abs(distance - stage.centre_distance) >= _CENTRE_TOLERANCE:
                mm_text = abs(1e-3 * stage.centre_distance - distance) < 0.1 * distance
                yield (
                    f"stage {stage.name}: centre_distance = {1e3 * stage.centre_distance:.3f} mm, but its shafts are "
                    f"{1e3 * distance:.3f} mm apart: "
                    + (f"write centre_distance_mm = {stage.centre_distance:g}" if mm_text else "move a shaft axis")
                )

    states_velocity = False

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest input speed (rad/s)."""
        start, ramp = self.operation.input_speed, self.operation.ramp
        end = start if ramp is None else ramp.end_speed
        return min(start, end), max(start, end)

    @property
    def running_up(self) -> bool:
        """True where the speed changes."""
        return self.operation.ramp is not None

    def idles(self, stage: Stage) -> bool:
        """Return True for a stage that ends in a loose gear."""
        gears = {gear.name: gear for gear in self.gears}
        ends = [end for other in self.stages for end in (other.pinion, other.wheel)]
        return any(gears[end].loose and ends.count(end) == 1 for end in (stage.pinion, stage.wheel) if end in gears)

    @cached_property
    def ramp(self) -> SpeedRamp | None:
        """Change of speed, prescribed or by the torques that accelerate the train; None at constant speed."""
        asked, start = self.operation.ramp, self.operation.input_speed
        if asked is None:
            return None
        inertia = 0.0
        if isinstance(asked, TorqueRamp):
            inertia = input_inertia(self.gearbox_with_gears, self.straight_laws)
        return SpeedRamp(start, asked.end_speed, asked.lasting(start, inertia))

    def _check_fluctuation(self) -> None:
        """Refuse a record shorter than the run, and an input that would turn backwards."""
        if self.operation.fluctuation is None:
            return
        speed, drive = self.operation.input_speed, self.operation.fluctuation.drive
        run = self.ramp or SpeedRamp(speed, speed, 1.0)
        inertia = input_inertia(self.gearbox_with_gears, self.straight_laws)
        _, source = drive.source(self.gearbox, inertia)
        try:
            drive.drive(run.motion, inertia + source, min(run.start_speed, run.end_speed), run.duration)
        except InputError as error:
            raise InputError(f"operation.fluctuation: {error}") from None

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest line (Hz)."""
        return self.band.low, self.band.high

    @property
    def line_count(self) -> float:
        """Estimated number of lines."""
        return (self.band.high - self.band.low) / self.band.resolution

    def extent(self, fidelity: Fidelity, *, driven: bool) -> Extent:
        """Return the size of the housing, whose file is read and checked.

        If `driven`, the gears drive the housing and something must hold it.
        """
        size = self.housing.face_size(acoustics.required_element_size(self.band.high, self.air, fidelity.acoustics))
        extent = self.housing.extent(self, fidelity.housing, driven=driven)
        triangles = ceil(_TRIANGLES_PER_AREA * extent.area / size**2 + _TRIANGLES_PER_BORE * len(self.bearings))
        return replace(extent, triangles=triangles)

    @property
    def states_surface(self) -> bool:
        """True where the radiating surface comes from a file."""
        return self.housing.states_surface

    @property
    def seats(self) -> dict[str, tuple[float, float, float]]:
        """Bearing → centre of its seat (m)."""
        axes = {shaft.name: shaft.axis for shaft in self.shafts}
        return {bearing.name: (*axes.get(bearing.shaft, (0.0, 0.0)), bearing.z) for bearing in self.bearings}

    @cached_property
    def pairs(self) -> tuple[GearPair, ...]:
        """Gear pair of every stage."""
        gears, driven = {gear.name: gear for gear in self.gears}, {stage.wheel for stage in self.stages}

        def pair(stage: Stage) -> GearPair:
            pinion, wheel = gears[stage.pinion], gears[stage.wheel]
            drawn = pinion.idler_body if stage.pinion in driven else pinion.body
            with concerning(stage.name):
                return GearPair(
                    *offset_bodies(drawn, wheel.body, (pinion.z, wheel.z)),
                    stage.drawn_axes[0],
                    sense=self.rotations[pinion.rotor],
                    misalignment=stage.misalignment,
                )

        try:
            return tuple(map(pair, self.stages))
        except InputError as error:
            raise InputError(f"stages: {error}") from None

    @cached_property
    def deviations(self) -> tuple[PairDeviations | None, ...]:
        """Manufacturing deviations of every stage; None for one as drawn."""
        gears, found = {gear.name: gear for gear in self.gears}, []
        driven = {stage.wheel for stage in self.stages}
        for stage in self.stages:
            ends = ((gears[stage.pinion], True), (gears[stage.wheel], False))
            pinion, wheel = (
                gear.mesh_deviations(drives=drives, idles=drives and gear.name in driven) for gear, drives in ends
            )
            tilt = stage.drawn_axes[1]
            perfect = pinion is None and wheel is None and tilt == Misalignment()
            found.append(None if perfect else PairDeviations(pinion, wheel, tilt))
        return tuple(found)

    @property
    def seat_motions(self) -> int:
        """Motions of the bearing seats: 3 translations, or 5 with tilts where a bearing has a model, thus moments."""
        return 3 if all(bearing.model is None for bearing in self.bearings) else 5

    @cached_property
    def gearbox(self) -> Gearbox:
        """Dynamic model of shafts, bearings and meshes, without the inertia of the gears."""
        gears = {gear.name: gear for gear in self.gears}
        meshes = tuple(
            Mesh(gears[s.pinion].rotor, gears[s.wheel].rotor, gears[s.pinion].z - pair.pinion.offset)
            for s, pair in zip(self.stages, self.pairs, strict=True)
        )
        return Gearbox(
            self.shafts,
            tuple(map(_damped, self.bearings)),
            meshes,
            self.input_shaft,
            self.output_shaft,
            self.input_rotation,
            flexible_shafts=self.options.models("flexible_shafts"),
            gyroscopic=self.options.models("gyroscopic"),
            face_points=self.options.face_points,
            loose_gears=tuple(
                LooseGear(item.name, item.shaft, item.rigid_body, item.drag_torque) for item in self.gears if item.loose
            ),
            shaft_bearings=tuple(map(_damped, self.shaft_bearings)),
        )

    @cached_property
    def gearbox_with_gears(self) -> Gearbox:
        """`gearbox` with the mass and inertia of its gears on the shafts."""
        gearbox = self.gearbox
        for item in self.gears:
            if not item.loose:
                gearbox = gearbox.add_bodies(item.shaft, [item.rigid_body])
        return gearbox

    @property
    def undamped(self) -> tuple[str, ...]:
        """Names of the bearings that the case gives no damping, which take `USUAL_DAMPING`."""
        return tuple(bearing.name for bearing in self.supports if not bearing.damped)

    @property
    def load_dependent(self) -> bool:
        """True where the stiffness of a bearing depends on its load."""
        return not all(bearing.linear for bearing in self.supports)

    @property
    def supports(self) -> tuple[Bearing, ...]:
        """Bearings in the housing, then those between shafts."""
        return (*self.bearings, *self.shaft_bearings)

    @property
    def static_torque(self) -> float:
        """Torque at the input (N m) at which bearings are in balance: that of the operation, or of idle gears."""
        return self.operation.input_torque or self.operation.mesh_torque or 0.0

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """Static equilibrium under the case's torque on rigid seats."""
        return balanced(
            self.gearbox_with_gears,
            self.straight_laws,
            None,
            input_torque=self.static_torque,
            fidelity=STANDARD.dynamics,
        )

    @property
    def gearbox_on_rigid_seats(self) -> Gearbox:
        """`gearbox_with_gears`, its bearings with their stiffness at the load on rigid seats."""
        return self.equilibrium.gearbox if self.load_dependent else self.gearbox_with_gears

    @cached_property
    def _turns_per_input_turn(self) -> dict[str, Fraction]:
        """Turns of every shaft that turns, and loose gear, about +z per turn of the input in its own sense, exact."""
        gears = {gear.name: gear for gear in self.gears}
        turns = {self.input_shaft: Fraction(self.input_rotation)}
        for _ in self.stages:
            for stage in self.stages:
                pinion, wheel = gears[stage.pinion], gears[stage.wheel]
                if pinion.rotor in turns:
                    ratio = Fraction(pinion.geometry.teeth, wheel.geometry.teeth)
                    turns[wheel.rotor] = -turns[pinion.rotor] * ratio
        for stage in self.stages:
            swapped = gears[stage.wheel].rotor in turns
            require(
                gears[stage.pinion].rotor in turns,
                f"stage {stage.name}: its pinion {stage.pinion} is not driven by the input: "
                + ("swap pinion and wheel, or input_shaft and output_shaft" if swapped else "add the stage between"),
            )
        return turns

    @property
    def shaft_orders(self) -> dict[str, Fraction]:
        """Turns of every shaft that turns, and loose gear, per turn of the input, exact and positive."""
        return {shaft: abs(turns) for shaft, turns in self._turns_per_input_turn.items()}

    @property
    def rotations(self) -> dict[str, int]:
        """+1 where a shaft or loose gear turns by the right-hand rule about +z, else −1."""
        return {shaft: 1 if turns > 0 else -1 for shaft, turns in self._turns_per_input_turn.items()}

    @property
    def mesh_orders(self) -> dict[str, Fraction]:
        """Meshes of every stage per turn of the input, exact."""
        gears = {gear.name: gear for gear in self.gears}
        pinions = {stage.name: gears[stage.pinion] for stage in self.stages}
        return {name: pinion.geometry.teeth * self.shaft_orders[pinion.rotor] for name, pinion in pinions.items()}

    @property
    def mesh_forces(self) -> tuple[float, ...]:
        """Nominal force (N) of every stage along the flank normal, < 0 on back flanks.

        It follows from the input torque, or from `mesh_torque` for idle gears.
        """
        gears = {gear.name: gear for gear in self.gears}
        turns = [self.shaft_orders[gears[stage.pinion].rotor] for stage in self.stages]
        driving, idle = self.operation.input_torque, self.operation.mesh_torque or 0.0
        torques = [idle if driving == 0.0 or self.idles(stage) else driving for stage in self.stages]
        each = zip(self.pairs, torques, turns, strict=True)
        return tuple(pair.normal_force(torque / float(n)) for pair, torque, n in each)

    @property
    def straight_laws(self) -> tuple[MeshLaw, ...]:
        """Mesh laws with one constant stiffness, for statics that do not depend on the law."""
        reach = np.array([-1e-3, 1e-3])
        stiffness = 2e6 * max(1.0, *map(abs, self.mesh_forces)) * reach[None, :]
        return tuple(tabulated(pair, np.zeros(1), reach, stiffness) for pair in self.pairs)


def _damped(bearing: Support) -> Support:
    """Return the bearing, with `USUAL_DAMPING` where the case gives it no damping at all."""
    return bearing if bearing.damped else replace(bearing, stiffness_damping=USUAL_DAMPING)
