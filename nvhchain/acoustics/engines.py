"""The boundary element engines a case can name, how their systems are solved, and the memory that takes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module

from threadpoolctl import threadpool_limits

from nvhchain.acoustics.bands import BAND
from nvhchain.acoustics.compressed import compressed_size, compressed_systems
from nvhchain.acoustics.dense import dense_system
from nvhchain.acoustics.iterative import iteration_size
from nvhchain.acoustics.linear_system import System
from nvhchain.errors import ResourceError, is_whole, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FloatArray, RigidPlane, Surface
from nvhchain.kinds import check_arguments
from nvhchain.memory import free_memory

ENGINES = {"fused": "nvhchain.acoustics._fused", "bempp": "nvhchain.acoustics._bempp"}
"""Name of every engine and the module that offers `systems(surface, wavenumbers, fidelity)`; opened when first used."""

_STRIPED = ("fused",)
"""Engines that also offer `stripes`, complete rows a few at a time, which can be compressed."""

_BATCH_BYTES = {"fused": 2 * 2**30, "bempp": 0}
"""The fused engine builds the matrices of as many frequencies at once as fit into this."""

_MATRIX_COPIES = {"fused": 1.1, "bempp": 3.0}
"""Matrices alive at once per matrix handed over (bempp assembles its four operators one by one and adds them)."""

_COMPRESSED_BYTES = 2 * 2**30
"""Compressed matrices of as many frequencies as fit into this are made together."""

_STRIPE_BYTES = 1536 * 2**20
"""Stripes that are being compressed or assembled at a time."""


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
    `fidelity.solver` = "auto" compresses where dense matrices do not fit into the memory that is free now.
    """
    require(plane is None or engine == "fused", f"engine {engine} knows no reflecting plane: use fused")
    fidelity, _ = _fitting(len(surface.vertices), len(surface.triangles), 0, engine, fidelity)
    found = _compressed if fidelity.solver == "compressed" else _dense
    for system in found(engine, surface, wavenumbers, fidelity, plane):
        yield system
        system.release()


def _dense(
    engine: str, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> Iterator[System]:
    extra = () if plane is None else (plane,)
    for a, b in import_module(ENGINES[engine]).systems(surface, wavenumbers, fidelity, *extra):
        system = dense_system(a, b, surface.vertices, fidelity)
        del a, b  # else they would be alive while the next ones are built
        yield system


def _compressed(
    engine: str, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> Iterator[System]:
    module = import_module(ENGINES[engine])
    count = _compressed_batch(compressed_size(len(surface.vertices), len(surface.triangles), fidelity))
    # Thousands of small products: threads of their own cost ten times what they save; the engine has its threads.
    with threadpool_limits(1, user_api="blas"):
        for start in range(0, len(wavenumbers), count):
            some = wavenumbers[start : start + count]
            stripes = module.stripes(surface, some, fidelity, plane, memory=_STRIPE_BYTES)
            waiting = compressed_systems(stripes, surface, len(some), fidelity, plane)
            while waiting:
                yield waiting.pop(0)


def estimate_memory(
    n_vertex: int,
    n_face: int,
    engine: str = "fused",
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    *,
    points: int = 0,
    frequencies: int = 0,
) -> int:
    """Peak bytes of one task, a band of frequencies solved as `fidelity.solver` says ("auto": dense matrices).

    points, frequencies: field points (twice as many with a reflecting plane) and masters of transfer vectors, whose
    results and columns come on top (`vectors_memory`).
    Compressed matrices: at the frequency where the mesh has `fidelity.elements_per_wavelength`; finer meshes take less.
    """
    check_arguments(estimate_memory, locals())
    for name, count, least in (
        ("vertices", n_vertex, 1), ("triangles", n_face, 1),
        ("field points", points, 0), ("frequencies", frequencies, 0),
    ):  # fmt: skip
        require(
            is_whole(count) and count >= least,
            f"memory for {count} {name} cannot be estimated: give a whole number from {least} up",
        )
    return _solver_memory(n_vertex, n_face, engine, fidelity) + sum(
        vectors_memory(n_vertex, n_face, points, frequencies)
    )


def vectors_memory(n_vertex: int, n_face: int, points: int, frequencies: int) -> tuple[int, int]:
    """Bytes of transfer vectors, once as bands and once as a whole, and of what one band of them needs on the way: both
    layers, the adjoint solution and the finished vectors."""
    return 2 * 16 * frequencies * points * n_face, 16 * points * (2 * n_vertex + (2 + BAND) * n_face)


def _solver_memory(n_vertex: int, n_face: int, engine: str, fidelity: AcousticsFidelity) -> int:
    check_engine(engine)
    entry = 8 if fidelity.precision == "single" and engine == "fused" else 16
    one = entry * n_vertex * (n_vertex + n_face)
    if fidelity.solver == "compressed":
        size = compressed_size(n_vertex, n_face, fidelity)
        return int(min(_STRIPE_BYTES, BAND * one) + _compressed_batch(size) * size + iteration_size(n_vertex))
    dense = _MATRIX_COPIES[engine] * one * max(1, min(BAND, _BATCH_BYTES[engine] // one))
    return int(dense + (0 if fidelity.solver == "direct" else iteration_size(n_vertex)))


def _compressed_batch(size: int) -> int:
    """Wavenumbers whose compressed matrices of `size` bytes are made together."""
    return max(1, min(BAND, _COMPRESSED_BYTES // size))


def check_memory(surface: Surface, kept: int, engine: str, fidelity: AcousticsFidelity = STANDARD.acoustics) -> int:
    """Bytes that one task takes; `ResourceError` unless they and `kept` bytes of results fit into free memory."""
    return _fitting(len(surface.vertices), len(surface.triangles), kept, engine, fidelity)[1]


def _fitting(
    n_vertex: int, n_face: int, kept: int, engine: str, fidelity: AcousticsFidelity
) -> tuple[AcousticsFidelity, int]:
    """Fidelity whose solver fits into free memory beside `kept` bytes of results, and the bytes one task of it takes.

    Raises ResourceError with what is needed, what is free and what would help.
    """
    striped = engine in _STRIPED
    require(
        fidelity.solver != "compressed" or striped,
        f"engine {engine} cannot compress its matrices: use engine {', '.join(_STRIPED)} or another solver",
    )
    free = free_memory()
    solvers = ("auto", "compressed") if fidelity.solver == "auto" and striped else (fidelity.solver,)
    for solver in solvers:
        chosen = replace(fidelity, solver=solver)
        task = _solver_memory(n_vertex, n_face, engine, chosen)
        if task + kept <= free:
            return chosen, task
    raise ResourceError(
        f"boundary element matrices of {n_face} triangles (solver {chosen.solver!r}) need "
        f"{(task + kept) / 2**30:.3g} GiB, {free / 2**30:.3g} GiB are free: "
        + ("ask for fewer field points or frequencies at once, " if kept > task else "")
        + ("choose solver = 'compressed', " if striped and chosen.solver != "compressed" else "")
        + "lower the upper frequency or the elements per wavelength (memory falls with their fourth power)"
    )
