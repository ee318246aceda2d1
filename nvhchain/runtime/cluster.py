"""Executors: dask.distributed on this machine or at an address, and what any executor offers to a task.

Every `concurrent.futures.Executor` serves. They differ in how many tasks of a size they hold at once, in how many tasks
share a machine, and in how they tell that a worker was lost.
"""

from __future__ import annotations

import asyncio
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
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.processes import isolated
from nvhchain.runtime.threads import blas_threads, give_blas, granted

T = TypeVar("T")

_USABLE = 0.8
"""Share of a dask worker's memory limit that it may fill: beyond it dask pauses the worker, at 0.95 it ends it."""

_PROGRAM = 256 * 2**20
"""Bytes of a worker that the program and its libraries take once they are loaded."""

_CLOSED = ("closing", "closed")
"""What a dask client says of itself once its scheduler is lost or it was closed."""


@contextmanager
@checked
def local_cluster(workers: int | None = None, *, memory_per_worker: int | None = None) -> Iterator[Executor]:
    """An executor of worker processes on this machine (dask.distributed); a worker that dies is replaced.

    workers: processes (default: one per core).  memory_per_worker: bytes (default: an equal part of 90 % of what is
    free now).  Workers import the calling script: it must keep its own work under `if __name__ == "__main__":`.
    Raises InputError when dask.distributed is not installed, for fewer workers than one and for less memory than the
    program itself takes.
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
            is_whole(memory_per_worker) and _for_tasks(int(memory_per_worker)) > 0,
            f"memory_per_worker = {memory_per_worker} bytes leaves nothing for tasks: give a whole number above "
            f"{_PROGRAM / _USABLE:.3g}, which the program itself takes",
        )
        memory = int(memory_per_worker)
    with (
        isolated(),
        distributed.LocalCluster(
            n_workers=count, threads_per_worker=1, memory_limit=memory, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client.get_executor(pure=False)


@contextmanager
@checked
def connect(address: str, *, timeout: float = 10.0) -> Iterator[Executor]:
    """An executor of the workers of a running dask scheduler; scheduler and workers are left running.

    address: such as `tcp://host:8786`.  timeout: s in which the scheduler, and then its first worker, must answer.
    Raises InputError when dask.distributed is not installed, the address is wrong or nothing answers there.
    """
    require(0 < timeout < float("inf"), f"timeout = {timeout:g} s must be positive and finite")
    distributed = _distributed()
    try:
        # A client waits for ever for what listens and is no scheduler; one that found nobody is closed by the garbage
        # collector, which may lock up another one just starting.
        with ThreadPoolExecutor(1) as beside:  # as the calling thread may have a loop of its own
            beside.submit(asyncio.run, _identity(address, timeout)).result()
        client = distributed.Client(address, timeout=timeout, set_as_default=False)
    except Exception as error:  # of any kind, as what another protocol says is taken for sizes of messages
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
    """Raise an error unless something of dask says within `timeout` s what it is."""
    async with import_module("distributed.core").rpc(address, timeout=timeout) as scheduler:
        await asyncio.wait_for(scheduler.identity(), timeout)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Room:
    """tasks: how many an executor may hold at once.  neighbours: tasks that share a machine then, at most."""

    tasks: int
    neighbours: int


def room(executor: Executor, memory_per_task: int) -> Room:
    """Room for tasks of `memory_per_task` bytes; ResourceError where no worker of a cluster holds even one."""
    workers = _workers_of(executor)
    if workers is not None:
        return _room_of_cluster(workers, memory_per_task)
    fit = max(1, int(free_memory() // memory_per_task))
    # The pools of the standard library and of joblib keep the number of their workers there.
    tasks = min(fit, int(getattr(executor, "_max_workers", cores())))
    return Room(tasks, tasks)


def worker_memory(executor: Executor | None) -> list[int]:
    """Bytes that tasks may fill on the workers of a cluster, every size once, increasing; none where workers have no
    limit of their own."""
    workers = _workers_of(executor) or {}
    return sorted({_for_tasks(worker["memory_limit"]) for worker in workers.values() if worker["memory_limit"]})


def _for_tasks(limit: int) -> int:
    """Bytes that tasks may fill on a worker with this limit of memory."""
    return max(0, int(_USABLE * limit) - _PROGRAM)


def _workers_of(executor: Executor | None) -> dict[str, Any] | None:
    """What dask tells of every worker, None of any other executor; `InputError` where its client was closed."""
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
    """Each worker by its own memory limit; the most crowded machine counts for all."""
    tasks, machines = 0, dict[str, int]()
    for worker in workers.values():
        limit, threads = worker["memory_limit"], worker["nthreads"]
        tasks += min(threads, _for_tasks(limit) // memory_per_task) if limit else threads
        machines[worker["host"]] = machines.get(worker["host"], 0) + threads
    if workers and tasks == 0:
        largest = max(worker["memory_limit"] for worker in workers.values())
        raise ResourceError(
            f"a task needs {memory_per_task / 2**30:.3g} GiB, the largest worker has {largest / 2**30:.3g} GiB, of "
            f"which {_for_tasks(largest) / 2**30:.3g} are for tasks: use fewer, larger workers or lower the upper "
            "frequency"
        )
    return Room(max(1, tasks), max(1, *machines.values(), 1))


def share(home: int, neighbours: int, solve: Callable[..., T], *arguments: Any) -> T:
    """`solve(*arguments)` on this machine's cores divided by the `neighbours` that share it.

    home: identifier of the caller's process; another one is a worker, which takes its share of threads whatever it
    began with.
    """
    count = max(1, cores() // neighbours)
    if os.getpid() != home:
        give_blas(count)
    with blas_threads(count), granted(count):
        return solve(*arguments)


def is_gone(executor: Executor | None) -> bool:
    """Whether the scheduler behind an executor is lost: its tasks then stay under way for ever."""
    return getattr(getattr(executor, "_client", None), "status", None) in _CLOSED


def workers_at(executor: Executor) -> frozenset[Any] | None:
    """The worker processes that a cluster has now, None where it cannot be asked.

    One that takes the place of another may have its address, but not its folder.
    """
    running = getattr(getattr(executor, "_client", None), "status", None) == "running"
    workers = _workers_of(executor) if running else None
    return None if workers is None else frozenset((at, one.get("local_directory")) for at, one in workers.items())


def worker_lost(error: BaseException) -> bool:
    """Whether `error` says that a worker died under a task, not that the task itself failed."""
    if isinstance(error, BrokenExecutor | CancelledError):
        return True
    scheduler = sys.modules.get("distributed.scheduler")
    return scheduler is not None and isinstance(error, scheduler.KilledWorker)


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as error:
        raise InputError(
            "dask.distributed is not installed: run 'pip install nvhchain[cluster]', or hand in an executor of "
            "concurrent.futures"
        ) from error
