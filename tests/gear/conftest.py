"""Gear pairs of the two-stage gearbox and a closed-form compliance that stands in for the finite elements."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.fidelity import DRAFT, GearFidelity
from nvhchain.gear.compliance.flank_compliance import FlankCompliance
from nvhchain.gear.drawing.blank import SOLID, Slots
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.drawing.pair import GearPair


def gearbox_geometry(teeth: int, *, stage: int, hand: int, **changes: float) -> GearGeometry:
    """Gear of stage 1 (m_n 2.7, b 22) or 2 (m_n 2.68, b 40) with β = 10°."""
    module, width = ((2.7e-3, 22e-3), (2.68e-3, 40e-3))[stage - 1]
    data = {
        "teeth": teeth,
        "normal_module": module,
        "normal_pressure_angle": np.radians(20.0),
        "helix_angle": hand * np.radians(10.0),
        "face_width": width,
        "bore_radius": 0.35 * teeth * module / 2,
    }
    return GearGeometry(**(data | changes))


def body(geometry: GearGeometry, symmetry: int = 0) -> GearBody:
    """A solid gear, or one with `symmetry` slots."""
    if not symmetry:
        return GearBody(geometry, SOLID)
    inner, outer = geometry.bore_radius, geometry.root_radius
    slots = Slots(symmetry, inner + 0.2 * (outer - inner), inner + 0.6 * (outer - inner), np.pi / symmetry)
    return GearBody(geometry, slots)


def stage_pair(
    stage: int, *, symmetries: tuple[int, int] = (0, 0), mirrored: bool = False, sense: int = 1, **changes: float
) -> GearPair:
    """Pinion (right-handed unless mirrored) and wheel of a gearbox stage; `changes` go to both geometries."""
    hands = (-1, 1) if mirrored else (1, -1)
    teeth = ((20, 50), (30, 82))[stage - 1]
    pinion, wheel = (gearbox_geometry(z, stage=stage, hand=h, **changes) for z, h in zip(teeth, hands, strict=True))
    distance = pinion.pitch_radius + wheel.pitch_radius
    return GearPair(body(pinion, symmetries[0]), body(wheel, symmetries[1]), distance, sense)


def beam_compliance(
    gear: GearBody, *, body_share: float = 0.5, modulation: float = 0.0, reach: int = 3
) -> FlankCompliance:
    """Teeth as short cantilevers on a body whose softness spreads over neighbours and, if modulated, over the sector.

    A product of positive kernels, hence symmetric and positive: bending and shear of a beam over the radius,
    exponential decay over the axis and from tooth to tooth. The size is that of real steel teeth (some 0.1 mm µm/N).
    """
    g: GearGeometry = gear.geometry
    radius = np.linspace(g.form_radius, g.tip_circle_radius, 9)
    axial = np.linspace(-g.face_width / 2, g.face_width / 2, 9)
    sector = gear.sector
    y = (radius - g.root_radius) / g.normal_module
    low, high = np.minimum.outer(y, y), np.maximum.outer(y, y)
    thickness = 1.9
    unit = 1 / (STEEL.young * g.face_width)
    beam = unit * (low**2 * (3 * high - low) * 2 / thickness**3 + 3.1 * low / thickness)
    decay = np.exp(-np.abs(np.subtract.outer(axial, axial)) / (2 * g.normal_module))
    decay *= len(axial) / decay.mean(axis=1).sum()
    foundation = unit * body_share * 4.0
    spread = np.exp(-np.abs(np.subtract.outer(axial, axial)) / (4 * g.normal_module))
    teeth = np.arange(sector)
    softness = np.sqrt(1 + modulation * np.cos(2 * np.pi * teeth / sector))
    n_p, n_w = len(radius), len(axial)
    blocks = np.zeros((sector, reach + 1, 2, n_p, n_w, 2, n_p, n_w))
    for t in teeth:
        for d in range(reach + 1):
            kernel = foundation * softness[t] * softness[(t + d) % sector] * 0.35**d * spread
            part = np.broadcast_to(kernel[None, :, None, :], (n_p, n_w, n_p, n_w))
            for flank in range(2):
                for other in range(2):
                    blocks[t, d, flank, :, :, other] = part if flank == other else -0.5 * part
            if d == 0:
                tooth = beam[:, None, :, None] * decay[None, :, None, :]
                for flank in range(2):
                    blocks[t, d, flank, :, :, flank] += tooth
                    blocks[t, d, flank, :, :, 1 - flank] -= 0.8 * tooth
    # friction towards the tip has tan α_r of the circumferential force that the normal one has
    share = np.repeat(g.roll_angle_at(radius), n_w)
    n = n_p * n_w
    friction = np.empty((sector, 2 * reach + 1, 2, n, n))
    for t in teeth:
        for d in range(-reach, reach + 1):
            for flank in range(2):
                near = blocks[t, d] if d >= 0 else np.moveaxis(blocks[(t + d) % sector, -d], (3, 4, 5), (0, 1, 2))
                friction[t, reach + d, flank] = near[flank, :, :, flank].reshape(n, n) * share
    return FlankCompliance(radius, axial, g.teeth, sector, blocks, friction=friction)


@pytest.fixture(scope="session")
def make_pair() -> Callable[..., GearPair]:
    return stage_pair


@pytest.fixture(scope="session")
def make_compliances() -> Callable[..., tuple[FlankCompliance, FlankCompliance]]:
    def make(pair: GearPair, *, modulation: float = 0.0) -> tuple[FlankCompliance, FlankCompliance]:
        return beam_compliance(pair.pinion), beam_compliance(pair.wheel, modulation=modulation)

    return make


@pytest.fixture(scope="session")
def sliced_fidelity() -> Callable[[int], GearFidelity]:
    """Contact on the path alone; tip edges beyond it have tests of their own."""
    return lambda slices: dataclasses.replace(DRAFT.gear, slices=slices, corner_gap=0.0)


@pytest.fixture(scope="session")
def make_body() -> Callable[..., GearBody]:
    return body


@pytest.fixture(scope="session")
def make_geometry() -> Callable[..., GearGeometry]:
    return gearbox_geometry


def add_own_part(compliance: FlankCompliance) -> FlankCompliance:
    """The same with a tenth of a tooth's own compliance in its part for finer layers, and as much added."""
    n = len(compliance.radius) * len(compliance.axial)
    own = np.stack([0.1 * compliance.blocks[0, 0, f, :, :, f].reshape(n, n) for f in (0, 1)])
    blocks = compliance.blocks.copy()
    for f in (0, 1):
        blocks[:, 0, f, :, :, f] += own[f].reshape(blocks[0, 0, f, :, :, f].shape)
    return dataclasses.replace(compliance, blocks=blocks, tooth_axial=compliance.axial, own=own)
