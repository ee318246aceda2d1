"""Files are whole or not there: at every byte at which the system may stop taking them."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from nvhchain.errors import WriteError
from nvhchain.files import atomic_write
from nvhchain.files.atomic_write import write_atomic

CASES = Path(__file__).parents[2] / "cases"

WRITERS = """
    import json, resource, sys
    from pathlib import Path

    import numpy as np

    import nvhchain as nvh
    from nvhchain.files import hdf5
    from nvhchain.handoff import BearingForces, FieldPressure
    from nvhchain.interop import write_bearing_forces
    from nvhchain.sound import steady_sound, write_wav

    PUSH = np.random.default_rng(1).normal(size=(8, 1, 3))
    FORCES = BearingForces(np.arange(8) / 1e3, PUSH, ("A",), [[0.0, 0, 0]], 9.0)
    SOUND = FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]], 261.8)

    def picture(path):
        from nvhchain.plots.files import save
        from matplotlib.figure import Figure

        save([Figure(figsize=(1, 1)).subplots()], path)

    def standing(path):
        from nvhchain.files.atomic_write import content_of, write_atomic

        write_atomic(path, content_of(lambda file: np.savez(file, a=np.arange(9.0))))

    WRITERS = {
        "hand_off.h5": lambda path: hdf5.save(FORCES, path),
        "text.json": lambda path: hdf5.write_text(path, json.dumps(list(range(99)))),
        "sound.wav": lambda path: write_wav(steady_sound(SOUND), path),
        "figure.png": picture,
        "standing.npz": standing,
        **{f"forces{end}": lambda path: write_bearing_forces(FORCES, path) for end in (".csv", ".mat", ".h5", ".uff")},
    }

    def tried(name, folder, steps):
        path = folder / name
        write = WRITERS[name]
        write(path)
        size, wrong = path.stat().st_size, []
        path.write_bytes(b"what was there")
        stops = sorted({*range(0, min(size, 24)), *np.linspace(0, size - 1, steps).astype(int).tolist()})
        for stop in stops:
            resource.setrlimit(resource.RLIMIT_FSIZE, (stop, resource.RLIM_INFINITY))
            try:
                write(path)
                wrong.append(f"{stop}: silent")
            except OSError as error:
                if "cannot be written" not in str(error):
                    wrong.append(f"{stop}: {error}")
            finally:
                resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            if path.read_bytes() != b"what was there" or len(list(folder.iterdir())) != 1:
                wrong.append(f"{stop}: left {sorted(folder.iterdir())}")
        path.unlink()
        return {"tries": len(stops), "wrong": wrong}

    folder = Path(sys.argv[1])
    print(json.dumps({name: tried(name, folder, int(sys.argv[2])) for name in WRITERS}))
"""


@pytest.mark.slow
def test_no_writer_is_silent_at_any_byte_at_which_the_system_takes_no_more(tmp_path):
    """A limit on the size of files stops the kernel at that byte; a signal for it is ignored by Python."""
    command = [sys.executable, "-c", textwrap.dedent(WRITERS), str(tmp_path), "24"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert len(found) == 9
    assert {name: of["wrong"] for name, of in found.items() if of["wrong"]} == {}
    assert min(of["tries"] for of in found.values()) > 40


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_what_fails_after_the_last_byte_is_an_error_and_leaves_what_was_there(tmp_path, monkeypatch, call):
    def fail(*_):
        raise OSError(5, "Input/output error")

    (tmp_path / "a").write_bytes(b"before")
    monkeypatch.setattr(atomic_write.os, call, fail)
    with pytest.raises(WriteError, match=r"a: cannot be written \(Input/output error\): check the disk"):
        write_atomic(tmp_path / "a", b"after")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"before"]


def test_a_disk_that_returns_something_else_is_found_before_the_rename(tmp_path, monkeypatch):
    (tmp_path / "a").write_bytes(b"before")
    for returned in (b"aftes", b"afte", b""):
        monkeypatch.setattr(atomic_write, "_read", lambda _, returned=returned: iter([returned]))
        with pytest.raises(WriteError, match=r"5 that were written\): check the disk"):
            write_atomic(tmp_path / "a", [b"aft", b"er"])
        assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"before"]
    monkeypatch.undo()
    assert write_atomic(tmp_path / "a", [b"aft", b"er"]).read_bytes() == b"after"


def test_files_have_the_permissions_that_the_user_asks_for(tmp_path):
    before = os.umask(0o027)
    try:
        assert write_atomic(tmp_path / "a", b"x").stat().st_mode & 0o777 == 0o640
    finally:
        os.umask(before)


@pytest.mark.slow
def test_a_run_on_a_full_disk_ends_in_one_line_and_the_next_is_right(tmp_path):
    program = "from nvhchain.cli import main; raise SystemExit(main())"
    command = [sys.executable, "-c", program, "run", str(CASES / "sphere" / "on_floor.toml"), "--fidelity", "draft"]

    def run(out, blocks="unlimited"):  # of 512 bytes
        limited = ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", *command, "--out", str(tmp_path / out)]
        return subprocess.run(limited, capture_output=True, text=True)

    whole_run = run("whole")
    assert whole_run.returncode == 0
    largest = max(path.stat().st_size for path in (tmp_path / "whole").rglob("*"))
    stopped = run("full", largest // 512 - 1)
    assert stopped.returncode == 1
    assert "cannot be written (File too large)" in stopped.stderr.splitlines()[-1]
    assert "Traceback" not in stopped.stderr
    again = run("full")
    assert (again.returncode, again.stdout) == (0, whole_run.stdout.replace("/whole/", "/full/"))
