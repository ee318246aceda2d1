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
