"""Case of a body with a given surface velocity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from nvhchain import acoustics
from nvhchain.case.bodies import Extent, Sphere, SurfaceFile
from nvhchain.case.operation import EngineName, FieldPoint, Quantity, check_case_name, check_plane, check_quantities
from nvhchain.case.sound import BackgroundLevels, RecordedBackground, Target
from nvhchain.conventions import Air
from nvhchain.errors import counted, require
from nvhchain.fidelity import AcousticsFidelity, Fidelity
from nvhchain.handoff import RigidPlane, SurfaceVelocity
from nvhchain.kinds import check_fields
from nvhchain.names import check_names

LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1e-3, 1e5
"""Limits (Hz) of frequencies; values outside are mistakes in the unit."""

FASTEST = 100.0
"""Upper limit (m/s) of velocities; sound is far from linear beyond it."""


@dataclass(frozen=True)
class RadiatorCase:
    """Body with a given surface velocity.

    Parameters
    ----------
    name : str
        Name, also of its folder.
    body : Sphere or SurfaceFile
        Body.
    frequencies : tuple of float
        Lines (Hz), (n_f,).
    field_points : tuple of FieldPoint
        Microphones.
    pulsation : float
        Outward velocity everywhere (m/s, peak).
    velocity : tuple of float
        Velocity of the body as a whole, (3,) (m/s, peak).
    quantities : tuple of str
        `surface_velocity`, `pressure`, `sound_power`, `radiation_efficiency`, `directivity`.
    air : Air
        Air around the body.
    engine : str
        Boundary element engine, `fused` or `bempp`.
    reflecting_plane : RigidPlane, optional
        Rigid plane beside the body; without one the field is free.
    background : RecordedBackground or BackgroundLevels, optional
        Background to listen to beside the body.
    targets : tuple of Target
        Largest levels.
    folder : str
        Folder of the case file.
    """

    name: str
    body: Sphere | SurfaceFile
    frequencies: tuple[float, ...]
    field_points: tuple[FieldPoint, ...] = ()
    pulsation: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quantities: tuple[Quantity, ...] = ("pressure",)
    air: Air = Air()  # noqa: RUF009 (frozen)
    engine: EngineName = "fused"
    reflecting_plane: RigidPlane | None = None
    background: RecordedBackground | BackgroundLevels | None = None
    targets: tuple[Target, ...] = ()
    folder: str = "."

    def __post_init__(self) -> None:
        check_fields(self)
        check_case_name(self.name)
        check_quantities(self.quantities, self.field_points)
        require("bearing_forces" not in self.quantities, f"quantities: {self.name} has no bearings")
        check_plane(self.reflecting_plane, self.field_points)
        check_names([target.name for target in self.targets], "targets")
        if self.reflecting_plane is not None:
            self.body.check_above(self.reflecting_plane)
        self.body.check_outside(self.field_points)
        f = self.frequencies
        require(
            len(f) > 0 and f[0] > 0 and all(a < b for a, b in pairwise(f)),
            f"frequencies = {f} Hz must be positive and increasing",
        )
        require(
            f[0] >= LOWEST_FREQUENCY and f[-1] <= HIGHEST_FREQUENCY,
            f"frequencies = {f[0]:g}…{f[-1]:g} Hz are outside {LOWEST_FREQUENCY:g}…{HIGHEST_FREQUENCY:g} Hz: give them "
            "in Hz",
        )
        for name, value in (("pulsation", self.pulsation), *(("velocity", component) for component in self.velocity)):
            require(
                abs(value) <= FASTEST,
                f"{name} = {value:g} m/s is beyond ±{FASTEST:g} m/s, of large amplitude: lower it",
            )

    def __repr__(self) -> str:
        low, high = self.frequencies[0], self.frequencies[-1]
        lines = f"{counted(len(self.frequencies), 'line')} at {low:.4g}…{high:.4g} Hz"
        return f"RadiatorCase({self.name}: {type(self.body).__name__}; {lines}; {', '.join(self.quantities)})"

    running_up = False
    states_velocity = True
    assumptions: ClassVar[tuple[str, ...]] = ()
    mesh_orders: ClassVar[Mapping[str, Fraction]] = MappingProxyType({})
    speeds: ClassVar[None] = None

    @property
    def moves(self) -> bool:
        """True where the case gives the body a motion; else a run takes a supplied surface velocity."""
        return self.pulsation != 0 or any(self.velocity)

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest line (Hz)."""
        return self.frequencies[0], self.frequencies[-1]

    @property
    def line_count(self) -> float:
        """Number of lines."""
        return len(self.frequencies)

    @property
    def states_surface(self) -> bool:
        """True where the radiating surface comes from a file."""
        return self.body.states_surface

    def extent(self, fidelity: Fidelity, *, driven: bool) -> Extent:
        """Return the size of the body; a surface file is read for it."""
        return self.body.extent(Path(self.folder), self._edge(fidelity.acoustics))

    def surface_velocity(self, knobs: AcousticsFidelity) -> SurfaceVelocity:
        """Return the outward normal velocity, pulsation + velocity · n, on every face at every frequency."""
        surface = self.body.solved(Path(self.folder), self._edge(knobs))
        normal = self.pulsation + surface.normals @ np.array(self.velocity)
        lines = np.tile(normal.astype(complex), (len(self.frequencies), 1))
        return SurfaceVelocity(np.array(self.frequencies), lines, surface)

    def _edge(self, knobs: AcousticsFidelity) -> float:
        return acoustics.required_element_size(self.frequencies[-1], self.air, knobs)
