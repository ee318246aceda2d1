"""What this machine offers to nvhchain: packages, system libraries, solvers, compiler, renderer, memory.

Every engine is tried in a process of its own: a missing library or a broken driver may end a process without an
exception, and the diagnosis has to survive that.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

import numpy as np
import psutil
from packaging.requirements import Requirement

GMSH_PACKAGES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
"""Debian packages that hold the libraries gmsh's wheel needs."""

MEMORY = 4 * 2**30
"""Bytes that `draft` needs with room to spare."""

SECONDS = 180.0
"""Time one trial may take; bempp compiles for a long time on a slow machine."""

_GMSH = "import gmsh; gmsh.initialize(interruptible=False); print(gmsh.option.getString('General.Version'))"
_SOLVER = """
import numpy as np, scipy.sparse as sp
from nvhchain.fem._sparse import factorize
matrix = sp.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(500, 500)).tocsr()
with factorize(matrix) as factor:
    solution = factor.solve(np.ones(500))
    assert np.abs(matrix @ solution - 1.0).max() < 1e-8
    print(type(factor).__name__.strip("_"))
"""
_NUMBA = """
import numba
double = numba.njit("float64(float64)")(lambda x: 2.0 * x)
assert double(1.5) == 3.0
print(numba.__version__)
"""
_BEMPP = "import bempp_cl, bempp_cl.api; print(bempp_cl.__version__)"


@dataclass(frozen=True)
class Finding:
    """One line of the diagnosis.  ok: whether the chain can run with it.  remedy: what to do if not, else empty."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def diagnose() -> list[Finding]:
    """Try everything the chain relies on; takes about ten seconds."""
    findings = [check() for check in CHECKS]
    return [replace(finding, remedy="") if finding.ok else finding for finding in findings]


def _python() -> Finding:
    version = platform.python_version()
    return Finding(
        "python", sys.version_info >= (3, 11), f"{version} on {platform.machine()}", "install Python 3.11 or newer"
    )


def _packages() -> Finding:
    """Installed versions against the bounds of the package's own metadata."""
    found, wrong = [], []
    for line in metadata.requires("nvhchain") or []:
        requirement = Requirement(line)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            version = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            wrong.append(f"{requirement.name} is missing")
            continue
        found.append(f"{requirement.name} {version}")
        if not requirement.specifier.contains(version, prereleases=True):
            wrong.append(f"{requirement.name} {version} is outside {requirement.specifier}")
    return Finding("packages", not wrong, ", ".join(wrong or found), "run 'pip install -c constraints.txt -e .'")


def _gmsh() -> Finding:
    ok, detail = _attempt(_GMSH)
    if ok:
        return Finding("gmsh", True, detail)
    missing = missing_libraries()
    if missing:
        return Finding("gmsh", False, f"lacks {', '.join(missing)}", f"run 'sudo apt-get install {GMSH_PACKAGES}'")
    return Finding("gmsh", False, detail, "reinstall it with 'pip install --force-reinstall gmsh'")


def missing_libraries() -> list[str]:
    """System libraries that gmsh's shared library asks for and the dynamic linker does not find."""
    missing: list[str] = []
    for library in sorted(Path(sys.prefix, "lib").glob("libgmsh.so*")):
        done = subprocess.run(["ldd", str(library)], capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})
        missing += re.findall(r"^\s*(\S+) => not found", done.stdout, re.MULTILINE)
    return sorted(set(missing))


def _solver() -> Finding:
    ok, detail = _attempt(_SOLVER)
    if ok and "Superlu" in detail and platform.machine().lower() in ("x86_64", "amd64"):
        ok, detail = False, "pypardiso does not load, only small systems can be solved"
    return Finding("sparse solver", ok, detail, "reinstall it with 'pip install --force-reinstall pypardiso mkl'")


def _numba() -> Finding:
    return Finding("numba", *_attempt(_NUMBA), "reinstall it with 'pip install --force-reinstall numba llvmlite'")


def _compiler_cache() -> Finding:
    """numba caches beside the source where it may write, else in the user's cache folder."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent)
    if not _writable(folder):
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    remedy = "set NUMBA_CACHE_DIR to a folder that you may write, or every process compiles again"
    return Finding("compiler cache", _writable(folder), str(folder), remedy)


def _writable(folder: Path) -> bool:
    """Whether `folder`, or the nearest parent that exists, may be written."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK | os.X_OK)


def _bempp() -> Finding:
    return Finding("bempp", *_attempt(_BEMPP), "reinstall it with 'pip install --force-reinstall bempp-cl'")


def _renderer() -> Finding:
    from nvhchain.handoff import Surface
    from nvhchain.plots._pyvista import render

    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    body = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    works = render(body, np.full((4, 3), 0.5), np.array([1.0, 1.0, 1.0])) is not None
    detail = (
        "VTK renders off screen" if works else "VTK cannot render off screen, matplotlib draws instead (libegl1 helps)"
    )
    return Finding("pictures", True, detail)


def _machine() -> Finding:
    memory = psutil.virtual_memory()
    detail = (
        f"{psutil.cpu_count(logical=False) or 1} cores ({os.cpu_count()} threads), "
        f"{memory.available / 2**30:.1f} of {memory.total / 2**30:.1f} GiB memory free"
    )
    return Finding("machine", memory.available >= MEMORY, detail, f"free at least {MEMORY / 2**30:.0f} GiB of memory")


def _attempt(code: str) -> tuple[bool, str]:
    """Run `code` in a fresh interpreter: whether it ended well, and the last line it said."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {SECONDS:.0f} s"
    said = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    return done.returncode == 0, said[-1] if said else f"ended with code {done.returncode}"


CHECKS: tuple[Callable[[], Finding], ...] = (
    _python,
    _packages,
    _gmsh,
    _solver,
    _numba,
    _compiler_cache,
    _bempp,
    _renderer,
    _machine,
)
"""In the order in which they are reported."""
