"""The boundary element engines a case can name, and the memory their dense matrices take."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import psutil

from nvhchain.acoustics.bands import BAND
from nvhchain.acoustics.linear_system import DirectSystem, System
from nvhchain.errors import ResourceError, require
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import FloatArray, RigidPlane, Surface

ENGINES = {"fused": "nvhchain.acoustics._fused", "bempp": "nvhchain.acoustics._bempp"}
"""Name of every engine and the module that offers `systems(surface, wavenumbers, fidelity)`; opened when first used."""

_BATCH_BYTES = {"fused": 2 * 2**30, "bempp": 0}
"""The fused engine builds the matrices of as many frequencies at once as fit into this."""

_MATRIX_COPIES = {"fused": 1.1, "bempp": 3.0}
"""Matrices alive at once per matrix handed over (bempp assembles its four operators one by one and adds them)."""


def check_engine(engine: str) -> None:
    """Raise `InputError` unless `engine` names a boundary element engine."""
    require(engine in ENGINES, f"acoustic engine {engine!r} is unknown: choose from {', '.join(ENGINES)}")


def systems(
    engine: str,
    surface: Surface,
    wavenumbers: FloatArray,
    fidelity: AcousticsFidelity,
    plane: RigidPlane | None = None,
) -> Iterator[System]:
    """Yield A p = B ∂p/∂n per wavenumber (rad/m, > 0), ready to be solved: Galerkin, Burton–Miller.

    (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n, tested with the linear functions of p; e^{+jωt}, α of `coupling`.
    plane: a rigid plane that reflects.  Use a system before the next is asked for: then its memory is given back.
    """
    require(plane is None or engine == "fused", f"engine {engine} knows no reflecting plane: use fused")
    module = import_module(ENGINES[engine])
    extra = () if plane is None else (plane,)
    for a, b in module.systems(surface, wavenumbers, fidelity, *extra):
        system = DirectSystem(a, b)
        del a, b  # else they would be alive while the next ones are built
        yield system
        system.release()


def estimate_memory(n_vertex: int, n_face: int, engine: str = "fused") -> int:
    """Peak bytes of one task: dense complex A (factorised in place) and B, and the engine's copies."""
    check_engine(engine)
    one = 16 * n_vertex * (n_vertex + n_face)
    return int(_MATRIX_COPIES[engine] * max(one, min(BAND * one, _BATCH_BYTES[engine])))


def check_memory(surface: Surface, kept: int, engine: str) -> int:
    """Bytes that one task takes; `ResourceError` unless they and `kept` bytes of results fit into free memory."""
    n_vertex, n_face = len(surface.vertices), len(surface.triangles)
    task = estimate_memory(n_vertex, n_face, engine)
    free = int(psutil.virtual_memory().available)
    if task + kept > free:
        raise ResourceError(
            f"boundary element matrices of {n_face} triangles need {(task + kept) / 2**30:.3g} GiB, "
            f"{free / 2**30:.3g} GiB are free: lower the upper frequency or "
            "the elements per wavelength (memory falls with their fourth power)"
        )
    return task
