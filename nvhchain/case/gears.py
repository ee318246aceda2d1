"""Gears of a case, and the stages in which they mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from nvhchain.case.blank_mesh import Mesh as BlankMesh
from nvhchain.case.deviations import Deviations, StageTolerances
from nvhchain.conventions import STEEL, Material
from nvhchain.dimensions import Length
from nvhchain.dynamics import RigidBody
from nvhchain.errors import InputError, Mistakes, concerning, mistakes, require, require_within
from nvhchain.gear import (
    Differential,
    GearBody,
    GearDeviations,
    GearGeometry,
    Holes,
    MicroGeometry,
    Misalignment,
    Slots,
    Solid,
    ThinRim,
    mass_properties,
    set_backlash,
    sizes,
)
from nvhchain.names import check_name


@dataclass(frozen=True)
class Gear:
    """Gear on its shaft.

    Parameters
    ----------
    name : str
        Name.
    shaft : str
        Name of its shaft.
    z : float
        Mid-plane of its face width in the gearbox frame (m).
    geometry : GearGeometry
        Teeth.
    blank : Solid, ThinRim, Holes, Slots, Differential or Mesh
        Body below the teeth, or a mesh of the whole gear, whose teeth must be those of the geometry.
    material : Material
        Material.
    loose : bool
        True for a gear that turns freely on its shaft, such as the idle gear of a shifted gearbox.
    drag_torque : float
        Friction of a loose gear against its motion relative to the shaft (N m).
    deviations : Deviations, optional
        Manufacturing deviations of its teeth; as drawn by default.
    """

    name: str
    shaft: str
    z: Length
    geometry: GearGeometry
    blank: Solid | ThinRim | Holes | Slots | Differential | BlankMesh = field(default_factory=Solid)
    material: Material = STEEL
    loose: bool = False
    drag_torque: float = 0.0
    deviations: Deviations | None = None

    def __post_init__(self) -> None:
        check_name(self.name, "gear: name")
        require_within(f"gear {self.name}: drag_torque", self.drag_torque, 0, 1e5, "N m")
        require(
            self.loose or self.drag_torque == 0.0,
            f"gear {self.name}: drag_torque = {self.drag_torque:g} N m belongs to a gear with loose = true; that of a "
            "shaft is the shaft's drag_torque",
        )
        _ = self.body
        if self.deviations is not None:
            try:
                self.deviations.gear_deviations(self.geometry, drives=True)
            except InputError as error:
                raise InputError(f"gear {self.name}: deviations: {error}") from None

    @property
    def rotor(self) -> str:
        """Name of the rotating part: the shaft, or the gear itself where it is loose."""
        return self.name if self.loose else self.shaft

    @property
    def drawing_line(self) -> str:
        """Sizes of the teeth by which the gear is compared with its drawing, in words."""
        teeth, found = self.geometry, sizes(self.geometry)
        words = [
            f"gear {self.name}: x = {found.profile_shift:.5f}, s_n = {1e3 * found.normal_thickness:.4f} mm, d_a = "
            f"{2e3 * teeth.tip_circle_radius:.4f} mm, d_Ff = {2e3 * teeth.form_radius:.4f} mm"
            + (f" ({1e3 * teeth.undercut * teeth.normal_module:.3g} mm of undercut)" if teeth.undercut > 0 else "")
        ]
        if found.base_tangent_length is not None:
            words.append(f"W_{found.span_teeth} = {1e3 * found.base_tangent_length:.4f} mm")
        if found.dimension_over_balls is not None and found.dimension_over_pins is not None:
            ball, pins = f"{1e3 * (found.ball_diameter or 0.0):g} mm", found.dimension_over_pins
            same = abs(pins - found.dimension_over_balls) < 1e-9
            gauge = "balls or pins" if same else "balls"
            words.append(f"M_d = {1e3 * found.dimension_over_balls:.4f} mm over {gauge} of {ball}")
            words += [] if same else [f"{1e3 * pins:.4f} mm over pins"]
        return "; ".join(words)

    @cached_property
    def rigid_body(self) -> RigidBody:
        """Mass and inertia of the gear."""
        own = mass_properties(self.body)
        return RigidBody(self.z + own.centre, own.mass, own.polar_inertia, own.transverse_inertia)

    @cached_property
    def body(self) -> GearBody:
        """Gear body for the contact problem."""
        blank = self.blank.read() if isinstance(self.blank, BlankMesh) else self.blank
        return GearBody(self.geometry, blank, self.material)

    def mesh_deviations(self, *, drives: bool, idles: bool) -> GearDeviations | None:
        """Return the deviations in a mesh; where an idler drives, those of its coast flanks carry."""
        if self.deviations is None:
            return None
        found = self.deviations.gear_deviations(self.geometry, drives=drives and not idles)
        return replace(found, drive=found.coast, coast=found.drive) if idles else found

    @property
    def idler_body(self) -> GearBody:
        """Gear body where the gear drives another: an idler does so with its coast flanks."""
        micro = self.geometry.micro
        if micro.drive == micro.coast:
            return self.body
        turned = replace(self.geometry, micro=MicroGeometry(micro.coast, micro.drive))
        return replace(self.body, geometry=turned)


@dataclass(frozen=True)
class Stage:
    """Two gears in mesh.

    Parameters
    ----------
    name : str
        Name.
    pinion, wheel : str
        Names of the gears; the pinion drives.
    centre_distance : float
        Centre distance (m).
    misalignment : Misalignment
        Angles between the axes in the mesh (rad); the axes are parallel in the dynamics.
    tolerances : StageTolerances, optional
        Tolerances of the axes, within which centre distance and misalignment of the mesh are drawn.
    normal_backlash : float, optional
        Backlash along the line of action (m); gives the tooth thickness of gears that state none.
    circumferential_backlash : float, optional
        Backlash on the working pitch circles (m), instead of the normal one.
    """

    name: str
    pinion: str
    wheel: str
    centre_distance: Length
    misalignment: Misalignment = Misalignment()  # noqa: RUF009 (frozen)
    tolerances: StageTolerances | None = None
    normal_backlash: Length | None = None
    circumferential_backlash: Length | None = None

    def __post_init__(self) -> None:
        check_name(self.name, "stage: name")
        require(
            self.normal_backlash is None or self.circumferential_backlash is None,
            f"stage {self.name}: normal_backlash = {self.normal_backlash} m and circumferential_backlash = "
            f"{self.circumferential_backlash} m: give one of them",
        )

    @property
    def drawn_axes(self) -> tuple[float, Misalignment]:
        """Centre distance of the mesh (m) and angles of the axes beyond `misalignment`, within the tolerances."""
        if self.tolerances is None:
            return self.centre_distance, Misalignment()
        return self.tolerances.drawn(self.centre_distance)


def set_backlashes(gears: Sequence[Gear], stages: Sequence[Stage]) -> tuple[Gear, ...]:
    """Return the gears with the tooth thickness that the backlash of their stages gives.

    Raises Mistakes with all contradictions at once.
    """
    found, wrong = {gear.name: gear for gear in gears}, []
    for stage in stages:
        if stage.normal_backlash is None and stage.circumferential_backlash is None:
            continue
        pair = [found[stage.pinion], found[stage.wheel]]
        try:
            with concerning(stage.name):
                shapes = set_backlash(
                    pair[0].geometry,
                    pair[1].geometry,
                    stage.centre_distance,
                    normal=stage.normal_backlash,
                    circumferential=stage.circumferential_backlash,
                )
            for gear, shape in zip(pair, shapes, strict=True):
                found[gear.name] = gear if shape is gear.geometry else replace(gear, geometry=shape)
        except InputError as error:
            wrong += [f"stage {stage.name}: {text}" for text in mistakes(error)]
    if wrong:
        raise Mistakes(wrong)
    return tuple(found.values())
