"""Bands on executors that lose workers, run out of room, fail or are not there."""

import itertools
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from nvhchain.acoustics import ExteriorProblem, Work, sphere
from nvhchain.acoustics.systems import frequency_blocks as bands
from nvhchain.acoustics.systems.frequency_blocks import BAND, _task, solve_bands
from nvhchain.conventions import Air
from nvhchain.errors import InputError, ResourceError, SolverError
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.runtime import cluster
from tests.rounding import same

BODY, POINTS, AIR = sphere(0.1, 2), np.array([[0.0, 0.0, 1.0], [0.3, 0.2, -0.4]]), Air(343.0, 1.21)
FIDELITY = AcousticsFidelity(elements_per_wavelength=3.0, masters=32)
MASTERS = np.linspace(50.0, 2500.0, 32)


def vectors(executor=None, progress=None, body=BODY):
    problem = ExteriorProblem(body, air=AIR, fidelity=FIDELITY)
    return problem.transfer_vectors(POINTS, MASTERS, Work(executor, progress)).vectors


@pytest.fixture(scope="module")
def serial():
    """On one thread: rounding depends on how many take part in a factorisation."""
    with threadpool_limits(1), ThreadPoolExecutor(1) as own:
        return own.submit(cluster.share, os.getpid(), cluster.cores(), vectors).result()


@pytest.fixture(scope="module")
def two_workers():
    with cluster.local_cluster(2, memory_per_worker=2 * 2**30) as executor:
        yield executor


def processes(executor):
    return executor._client.run(os.getpid)


@pytest.mark.slow
def test_two_workers_one_killed_under_way_give_the_same_as_one_process(two_workers, serial):
    before, seen = processes(two_workers), []

    def kill_one(done, total):
        seen.append(done)
        if done == 2 * BAND:
            os.kill(next(iter(before.values())), signal.SIGKILL)

    assert len(set(before.values())) == 2
    assert same(vectors(two_workers, kill_one), serial)
    assert seen == list(range(0, len(MASTERS) + 1, BAND))
    two_workers._client.wait_for_workers(2, timeout=30)
    assert len(set(before.values()) & set(processes(two_workers).values())) == 1  # replaced, and the other one lived


@pytest.mark.slow
def test_a_scheduler_is_reached_by_its_address_and_left_running(two_workers, serial):
    address = two_workers._client.scheduler.address
    for _ in range(2):
        with cluster.connect(address) as executor:
            assert same(vectors(executor), serial)


@pytest.mark.slow
def test_workers_leave_cores_to_each_other(two_workers):
    room = cluster.room(two_workers, 2**20)
    assert (room.tasks, room.neighbours) == (2, 2)
    blas, assembly = two_workers.submit(cluster.share, os.getpid(), room.neighbours, _threads).result(60)
    assert blas == assembly == max(1, cluster.cores() // 2)


def _threads():
    from nvhchain.runtime.threads import limit_threads

    return max(pool["num_threads"] for pool in threadpool_info()), limit_threads(1000)


@pytest.mark.slow
def test_a_task_larger_than_every_worker_is_refused_with_the_number(two_workers):
    assert cluster.room(two_workers, 2**30).tasks == 2
    with pytest.raises(ResourceError, match=r"needs 1.7 GiB, .* has 2 GiB, of which 1.35 .* fewer, larger workers"):
        cluster.room(two_workers, int(1.7 * 2**30))


def test_no_more_tasks_are_under_way_than_memory_holds(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: type("M", (), {"available": 3 * 2**30}))
    running, most = [], []

    def solve(frequency):
        running.append(1)
        most.append(len(running))
        time.sleep(0.02)
        running.pop()
        return frequency + 0j

    with ThreadPoolExecutor(8) as executor:
        solve_bands(solve, MASTERS, memory_per_task=2**30, executor=executor, progress=None)
    assert max(most) == 3


def test_an_error_of_a_task_comes_out_as_it_is_and_what_has_not_begun_is_cancelled():
    begun = []

    def solve(frequency):
        begun.append(frequency[0])
        if len(begun) == 3:
            raise SolverError("singular")
        return frequency + 0j

    with ThreadPoolExecutor(2) as executor:
        with pytest.raises(SolverError, match="singular"):
            solve_bands(solve, np.arange(400.0), memory_per_task=1, executor=executor, progress=None)
        assert executor.submit(int, 5).result() == 5  # the executor is as good as before
    assert len(begun) <= 6


@pytest.mark.slow
def test_an_error_on_a_worker_process_comes_out_as_it_is(two_workers):
    with pytest.raises(ResourceError, match="too large"):
        solve_bands(_refuse, MASTERS, memory_per_task=1, executor=two_workers, progress=None)
    assert two_workers.submit(int, 5).result() == 5


def _refuse(frequency):
    raise ResourceError("too large")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:surface mesh has 2.58 elements")
def test_a_process_pool_broken_by_a_killed_worker_is_finished_here_with_a_warning():
    """Its tasks fit into a pipe (64 KiB): with others the shutdown of a broken pool of Python before 3.11.5 may never
    end (CPython gh-94777)."""
    body = sphere(0.1, 1)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:

        def kill_one(done, total):
            if done == BAND:
                os.kill(next(iter(executor._processes)), signal.SIGKILL)

        with pytest.warns(RuntimeWarning, match=r"the executor is broken .* bands of frequencies are solved in this"):
            spread = vectors(executor, kill_one, body)
    assert same(spread, vectors(body=body))


class Losing:
    """An executor that loses the worker of its first tasks, in one of the ways of telling so."""

    def __init__(self, losses, error):
        self.losses, self.error = losses, error

    def submit(self, function, *arguments):
        future = Future()
        if self.losses > 0:
            self.losses -= 1
            if self.error is None:
                future.cancel()  # and nobody is notified, as of what an executor that is shut down had not begun
            else:
                future.set_exception(self.error)
        else:
            future.set_result(function(*arguments))
        return future


def killed():
    from distributed.scheduler import KilledWorker

    return KilledWorker("task", type("W", (), {"address": "tcp://w"}), 3)


@pytest.mark.parametrize("error", [None, killed()], ids=["cancelled", "killed"])
def test_a_lost_band_is_given_out_again_until_it_is_clear_that_it_kills(error, monkeypatch):
    """A cancelled one was waited for without end."""
    monkeypatch.setattr(bands, "_PATIENCE", 0.01)

    def solve(frequency):
        return frequency + 0j

    arguments = {"memory_per_task": 2**31, "progress": None}
    found = solve_bands(solve, MASTERS, executor=Losing(2, error), **arguments)
    assert np.array_equal(found, MASTERS)
    with pytest.raises(SolverError, match=r"3 workers were lost.* \(\S.*\): .* needs 2 GiB; give workers more memory"):
        solve_bands(solve, MASTERS, executor=Losing(99, error), **arguments)


class Watched:
    """A cluster that never finishes a task by itself and shows other workers at every look."""

    def __init__(self, looks):
        self._client, self.looks, self.tasks = self, iter(looks), []
        self.status = "running"

    def scheduler_info(self, n_workers):
        return {"workers": {at: {"memory_limit": 0, "nthreads": 1, "host": "w"} | of for at, of in next(self.looks)}}

    def submit(self, function, *arguments):
        self.tasks.append((Future(), function, arguments))
        return self.tasks[-1][0]


def lasting(number=0):
    return ("tcp://w", {"local_directory": f"worker-{number}"})


GONE = itertools.chain([[lasting()]], itertools.repeat([]))
REPLACED = ([lasting(number)] for number in itertools.count())
BY_TURNS = ([(f"tcp://{number // 2}", {}), (f"tcp://{(number + 1) // 2}", {})] for number in itertools.count(1))


@pytest.mark.parametrize("looks", [GONE, REPLACED, BY_TURNS], ids=["gone", "replaced", "by turns"])
def test_a_cluster_whose_workers_are_lost_as_fast_as_they_come_is_not_waited_for(looks, monkeypatch):
    """Its scheduler keeps tasks for workers to come: those that die of what they are sent, or whose lifetime is shorter
    than a task, made the call wait for ever."""
    monkeypatch.setattr(bands, "_PATIENCE", 0.01)
    with pytest.warns(RuntimeWarning, match=r"as fast as they come, all 12 times\): 8 bands .* solved in this"):
        found = solve_bands(
            lambda frequency: frequency + 0j, MASTERS, memory_per_task=1, executor=Watched(looks), progress=None
        )
    assert np.array_equal(found, MASTERS)


def test_a_cluster_is_waited_for_while_bands_are_finished_between_losses(monkeypatch):
    """All workers are replaced at every look, 24 times in all, and a band is finished at every third."""

    def looks():
        for number in itertools.count():
            if number % 3 == 2:
                future, function, arguments = watched.tasks[number // 3]
                future.set_result(function(*arguments))
            yield [lasting(number)]

    monkeypatch.setattr(bands, "_PATIENCE", 0.01)
    watched = Watched(looks())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = solve_bands(
            lambda frequency: frequency + 0j, MASTERS, memory_per_task=1, executor=watched, progress=None
        )
    assert np.array_equal(found, MASTERS)


def test_only_signs_of_a_lost_worker_count_as_one():
    assert cluster.worker_lost(BrokenProcessPool())
    assert not any(cluster.worker_lost(error) for error in (SolverError(), InputError(), MemoryError(), OSError()))


def test_a_worker_with_other_code_refuses():
    with pytest.raises(InputError, match=r"a worker runs nvhchain 0.* its caller 0.0: install the same"):
        _task("0.0", 1, os.getpid(), vectors)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", ""])
def test_an_address_where_nothing_answers_is_bad_input_within_the_time_given(address):
    start = time.monotonic()
    with (
        pytest.raises(InputError, match=r"no dask scheduler answers at .* start one"),
        cluster.connect(address, timeout=0.5),
    ):
        pass
    assert time.monotonic() - start < 5


@pytest.mark.slow
def test_a_port_that_listens_and_is_no_scheduler_is_bad_input_within_the_time_given(two_workers):
    """One that keeps silent, one that greets, the dashboard and a worker; a client waited for ever."""

    def greet():
        while True:
            try:
                caller, _ = greeting.accept()
            except OSError:
                return
            with caller:
                caller.sendall(b"SSH-2.0-OpenSSH_9.2p1\r\n" + bytes(64))

    dashboard = two_workers._client.dashboard_link.split("//")[1].split("/")[0]
    worker = next(iter(two_workers._client.scheduler_info()["workers"]))
    with socket.create_server(("127.0.0.1", 0)) as silent, socket.create_server(("127.0.0.1", 0)) as greeting:
        threading.Thread(target=greet, daemon=True).start()
        ports = (f"127.0.0.1:{of.getsockname()[1]}" for of in (silent, greeting))
        for address in (*(f"tcp://{port}" for port in (*ports, dashboard)), worker, "tls://127.0.0.1:8786"):
            start = time.monotonic()
            with pytest.raises(InputError, match=r"no dask scheduler answers at"), cluster.connect(address, timeout=1):
                pass
            assert time.monotonic() - start < 8


@pytest.mark.slow
def test_a_scheduler_without_workers_is_bad_input(two_workers, monkeypatch):
    def none_come(client, count, timeout):
        raise TimeoutError

    monkeypatch.setattr("distributed.Client.wait_for_workers", none_come)
    message = r"has no workers after 3 s: start some with 'dask worker tcp://.* --nthreads 1'"
    with (
        pytest.raises(InputError, match=message),
        cluster.connect(two_workers._client.scheduler.address, timeout=3),
    ):
        pass


@pytest.mark.parametrize("failures", [1, 2])
def test_workers_that_end_at_their_start_are_started_once_more(monkeypatch, failures):
    import distributed

    whole, tried = distributed.LocalCluster, []

    def failing(**options):
        tried.append(options)
        if len(tried) <= failures:
            raise RuntimeError("Nanny failed to start.")
        return whole(**options)

    monkeypatch.setattr(distributed, "LocalCluster", failing)
    if failures == 1:
        with cluster.local_cluster(1, memory_per_worker=2**30) as executor:
            assert executor.submit(abs, -1).result() == 1
        return
    with (
        pytest.raises(ResourceError, match=r"1 worker processes do not start \(Nanny failed.*run without workers"),
        cluster.local_cluster(1, memory_per_worker=2**30),
    ):
        pass


INTERRUPTED = """
import os, re, signal, threading
from pathlib import Path
import psutil
from nvhchain.runtime.cluster import local_cluster

def interrupt(ended):
    while not ended.wait(0.05):
        for child in psutil.Process().children():
            if "spawn_main" in " ".join(child.cmdline()):
                status = Path(f"/proc/{child.pid}/status").read_text()
                assert int(re.search("SigBlk:\\t(.*)", status)[1], 16) & 2, "an interruption reaches the worker"
                child.send_signal(signal.SIGINT)

if __name__ == "__main__":
    ended = threading.Event()
    threading.Thread(target=interrupt, args=(ended,), daemon=True).start()
    with local_cluster(1, memory_per_worker=2**30) as executor:
        assert executor.submit(os.getpid).result() == executor.submit(os.getpid).result()
        ended.set()
"""


@pytest.mark.slow
def test_workers_interrupted_from_their_start_go_on_and_nothing_is_left(tmp_path):
    """As by Ctrl-C at a terminal, which reaches every process."""
    (tmp_path / "script.py").write_text(INTERRUPTED)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"],
        env={**os.environ, "TMPDIR": str(temporary)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(temporary.iterdir()) == []


KILLED = """
import os, signal
from nvhchain.runtime.cluster import local_cluster
if __name__ == "__main__":
    with local_cluster(1, memory_per_worker=2**30) as executor:
        executor.submit(os.getpid).result()
        {end}
"""


@pytest.mark.slow
def test_the_folder_of_a_killed_cluster_goes_with_the_next_cluster(tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    left = []
    for end in ("os.kill(os.getpid(), signal.SIGKILL)", "pass"):
        (tmp_path / "script.py").write_text(KILLED.format(end=end))
        subprocess.run([sys.executable, tmp_path / "script.py"], env={**os.environ, "TMPDIR": str(temporary)})
        left.append(len(list(temporary.iterdir())))
    assert left == [1, 0]


def test_without_dask_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    for opened in (cluster.local_cluster(2), cluster.connect("tcp://127.0.0.1:8786")):
        with pytest.raises(InputError, match=r'pip install "nvhchain\[cluster\]"'), opened:
            pass


@pytest.mark.parametrize(
    ("opened", "said"),
    [
        (lambda: cluster.local_cluster(0), "0 workers"),
        (lambda: cluster.local_cluster(1.5), r"1\.5 workers .* a whole number"),
        (lambda: cluster.local_cluster(1, memory_per_worker=-1), "-1 bytes leaves nothing for tasks"),
        (lambda: cluster.connect(None), "address = None is of the wrong kind"),
        (lambda: cluster.connect("tcp://127.0.0.1:1", timeout=np.nan), "timeout = nan s"),
    ],
)
def test_clusters_of_no_meaning_are_refused(opened, said):
    with pytest.raises(InputError, match=said), opened():
        pass


@pytest.mark.slow
def test_an_executor_whose_client_was_closed_is_refused():
    with cluster.local_cluster(1, memory_per_worker=2**30) as executor:
        pass
    with pytest.raises(InputError, match="the executor takes no tasks any more, its client is closed: hand in one"):
        vectors(executor)
