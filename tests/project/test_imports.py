"""The import contract of the architecture, and what `import nvhchain` may cost."""

import ast
import json
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = {
    "gmsh",
    "bempp_cl",
    "pypardiso",
    "matplotlib",
    "pyvista",
    "vtkmodules",
    "numba",
    "scipy",
    "h5py",
    "numpy",
}
PROBE = """
import json, sys, time
start = time.process_time()
import nvhchain
print(json.dumps([time.process_time() - start, sorted({name.partition(".")[0] for name in sys.modules})]))
"""


def imported_in_fresh_process(module: str = "nvhchain") -> tuple[float, set[str]]:
    probe = PROBE.replace("import nvhchain", f"import {module}")
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True, cwd=ROOT)
    seconds, modules = json.loads(done.stdout)
    return seconds, set(modules)


def test_layers_and_engine_doors_hold():
    """In a process of its own: import-linter turns off the loggers of this one."""
    script = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


def test_importing_the_package_stays_below_half_a_second_and_opens_no_engine():
    runs = [imported_in_fresh_process() for _ in range(3)]
    assert not runs[0][1] & HEAVY
    assert statistics.median(seconds for seconds, _ in runs) < 0.5


def test_names_that_are_imported_late_differ_from_the_modules_beside_them():
    """The import system sets a module as an attribute of its package, too: the name would then be the module."""
    clashes, looked_at = [], 0
    for file in (ROOT / "nvhchain").rglob("__init__.py"):
        text = file.read_text(encoding="utf-8")
        if "deferred(__name__" in text:
            found = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
            names = {name.name for node in found if file.parent.name in str(node.module) for name in node.names}
            clashes += [f"{file}: {name}" for name in names & {path.stem for path in file.parent.iterdir()}]
            looked_at += len(names)
    assert not clashes
    assert looked_at > 100


def test_a_comparison_answers_before_it_opens_what_draws_and_packages_open_late():
    assert "matplotlib" not in imported_in_fresh_process("nvhchain.report.comparison")[1]
    script = "import sys, nvhchain.gear; print(*(name for name in sys.modules if name.startswith('nvhchain.gear')))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["nvhchain.gear"]


@pytest.mark.parametrize("module", ["report.sound.microphones", "report.page.sections.listening.microphones"])
def test_microphones_are_added_without_the_packages_that_draw_and_compile(module):
    assert not imported_in_fresh_process(f"nvhchain.{module}")[1] & {"gmsh", "matplotlib", "numba", "pyvista"}


def test_no_folder_holds_more_than_14_modules_and_no_module_more_than_500_lines():
    folders = [folder for folder in (ROOT / "nvhchain").rglob("*") if folder.is_dir()]
    crowded = {str(folder): many for folder in folders if (many := len(modules(folder))) > 14}
    long = {str(path): lines for path in (ROOT / "nvhchain").rglob("*.py") if (lines := count_lines(path)) > 500}
    assert (crowded, long) == ({}, {})


def modules(folder):
    return [path for path in folder.glob("*.py") if path.name != "__init__.py"]


def count_lines(path):
    return len(path.read_text(encoding="utf-8").splitlines())
