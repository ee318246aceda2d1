"""Threads of BLAS, of which a process has one number, and those granted to the work under way."""

import multiprocessing
import os
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest
from threadpoolctl import ThreadpoolController, threadpool_limits

from nvhchain.acoustics.systems import engines
from nvhchain.runtime import cluster, threads
from nvhchain.runtime.threads import blas_threads, granted, limit_threads


def of_blas():
    """Of the libraries that have one number for the process.

    Each thread has its own of MKL, which others may load. The OpenBLAS of cvxopt's wheel has no threads.
    """
    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    (number,) = {
        library.num_threads
        for library in libraries
        if not threads._limits_each_thread(library) and getattr(library, "threading_layer", "") != "disabled"
    }
    return number


@pytest.fixture(autouse=True)
def four_threads():
    """BLAS starts with four, whatever the machine has."""
    with threadpool_limits(4, user_api="blas"):
        yield


@pytest.mark.parametrize("first", [0, 1])
def test_of_limits_that_overlap_the_lowest_holds_and_nothing_is_left_of_them_in_whatever_order_they_end(first):
    limits = [blas_threads(1), blas_threads(2)]
    for limit, holds in zip(limits, (1, 1), strict=True):
        limit.__enter__()
        assert of_blas() == holds
    limits[first].__exit__(None, None, None)
    assert of_blas() == (2, 1)[first]
    limits[1 - first].__exit__(None, None, None)
    assert of_blas() == 4


def test_no_limit_gives_blas_more_threads_than_it_had():
    with blas_threads(16), blas_threads(3), blas_threads(8):
        assert of_blas() == 3
    assert of_blas() == 4


def worker(told):
    cluster.cores = lambda: 12
    with threadpool_limits(1, user_api="blas"):
        told.put(cluster.share(os.getppid(), 4, of_blas))


def test_a_worker_that_began_with_one_thread_takes_its_share():
    """Those of dask do, and those forked while their parent has one."""
    context = multiprocessing.get_context("fork")
    told = context.SimpleQueue()
    child = context.Process(target=worker, args=(told,))
    with blas_threads(1):
        child.start()
    child.join(20)
    child.kill()
    assert child.exitcode == 0  # else nothing was told
    assert told.get() == 3


def forked(told):
    with blas_threads(3):
        told.put((of_blas(), limit_threads(8)))


def test_a_process_forked_while_a_limit_is_set_in_another_thread_is_not_locked_up_by_it():
    """That thread is not there to open the lock; BLAS has what it had at the fork."""
    context = multiprocessing.get_context("fork")
    told = context.SimpleQueue()
    child = context.Process(target=forked, args=(told,))
    with blas_threads(2), threads._shared._lock:
        child.start()
    child.join(20)
    child.kill()
    assert child.exitcode == 0
    assert told.get() == (2, 8)


def test_granted_threads_hold_where_they_were_granted_alone():
    with granted(2), ThreadPoolExecutor(1) as pool:
        assert (limit_threads(8), limit_threads(1), pool.submit(limit_threads, 8).result()) == (2, 1, 8)
    assert limit_threads(8) == 8


class Watched:
    """A system that is solved at once."""

    record = engines.SolverRecord()

    def release(self):
        pass


def test_sets_of_two_callers_leave_blas_as_it_was(monkeypatch):
    """Each on its own would put back what the other one had set."""
    monkeypatch.setattr(engines, "threads", lambda: 2)
    begun, end = ([Event(), Event()] for _ in range(2))

    def solve_until_told(caller):
        def solve(at, system):
            begun[caller].set()
            assert end[caller].wait(20)

        engines.solve_each([[Watched()]], solve)

    with ThreadPoolExecutor(2) as pool:
        callers = []
        for caller in (0, 1):
            callers.append(pool.submit(solve_until_told, caller))
            assert begun[caller].wait(20)
        for caller in (0, 1):
            assert of_blas() == 2
            end[caller].set()
            callers[caller].result()
    assert of_blas() == 4


def test_systems_solved_side_by_side_share_the_threads_out(monkeypatch):
    monkeypatch.setattr(engines, "threads", lambda: 4)

    seen = []
    for count in (4, 2, 1, 3):
        engines.solve_each(
            [[Watched() for _ in range(count)]], lambda at, system: seen.append((of_blas(), limit_threads(9)))
        )
    assert seen == [(1, 1)] * 4 + [(2, 2)] * 2 + [(4, 4)] + [(1, 1)] * 3
    assert of_blas() == 4
