"""A run that is killed goes on with the bands it had finished, and with no others."""

import os
import signal
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import Bempp, ExteriorProblem, Fused, Work, sphere
from nvhchain.acoustics.solutions import quantities
from nvhchain.acoustics.systems.frequency_blocks import BAND
from nvhchain.conventions import Air
from nvhchain.errors import InputError, SolverError, WriteError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import FieldPressure
from tests.rounding import same

CASES = Path(__file__).parents[2] / "cases"
BODY, POINTS, AIR = sphere(0.1, 2), np.array([[0.0, 0.0, 1.0]]), Air(343.0, 1.21)
FUSED = Fused()
FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=14)
MASTERS = np.linspace(100.0, 2000.0, 14)


def vectors(
    folder, *, surface=BODY, points=POINTS, masters=MASTERS, air=AIR, fidelity=FIDELITY, engine=FUSED, progress=None
):
    problem = ExteriorProblem(surface, air=air, fidelity=fidelity, engine=engine)
    return problem.transfer_vectors(points, masters, Work(progress=progress, checkpoints=folder))


@pytest.fixture(scope="module")
def whole():
    return vectors(None)


@pytest.fixture
def half(tmp_path):
    """A folder with the first two bands of four."""
    vectors(tmp_path, masters=MASTERS[: 2 * BAND])
    assert len(list(tmp_path.glob("*.h5"))) == 2
    return tmp_path


@pytest.mark.slow
def test_a_killed_process_leaves_whole_bands_and_the_next_one_solves_only_the_rest(tmp_path, solved, whole):
    script = f"""
        import numpy as np
        from tests.acoustics.test_checkpoints import Path, vectors
        vectors(Path({str(tmp_path)!r}), progress=lambda done, total: print(done, flush=True))
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    with subprocess.Popen(command, cwd=CASES.parent, stdout=subprocess.PIPE, text=True) as child:
        for line in child.stdout:
            if int(line) == 2 * BAND:
                os.kill(child.pid, signal.SIGKILL)
                break
    assert child.wait() == -signal.SIGKILL
    there = list(tmp_path.glob("*.h5"))
    assert 2 <= len(there) < 4
    resumed = vectors(tmp_path)
    assert len(solved) == len(MASTERS) - BAND * len(there)
    assert same(resumed.vectors, whole.vectors)


def test_bands_are_found_from_the_start_and_progress_counts_them(half, solved, whole):
    seen = []
    resumed = vectors(half, progress=lambda done, total: seen.append(done))
    assert same(resumed.vectors, whole.vectors)
    assert (len(solved), seen) == (6, [0, 4, 8, 12, 14])
    again = vectors(half)
    assert same(again.vectors, whole.vectors)
    assert again.provenance == resumed.provenance  # how bands were solved is kept with them
    condition = "solver_reciprocal_condition"  # to rounding, as the vectors
    assert again.provenance | {condition: 0.0} == whole.provenance | {condition: 0.0}
    assert again.provenance[condition] == pytest.approx(whole.provenance[condition], rel=1e-12)
    assert len(solved) == 6


@pytest.mark.parametrize(
    "damage",
    [lambda data: data[: len(data) // 2], lambda data: data[:-3000] + bytes(3000), lambda data: b""],
    ids=["truncated", "altered", "empty"],
)
def test_a_damaged_band_is_solved_again(half, solved, whole, damage):
    first = min(half.glob("*.h5"))
    first.write_bytes(damage(first.read_bytes()))
    assert same(vectors(half).vectors, whole.vectors)
    assert len(solved) == len(MASTERS) - BAND


def test_bands_of_another_surface_under_the_right_names_are_not_used(half, tmp_path_factory, solved, whole):
    other = tmp_path_factory.mktemp("other")
    vectors(other, surface=sphere(0.11, 2), masters=MASTERS[: 2 * BAND])
    for right, wrong in zip(sorted(half.glob("*.h5")), sorted(other.glob("*.h5")), strict=True):
        right.write_bytes(wrong.read_bytes())
    solved.clear()
    assert same(vectors(half).vectors, whole.vectors)
    assert len(solved) == len(MASTERS)


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        {"points": POINTS + 0.01},
        {"masters": MASTERS + 0.01},
        {"air": Air(343.0, 1.2)},
        {"fidelity": AcousticsFidelity(elements_per_wavelength=3.0, masters=14, singular_order=5)},
        {"surface": sphere(0.1, 2, centre=(0.0, 0.0, 1e-9))},
    ],
    ids=lambda change: next(iter(change)),
)
def test_bands_made_from_anything_else_are_not_used(half, solved, change):
    vectors(half, **change)
    assert len(solved) == len(MASTERS)


def test_bands_of_another_engine_are_not_used(half, monkeypatch):
    def systems(*_):
        raise SolverError("asked for anew")

    monkeypatch.setattr(quantities, "systems", systems)
    vectors(half, masters=MASTERS[:BAND])
    with pytest.raises(SolverError, match="asked for anew"):
        vectors(half, masters=MASTERS[:BAND], engine=Bempp())


def test_bands_made_by_other_code_are_not_used(half, solved, monkeypatch):
    monkeypatch.setattr("nvhchain.acoustics.systems.frequency_blocks.code_version", lambda package: "0.0")
    vectors(half)
    assert len(solved) == len(MASTERS)


def test_the_chain_goes_on_with_finished_bands_and_drops_them_when_the_set_is_whole(tmp_path, solved, monkeypatch):
    case = replace(nvh.load_case(CASES / "sphere" / "pulsating.toml"), frequencies=tuple(np.linspace(100.0, 600.0, 10)))
    real, count = quantities.layer_potentials, []

    def fails_late(*arguments):
        count.append(1)
        if len(count) == BAND + 1:
            raise SolverError("the power failed")
        return real(*arguments)

    with monkeypatch.context() as broken:
        broken.setattr(quantities, "layer_potentials", fails_late)
        with pytest.raises(SolverError, match="the power failed"):
            nvh.run(case, fidelity=nvh.DRAFT, out=tmp_path)
    assert len(list(tmp_path.glob("transfer_vectors-*.parts/*.h5"))) == 1
    solved.clear()
    result = nvh.run(case, fidelity=nvh.DRAFT, out=tmp_path)
    assert len(solved) == len(result.transfer_vectors.frequency) - BAND
    assert [path.suffix for path in tmp_path.glob("transfer_vectors-*")] == [".h5"]


def test_a_shelf_without_a_folder_keeps_no_parts():
    seen = []

    def compute(progress, parts):
        seen.append(parts)
        return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]])

    ResultCache(None).cached_in_parts("p-{key}", FieldPressure, "acoustics", (), compute, fidelity=None)
    assert seen == [None]


def test_a_folder_may_be_named_by_text_and_a_file_in_its_place_is_refused_before_anything_is_solved(tmp_path, solved):
    file = tmp_path / "file"
    file.write_text("in the way")
    for place in (file, file / "below", "/proc/nvhchain", "/proc"):  # the last is there, and nobody may write into it
        with pytest.raises(InputError, match=r"checkpoints = .* cannot take files .*name another folder"):
            vectors(place, masters=MASTERS[:1])
    assert solved == []
    vectors(str(tmp_path / "new" / "folder"), masters=MASTERS[:1])
    assert len(list((tmp_path / "new" / "folder").glob("*.h5"))) == 1


def test_a_band_that_cannot_be_saved_is_told_with_its_place(half):
    first = min(half.glob("*.h5"))
    first.unlink()
    first.mkdir()
    with pytest.raises(WriteError, match=f"{first}: cannot be written .*; what was finished before is kept"):
        vectors(half, masters=MASTERS[: 2 * BAND])
