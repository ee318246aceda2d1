"""A stage is computed once per set of inputs; changed inputs and damaged files are computed again."""

import gc
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from subprocess import PIPE
from threading import Event
from time import sleep

import numpy as np
import pytest

from nvhchain import DRAFT
from nvhchain.errors import AccuracyWarning, InputError, warn_caller
from nvhchain.files import hdf5, result_cache
from nvhchain.files.result_cache import ResultCache, code_version, fingerprint, origin
from nvhchain.handoff import FieldPressure, SoundAccuracy, warn_of


@pytest.fixture
def counted(tmp_path):
    calls = []

    def run(*inputs, fidelity=DRAFT.acoustics, name="pressure"):
        def compute(progress):
            progress(1, 1)
            calls.append(inputs)
            return FieldPressure(
                [50.0], [[0.0, 0, 1]], [[1.0 + 1j]], accuracy=SoundAccuracy(interpolation_error=[0.01])
            )

        return ResultCache(tmp_path).cached(name, FieldPressure, "acoustics", inputs, compute, fidelity=fidelity)

    return run, calls, tmp_path


def test_same_inputs_are_computed_once(counted):
    run, calls, _ = counted
    first, second = run(1.0, "a"), run(1.0, "a")
    assert len(calls) == 1
    assert first.content_hash == second.content_hash


def test_what_is_found_repeats_the_warnings_of_its_making(tmp_path):
    near = SoundAccuracy(clearance=0.1, expected_error_nearest_db=2.0)

    def ask():
        return ResultCache(tmp_path).cached(
            "pressure", FieldPressure, "acoustics", (1.0,),
            lambda progress: FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]], accuracy=near), fidelity=None,
        )  # fmt: skip

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ask()  # whoever makes it warns
    with pytest.warns(AccuracyWarning, match="0.1 element edges from the surface") as found:
        ask()
    assert found[0].message.subjects == ("pressure",)


def test_warnings_without_a_statement_of_accuracy_are_repeated_too(tmp_path):
    """Those of a part that is cached itself count for both; one that follows from the accuracy is given once."""
    cache, near = ResultCache(tmp_path), SoundAccuracy(clearance=0.1, expected_error_nearest_db=2.0)

    def ask(name, compute):
        return cache.cached(name, FieldPressure, "acoustics", (1.0,), compute, fidelity=None)

    def part(progress):
        warn_caller("the rim does not bend", kind="rims")
        return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0]])

    def whole(progress):
        ask("part", part)
        warn_of(near)
        return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0]], accuracy=near)

    for _ in range(2):
        with pytest.warns(AccuracyWarning) as found:
            ask("whole", whole)
        told = [(str(each.message).partition(":")[0], each.message.kind, each.message.subjects) for each in found]
        assert len(told) == 2
        assert ("the rim does not bend", "rims", ("whole", "part")) in told
    with pytest.warns(AccuracyWarning, match="rim") as found:
        ask("part", part)
    assert len(found) == 1


@pytest.mark.parametrize(
    "nonsense", [5, None, "abc", [["x"]], [[1, 2, 3]], [["x", "y", 5]], [["x", "y", ["z"] * 3000]]]
)
def test_a_file_with_other_warnings_is_damaged(nonsense, counted):
    run, calls, folder = counted
    made = run(1.0)
    hdf5.save(made.replace(provenance=made.provenance | {"warnings": nonsense}), folder / "pressure.h5")
    assert run(1.0).content_hash == made.content_hash
    assert len(calls) == 2


def test_a_stale_statement_of_accuracy_reaches_nothing_that_follows(tmp_path):
    """Three steps of a run: vectors whose file states another accuracy than before are vectors of their own."""
    made = []

    def step(name, *inputs, accuracy):
        def compute(progress):
            made.append(name)
            return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0]], accuracy=accuracy(*inputs))

        return ResultCache(tmp_path).cached(name, FieldPressure, "acoustics", inputs, compute, fidelity=None)

    def run():
        vectors = step("vectors", 1.0, accuracy=lambda _: SoundAccuracy(expected_error_db=0.1))
        heard = step("heard", vectors, accuracy=lambda of: of.accuracy | SoundAccuracy(cancellation_error_db=0.5))
        return step("band", heard, accuracy=lambda of: of.accuracy)

    first = run()
    assert (run().content_hash, made) == (first.content_hash, ["vectors", "heard", "band"])
    kept = hdf5.load(tmp_path / "vectors.h5")
    hdf5.save(kept.replace(accuracy=SoundAccuracy(expected_error_db=2.0)), tmp_path / "vectors.h5")
    assert origin(hdf5.load(tmp_path / "vectors.h5")) == origin(kept)
    later = run()
    assert made == ["vectors", "heard", "band", "heard", "band"]
    assert later.accuracy == SoundAccuracy(expected_error_db=2.0, cancellation_error_db=0.5)


def test_results_in_files_of_another_form_are_computed_again(counted, monkeypatch):
    run, calls, _ = counted
    run(1.0)
    monkeypatch.setattr(hdf5, "SCHEMA_VERSION", hdf5.SCHEMA_VERSION + 1)
    code_version.cache_clear()
    run(1.0)
    code_version.cache_clear()
    assert len(calls) == 2


@pytest.mark.parametrize(
    ("package", "counts", "does_not"),
    [
        ("gear", ("gear/laws/mesh_law.py", "fem/eigen.py", "kinds.py", "chain/steps/gears.py"), "housing/reduction.py"),
        (
            "housing",
            ("housing/reduction.py", "case/housing.py", "case/cad.py", "fem/structural/shells.py"),
            "gear/laws/mesh_law.py",
        ),
        ("dynamics", ("dynamics/runs/linear.py", "bearings/rows.py", "runtime/threads.py"), "gear/laws/mesh_law.py"),
        ("acoustics", ("acoustics/fused/engine.py", "levels.py", "handoff/base.py"), "report/summary.py"),
    ],
)
def test_results_depend_on_all_code_that_makes_them(package, counts, does_not, monkeypatch):
    """That of a package, of all that it imports, and of the steps that call it; on no other."""
    before, plain = code_version(package), Path.read_bytes

    def version(changed):
        code_version.cache_clear()
        file = Path(result_cache.__file__).parents[1] / changed
        assert file.is_file()
        monkeypatch.setattr(Path, "read_bytes", lambda path: plain(path) + b"#" * (path == file))
        return code_version(package)

    try:
        assert all(version(changed) != before for changed in counts)
        assert version(does_not) == before
    finally:
        monkeypatch.undo()
        code_version.cache_clear()


def test_changed_inputs_and_fidelity_are_computed_again(counted):
    run, calls, _ = counted
    run(1.0)
    run(1.0 + 1e-15)
    run(1.0 + 1e-15, fidelity=replace(DRAFT.acoustics, masters=17))
    assert len(calls) == 3


@pytest.mark.parametrize("folders", [("one", "one"), ("one", "two"), ("one", "common"), (None, "one")])
def test_who_comes_second_waits_and_finds(tmp_path, monkeypatch, folders):
    """In the folder of both, or in the common one."""
    monkeypatch.setenv("NVHCHAIN_CACHE", str(tmp_path / "common"))
    made, first_is_at_it = [], Event()

    def slowly(progress):
        made.append(1)
        first_is_at_it.set()
        sleep(0.3)
        return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]], provenance={})

    def ask(folder):
        store = ResultCache(tmp_path / folder if folder else None)
        return store.cached("p-{key}", FieldPressure, "acoustics", (1.0,), slowly, fidelity=None)

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(ask, folders[0])
        first_is_at_it.wait()
        second = pool.submit(ask, folders[1])
        assert first.result().content_hash == second.result().content_hash
    assert len(made) == 1
    assert {path.name for path in tmp_path.iterdir()} == {"common", *filter(None, folders)}
    assert len({path.name for path in tmp_path.rglob("*.h5")}) == 1
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".h5"]


def test_a_process_that_was_killed_at_a_stage_holds_up_nobody(counted):
    run, calls, folder = counted
    script = f"""
from pathlib import Path
from nvhchain.files.result_cache import _exclusive
with _exclusive(Path({str(folder / "pressure.h5")!r})):
    print("held", flush=True)
    input()
"""
    with subprocess.Popen([sys.executable, "-c", script], stdin=PIPE, stdout=PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        holder.kill()
    run(1.0)
    assert len(calls) == 1


def test_a_stage_that_is_refused_leaves_no_folder(tmp_path):
    def refused(progress):
        raise InputError("too small")

    with pytest.raises(InputError):
        ResultCache(tmp_path / "out").cached("p", FieldPressure, "acoustics", (), refused, fidelity=None)
    assert not list(tmp_path.iterdir())


def test_damaged_file_is_computed_again(counted):
    run, calls, folder = counted
    run(1.0)
    path = folder / "pressure.h5"
    path.write_bytes(path.read_bytes()[:-100])
    run(1.0)
    run(1.0)
    assert len(calls) == 2


def test_a_hand_off_in_use_is_not_read_again_unless_its_file_has_changed(counted, monkeypatch):
    run, calls, folder = counted
    read, load = [], hdf5.load
    monkeypatch.setattr(hdf5, "load", lambda path, kind: read.append(path) or load(path, kind))
    made = run(1.0)
    assert run(1.0) is made
    assert not read
    path = folder / "pressure.h5"
    whole = path.read_bytes()
    path.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert run(1.0) is not made
    assert len(read) == 1
    assert len(calls) == 2
    del made
    assert run(1.0).content_hash
    assert len(calls) == 2


def test_a_hand_off_that_nobody_uses_is_not_kept_in_memory(counted):
    run, _, _ = counted
    run(1.0)
    gc.collect()
    assert not [one for one in result_cache._LIVING.values() if isinstance(one, FieldPressure)]


def test_variants_live_side_by_side_when_the_name_carries_the_key(counted):
    run, calls, folder = counted
    for value in (1.0, 2.0, 1.0, 2.0):
        run(value, name="law-{key}")
    assert len(calls) == 2
    assert len(list(folder.glob("law-*.h5"))) == 2


def test_result_carries_fidelity_version_and_key(counted):
    run, _, _ = counted
    provenance = run(1.0).provenance
    assert provenance["fidelity"]["masters"] == DRAFT.acoustics.masters
    assert provenance["version"].startswith("0.")
    assert len(provenance["key"]) == 64
    assert run(1.0).accuracy.interpolation_error == [0.01]


def test_fingerprint_tells_structure_and_type_apart():
    values = [1, 1.0, "1", (1,), ((1,),), (1, 2), {"a": 1}, np.ones(1), np.ones((1, 1)), None]
    assert len({fingerprint(v) for v in values}) == len(values)
    assert fingerprint((1, 2), 3) != fingerprint((1, 2, 3))


def _made(folder, calls, *, name="mesh_law-{key}"):
    def compute(progress):
        calls.append(name)
        return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]], accuracy=SoundAccuracy(interpolation_error=[0.01]))

    return ResultCache(folder).cached(name, FieldPressure, "acoustics", (1.0,), compute, fidelity=None)


def test_runs_into_several_folders_share_operators_through_a_common_one(tmp_path, monkeypatch):
    monkeypatch.setenv("NVHCHAIN_CACHE", str(tmp_path / "common"))
    calls = []
    first = _made(tmp_path / "one", calls)
    assert _made(tmp_path / "two", calls).content_hash == first.content_hash
    assert _made(None, calls).content_hash == first.content_hash  # without a folder of its own, too
    assert len(calls) == 1
    (there,) = (tmp_path / "common").iterdir()
    assert {path.name for path in (tmp_path / "two").iterdir()} == {there.name}  # folders stay complete
    there.write_bytes(there.read_bytes()[:-9])
    _made(tmp_path / "three", calls)
    assert len(calls) == 2  # a damaged file is computed again, and replaced
    _made(tmp_path / "four", calls)
    assert len(calls) == 2


def test_results_of_one_load_case_stay_in_their_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NVHCHAIN_CACHE", str(tmp_path / "common"))
    calls = []
    _made(tmp_path / "one", calls, name="pressure")
    _made(tmp_path / "two", calls, name="pressure")
    assert len(calls) == 2


def test_a_common_folder_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NVHCHAIN_CACHE", str(tmp_path / "file"))
    with pytest.raises(InputError, match=r"NVHCHAIN_CACHE .*file"):
        _made(tmp_path / "one", [])
