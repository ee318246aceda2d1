"""Executors: dask.distributed on this machine or at an address, and the room that any executor offers to a task.

Every `concurrent.futures.Executor` serves. Executors differ in the number of tasks of a size that they hold at once,
and in the number of tasks that share a machine. They also signal a lost worker differently.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeVar

from nvhchain.errors import InputError, ResourceError, is_whole, require
from nvhchain.kinds import checked
from nvhchain.runtime.folder_lock import temporary_folder
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.processes import interrupts_for_this_process_alone, isolated
from nvhchain.runtime.threads import blas_threads, cores, granted, set_blas_threads

T = TypeVar("T")

_USABLE = 0.8
"""Share of a dask worker's memory limit that tasks may fill. Beyond it dask pauses the worker, at 0.95 it ends it."""

_PROGRAM = 256 * 2**20
"""Memory of a worker for the program and its libraries (bytes)."""

_CLOSED = ("closing", "closed")
"""States of a dask client whose scheduler is lost or that was closed."""


@contextmanager
@checked
def local_cluster(workers: int | None = None, *, memory_per_worker: int | None = None) -> Iterator[Executor]:
    """Yield an executor of worker processes on this machine (dask.distributed); a worker that dies is replaced.

    workers: number of processes; one per core by default.
    memory_per_worker: memory limit (bytes); by default an equal part of 90 % of the free memory.

    Workers import the calling script: it must keep its own work under `if __name__ == "__main__":`.
    """
    distributed = _distributed()
    require(
        workers is None or (is_whole(workers) and workers >= 1),
        f"{workers} workers cannot work: ask for a whole number, 1 or more",
    )
    count = int(workers or cores())
    memory = int(0.9 * free_memory() / count)
    if memory_per_worker is not None:
        require(
            is_whole(memory_per_worker) and _task_memory(int(memory_per_worker)) > 0,
            f"memory_per_worker = {memory_per_worker} bytes leaves nothing for tasks: give a whole number above "
            f"{_PROGRAM / _USABLE:.3g}, which the program itself takes",
        )
        memory = int(memory_per_worker)
    with (
        isolated(),
        temporary_folder("cluster") as folder,
        import_module("dask").config.set({"temporary-directory": str(folder)}),
        _started(distributed, count, memory) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client.get_executor(pure=False)


def _started(distributed: Any, count: int, memory: int) -> Any:
    """Return a new cluster; raise ResourceError if a worker ends before it has started, twice."""
    for last in (False, True):
        try:
            with interrupts_for_this_process_alone():
                return distributed.LocalCluster(
                    n_workers=count, threads_per_worker=1, memory_limit=memory, dashboard_address="127.0.0.1:0"
                )
        except RuntimeError as error:  # dask's for any worker that fails to start
            if last:
                raise ResourceError(
                    f"{count} worker processes do not start ({error!s:.100}): free memory, or run without workers"
                ) from error
    raise AssertionError


@contextmanager
@checked
def connect(address: str, *, timeout: float = 10.0) -> Iterator[Executor]:
    """Yield an executor of the workers of a running dask scheduler; scheduler and workers keep running.

    address: address such as `tcp://host:8786`.
    timeout: time (s) in which the scheduler, and then its first worker, must answer.
    """
    require(0 < timeout < float("inf"), f"timeout = {timeout:g} s must be positive and finite")
    import asyncio  # slow to import

    distributed = _distributed()
    try:
        # A client waits for ever for a listener that is no scheduler. A client without a scheduler is closed by the
        # garbage collector, which may lock up another client that is starting.
        with ThreadPoolExecutor(1) as pool:  # the calling thread may have a loop of its own
            pool.submit(asyncio.run, _identity(address, timeout)).result()
        client = distributed.Client(address, timeout=timeout, set_as_default=False)
    except Exception as error:  # any kind: bytes of another protocol are taken for sizes of messages
        raise InputError(
            f"no dask scheduler answers at {address!r} within {timeout:g} s ({error!s:.100}): start one with "
            "'dask scheduler' or correct the address"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=timeout)
        except TimeoutError as error:
            raise InputError(
                f"the dask scheduler at {address} has no workers after {timeout:g} s: start some with "
                f"'dask worker {address} --nthreads 1'"
            ) from error
        yield client.get_executor(pure=False)


async def _identity(address: str, timeout: float) -> None:
    """Raise an error unless a dask process answers with its identity within `timeout` (s)."""
    import asyncio

    async with import_module("distributed.core").rpc(address, timeout=timeout) as scheduler:
        await asyncio.wait_for(scheduler.identity(), timeout)


@dataclass(frozen=True)
class Room:
    """Room of an executor for tasks.

    tasks : number of tasks that it may hold at once.
    neighbours : largest number of tasks that share a machine then.
    """

    tasks: int
    neighbours: int


def room(executor: Executor, memory_per_task: int) -> Room:
    """Return the room for tasks of `memory_per_task` bytes; raise ResourceError if no worker of a cluster holds one."""
    workers = _workers_of(executor)
    if workers is not None:
        return _room_of_cluster(workers, memory_per_task)
    fit = max(1, int(free_memory() // memory_per_task))
    # pools of the standard library and of joblib keep the number of their workers there
    tasks = min(fit, int(getattr(executor, "_max_workers", cores())))
    return Room(tasks, tasks)


def worker_memory(executor: Executor | None) -> list[int]:
    """Return the bytes for tasks on the workers of a cluster, each size once, increasing.

    The list is empty if workers have no limit of their own.
    """
    workers = _workers_of(executor) or {}
    return sorted({_task_memory(worker["memory_limit"]) for worker in workers.values() if worker["memory_limit"]})


def _task_memory(limit: int) -> int:
    """Return the bytes for tasks on a worker with this memory limit."""
    return max(0, int(_USABLE * limit) - _PROGRAM)


def _workers_of(executor: Executor | None) -> dict[str, Any] | None:
    """Return dask's record of every worker, None for any other executor; raise InputError if its client was closed."""
    client: Any = getattr(executor, "_client", None)
    if not hasattr(client, "scheduler_info"):
        return None
    require(
        not is_gone(executor),
        "the executor takes no tasks any more, its client is closed: hand in one that is open until the call returns",
    )
    workers: dict[str, Any] = client.scheduler_info(n_workers=-1)["workers"]
    return workers


def _room_of_cluster(workers: dict[str, Any], memory_per_task: int) -> Room:
    """Return the room of a cluster: each worker by its own memory limit, neighbours of the most crowded machine."""
    tasks, machines = 0, dict[str, int]()
    for worker in workers.values():
        limit, threads = worker["memory_limit"], worker["nthreads"]
        tasks += min(threads, _task_memory(limit) // memory_per_task) if limit else threads
        machines[worker["host"]] = machines.get(worker["host"], 0) + threads
    if workers and tasks == 0:
        largest = max(worker["memory_limit"] for worker in workers.values())
        raise ResourceError(
            f"a task needs {memory_per_task / 2**30:.3g} GiB, the largest worker has {largest / 2**30:.3g} GiB, of "
            f"which {_task_memory(largest) / 2**30:.3g} are for tasks: use fewer, larger workers or lower the upper "
            "frequency"
        )
    return Room(max(1, tasks), max(1, *machines.values(), 1))


def share(home: int, neighbours: int, solve: Callable[..., T], *arguments: Any) -> T:
    """Return `solve(*arguments)`, computed on this machine's cores divided by the `neighbours` that share it.

    home : identifier of the caller's process. Any other process is a worker, which takes its share of threads whatever
        its number was.
    """
    count = max(1, cores() // neighbours)
    if os.getpid() != home:
        set_blas_threads(count)
    with blas_threads(count), granted(count):
        return solve(*arguments)


def is_gone(executor: Executor | None) -> bool:
    """Return True if the scheduler behind an executor is lost: its tasks then never end."""
    return getattr(getattr(executor, "_client", None), "status", None) in _CLOSED


def workers_at(executor: Executor) -> frozenset[Any] | None:
    """Return the worker processes of a cluster; None if it does not answer.

    A worker that replaces another may have its address, but not its folder.
    """
    running = getattr(getattr(executor, "_client", None), "status", None) == "running"
    workers = _workers_of(executor) if running else None
    return (
        None
        if workers is None
        else frozenset((address, one.get("local_directory")) for address, one in workers.items())
    )


def worker_lost(error: BaseException) -> bool:
    """Return True if `error` means that a worker died under a task, not that the task itself failed."""
    if isinstance(error, BrokenExecutor | CancelledError):
        return True
    scheduler = sys.modules.get("distributed.scheduler")
    return scheduler is not None and isinstance(error, scheduler.KilledWorker)


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as error:
        raise InputError(
            'dask.distributed is not installed: run pip install "nvhchain[cluster]", or hand in an executor of '
            "concurrent.futures"
        ) from error
