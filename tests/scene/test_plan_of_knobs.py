"""The plan takes more where a knob makes more work, in the proportion in which that work is counted here."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics.fused import mesh as fused_mesh
from nvhchain.fem.triangles import equal_pieces
from nvhchain.gear.contact.engagement import slice_count
from nvhchain.gear.elements.gear_mesh import gear_mesh
from nvhchain.scene.planned import BASE_MEGABYTES
from nvhchain.scene.radiation import close_points


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")


def planned(case, name, stage="", **knobs):
    """Stage of the plan at draft with these knobs of a stage of the chain."""
    fidelity = replace(nvh.DRAFT, **{stage: replace(getattr(nvh.DRAFT, stage), **knobs)}) if stage else nvh.DRAFT
    return next(one for one in nvh.plan(case, fidelity=fidelity).steps if one.name.startswith(name))


def rise(case, name, stage, **knobs):
    """Seconds of a stage that these knobs add."""
    return planned(case, name, stage, **knobs).seconds - planned(case, name).seconds


@pytest.mark.parametrize("knobs", [{"singular_order": 8}, {"close_orders": (12, 8)}, {"close_distances": (3.0, 6.0)}])
def test_a_plan_takes_longer_by_the_points_of_close_triangles(case, knobs):
    stage, finer = planned(case, "transfer"), replace(nvh.DRAFT.acoustics, **knobs)
    faces = int(stage.counts["triangles"])
    more = close_points(faces, finer, needles=True) - close_points(faces, nvh.DRAFT.acoustics, needles=True)
    added = rise(case, "transfer", "acoustics", **knobs)
    assert added / (faces * more * stage.counts["masters"]) == pytest.approx(3.6e-9, rel=1e-6)


def of_wheel(case, count, **knobs):
    """`count` of the wheel's mesh with these knobs, over that at draft."""
    wheel = case.pairs[0].wheel
    turned, base = (count(gear_mesh(wheel, f)) for f in (replace(nvh.DRAFT.gear, **knobs), nvh.DRAFT.gear))
    return turned / base


def entries(mesh):
    """Of a tooth's stiffness between the nodes that it shares."""
    lines = (mesh.pitch.left[:-1], mesh.pitch.right[:-1], mesh.pitch.bottom)
    return sum(len(mesh.pitch_solid.stacked(line)) for line in lines) ** 2


def bricks(mesh):
    return len(mesh.blank_solid.elements)


def planned_of_bodies(case, **knobs):
    """Seconds and megabytes of the gears' finite elements, over those at draft."""
    contact = planned(case, "mesh law", "gear", bodies="analytic").seconds  # the contact problems, which stay
    base, turned = planned(case, "mesh law"), planned(case, "mesh law", "gear", **knobs)
    seconds = (turned.seconds - contact) / (base.seconds - contact)
    return seconds, (turned.megabytes - BASE_MEGABYTES) / (base.megabytes - BASE_MEGABYTES)


def test_gears_take_seconds_and_memory_by_the_entries_between_the_nodes_that_teeth_share(case):
    """Teeth and blanks of 6, 12 and 24 layers."""
    wheel, layers = case.pairs[0].wheel, (6, 12, 24)
    counted = np.diff([entries(gear_mesh(wheel, replace(nvh.DRAFT.gear, width_layers=count))) for count in layers])
    steps = [planned(case, "mesh law", "gear", width_layers=count, layer_thickness=100.0) for count in layers]
    for found in ([step.seconds for step in steps], [step.megabytes for step in steps]):
        less, more = np.diff(found)
        assert more / less == pytest.approx(counted[1] / counted[0], rel=0.3)


def test_layers_of_teeth_take_seconds_and_memory(case):
    """Twice as many layers of a tooth take 2.8 times as long, of a blank four times."""
    few, twice, four = (
        planned(case, "mesh law", "gear", width_layers=3, layer_thickness=6.0 / count) for count in (12, 24, 48)
    )
    assert (four.seconds - twice.seconds) / (twice.seconds - few.seconds) == pytest.approx(2**1.5)
    assert few.megabytes < twice.megabytes < four.megabytes


def test_gears_of_finer_transverse_mesh_take_seconds_by_the_bricks_of_the_blank_and_less_memory(case):
    low, high = (of_wheel(case, count, transverse_refinement=2) for count in (entries, bricks))
    seconds, megabytes = planned_of_bodies(case, transverse_refinement=2)
    assert seconds == pytest.approx(high, rel=0.2)
    assert 1.1 * low < megabytes < high


def test_contact_problems_take_seconds_by_angles_and_by_the_pairs_of_slices(case):
    assert rise(case, "mesh law", "gear", angles_per_mesh=12 * 64) == pytest.approx(
        11 * rise(case, "mesh law", "gear", angles_per_mesh=2 * 64), rel=0.02
    )
    assert slice_count(case.pairs[0], nvh.DRAFT.gear) == nvh.DRAFT.gear.slices
    assert rise(case, "mesh law", "gear", slices=3 * 32) == pytest.approx(
        8 / 3 * rise(case, "mesh law", "gear", slices=2 * 32), rel=0.02
    )
    assert 0.77 / 1.5 < rise(case, "mesh law", "gear", slices=96) < 0.77 * 1.5  # s measured
    count = [replace(nvh.DRAFT.gear, deflections_per_doubling=each).deflections for each in (3, 8, 16)]
    assert rise(case, "mesh law", "gear", deflections_per_doubling=16) == pytest.approx(
        (count[2] - count[0]) / (count[1] - count[0]) * rise(case, "mesh law", "gear", deflections_per_doubling=8)
    )


def test_a_housing_takes_seconds_by_the_pieces_that_its_skin_is_cut_into(case):
    pieces = {count: len(equal_pieces(count)) for count in (6, 12, 24)}
    twice, four = (rise(case, "housing", "housing", samples_per_face=float(n)) for n in (12, 24))
    assert four / twice == pytest.approx((pieces[24] - pieces[6]) / (pieces[12] - pieces[6]))
    assert four > 0.2 * planned(case, "housing").seconds


def test_rules_of_touching_needles_take_memory_by_the_fourth_power_of_their_order(case):
    rules = fused_mesh.quadrature_rules(nvh.DRAFT.acoustics.quadrature_order, 2, nvh.DRAFT.acoustics)
    kept = rules.chunks.nbytes * (8 / nvh.DRAFT.acoustics.singular_order) ** 4 / 1e6
    assert planned(case, "transfer", "acoustics", singular_order=8).megabytes > BASE_MEGABYTES + 2 * kept
