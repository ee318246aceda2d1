"""A solid model through both formats and several unit systems and back: all of it stays, names and numbers too."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.conventions import ALUMINIUM, STEEL
from nvhchain.fem.solid_model import RigidSet
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.interop import read_abaqus, read_nastran, write_abaqus, write_nastran
from nvhchain.interop.notation._names import LARGEST_LABEL, abaqus_names, short_labels
from nvhchain.interop.solids.nastran_cards import cards, real
from nvhchain.interop.solids.writers import real16, real20
from nvhchain.testing.elements import held_box


def rich_model(labels=None):
    """Two materials in one group of one name, odd names, partly held points and nodes, labels with gaps."""
    model = sound_mesh(held_box("hex8", counts=(4, 2, 2)))[0]
    block = model.blocks[0]
    half = np.arange(len(block.nodes)) < 8
    number = 7 * np.arange(len(model.nodes)) + 3 if labels is None else labels(len(model.nodes))
    held = np.zeros_like(model.held)
    held[np.argmin(np.abs(model.nodes - [0.1, 0.0, 0.0]).sum(axis=1))] = [True, False, True]
    foot, seat = model.rigid_sets
    last = int(number[-1])
    some = np.array([True, True, False, False, True, False])
    return replace(
        model,
        labels=number,
        blocks=(
            replace(block, nodes=block.nodes[half], labels=block.labels[half] * 3, group="wall"),
            replace(block, nodes=block.nodes[~half], labels=block.labels[~half] * 3, group="wall", material=ALUMINIUM),
        ),
        rigid_sets=(
            replace(foot, name="1", label=last + 1, held=some),
            replace(seat, name="left, 2nd", label=last + 2),
        ),
        held=held,
        groups={"TOP": model.groups["TOP"], "top": model.groups["TOP"][:3], "3 ribs": np.arange(5)},
    )


def same(one, other):
    """Whether two models are the same but for the order of nodes, digits and where they came from."""
    a, b = np.argsort(one.labels), np.argsort(other.labels)
    assert one.labels[a].tolist() == other.labels[b].tolist()
    np.testing.assert_allclose(other.nodes[b], one.nodes[a], atol=1e-12)
    assert np.array_equal(other.held[b], one.held[a])
    assert len(other.blocks) == len(one.blocks)
    for mine, theirs in zip(one.blocks, other.blocks, strict=True):
        assert (theirs.kind, theirs.group) == (mine.kind, mine.group)
        assert theirs.labels.tolist() == mine.labels.tolist()
        assert np.array_equal(other.labels[theirs.nodes], one.labels[mine.nodes])
        for name in ("young", "poisson", "density"):
            assert getattr(theirs.material, name) == pytest.approx(getattr(mine.material, name), rel=1e-11)
    assert [(r.name, r.label, r.held.tolist()) for r in other.rigid_sets] == [
        (r.name, r.label, r.held.tolist()) for r in one.rigid_sets
    ]
    for mine, theirs in zip(one.rigid_sets, other.rigid_sets, strict=True):
        assert set(other.labels[theirs.nodes]) == set(one.labels[mine.nodes])
        np.testing.assert_allclose(theirs.reference, mine.reference, atol=1e-12)
    assert list(other.groups) == list(one.groups)
    for name, members in one.groups.items():
        assert other.labels[other.groups[name]].tolist() == one.labels[members].tolist()
    return True


def with_references(model):
    """The model as it comes from a file: the reference points of rigid sets are nodes, too."""
    return replace(
        model,
        nodes=np.vstack([model.nodes, [r.reference for r in model.rigid_sets]]),
        labels=np.concatenate([model.labels, [r.label for r in model.rigid_sets]]),
        held=np.vstack([model.held, np.zeros((len(model.rigid_sets), 3), dtype=bool)]),
    )


def test_nastran_abaqus_nastran_keeps_everything(tmp_path):
    model = with_references(rich_model())
    first = read_nastran(write_nastran(model, tmp_path / "a.bdf", units="mm-t-s"), units="mm-t-s")
    assert same(model, first)
    second = read_abaqus(write_abaqus(first, tmp_path / "b.inp", units="in-lbf-s"), units="in-lbf-s")
    assert same(model, second)
    third = read_nastran(write_nastran(second, tmp_path / "c.bdf", units="mm-kg-ms"), units="mm-kg-ms")
    assert same(model, third)


@pytest.mark.parametrize("start", [10**9, LARGEST_LABEL - 20])
def test_labels_of_more_than_eight_digits_come_back_from_nastran(tmp_path, start):
    """The assembly of an Abaqus file has such; the second range ends beyond the largest that fits."""
    model = with_references(rich_model(lambda count: np.arange(count) + start))
    block = model.blocks[0]
    model = replace(model, blocks=(replace(block, labels=block.labels + 10**8), *model.blocks[1:]))
    path = write_nastran(model, tmp_path / "long.bdf", units="mm-t-s")
    fields = [
        line[8 * i : 8 * i + 8] for line in path.read_text().splitlines() if line[:1] not in "$" for i in range(9)
    ]
    assert all(len(field.split()) <= 1 for field in fields if not field.startswith(("SOL", "BEGIN", "SPC =")))
    assert same(model, read_nastran(path, units="mm-t-s"))


def test_labels_that_fit_stay_and_new_ones_are_free():
    labels = np.array([5, LARGEST_LABEL, 10**9, 7, 2 * 10**9])
    short = short_labels(labels)
    assert short[[0, 1, 3]].tolist() == [5, LARGEST_LABEL, 7]
    assert len(set(short.tolist())) == 5
    assert short.max() <= LARGEST_LABEL
    assert short_labels(np.array([3, 10**9])).tolist() == [3, 4]


def test_names_for_abaqus_start_with_a_letter_and_differ_in_more_than_case():
    assert abaqus_names(["Top", "TOP", "3 ribs", "a,b", "a b", "", "Top"]) == [
        "Top", "TOP-2", "N3_ribs", "a_b", "a_b-2", "N", "Top-3",
    ]  # fmt: skip


def test_couplings_name_the_translations_that_calculix_wants(tmp_path):
    """Without them ccx 2.20 couples nothing and says nothing (benchmarks/housing/calculix_exchange.py)."""
    text = write_abaqus(held_box("hex8"), tmp_path / "box.inp", units="mm-t-s").read_text()
    assert text.count("*KINEMATIC\n1, 3\n") == 2


def test_model_without_anything_held_has_no_empty_boundary(tmp_path):
    free = held_box("hex8", held=False)
    assert "*BOUNDARY" not in write_abaqus(free, tmp_path / "free.inp", units="mm-t-s").read_text()


def followers(text, reference):
    """Labels that a written rigid set names as dependent; neither program takes its reference among them."""
    if "RBE2" in text:
        (card,) = [card for card in cards(text.splitlines()) if card[0] == "RBE2" and card[2] == str(reference)]
        return {int(field) for field in card[4:] if field}
    nodes = text.split("*NSET, NSET=NVHCHAIN_RIGID_S\n")[1].split("*")[0]
    return {int(cell) for cell in nodes.replace("\n", " ").split(",") if cell.strip()}


def test_rigid_set_about_a_node_of_the_mesh_stays_one(tmp_path):
    model = held_box("hex8")
    corner = model.rigid_sets[1].nodes[0]
    about = RigidSet("S", model.nodes[corner], model.rigid_sets[1].nodes, int(model.labels[corner]))
    model = replace(model, rigid_sets=(model.rigid_sets[0], about))
    for write, read in ((write_nastran, read_nastran), (write_abaqus, read_abaqus)):
        back = read(write(model, tmp_path / "m", units="mm-t-s"), units="mm-t-s")
        assert set(back.labels[back.rigid_sets[1].nodes]) == set(model.labels[about.nodes])
        assert not {about.label}.intersection(followers((tmp_path / "m").read_text(), about.label))
        assert back.blocks[0].material.young == pytest.approx(STEEL.young)


def test_numbers_keep_to_the_width_of_both_formats():
    """ccx 2.20 reads 20 characters of a field and stops at a number that is cut."""
    for value in (-5.388445916248354e-15, -1.2345678901234567e-300, 1 / 3, -1e22 / 3, 2.1e11, 0.0, -123456.78901234567):
        assert len(real20(value)) <= 20
        assert len(real16(value)) <= 16
        assert float(real20(value)) == pytest.approx(value, rel=1e-12)
        assert real(real16(value)) == pytest.approx(value, rel=1e-9)
