"""Children run code of the packages, never of the working directory."""

import ast
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor
from importlib.metadata import packages_distributions
from pathlib import Path

import psutil
import pytest

import nvhchain
from nvhchain.runtime.processes import process_pool

PACKAGE = Path(nvhchain.__file__).parent
SPHERE = PACKAGE.parent / "cases" / "sphere" / "on_floor.toml"
STARTERS = {"subprocess", "multiprocessing", "pty", "_posixsubprocess"}
IN_OS = ("exec", "spawn", "posix_spawn", "system", "popen", "fork")

HOSTILE = """
open({mark!r}, "a").write(__name__ + " ")
raise ImportError("a module of the working directory")
"""

CHILDREN = {
    "mesher": """
from nvhchain.errors import SolverError
from nvhchain.housing.casting import _gmsh
try:
    _gmsh.mesh({})
except SolverError as error:
    assert "KeyError" in str(error), error
""",
    "kernels": """
from nvhchain.acoustics.fused import engine as _fused
with _fused._compiling_close("double") as child:
    assert child.wait() == 0
""",
    "laws ahead": """
from pathlib import Path
from nvhchain import DRAFT
from nvhchain.chain import prefetch as ahead
with ahead._mesh_law_process(([], DRAFT, Path(), [], [])):
    pass
""",
    "trade-off": """
import sys
from pathlib import Path
from nvhchain import DRAFT, load_case
from nvhchain.files.result_cache import Unwatched
from nvhchain.tradeoff.measure import Ledger, measured_run
out = Path(sys.argv[1])
run = measured_run(load_case(sys.argv[2]), DRAFT, out=out, operators=out, ledger=Ledger(out / "l"), watcher=Unwatched())
assert not run.refused, run
""",
    "doctor": """
from nvhchain import doctor
ok, said = doctor._attempt("import gmsh, h5py, json, numba, numpy, pickle, nvhchain")
assert ok, said
""",
    "workers": """
from nvhchain.runtime.cluster import local_cluster
with local_cluster(1) as executor:
    assert executor.submit(len, "abc").result() == 3
""",
    "picture": """
import numpy as np
from nvhchain.handoff import Surface
from nvhchain.plots.bodies import _pyvista
corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
body = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
_pyvista.render(body, np.full((4, 3, 3), 0.5), np.ones(3))
_pyvista.render_frames(corners[None], body.triangles, np.full((1, 12, 3), 0.5), np.ones(3))
""",
}


@pytest.fixture
def hostile(tmp_path):
    """A folder with a file for every module of Python and of the packages, and the list of those imported from it."""
    folder, mark = tmp_path / "hostile", tmp_path / "imported.txt"
    folder.mkdir()
    mark.touch()
    names = {*sys.stdlib_module_names, *packages_distributions(), "nvhchain", "sitecustomize", "usercustomize"}
    for name in names:
        folder.joinpath(f"{name.partition('/')[0]}.py").write_text(HOSTILE.format(mark=str(mark)))
    return folder, mark


@pytest.mark.slow
@pytest.mark.parametrize("kind", CHILDREN)
def test_no_child_imports_from_the_working_directory(kind, hostile, tmp_path):
    folder, mark = hostile
    script = tmp_path / "script.py"  # as the console script: its own folder is on the path, the working directory not
    body = "".join(f"    {line}\n" for line in CHILDREN[kind].splitlines())
    script.write_text(f"if __name__ == '__main__':\n{body}")
    command = [sys.executable, str(script), str(tmp_path / "out"), str(SPHERE)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert mark.read_text() == ""
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_run_as_a_module_leaves_the_working_directory_alone_once_it_has_begun(hostile, tmp_path):
    """Python itself searches there for what `nvhchain.cli` takes to begin with."""
    folder, mark = hostile
    loaded = subprocess.run(
        [sys.executable, "-P", "-c", "import runpy, sys, nvhchain.cli; print(*sys.modules)"],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    for name in (*loaded, "nt", "_winapi", "msvcrt"):  # the last three are looked for in vain
        folder.joinpath(f"{name}.py").unlink(missing_ok=True)
    command = [sys.executable, "-m", "nvhchain.cli", "run", str(SPHERE), "--fidelity", "draft", "--workers", "1"]
    done = subprocess.run([*command, "--out", str(tmp_path / "out")], cwd=folder, capture_output=True, text=True)
    assert mark.read_text() == ""
    assert done.returncode == 0, done.stderr


def test_modules_of_pythonpath_are_found_by_children(tmp_path, monkeypatch):
    from nvhchain.runtime import processes

    tmp_path.joinpath("mine.py").write_text("print('found')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert processes.run_python("-c", "import mine", seconds=60.0).stdout == "found\n"


def test_processes_are_started_in_one_module_only():
    door = PACKAGE / "runtime" / "processes.py"
    starting = {file for file in PACKAGE.rglob("*.py") if _starts_processes(ast.parse(file.read_text()))}
    assert starting == {door}


def _starts_processes(tree):
    """Whether a module takes more than a type from what starts processes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import) and any(alias.name.partition(".")[0] in STARTERS for alias in node.names):
            return True
        if isinstance(node, ast.ImportFrom):
            home, names = (node.module or "").partition(".")[0], {alias.name for alias in node.names}
            if "ProcessPoolExecutor" in names or (home in STARTERS and not names <= {"Popen", "TimeoutExpired"}):
                return True
            if home == "os" and any(name.startswith(IN_OS) for name in names):
                return True
        if isinstance(node, ast.Attribute) and node.attr.startswith(IN_OS) and ast.unparse(node.value) == "os":
            return True
    return False


def test_a_child_that_ends_early_does_not_end_a_script_that_uses_gmsh():
    """`gmsh.initialize` restores the system's default of SIGPIPE, which ends whoever writes to a closed pipe."""
    script = """
import gmsh
from nvhchain.runtime import processes
gmsh.initialize(readConfigFiles=False, interruptible=False)
print(processes.exchange("-c", "", content=bytes(2**24), seconds=60.0).returncode)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "0\n")


CALLER = """
import os, time
from concurrent.futures import wait
from nvhchain.runtime.processes import process_pool
if __name__ == "__main__":
    with process_pool(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        task = pool.submit(time.sleep, 600)
        while not task.done():
            wait([task], 1.0)  # Python may lose an interruption on the way into a wait without an end
"""


def test_workers_of_a_pool_end_with_a_caller_that_is_killed(tmp_path):
    """Children of `multiprocessing` wait for their next task for ever."""
    (tmp_path / "caller.py").write_text(CALLER)
    caller = subprocess.Popen([sys.executable, tmp_path / "caller.py"], stdout=subprocess.PIPE, text=True)
    with caller:
        worker = psutil.Process(int(caller.stdout.readline()))
        caller.kill()
    worker.wait(60.0)
    assert not worker.is_running()


def test_a_process_that_dies_costs_its_own_task_and_is_replaced():
    with process_pool(2) as pool:
        beside = pool.submit(time.sleep, 1.0)
        with pytest.raises(BrokenExecutor):
            pool.submit(os._exit, 1).result()
        assert pool.submit(pow, 2, 3).result() == 8
        assert beside.result() is None


INTERRUPTED = """
import os, re, signal, threading
from pathlib import Path
import psutil
from nvhchain.runtime.processes import process_pool

def interrupt(ended):
    while not ended.wait(0.02):
        for child in psutil.Process().children():
            if "spawn_main" in " ".join(child.cmdline()):
                status = Path(f"/proc/{child.pid}/status").read_text()
                assert int(re.search("SigBlk:\\t(.*)", status)[1], 16) & 2, "an interruption reaches the worker"
                child.send_signal(signal.SIGINT)

if __name__ == "__main__":
    ended = threading.Event()
    threading.Thread(target=interrupt, args=(ended,), daemon=True).start()
    with process_pool(1) as pool:
        assert pool.submit(os.getpid).result() == pool.submit(os.getpid).result()
        ended.set()
"""


def test_workers_of_a_pool_interrupted_from_their_start_go_on(tmp_path):
    """As by Ctrl-C at a terminal, which reaches every process, also one that is still importing."""
    (tmp_path / "script.py").write_text(INTERRUPTED)
    done = subprocess.run([sys.executable, tmp_path / "script.py"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_tasks_of_a_pool_end_with_the_interruption_of_their_caller(tmp_path):
    (tmp_path / "caller.py").write_text("import signal\nsignal.signal(2, signal.default_int_handler)" + CALLER)
    command = [sys.executable, tmp_path / "caller.py"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as caller:
        worker = psutil.Process(int(caller.stdout.readline()))
        caller.send_signal(signal.SIGINT)
        try:
            assert caller.wait(60.0) == -signal.SIGINT
        finally:
            caller.kill()
    worker.wait(60.0)
