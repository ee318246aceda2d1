"""Mesh laws on a closed-form compliance: shape over deflection and angle, symmetry, convergence."""

import dataclasses
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, STANDARD
from nvhchain.gear import Flank, MicroGeometry
from nvhchain.gear.compliance.flank_compliance import FlankCompliance
from nvhchain.gear.contact import engagement as engagement_module
from nvhchain.gear.contact.engagement import Engagement, engaged_reach
from nvhchain.gear.contact.local_law import half_space_compliance, held_excess
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.gear.laws.mesh_law import deflection_grid, law_load, mesh_law
from nvhchain.runtime.threads import granted
from tests.gear.conftest import add_own_part, stage_pair
from tests.gear.weber_banaschek import local_deflection

TORQUE = 250.0
COARSE = dataclasses.replace(DRAFT.gear, angles_per_mesh=16)


def sliced(slices):
    """Contact on the path alone."""
    return dataclasses.replace(COARSE, slices=slices, corner_gap=0.0)


@pytest.fixture(scope="module")
def slotted(make_pair, make_compliances):
    pair = make_pair(1, symmetries=(0, 5), thickness_allowance=40e-6)
    return pair, make_compliances(pair, modulation=0.3)


@pytest.fixture(scope="module")
def slotted_law(slotted):
    pair, compliances = slotted
    force = pair.normal_force(TORQUE)
    return mesh_law(pair, nominal_force=force, fidelity=COARSE, compliances=compliances)


def test_law_covers_the_body_period_and_the_asked_range(slotted, slotted_law):
    pair, _ = slotted
    law = slotted_law
    assert law.force.shape == (10 * COARSE.angles_per_mesh, COARSE.deflections)
    assert law.period == pytest.approx(10 * 2 * np.pi / 50)
    nominal = pair.normal_force(TORQUE)
    assert law.force[:, -1].min() >= COARSE.drive_reach * nominal
    assert law.force[:, 0].max() < -1.3 * nominal


def test_force_is_zero_exactly_in_the_gap_and_strictly_monotone_outside(slotted, slotted_law):
    pair, _ = slotted
    law = slotted_law
    gap = (law.deflection >= -pair.backlash) & (law.deflection <= 0)
    assert law.deflection[gap] == pytest.approx([-pair.backlash, 0.0])
    assert not law.force[:, gap].any()
    rise = np.diff(law.force, axis=1)
    between = gap[:-1] & gap[1:]
    assert (rise[:, ~between] > 0).all()


@pytest.mark.parametrize("own", [False, True])
def test_every_mesh_period_loads_its_own_teeth(slotted, own):
    """The law takes lines and what teeth share from the first mesh period; here they are made at the angle itself."""
    pair, compliances = slotted
    if own:
        compliances = tuple(add_own_part(c) for c in compliances)
    law = mesh_law(pair, nominal_force=pair.normal_force(TORQUE), fidelity=COARSE, compliances=compliances)
    for at in (3, 16 * 4 + 3, 16 * 9 + 11):
        for flank, sign, approach in ((DRIVE, 1.0, law.deflection), (BACK, -1.0, -law.deflection)):
            engagement = Engagement(pair, compliances, COARSE)
            lines = engagement.lines(law.angle[at], flank)
            approach = approach - (flank == BACK) * pair.backlash
            force = engagement.forces_on(lines, approach[:, None] - engagement.gap(lines)).sum(axis=1)
            np.testing.assert_allclose(law.force[at, force > 0], sign * force[force > 0], rtol=1e-9)


def test_law_starts_with_a_soft_contact_and_stiffens(slotted_law):
    """Weber–Banaschek: the local stiffness grows with load."""
    slope = np.diff(slotted_law.force, axis=1) / np.diff(slotted_law.deflection)
    drive = slotted_law.deflection[:-1] >= 0
    assert (np.diff(slope[:, drive], axis=1) > 0).all()


def test_a_modulated_body_shows_at_its_own_period_and_a_plain_one_does_not(slotted, slotted_law):
    lines = np.abs(np.fft.rfft(slotted_law.force[:, -1])) / len(slotted_law.angle)
    mesh = np.arange(len(lines)) % 10 == 0
    assert lines[1] > 0.01 * lines[0]
    pair, (pinion, wheel) = slotted
    plain = FlankCompliance(
        wheel.radius, wheel.axial, 50, 10, np.repeat(wheel.blocks[:1] * 0 + wheel.blocks.mean(0), 10, 0)
    )
    law = mesh_law(pair, nominal_force=pair.normal_force(TORQUE), fidelity=COARSE, compliances=(pinion, plain))
    lines = np.abs(np.fft.rfft(law.force[:, -1])) / len(law.angle)
    assert lines[~mesh].max() < 1e-9 * lines[0]


def test_back_flank_is_the_mirror_image_of_the_drive_flank(make_pair, make_compliances):
    """Gears of mirrored hand running the other way are the same drawing seen in a mirror."""
    pair = make_pair(1, thickness_allowance=40e-6)
    engagement = Engagement(pair, make_compliances(pair), sliced(8))
    approach = np.array([5e-6, 20e-6])
    # θ at which back flank pair −1 touches at the pitch point at mid-width (wheel tooth 0 follows by one thickness)
    wheel = pair.wheel.geometry
    radius = pair.base_radius[1] / np.cos(pair.working_pressure_angle)
    mirror = -2 * float(wheel.half_tooth_angle(radius))
    for angle in np.linspace(0, 1, 5) * pair.mesh_period:
        drive = engagement.forces(angle, approach)[1].sum(axis=1)
        back = engagement.forces(mirror - angle, approach, flank=BACK)[1].sum(axis=1)
        np.testing.assert_allclose(back, drive, rtol=1e-8)


@pytest.mark.parametrize("modulation", [0.0, 0.3])
def test_pair_running_the_other_way_with_mirrored_hand_has_the_same_law(make_pair, make_compliances, modulation):
    """Reflection of the whole drawing at a plane through both shafts; the blanks of the case are symmetric to it."""
    symmetries = (0, 5)
    one = make_pair(1, symmetries=symmetries, thickness_allowance=40e-6)
    other = dataclasses.replace(make_pair(1, symmetries=symmetries, thickness_allowance=40e-6, mirrored=True), sense=-1)
    compliances = make_compliances(one, modulation=modulation)
    deflection = np.array([-100e-6, 15e-6])
    a, b = (Engagement(pair, compliances, sliced(8)) for pair in (one, other))
    for angle in np.linspace(-2, 5, 6) * one.mesh_period:
        np.testing.assert_allclose(a.mesh_force(angle, deflection), b.mesh_force(angle, deflection), rtol=1e-9)


def test_phases_kept_are_bounded_and_stay_in_their_process(slotted, monkeypatch):
    monkeypatch.setattr(engagement_module, "_KEPT", 3)
    monkeypatch.setattr(engagement_module, "_KEPT_BYTES", 1.0)
    engagement = Engagement(*slotted, sliced(8))
    for angle in np.linspace(0.0, 0.1, 5):
        engagement.mesh_force(angle, np.array([20e-6]))
    assert len(engagement._phases) == 3
    assert len(engagement._common_compliances) == 1
    assert not {"_phases", "_common_compliances"} & set(pickle.loads(pickle.dumps(engagement)).__dict__)


def test_neighbouring_teeth_are_coupled(slotted):
    """Freed of the coupling between teeth, the same deflection carries more."""
    pair, compliances = slotted
    alone = tuple(
        dataclasses.replace(c, blocks=np.concatenate([c.blocks[:, :1], 0 * c.blocks[:, 1:]], axis=1))
        for c in compliances
    )
    coupled, free = (Engagement(pair, c, sliced(8)).mesh_force(0.0, np.array([20e-6]))[0] for c in (compliances, alone))
    assert 1.02 < free / coupled < 1.5


def test_rigid_bodies_leave_weber_banaschek_and_the_held_tooth_alone(make_pair, make_compliances):
    """With C = 0 every slice stands alone and obeys the closed form, here away from the tips."""
    pair = make_pair(2)
    rigid = tuple(dataclasses.replace(c, blocks=0 * c.blocks) for c in make_compliances(pair))
    lines, forces = Engagement(pair, rigid, sliced(10)).forces(0.3 * pair.mesh_period, np.array([4e-6]))
    materials = (pair.pinion.material, pair.wheel.material)
    q = forces[0] / lines.length
    local = local_deflection(q, lines.curvature, tuple(lines.depth), materials)
    local += q * sum(half_space_compliance(m) * held_excess(m.poisson) for m in materials)
    inside = (lines.edges.distance > 0.8 * lines.depth).all(axis=0)
    assert inside.sum() > 5
    np.testing.assert_allclose(local[inside], 4e-6, rtol=2e-3)
    np.testing.assert_array_less(local[~inside], 4e-6)


def test_separation_of_the_flanks_delays_contact(slotted):
    pair, compliances = slotted
    engagement = Engagement(pair, compliances, sliced(8))
    lines, _ = engagement.forces(0.0, np.array([10e-6]))
    gap = np.full(len(lines.length), 4e-6)
    shifted = engagement.forces(0.0, np.array([4e-6, 14e-6]), separation=gap)[1].sum(axis=1)
    plain = engagement.forces(0.0, np.array([10e-6]))[1].sum(axis=1)
    np.testing.assert_allclose(shifted, [0.0, plain[0]], rtol=1e-9)


def test_more_slices_move_the_force_by_less_than_one_percent(slotted):
    pair, compliances = slotted
    angles = np.linspace(0, pair.mesh_period, 7)
    force = {
        n: np.array([Engagement(pair, compliances, sliced(n)).mesh_force(a, np.array([20e-6]))[0] for a in angles])
        for n in (STANDARD.gear.slices, 4 * STANDARD.gear.slices)
    }
    coarse, fine = force.values()
    assert np.abs(coarse - fine).max() < 1e-2 * fine.min()


def test_executor_threads_and_progress_give_the_same_law(slotted, slotted_law):
    pair, compliances = slotted
    seen = []
    with granted(1):
        alone = mesh_law(pair, nominal_force=pair.normal_force(TORQUE), fidelity=COARSE, compliances=compliances)
    assert alone.content_hash == slotted_law.content_hash
    with ThreadPoolExecutor(2) as executor:
        law = mesh_law(
            pair,
            nominal_force=pair.normal_force(TORQUE),
            fidelity=COARSE,
            compliances=compliances,
            executor=executor,
            progress=lambda done, total: seen.append((done, total)),
        )
    assert law.content_hash == slotted_law.content_hash
    assert seen == [(done, 10) for done in range(1, 11)]


@pytest.mark.parametrize("load", [300.0, 512.0, 9000.0])
def test_deflections_are_powers_of_two_and_steps_between_them_whatever_the_load(slotted, load):
    """3 doublings on the drive flank, 2 on the back flank, where steps are twice as far apart; even ones below them."""
    pair, compliances = slotted
    engagement = Engagement(pair, compliances, STANDARD.gear)
    grid = deflection_grid(engagement, load, np.array([0.0]))
    assert STANDARD.gear.law_steps == ((4, 3), (2, 2))
    assert len(grid) == STANDARD.gear.deflections == 16 + 6 + 2
    for steps, per_doubling in ((grid[8:], 4), ((-pair.backlash - grid[:6])[::-1], 2)):
        np.testing.assert_allclose(np.diff(steps[:per_doubling], prepend=0.0), steps[0], rtol=1e-9)
        number = np.log2(1e6 * steps[per_doubling - 1 :]) * per_doubling
        np.testing.assert_allclose(number, np.round(number), atol=1e-6)
        np.testing.assert_allclose(np.diff(number), 1.0, atol=1e-6)
    assert grid[6] == -pair.backlash
    assert grid[7] == 0.0


def test_loads_up_to_a_power_of_two_share_a_law():
    assert [law_load(force) for force in (0.3, 1.0, -1.01, 8192.0, 8193.0)] == [0.5, 1.0, 2.0, 8192.0, 16384.0]


def test_every_angle_carries_the_asked_force_at_the_end_of_the_grid(make_body, make_geometry, make_compliances):
    """24 mesh periods in a body period: one in 24 angles is the same phase of the mesh each time."""
    changes = {"stage": 1, "helix_angle": 0.0, "thickness_allowance": 40e-6}
    pinion, wheel = make_body(make_geometry(24, hand=1, **changes)), make_body(make_geometry(48, hand=-1, **changes), 2)
    pair = GearPair(pinion, wheel, pinion.geometry.pitch_radius + wheel.geometry.pitch_radius)
    assert pair.meshes_per_body_period == 24
    fidelity = dataclasses.replace(COARSE, slices=1, angles_per_mesh=24)
    engagement = Engagement(pair, make_compliances(pair, modulation=0.2), fidelity)
    nominal = pair.normal_force(TORQUE)
    angle = np.arange(24 * 24) * (pair.mesh_period / 24)
    grid = deflection_grid(engagement, nominal, angle)
    carried = np.array([engagement.mesh_force(a, grid[[0, 1, -2, -1]]) for a in angle])
    assert carried[:, 2].min() < fidelity.drive_reach * nominal <= carried[:, 3].min()
    assert (-carried[:, 1]).min() < fidelity.back_reach * nominal <= (-carried[:, 0]).min()


def test_a_crowned_back_flank_carries_the_load_of_coasting():
    """40 µm of crowning on the coast flanks are softer than the drive flanks, whose reach left it 40 % short."""
    knobs = dataclasses.replace(DRAFT.gear, slices=8, angles_per_mesh=12, deflections_per_doubling=3, bodies="analytic")
    plain = stage_pair(1, thickness_allowance=80e-6)
    flank = Flank(lead_crowning=40e-6)
    pinion = dataclasses.replace(plain.pinion.geometry, micro=MicroGeometry(coast=flank))
    crowned = dataclasses.replace(plain, pinion=dataclasses.replace(plain.pinion, geometry=pinion))
    before, law = (mesh_law(pair, nominal_force=3000.0, fidelity=knobs) for pair in (plain, crowned))
    assert -law.force[:, 0].max() > knobs.back_reach * 3000.0
    assert law.deflection[-1] == before.deflection[-1]
    assert before.deflection[0] > 1.5 * law.deflection[0]


def test_without_backlash_the_grid_has_no_double_point(make_pair, make_compliances):
    pair = make_pair(1)
    law = mesh_law(pair, nominal_force=pair.normal_force(TORQUE), fidelity=COARSE, compliances=make_compliances(pair))
    assert np.diff(law.deflection).min() > 1e-7


def test_compliance_that_does_not_fit_the_pair_is_refused(slotted, make_pair, make_compliances):
    pair, compliances = slotted
    with pytest.raises(InputError, match="compute it for this gear"):
        Engagement(pair, compliances[::-1], sliced(6))
    short = tuple(dataclasses.replace(c, blocks=c.blocks[:, :1]) for c in compliances)
    with pytest.raises(InputError, match="reach"):
        Engagement(pair, short, sliced(6))
    assert engaged_reach(pair) == 2
    assert engaged_reach(make_pair(2)) == 2
