"""Reduced matrices of other programs: the same housing through every format, and what is refused."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.fem import lowest_modes
from nvhchain.fidelity import DRAFT
from nvhchain.housing import RadiatingFaces, housing_from_modes, reduce_model
from nvhchain.housing.exchange.craig_bampton import craig_bampton
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.housing.modes.response import face_displacement
from nvhchain.interop import write_craig_bampton, write_nastran
from nvhchain.interop.matrices.dmig import read_dmig
from nvhchain.interop.matrices.reduced import SuperelementFiles, read_superelement
from nvhchain.testing.elements import held_box
from tests.interop.matrix_files import write_coordinates, write_dmig, write_mtx

TOP = 40000.0


@pytest.fixture(scope="module")
def body():
    """Held box with a seat, its reduced matrices, and these in millimetres, tonnes and seconds."""
    model = sound_mesh(held_box("hex8"))[0]
    seat = model.rigid_sets[1]
    whole = append_seats(model, (seat,))
    K, M, T = constrained(whole)
    made = craig_bampton(K, M, sp.csr_matrix(T), TOP, names=("S",), positions=seat.reference[None])
    scale = np.ones(len(made.stiffness))
    scale[:3] = 1e-3
    stiffness, mass = (1e3 * scale[:, None] * one * scale for one in (made.stiffness, made.mass))
    return model, made, lowest_modes(K, M, 8000.0)[0], (stiffness, mass, 1e3 * made.motion * scale)


def deck_of(model, tmp_path):
    return write_nastran(model, tmp_path / "box.bdf", units="mm-t-s")


def files_of(kind, body, tmp_path):
    model, _, _, (K, M, R) = body
    seat, labels, deck = model.rigid_sets[1].label, model.labels.tolist(), deck_of(model, tmp_path)
    recovery = (labels, R)
    if kind in ("DMIG", "square DMIG"):
        form = 6 if kind == "DMIG" else 1
        path = write_dmig(tmp_path / "box.pch", seat, {"KAAX": K, "MAAX": M}, recovery, form)
        return SuperelementFiles((path,), deck)
    if kind.endswith("OP4"):
        op4 = pytest.importorskip("pyyeti.nastran.op4")
        order = sorted([*labels, *[rigid.label for rigid in model.rigid_sets]])
        rows = np.zeros((len(order), 3, len(K)))
        rows[np.searchsorted(order, labels)] = R.reshape(len(labels), 3, -1)
        named = {"kaax": K, "maax": M, "mug1": rows.reshape(-1, len(K))}
        op4.write(str(tmp_path / "box.op4"), named, binary=kind == "binary OP4", digits=16)
        return SuperelementFiles((tmp_path / "box.op4",), deck, (seat,))
    other = write_dmig(tmp_path / "motion.pch", seat, {"UNUSED": np.eye(len(K))}, recovery)
    if kind == "user element":
        return SuperelementFiles((write_mtx(tmp_path / "box.mtx", seat, {"STIFFNESS": K, "MASS": M}), other), deck)
    stiffness, mass = (
        write_coordinates(tmp_path / f"box_{n}1.mtx", seat, one) for n, one in (("STIF", K), ("MASS", M))
    )
    return SuperelementFiles((stiffness, mass, other), deck)


@pytest.mark.parametrize("kind", ["DMIG", "square DMIG", "ASCII OP4", "binary OP4", "user element", "coordinates"])
def test_every_format_has_the_modes_of_the_matrices_and_of_the_whole_model(kind, body, tmp_path):
    model, made, whole, _ = body
    files = files_of(kind, body, tmp_path)
    found = read_superelement(files, units="mm-t-s")
    values, vectors = scipy.linalg.eigh(made.stiffness, made.mass)
    frequency = np.sqrt(values) / (2 * np.pi)
    assert len(found.frequency) == len(frequency)
    assert found.frequency == pytest.approx(frequency, rel=1e-6)
    assert found.frequency[: len(whole)] == pytest.approx(whole, rel=1e-3)
    rows = np.searchsorted(found.labels, model.labels)
    shapes = np.abs((made.motion @ vectors).T.reshape(len(values), -1, 3))
    error = np.abs(np.abs(found.shapes[:, rows]) - shapes).max(axis=(1, 2))
    assert (error < 1e-5 * shapes.max(axis=(1, 2))).all()
    seat = np.searchsorted(found.labels, model.rigid_sets[1].label)
    exact = np.linalg.inv(made.stiffness)[:3, :3]
    static = found.shapes[:, seat].T @ (found.shapes[:, seat] / (2 * np.pi * found.frequency[:, None]) ** 2)
    assert np.abs(static - exact).max() < 1e-6 * np.abs(exact).max()


@pytest.mark.slow
def test_velocity_of_the_surface_is_that_of_the_whole_model(body, tmp_path):
    model, *_ = body
    seat = {"S": model.rigid_sets[1].reference}
    options = {"f_max": 5000.0, "faces": RadiatingFaces(0.02), "modal_damping": 0.02, "fidelity": DRAFT.housing}
    with pytest.warns(
        AccuracyWarning, match="miss the sound power of the skin by -1"
    ):  # edges of a slender box, rounded
        whole = reduce_model(model, bearing_seats(model, seat), **options)
    modes = read_superelement(files_of("DMIG", body, tmp_path), units="mm-t-s")
    missed = pytest.warns(AccuracyWarning, match="miss the sound power of the skin by -1")
    with missed, pytest.warns(AccuracyWarning, match="6 of 24 corners of the skin have no displacements"):
        matrices = housing_from_modes(modes, seat, residual_vectors=True, **options)
    lines = np.linspace(200.0, 5000.0, 97)
    force = np.tile(np.array([1.0, 2.0j, -0.5 + 0.3j]), (len(lines), 1))
    squares = [
        ((lines[:, None] * np.abs(face_displacement(one, lines, force))) ** 2 @ one.surface.areas).sum()
        for one in (whole, matrices)
    ]
    assert abs(10 * np.log10(squares[1] / squares[0])) < 0.1


def test_complex_stiffness_and_viscous_damping_damp_the_modes(body, tmp_path):
    model, _, _, (K, M, R) = body
    seat = model.rigid_sets[1].label
    path = write_dmig(
        tmp_path / "box.pch", seat, {"KAAX": (1 + 0.04j) * K, "MAAX": M, "BAAX": 20.0 * M}, (model.labels.tolist(), R)
    )
    found = read_superelement(SuperelementFiles((path,), deck_of(model, tmp_path)), units="mm-t-s")
    assert found.damping == pytest.approx(0.02 + 20.0 / (4 * np.pi * found.frequency), rel=1e-5)


def test_a_massless_unknown_keeps_its_static_flexibility(body, tmp_path):
    """A spring of 1 kN/mm at the first modal coordinate's place: its end has no mass and moves the seat."""
    model, _, _, (K, M, R) = body
    bigger, lighter, motion = (
        np.zeros(np.array(one.shape) + grow) for one, grow in ((K, (1, 1)), (M, (1, 1)), (R, (0, 1)))
    )
    bigger[:-1, :-1], lighter[:-1, :-1], motion[:, :-1] = K, M, R
    bigger[-1, -1], bigger[0, -1], bigger[-1, 0], bigger[0, 0] = 1e3, -1e3, -1e3, K[0, 0] + 1e3
    path = write_dmig(
        tmp_path / "box.pch",
        model.rigid_sets[1].label,
        {"KAAX": bigger, "MAAX": lighter},
        (model.labels.tolist(), motion),
    )
    found = read_superelement(SuperelementFiles((path,), deck_of(model, tmp_path)), units="mm-t-s")
    seat = np.searchsorted(found.labels, model.rigid_sets[1].label)
    static = (found.shapes[:, seat, 0] ** 2 / (2 * np.pi * found.frequency) ** 2).sum()
    assert static == pytest.approx(1e-3 * np.linalg.inv(bigger)[0, 0], rel=1e-6)


def test_our_own_export_is_read_as_matrices(body, tmp_path):
    _, made, _, _ = body
    found = read_dmig(write_craig_bampton(made, tmp_path / "house.bdf"))
    assert np.abs(found["KHOUSE"].values - made.stiffness).max() < 1e-9 * np.abs(made.stiffness).max()
    assert found["MHOUSE"].rows[:7] == (*((1, c) for c in range(1, 7)), (2, 0))


def test_what_is_missing_or_wrong_is_named(body, tmp_path):
    model, _, _, (K, M, R) = body
    seat, deck = model.rigid_sets[1].label, deck_of(model, tmp_path)
    motion = (model.labels.tolist(), R)

    def dmig(name="box", **matrices):
        return write_dmig(tmp_path / f"{name}.pch", seat, matrices, motion, form=1)

    skew = K.copy()
    skew[0, 1] += 0.1 * K[0, 0]
    plain = write_dmig(tmp_path / "plain.pch", seat, {"KAAX": K, "MAAX": M})
    short = (tmp_path / "box.mtx").with_name("short.mtx")
    text = write_mtx(tmp_path / "box.mtx", seat, {"STIFFNESS": K, "MASS": M}).read_text()
    short.write_text(text[: text.index("*MATRIX,TYPE=MASS") - 40])
    for files, message in (
        (SuperelementFiles((dmig("no mass", KAAX=K),), deck), "no usual name of a mass matrix among KAAX, MUG1"),
        (SuperelementFiles((dmig("skew", KAAX=skew, MAAX=M),), deck), "KAAX is not symmetric"),
        (SuperelementFiles((dmig("mass", KAAX=K, MAAX=-M),), deck), "not those of a structure|negative eigenvalue"),
        (
            SuperelementFiles((dmig("stiffness", KAAX=-K, MAAX=M),), deck),
            "not those of a structure|negative eigenvalue",
        ),
        (SuperelementFiles((plain,), deck), "no recovery matrix, thus sound is impossible"),
        (SuperelementFiles((dmig(KAAX=K, MAAX=M),)), "no deck with the elements of the skin"),
        (SuperelementFiles((short,), deck), r"TYPE=STIFFNESS has \d+ numbers"),
    ):
        with pytest.raises(InputError, match=message):
            read_superelement(files, units="mm-t-s")
