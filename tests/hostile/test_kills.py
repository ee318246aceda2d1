"""Killed commands: what they leave goes, and what they had begun is right in the end (small part of `make kills`)."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from nvhchain.cli import termination
from nvhchain.files.atomic_write import write_atomic
from nvhchain.runtime import processes
from nvhchain.runtime.folder_lock import remove_abandoned

ROOT = Path(__file__).parents[2]

WRITER = """
import sys, time
from pathlib import Path
from nvhchain.files.atomic_write import write_atomic
def pieces():
    yield b"half"
    print("begun", flush=True)
    time.sleep(600)
write_atomic(Path(sys.argv[1]), pieces())
"""


@pytest.fixture
def writer(tmp_path):
    """A process that is writing a file."""
    command = [sys.executable, "-c", WRITER, str(tmp_path / "a")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "begun\n"
        yield process
        process.kill()


def test_unfinished_files_of_killed_processes_go_with_the_next_one_that_is_written(writer, tmp_path):
    write_atomic(tmp_path / "b", b"whole")
    assert len(list(tmp_path.glob(".nvhchain-*.part"))) == 1  # its writer is alive
    writer.kill()
    writer.wait()
    write_atomic(tmp_path / "b", b"whole again")
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_a_lock_that_nobody_holds_is_removed(tmp_path):
    (tmp_path / "stale.lock").touch()
    (tmp_path / "other").touch()
    remove_abandoned(tmp_path, "*.lock")
    assert [path.name for path in tmp_path.iterdir()] == ["other"]


CALLER = """
from nvhchain.runtime import processes
processes.{call}
"""
CALLS = {
    "run": "run_python('-c', 'import time; time.sleep(600)', seconds=600.0)",
    "exchange": "exchange('-c', 'while True: pass', content=b'', seconds=600.0)",
    "start": "start_python('-c', 'import time; time.sleep(600)').wait()",
}


@pytest.mark.parametrize("call", CALLS)
def test_children_end_with_a_caller_that_is_killed(call):
    caller = subprocess.Popen([sys.executable, "-c", CALLER.format(call=CALLS[call])])
    end = time.monotonic() + 60
    while not (children := psutil.Process(caller.pid).children()) and time.monotonic() < end:
        time.sleep(0.02)
    time.sleep(0.5)  # it has begun
    caller.kill()
    caller.wait()
    assert children
    assert psutil.wait_procs(children, timeout=10)[1] == []


def test_a_child_has_the_arguments_and_the_name_that_python_gives(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("import sys; print(__name__, sys.argv)")
    by_path = processes.run_python(str(script), "a", seconds=60.0)
    assert by_path.stdout == f"__main__ ['{script}', 'a']\n"
    by_code = processes.run_python("-c", script.read_text(), "a", seconds=60.0)
    assert by_code.stdout == "__main__ ['-c', 'a']\n"


DELETED = """
import os, signal, time
from nvhchain.cli.termination import termination_interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
class Deleted:
    def __del__(self):
        os.kill(os.getpid(), signal.{name})
        time.sleep(0.01)
try:
    with termination_interrupts():
        Deleted()
        end = time.monotonic() + 30
        while time.monotonic() < end:
            sum(range(100))
except KeyboardInterrupt as error:
    print(type(error).__name__)
"""


@pytest.mark.parametrize(("name", "raised"), [("SIGINT", "KeyboardInterrupt"), ("SIGTERM", "Terminated")])
def test_an_interruption_while_an_object_is_deleted_is_not_lost(name, raised):
    done = subprocess.run([sys.executable, "-c", DELETED.format(name=name)], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == (f"{raised}\n", "")


LOADED = """
import os, runpy, signal, sys
from pathlib import Path
from numba.core.registry import cpu_target
from nvhchain.cli import termination
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
later = []
termination._send_again = later.append
kernel = Path(sys.argv[1]) / "kernel.py"
kernel.write_text("import numba\\n@numba.njit('f8(f8)', cache=True)\\ndef double(x):\\n    return 2 * x\\n")
if not os.fork():
    runpy.run_path(str(kernel))  # compiles it, and keeps it
    os._exit(0)
os.wait()
engine = cpu_target.target_context.codegen()._engine._ee
kept = engine._object_cache_getbuffer
def asked_by_llvm(module):
    os.kill(os.getpid(), signal.{name})
    return kept(module)
try:
    with termination.termination_interrupts():
        engine._object_cache_getbuffer = asked_by_llvm
        double = runpy.run_path(str(kernel))["double"]
        engine._object_cache_getbuffer = kept
        print(double.stats.cache_hits.total(), double(2.0), flush=True)
        signal.raise_signal(later[0])
except KeyboardInterrupt as error:
    print(type(error).__name__)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "raised"), [("SIGINT", "KeyboardInterrupt"), ("SIGTERM", "Terminated")])
def test_an_interruption_while_llvm_loads_a_kernel_comes_after_the_kernel(name, raised, tmp_path):
    """Without its content LLVM compiles an empty module, and the call ends by a segmentation fault."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(name=name), str(tmp_path)], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, f"1 4.0\n{raised}\n", "")


@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGTERM, termination.Terminated), (signal.SIGINT, KeyboardInterrupt)]
)
def test_an_import_in_c_that_turns_an_interruption_into_its_own_error_is_interrupted(number, kind, monkeypatch):
    """numba does: "numba._devicearray failed to import"."""
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)

    def imported():
        try:
            signal.raise_signal(number)
        except KeyboardInterrupt:
            raise ImportError("_devicearray failed to import") from None

    with pytest.raises(kind), termination.termination_interrupts():
        imported()
    with pytest.raises(ImportError, match="missing"), termination.termination_interrupts():
        raise ImportError("missing")


PRINTED = """
import os, signal, sys, time
import numpy as np
from nvhchain.cli.termination import termination_interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == "numpy._core._multiarray_umath":
            os.kill(os.getpid(), signal.{name})
            time.sleep(0.01)
sys.meta_path.insert(0, Interrupting())
del sys.modules["numpy._core._multiarray_umath"]
try:
    with termination_interrupts():
        import scipy.spatial._ckdtree
except KeyboardInterrupt as error:
    print(type(error).__name__)
"""


@pytest.mark.parametrize(("name", "raised"), [("SIGINT", "KeyboardInterrupt"), ("SIGTERM", "Terminated")])
def test_an_interruption_that_a_module_in_c_prints_is_not_printed(name, raised):
    """NumPy's C interface prints what it meets at its import, then raises an ImportError of its own."""
    done = subprocess.run([sys.executable, "-c", PRINTED.format(name=name)], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == (f"{raised}\n", "")


TASK = """
import asyncio, os, signal
from nvhchain.cli.termination import termination_interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
async def lost():
    raise RuntimeError("the worker ended")
async def waiting():
    task = asyncio.ensure_future(lost())
    await asyncio.sleep(0)
    os.kill(os.getpid(), signal.{name})
    await asyncio.sleep(1)
try:
    with termination_interrupts():
        asyncio.run(waiting())
except KeyboardInterrupt as error:
    print(type(error).__name__)
"""


@pytest.mark.parametrize(("name", "raised"), [("SIGINT", "KeyboardInterrupt"), ("SIGTERM", "Terminated")])
def test_tasks_that_end_with_an_interrupted_command_print_nothing(name, raised):
    """Dask starts workers in tasks, whose errors asyncio prints where nobody asks for them."""
    done = subprocess.run([sys.executable, "-c", TASK.format(name=name)], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == (f"{raised}\n", "")


@pytest.mark.slow
def test_spheres_survive_random_signals(tmp_path):
    """In a process of its own, as it is copied for every command; until each signal has come before the end."""
    script = """
import sys
from pathlib import Path
from benchmarks.hostile.kills import SIGNALS, tries
missing = {f"{signal.name} to the command" for signal in SIGNALS}
for seed in range(8):
    for _, kind, _, faults in tries(4, seed, Path(sys.argv[1]) / str(seed), 60.0, ["run, sphere"]):
        assert not faults, (kind, faults)
        missing.discard(kind)
    if not missing:
        break
assert not missing, missing
"""
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
