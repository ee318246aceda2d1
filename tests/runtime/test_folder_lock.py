"""One process at a time in a folder; SIGTERM ends a command as Ctrl-C does."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from threading import Timer

import psutil
import pytest

from nvhchain.runtime.folder_lock import hold_folder, temporary_folder

CASES = Path(__file__).parents[2] / "cases"
HOLD = """
    import sys
    from pathlib import Path
    from nvhchain.runtime.folder_lock import hold_folder
    with hold_folder(Path(sys.argv[1])):
        print("held", flush=True)
        sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the folder until it is killed."""
    command = [sys.executable, "-c", textwrap.dedent(HOLD), str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_a_held_folder_is_waited_for_with_a_line_that_names_the_process(holder, tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(HOLD), str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as second:
        line = second.stderr.readline()
        assert line.startswith(f"{tmp_path}: waits for process {holder.pid} (-c import sys from pathlib")
        holder.kill()  # the system ends the hold
        assert second.stdout.readline() == "held\n"
        second.stdin.close()
    assert second.returncode == 0
    assert list(tmp_path.iterdir()) == []


def test_processes_started_here_are_waited_for_without_a_line(holder, tmp_path, caplog):
    Timer(0.2, holder.kill).start()
    with hold_folder(tmp_path):
        assert caplog.text == ""


def _command(process):
    """Return the command line of a process, nothing where it has ended meanwhile."""
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


@pytest.mark.slow
def test_sigterm_ends_a_command_and_its_children_as_an_interruption(tmp_path):
    """While gmsh meshes a housing in another process, in a group that no terminal reaches."""
    program = "from nvhchain.cli import main; raise SystemExit(main())"
    case = CASES / "small" / "single_stage.toml"
    command = [
        sys.executable,
        "-c",
        program,
        "run",
        str(case),
        "--fidelity",
        "reference",
        "--out",
        str(tmp_path / "out"),
    ]
    (tmp_path / "temporary").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True) as run:
        children = []
        end = time.monotonic() + 60
        while not any("_gmsh" in _command(child) for child in children) and time.monotonic() < end:
            time.sleep(0.05)
            children = psutil.Process(run.pid).children(recursive=True)
        assert children
        os.kill(run.pid, signal.SIGTERM)
        assert run.wait(timeout=10) == 143
        assert run.stderr.read().endswith("interrupted; finished steps are cached\n")
    assert psutil.wait_procs(children, timeout=10)[1] == []
    assert list((tmp_path / "temporary").iterdir()) == []
    assert not [path for path in (tmp_path / "out").rglob("*") if path.suffix != ".h5"]


def test_temporary_folders_of_others_stay(tmp_path, monkeypatch):
    """Of a process at work, and what a name of another kind or a link leads to."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "file").touch()
    (tmp_path / "nvhchain-cluster-link").symlink_to(elsewhere)
    (tmp_path / "nvhchain-import-abandoned").mkdir()
    (tmp_path / "nvhchain-cluster-abandoned").mkdir()
    with temporary_folder("cluster") as first, temporary_folder("cluster") as second:
        assert first.is_dir()
        assert second.is_dir()
        assert first != second
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"elsewhere", "nvhchain-cluster-link", "nvhchain-import-abandoned"}
    assert (elsewhere / "file").exists()


def test_a_new_temporary_folder_that_another_process_removes_before_its_lock_is_made_again(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    opened, removed = os.open, []

    def open_late(path, *flags):
        if not removed:
            removed.append(path)
        descriptor = opened(path, *flags)
        if removed == [path]:
            Path(path).rmdir()
            removed.append(None)
        return descriptor

    monkeypatch.setattr(os, "open", open_late)
    with temporary_folder("cluster") as folder:
        assert folder.is_dir()
        assert str(folder) != removed[0]
