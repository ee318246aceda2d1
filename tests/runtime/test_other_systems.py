"""Systems without what Linux has: the names are taken away, and a run ends with the same bits."""

import os
import subprocess
import sys

import pytest

TAKEN = """
import os, signal, sys
import filelock, h5py, numba, psutil, scipy, tempfile, threadpoolctl  # they have their own ways round
for name in ("sched_getaffinity", "getuid", "O_DIRECTORY", "posix_fadvise", "register_at_fork", "fork", "mkfifo"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGPIPE", "setitimer", "SIGHUP"):
    if hasattr(signal, name):
        delattr(signal, name)
for name in ("fcntl", "resource", "pwd", "grp"):
    sys.modules[name] = None
"""
RUN = """
import nvhchain as nvh
case = nvh.load_case("cases/sphere/pulsating.toml")
for _ in range(2):
    result = nvh.run(case, fidelity=nvh.DRAFT, out=sys.argv[1])
print(result.pressure.content_hash)
"""


def outcome(code, folder):
    done = subprocess.run([sys.executable, "-c", code, str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.slow
def test_a_run_without_the_names_of_linux_has_the_same_bits(tmp_path):
    taken = outcome(TAKEN + RUN, tmp_path / "a")
    assert taken == outcome("import sys" + RUN, tmp_path / "b")
    assert not list((tmp_path / "a").glob("*.part"))


@pytest.mark.slow
@pytest.mark.parametrize("arguments", ["'check', 'cases/small/single_stage.toml'", "'doctor'"])
def test_commands_work_without_the_names_of_linux(arguments, tmp_path):
    code = f"{TAKEN}\nfrom nvhchain.cli import main\ncode = main([{arguments}])\nassert code in (0, 1), code"
    assert outcome(code, tmp_path)


@pytest.mark.slow
def test_a_sweep_measures_without_pipes_that_windows_lacks(tmp_path, monkeypatch):
    """The names are taken away in the measured run, too, which starts with `sitecustomize`."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))  # without locks, sweeps of other tests would remove its
    code = f"""{TAKEN}
import select, subprocess
for name in ("poll", "epoll"):
    if hasattr(select, name):
        delattr(select, name)
class Popen(subprocess.Popen):
    def __init__(self, *arguments, pass_fds=(), **options):
        assert not pass_fds, "pass_fds not supported on Windows"
        super().__init__(*arguments, **options)
subprocess.Popen = Popen
"""
    (tmp_path / "sitecustomize.py").write_text(code)
    measured = """
import sys
from pathlib import Path
from nvhchain import DRAFT, load_case
from nvhchain.files.result_cache import Unwatched
from nvhchain.tradeoff.measure import Ledger, measured_run
out = Path(sys.argv[1])
assert not hasattr(__import__("select"), "poll")
case = load_case("cases/sphere/pulsating.toml")
run = measured_run(case, DRAFT, out=out, operators=out, ledger=Ledger(out / "l"), watcher=Unwatched())
print(run.refused, *run.stages)
"""
    assert outcome(measured, tmp_path / "out") == "None transfer_vectors pressure\n"


def test_a_folder_is_held_by_one_process_without_flock(tmp_path):
    code = f"""{TAKEN}
from pathlib import Path
from nvhchain.runtime.folder_lock import hold_folder
from filelock import FileLock, Timeout
folder = Path(sys.argv[1])
with hold_folder(folder):
    try:
        FileLock(folder / ".nvhchain.lock").acquire(timeout=0)
    except Timeout:
        print("held")
"""
    assert outcome(code, tmp_path) == "held\n"


def test_cores_are_counted_without_affinity(monkeypatch):
    from nvhchain.runtime import threads

    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert threads.cores() == os.cpu_count()
