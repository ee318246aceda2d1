"""Diagnosis of this machine: packages, system libraries, solvers, compiler, renderer, memory.

Every engine is tried in a process of its own. A missing library or a broken driver may end a process without an
exception, and the diagnosis must survive that.
"""

from __future__ import annotations

import json
import os
import platform
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from packaging.requirements import Requirement

from nvhchain.runtime import processes
from nvhchain.runtime.extras import installed, remedy

__all__: list[str] = []

GMSH_PACKAGES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
"""Debian packages with the libraries that gmsh's wheel needs."""

MEMORY = 4 * 2**30
"""Memory (bytes) that `draft` needs, with margin."""

SECONDS = 180.0
"""Time limit of one trial (s); bempp compiles for a long time on a slow machine."""

_GMSH = """
import gmsh
gmsh.initialize(readConfigFiles=False, interruptible=False)
print(gmsh.option.getString("General.Version"))
"""
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
_ENGINE = "import json; from nvhchain.doctor import engine_trial; print(json.dumps(engine_trial({engine!r})))"

ENGINE_SECONDS = 600.0
"""Time limit (s) of the trial of one boundary element engine, most of which is compilation."""

SPHERE_ERROR = 0.03
"""Admissible error of an engine against closed forms, relative to their peak, on 320 triangles.

Measured: 0.017 at the upper of the two frequencies, 0.004 on the pulsating sphere.
"""

ENGINE_DIFFERENCE = 1e-5
"""Admissible difference of both engines at equal quadrature, relative to the peak; measured 1e-10."""

_BEMPP = "import bempp_cl, bempp_cl.api; print(bempp_cl.__version__)"


@dataclass(frozen=True)
class Finding:
    """One line of the diagnosis.

    name: thing that was tried.
    ok: True if the chain can run with it.
    detail: version or fault.
    remedy: action to take if not ok, else empty.
    """

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def diagnose() -> list[Finding]:
    """Try everything that the chain relies on; takes about ten seconds.

    Returns one line per trial.
    """
    findings = [check() for check in CHECKS]
    return [replace(finding, remedy="") if finding.ok else finding for finding in findings]


def diagnose_acoustics() -> list[Finding]:
    """Compare both boundary element engines with closed forms and with each other on a sphere; takes 1 to 3 minutes.

    Returns one line per engine, and one for their difference.
    """
    findings, pressures = [], {}
    for engine in ("fused", "bempp"):
        if engine == "bempp" and not installed("bempp_cl"):
            findings.append(Finding("engine bempp", True, f"not installed, not tried ({remedy('bempp_cl')})"))
            continue
        ok, said = _attempt(_ENGINE.format(engine=engine), ENGINE_SECONDS)
        if not ok:
            findings.append(Finding(f"engine {engine}", False, said, f"see the line {engine!r} of 'nvhchain doctor'"))
            continue
        trial = json.loads(said)
        pressures[engine] = np.array(trial["real"]) + 1j * np.array(trial["imaginary"])
        errors = trial["pulsating"], trial["interior"]
        detail = (
            f"{errors[0]:.2e} off a pulsating sphere, {errors[1]:.2e} off an interior source, "
            f"first {trial['first']:.2f} s, then {trial['again']:.2f} s"
        )
        remedy = f"run 'python -m pytest tests/acoustics' and report it; until then use the engine other than {engine}"
        findings.append(Finding(f"engine {engine}", max(errors) < SPHERE_ERROR, detail, remedy))
    if len(pressures) == 2:
        one, other = pressures.values()
        difference = float(np.abs(one - other).max() / np.abs(one).max())
        remedy = "trust the engine that is nearer to the closed forms above, and report it"
        findings.append(
            Finding("engines agree", difference < ENGINE_DIFFERENCE, f"difference {difference:.2e} of the peak", remedy)
        )
    return [replace(finding, remedy="") if finding.ok else finding for finding in findings]


def engine_trial(engine: str) -> dict[str, Any]:
    """Try a boundary element engine on a sphere at an ordinary and an irregular frequency.

    Returns errors, times and pressures: - `pulsating`: error for a sphere that pulsates at 1 m/s, relative to the
    peak; - `interior`: error for a sphere with the velocity of a point source inside, relative to the peak; - `first`,
    `again`: times (s) with and without compilation; - `real`, `imaginary`: pressures (2, n_f, n_point) relative to the
    peak.

    The pressure of the pulsating sphere is p = jωρ a² e^{−jk(r−a)} / ((1 + jka) r) (Pierce, Acoustics, 4-1).
    """
    from nvhchain.acoustics import transfer_vectors
    from nvhchain.acoustics.surfaces.surface import sphere
    from nvhchain.acoustics.waves.incident import PointSource
    from nvhchain.conventions import Air
    from nvhchain.fidelity import AcousticsFidelity

    air, radius, frequency = Air(), 0.1, np.array([400.0, 1715.0])
    fidelity = AcousticsFidelity(
        elements_per_wavelength=3.0, masters=2, quadrature_order=6, close_orders=(6, 6), singular_order=6
    )
    body = sphere(radius, 2)
    points = np.array([[1.0, 0.0, 0.0], [0.0, -0.6, 0.8], [-0.2, 0.3, -0.1]])
    seconds = []
    for _ in range(2):
        start = time.perf_counter()
        vectors = transfer_vectors(body, points, frequency, air=air, fidelity=fidelity, engine=engine).vectors
        seconds.append(time.perf_counter() - start)

    k = 2 * np.pi * frequency[:, None] / air.speed_of_sound
    r = np.linalg.norm(points, axis=1)
    flow = 1j * k * air.impedance
    pulsating = flow * radius**2 * np.exp(-1j * k * (r - radius)) / ((1 + 1j * k * radius) * r)
    source = PointSource((0.02, -0.03, 0.01))
    there = np.array([source.pressure_and_gradient(points, float(value))[0] for value in k[:, 0]])
    gradient = np.array([source.pressure_and_gradient(body.centroids, float(value))[1] for value in k[:, 0]])
    velocity = np.einsum("fij,ij->fi", gradient, body.normals) / -flow
    exact = np.array([pulsating, there])
    found = np.array([vectors.sum(axis=2), np.einsum("fpi,fi->fp", vectors, velocity)])
    error = np.abs(found - exact).max(axis=2) / np.abs(exact).max(axis=2)
    found /= np.abs(exact).max(axis=(1, 2), keepdims=True)
    return {
        "pulsating": float(error[0].max()),
        "interior": float(error[1].max()),
        "first": seconds[0],
        "again": seconds[1],
        "real": found.real.tolist(),
        "imaginary": found.imag.tolist(),
    }


def _python() -> Finding:
    version = platform.python_version()
    return Finding(
        "python", sys.version_info >= (3, 11), f"{version} on {platform.machine()}", "install Python 3.11 or newer"
    )


def _packages() -> Finding:
    """Compare installed versions with the bounds in the package's own metadata; CHOLMOD may stand in for PARDISO."""
    found, wrong, wanted = [], [], []
    for line in metadata.requires("nvhchain") or []:
        requirement = Requirement(line)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            version = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            missing = f"{requirement.name} is missing"
            if requirement.name == "pypardiso" and installed("cvxopt"):
                found.append(f"{missing}, CHOLMOD solves instead")
                continue
            wrong.append(missing)
            wanted.append(f"{requirement.name}{requirement.specifier}")
            continue
        found.append(f"{requirement.name} {version}")
        if not requirement.specifier.contains(version, prereleases=True):
            wrong.append(f"{requirement.name} {version} is outside {requirement.specifier}")
            wanted.append(f"{requirement.name}{requirement.specifier}")
    checkout = Path(__file__).parents[1]
    if (checkout / "constraints.txt").is_file():
        repair = f"run 'pip install -c constraints.txt -e .' in {checkout}"
    else:
        repair = "run pip install " + " ".join(f'"{requirement}"' for requirement in wanted)
    return Finding("packages", not wrong, ", ".join(wrong or found), repair)


def _gmsh() -> Finding:
    ok, detail = _attempt(_GMSH)
    if ok:
        return Finding("gmsh", True, detail)
    missing = missing_libraries()
    if missing:
        return Finding("gmsh", False, f"lacks {', '.join(missing)}", f"run 'sudo apt-get install {GMSH_PACKAGES}'")
    return Finding("gmsh", False, detail, "reinstall it with 'pip install --force-reinstall gmsh'")


def missing_libraries() -> list[str]:
    """Find system libraries that gmsh's shared library needs and the dynamic linker does not find."""
    missing: list[str] = []
    for library in sorted(Path(sys.prefix, "lib").glob("libgmsh.so*")):
        done = processes.run(["ldd", str(library)], seconds=SECONDS, environment={"LC_ALL": "C"})
        if done is not None:
            missing += re.findall(r"^\s*(\S+) => not found", done.stdout, re.MULTILINE)
    return sorted(set(missing))


def _solver() -> Finding:
    ok, detail = _attempt(_SOLVER)
    if platform.machine().lower() not in ("x86_64", "amd64"):
        repair = f"MKL has no wheel for this processor; {remedy('cvxopt')} adds another solver"
    elif installed("pypardiso"):
        repair = "reinstall it with 'pip install --force-reinstall pypardiso mkl'"
    else:
        repair = "run 'pip install pypardiso'"
    if ok and "Superlu" in detail:
        ok, detail = False, "pypardiso does not load, only small systems can be solved"
        if os.environ.get("NVHCHAIN_SPARSE") == "superlu":
            detail, repair = "NVHCHAIN_SPARSE = superlu, only small systems can be solved", "unset NVHCHAIN_SPARSE"
    return Finding("sparse solver", ok, detail, repair)


def _numba() -> Finding:
    return Finding("numba", *_attempt(_NUMBA), "reinstall it with 'pip install --force-reinstall numba llvmlite'")


def _compiler_cache() -> Finding:
    """Check numba's cache folder: beside the source if that may be written, else the user's cache folder."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent)
    if not _writable(folder):
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    remedy = "set NUMBA_CACHE_DIR to a folder that you may write, or every process compiles again"
    return Finding("compiler cache", _writable(folder), str(folder), remedy)


def _writable(folder: Path) -> bool:
    """Return True if `folder`, or the nearest parent that exists, may be written."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK | os.X_OK)


def _bempp() -> Finding:
    if not installed("bempp_cl"):
        return Finding("bempp", True, f"not installed, the engine fused alone is there ({remedy('bempp_cl')})")
    return Finding("bempp", *_attempt(_BEMPP), "reinstall it with 'pip install --force-reinstall bempp-cl'")


def _renderer() -> Finding:
    from nvhchain.handoff import Surface
    from nvhchain.plots.bodies._pyvista import render

    if not installed("pyvista"):
        return Finding("pictures", True, f"pyvista is not installed, matplotlib draws instead ({remedy('pyvista')})")
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    body = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    works = render(body, np.full((4, 3, 3), 0.5), np.array([1.0, 1.0, 1.0])) is not None
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


def _attempt(code: str, seconds: float = SECONDS) -> tuple[bool, str]:
    """Run `code` in a fresh interpreter for at most `seconds`; return success and the last line of its output."""
    done = processes.run_python("-c", code, seconds=seconds)
    if done is None:
        return False, f"no answer within {seconds:.0f} s"
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
"""Checks, in the order of the report."""
