"""Boundary element engines of cases, the solution of their systems and the required memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib import import_module
from typing import ClassVar, Protocol, runtime_checkable

from nvhchain.acoustics.systems.compression import Stripe, compressed_size, compressed_systems
from nvhchain.acoustics.systems.frequency_blocks import BAND
from nvhchain.acoustics.systems.iterative import dense_system, iteration_size, patches_size
from nvhchain.acoustics.systems.linear_system import SolverRecord, System
from nvhchain.errors import InputError, ResourceError, is_whole, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RigidPlane, Surface
from nvhchain.kinds import checked
from nvhchain.runtime.cluster import worker_memory
from nvhchain.runtime.extras import check_installed
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import blas_threads, granted, threads

_FACE_BYTES = 1300
"""Bytes of a triangle besides the matrices: its neighbours and their rules, quadrature points."""

_SHARED = 0.5
"""Share of free memory for more than one frequency at a time with the results. Fewer bytes remain for the results when
the next frequencies begin."""

_COMPRESSED_BYTES = 4 * 2**30
"""Bytes of compressed matrices that are assembled together."""

_STRIPE_BYTES = 1536 * 2**20
"""Bytes of stripes that are compressed or assembled at a time."""


@runtime_checkable
class Engine(Protocol):
    """Boundary element matrices of a surface: Galerkin, Burton–Miller, e^{+jωt}.

    Attributes
    ----------
    name : str
        Name in cases and provenance.
    knobs : tuple of str
        Fields of the fidelity that affect the matrices.
    adapts : bool
        The quadrature cuts triangles across narrow gaps and takes more points for needles.
    striped : bool
        The engine offers `stripes`: complete rows, a few at a time, which can be compressed.
    reflects : bool
        The engine accepts a rigid reflecting plane.
    batch_bytes : int
        Bytes of matrices that are assembled together.
    copies : float
        Matrices held at once per matrix handed over.
    """

    name: ClassVar[str]
    knobs: ClassVar[tuple[str, ...]]
    adapts: ClassVar[bool] = False
    striped: ClassVar[bool] = False
    reflects: ClassVar[bool] = False
    batch_bytes: ClassVar[int] = 0
    copies: ClassVar[float] = 1.0

    def matrices(
        self, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
    ) -> Iterable[tuple[ComplexArray, ComplexArray]]:
        """Yield A (n_v, n_v) and B (n_v, n_face) of A p = B ∂p/∂n at every wavenumber (rad/m, > 0)."""
        ...

    def stripes(
        self, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
    ) -> Iterable[Stripe]:
        """Yield the same matrices as complete rows, a few at a time."""
        raise InputError(f"engine {self.name} cannot compress its matrices: use engine fused or another solver")

    def entry_bytes(self, fidelity: AcousticsFidelity) -> int:
        """Return the bytes of a matrix entry."""
        return 16

    def rules(self, fidelity: AcousticsFidelity) -> AcousticsFidelity:
        """Return the fidelity with the quadrature rules that the engine applies."""
        return fidelity

    def check(self) -> None:
        """Raise InputError with the remedy if the engine is not installed."""
        return

    def compile(self, fidelity: AcousticsFidelity) -> None:
        """Compile the kernels, or load them from disk."""
        return


@dataclass(frozen=True)
class Fused(Engine):
    """Compiled engine of this project: matrices of many wavenumbers in one pass over triangle pairs.

    Notes
    -----
    Frequencies that are assembled together share geometry: two take 1.25 times as long as one, four twice.
    """

    name = "fused"
    knobs = (
        "quadrature_order", "quadrature_error", "close_distances", "close_orders", "gap_ratio", "gap_halvings",
        "singular_order", "needle_aspect", "precision",
    )  # fmt: skip
    adapts = striped = reflects = True
    batch_bytes = 8 * 2**30

    def matrices(
        self, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
    ) -> Iterable[tuple[ComplexArray, ComplexArray]]:
        """Yield A and B, see `Engine.matrices`."""
        from nvhchain.acoustics.fused import engine

        return engine.systems(surface, wavenumbers, fidelity, plane)

    def stripes(
        self, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
    ) -> Iterable[Stripe]:
        """Yield the matrices as complete rows, see `Engine.stripes`."""
        from nvhchain.acoustics.fused import engine

        return engine.stripes(surface, wavenumbers, fidelity, plane, memory=_STRIPE_BYTES)

    def entry_bytes(self, fidelity: AcousticsFidelity) -> int:
        """Return 8 bytes in single precision, 16 in double."""
        return 8 if fidelity.precision == "single" else 16

    def compile(self, fidelity: AcousticsFidelity) -> None:
        """Compile the kernels, or load them from disk."""
        from nvhchain.acoustics.fused import engine

        engine.compile_kernels(fidelity.precision)


@dataclass(frozen=True)
class Bempp(Engine):
    """Independent engine bempp-cl for comparison: dense matrices in free field, one frequency at a time.

    Notes
    -----
    Its four operators are assembled one by one and added, which holds three matrices per matrix handed over.
    """

    name = "bempp"
    knobs = ("quadrature_order", "close_orders", "singular_order")
    copies = 3.0

    def matrices(
        self, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
    ) -> Iterable[tuple[ComplexArray, ComplexArray]]:
        """Yield A and B, see `Engine.matrices`."""
        from nvhchain.acoustics.systems import _bempp

        return _bempp.systems(surface, wavenumbers, fidelity)

    def rules(self, fidelity: AcousticsFidelity) -> AcousticsFidelity:
        """Return the fidelity with one order for all pairs that do not touch, across gaps and for needles as well."""
        order = max(fidelity.quadrature_order, *fidelity.close_orders)
        orders = (order,) * len(fidelity.close_orders)
        return replace(fidelity, gap_halvings=0, quadrature_order=order, close_orders=orders, needle_aspect=1e6)

    def check(self) -> None:
        """Raise InputError if bempp-cl is not installed."""
        check_installed("bempp_cl")


FUSED: Engine = Fused()

ENGINES: dict[str, Engine] = {engine.name: engine for engine in (FUSED, Bempp())}
"""Engines that cases can name."""


def engine_named(name: str) -> Engine:
    """Return the boundary element engine of this name; InputError if it is unknown or not installed."""
    require(name in ENGINES, f"acoustic engine {name!r} is unknown: choose from {', '.join(ENGINES)}")
    ENGINES[name].check()
    return ENGINES[name]


@checked
def compile_kernels(engine: str, fidelity: AcousticsFidelity) -> None:
    """Compile the kernels of transfer vectors, or load them from disk, before their first use.

    Without this call, compilation happens at first use.
    """
    found = engine_named(engine)
    import_module("nvhchain.acoustics.waves._layers")
    if fidelity.radiation == "boundary_elements":
        found.compile(fidelity)


def systems(
    engine: Engine,
    surface: Surface,
    wavenumbers: FloatArray,
    fidelity: AcousticsFidelity,
    plane: RigidPlane | None,
    memory: int,
) -> Iterator[list[System]]:
    """Yield A p = B ∂p/∂n per wavenumber (rad/m, > 0) for `solve_each`: Galerkin, Burton–Miller.

    plane : rigid plane that reflects.
    memory : bytes for the systems, from `check_memory`.

    The equation is (½ − K + αW) p = −(S + α(½ + K′)) ∂p/∂n, tested with the linear functions of p, e^{+jωt}, α of
    `coupling`. Systems come in lists that share the memory; the caller releases them before requesting the next.
    `fidelity.solver` = "auto" compresses if dense matrices exceed `memory`.
    """
    size = len(surface.vertices), len(surface.triangles), len(wavenumbers)
    ways = [*_solution_methods(*size, engine, fidelity)]
    chosen, count, _ = next((way for way in ways if way[2] <= memory), _leanest(ways))
    found = _compressed if chosen.solver == "compressed" else _dense
    for start in range(0, len(wavenumbers), count):
        yield found(engine, surface, wavenumbers[start : start + count], chosen, plane)


def solve_each(batches: Iterable[list[System]], solve: Callable[[int, System], None]) -> SolverRecord:
    """Call `solve(number, system)` for every system, release its memory and return the record of all solutions.

    Systems in memory together are solved side by side, in no more threads than assemble. Each one uses its share of the
    remaining threads for its own products.
    """
    record, number = SolverRecord(), 0

    def solved(index: int, system: System, own: int) -> SolverRecord:
        with granted(own), blas_threads(own):
            solve(index, system)
        system.release()
        return system.record

    for batch in batches:
        count = workers(len(batch))
        own = max(1, threads() // count)
        with ThreadPoolExecutor(count) as pool:
            for done in [pool.submit(solved, number + i, system, own) for i, system in enumerate(batch)]:
                record += done.result()
        number += len(batch)
        batch.clear()
    return record


def workers(frequencies: int) -> int:
    """Return the largest number of systems solved side by side."""
    return max(1, min(threads(), BAND, frequencies))


def _dense(
    engine: Engine, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> list[System]:
    matrices = engine.matrices(surface, wavenumbers, fidelity, plane)
    return [dense_system(a, b, surface.vertices, fidelity) for a, b in matrices]


def _compressed(
    engine: Engine, surface: Surface, wavenumbers: FloatArray, fidelity: AcousticsFidelity, plane: RigidPlane | None
) -> list[System]:
    # Thousands of small products: BLAS threads cost ten times what they save; the engine has its own threads.
    with blas_threads(1):
        stripes = engine.stripes(surface, wavenumbers, fidelity, plane)
        return [*compressed_systems(stripes, surface, len(wavenumbers), fidelity, plane)]


@checked
def estimate_memory(
    n_vertex: int,
    n_face: int,
    engine: str = "fused",
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    *,
    points: int = 0,
    frequencies: int = 0,
    free: int | None = None,
) -> int:
    """Estimate the peak memory of one task: a band of frequencies solved by `fidelity.solver`.

    fidelity: accuracy settings. "auto" counts as dense matrices.
    points: field points of transfer vectors; twice as many with a reflecting plane.
    frequencies: masters of transfer vectors. Their results and columns are added (`vectors_memory`).
    free: free bytes. If they are short, a run solves fewer frequencies at once and, for "auto", compresses the
    matrices. The result is then the size of that run, or the smallest possible one.

    Compressed matrices count for a mesh of `fidelity.elements_per_wavelength`; finer meshes take less.
    """
    for name, count, least in (
        ("vertices", n_vertex, 1), ("triangles", n_face, 1),
        ("field points", points, 0), ("frequencies", frequencies, 0),
    ):  # fmt: skip
        require(
            is_whole(count) and count >= least,
            f"memory for {count} {name} cannot be estimated: give a whole number from {least} up",
        )
    chosen_engine = engine_named(engine)
    kept = sum(vectors_memory(n_vertex, n_face, points, frequencies))
    ways = [*_solution_methods(n_vertex, n_face, frequencies or BAND, chosen_engine, fidelity)]
    if free is None:
        return ways[0][2] + kept
    least = _leanest(ways)[2]
    return next((task for _, count, task in ways if _fits(count, task + kept, free)), least) + kept


def vectors_memory(n_vertex: int, n_face: int, points: int, frequencies: int) -> tuple[int, int]:
    """Return the bytes of transfer vectors, and those needed to compute one band of them.

    The vectors count twice: as bands and as a whole. A band needs both layers and the adjoint solution of every system
    in progress, and the finished vectors.
    """
    active_values = workers(frequencies) * (2 * n_vertex + 2 * n_face)
    return 2 * 16 * frequencies * points * n_face, 16 * points * (active_values + min(BAND, frequencies) * n_face)


def _solver_memory(n_vertex: int, n_face: int, count: int, engine: Engine, fidelity: AcousticsFidelity) -> int:
    """Return the peak bytes of `count` systems that are in memory together."""
    mesh, matrices = _FACE_BYTES * n_face, count * _system_size(n_vertex, n_face, engine, fidelity)
    patches, iteration = patches_size(n_vertex), workers(count) * iteration_size(n_vertex)
    if fidelity.solver == "compressed":
        stripes = min(_STRIPE_BYTES, count * _dense_size(n_vertex, n_face, engine, fidelity))
        return mesh + matrices + count * patches + max(stripes, iteration)
    iterating = 0 if fidelity.solver == "direct" else workers(count) * patches + iteration
    return mesh + int(engine.copies * matrices) + iterating


def _batch(n_vertex: int, n_face: int, frequencies: int, engine: Engine, fidelity: AcousticsFidelity) -> int:
    """Return the number of systems of `frequencies` that are in memory together if memory is plentiful."""
    most = _COMPRESSED_BYTES if fidelity.solver == "compressed" else engine.batch_bytes
    return max(1, min(BAND, frequencies, most // _system_size(n_vertex, n_face, engine, fidelity)))


def _system_size(n_vertex: int, n_face: int, engine: Engine, fidelity: AcousticsFidelity) -> int:
    """Return the bytes of both matrices of one system as stored."""
    if fidelity.solver == "compressed":
        return compressed_size(n_vertex, n_face, fidelity)
    return _dense_size(n_vertex, n_face, engine, fidelity)


def _dense_size(n_vertex: int, n_face: int, engine: Engine, fidelity: AcousticsFidelity) -> int:
    return engine.entry_bytes(fidelity) * n_vertex * (n_vertex + n_face)


def check_memory(
    surface: Surface,
    frequencies: int,
    stored_bytes: int,
    columns: int,
    engine: Engine,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    executor: Executor | None = None,
) -> int:
    """Return the bytes of the systems of one task, a band of `frequencies`, besides its `columns` (bytes).

    ResourceError unless both and `stored_bytes` bytes of results fit into free memory. `cluster.room` refuses tasks
    that fit into no worker of the executor.
    """
    size = len(surface.vertices), len(surface.triangles), frequencies
    return _fitting(*size, stored_bytes, columns, engine, fidelity, worker_memory(executor))[2]


def _fitting(
    n_vertex: int,
    n_face: int,
    frequencies: int,
    stored_bytes: int,
    columns: int,
    engine: Engine,
    fidelity: AcousticsFidelity,
    workers: Sequence[int] = (),
) -> tuple[AcousticsFidelity, int, int]:
    """Return a fidelity whose solver fits into free memory, the systems in memory together, and their bytes.

    stored_bytes, columns : bytes of results, and of the columns of a task.
    workers : bytes that tasks may fill, for every size of worker, increasing. The first that holds one system counts,
        so that a scheduler may assign a task to any worker of at least that size.

    ResourceError states required memory, free memory and remedies.
    """
    require(
        fidelity.solver != "compressed" or engine.striped,
        f"engine {engine.name} cannot compress its matrices: use engine {FUSED.name} or another solver",
    )
    free = free_memory()
    ways = [*_solution_methods(n_vertex, n_face, frequencies, engine, fidelity)]
    for limit in workers or (free,):
        for chosen, count, task in ways:
            if _fits(count, task + columns + stored_bytes, free) and _fits(count, task + columns, limit):
                return chosen, count, task
    chosen, count, task = _leanest(ways)
    if _fits(count, task + columns + stored_bytes, free):
        return chosen, count, task
    results, remedies = columns + stored_bytes, []
    if task < free:
        remedies.append("ask for fewer field points or frequencies at once")
    if engine.striped and fidelity.solver not in ("auto", "compressed"):
        compressed = replace(fidelity, solver="compressed")
        if _leanest([*_solution_methods(n_vertex, n_face, frequencies, engine, compressed)])[2] + results < free:
            remedies.append("choose solver = 'compressed'")
    if results < free or task >= free:
        remedies.append(
            "lower the upper frequency or the elements per wavelength (memory falls with their fourth power)"
        )
    raise ResourceError(
        f"boundary element matrices of {n_face} triangles (solver {chosen.solver!r}) need {task / 2**30:.3g} GiB and "
        f"what they are solved for {results / 2**30:.3g} GiB, {free / 2**30:.3g} GiB are free: " + ", ".join(remedies)
    )


def _solution_methods(
    n_vertex: int, n_face: int, frequencies: int, engine: Engine, fidelity: AcousticsFidelity
) -> Iterator[tuple[AcousticsFidelity, int, int]]:
    """Yield ways to solve at `frequencies` frequencies, the fastest first.

    Each way consists of a fidelity with its solver, the number of systems in memory together, and their bytes.
    """
    solvers = ("auto", "compressed") if fidelity.solver == "auto" and engine.striped else (fidelity.solver,)
    for solver in solvers:
        chosen = replace(fidelity, solver=solver)
        for count in range(_batch(n_vertex, n_face, frequencies, engine, chosen), 0, -1):
            yield chosen, count, _solver_memory(n_vertex, n_face, count, engine, chosen)


def _leanest(methods: Sequence[tuple[AcousticsFidelity, int, int]]) -> tuple[AcousticsFidelity, int, int]:
    """Return the way with the least memory; small systems take more if compressed, for the work in progress."""
    return min(methods, key=lambda way: way[2])


def _fits(count: int, need: int, free: int) -> bool:
    """Return True if `count` systems at a time, with `need` bytes in all, may be solved in `free` bytes."""
    return need <= (free if count == 1 else _SHARED * free)
