"""Sweeps on executors: the same bits as here, and no row lost when workers die."""

import concurrent.futures
import importlib
import importlib.util
import itertools
import multiprocessing
import os
import signal
import threading
import time
import warnings

import numpy as np
import pytest

import clutch
from clutch import _sweep, executors

#: 48 rows of a few milliseconds each, with traces.
SAMPLES = clutch.sobol({"law.smc.kp_v": (2, 6), "law.smc.boundary_rad_s": (0.02, 0.5, "log")}, 16)
OPTIONS = {"seeds": 3, "traces": ["time_s", "error_rad", "counts", "code", "stuck"], "every": 50}


@pytest.fixture(scope="module")
def base():
    return clutch.Scenario.load("bench_smc_2", {"run.duration_s": 1.5})


@pytest.fixture(scope="module")
def local(base):
    # Also the trap of forking: after it this process has had native threads.
    return clutch.sweep(base, SAMPLES, **OPTIONS)


def same(a, b):
    assert a.table == b.table and a.traces == b.traces and list(a.traces) == list(b.traces)
    assert not b.interrupted


def needed(name):
    """A package that a user may lack; in continuous integration it must be there."""
    if os.environ.get("CI") is None and importlib.util.find_spec(name) is None:
        pytest.skip(f"{name} is not installed")
    return importlib.import_module(name)


@pytest.mark.parametrize("chunk", [None, 1, 7, 1000])
def test_chunks_of_any_size_on_threads_give_the_same_bits(base, local, chunk):
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        same(local, clutch.sweep(base, SAMPLES, executor=pool, chunk=chunk, **OPTIONS))


def test_what_is_no_executor_is_refused(base):
    with pytest.raises(TypeError, match=r"executor is of type object: expected one with submit\(function"):
        clutch.sweep(base, SAMPLES, executor=object(), **OPTIONS)


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes_give_the_same_bits(base, local, method):
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        same(local, clutch.sweep(base, SAMPLES, executor=pool, **OPTIONS))


def test_counts_and_codes_come_back_from_a_process_as_they_are_here(base):
    options = {"traces": ["counts", "code", "limit"], "every": 50}
    with concurrent.futures.ProcessPoolExecutor(1) as pool:
        there = clutch.sweep(base, {"run.seed": [1]}, executor=pool, **options)
    same(clutch.sweep(base, {"run.seed": [1]}, **options), there)


def test_a_native_sweep_in_a_forked_child_does_not_hang(base, local):
    context = multiprocessing.get_context("fork")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        future = pool.submit(clutch.sweep, base, SAMPLES, **OPTIONS)
        same(local, future.result(timeout=30))


def _steps():
    from clutch.gym import TrackingVectorEnv

    envs = TrackingVectorEnv(600, scenario="pd_2")
    envs.reset(seed=1)
    return float(envs.step(np.zeros(envs.action_space.shape, envs.action_space.dtype))[1].sum())


def test_shafts_in_a_forked_child_do_not_hang():
    pytest.importorskip("gymnasium")
    here = _steps()
    context = multiprocessing.get_context("fork")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        assert pool.submit(_steps).result(timeout=60) == here


class Counting:
    """An executor that notes the rows of each chunk; futures are done at once."""

    def __init__(self, workers=None):
        self.chunks = []
        if workers:
            self._max_workers = workers

    def submit(self, function, *arguments):
        self.chunks.append(len(arguments[1]))
        future = concurrent.futures.Future()
        try:
            future.set_result(function(*arguments))
        except Exception as e:
            future.set_exception(e)
        return future


def test_a_worker_gets_about_four_chunks_and_an_unknown_number_of_workers_64_rows_each(base):
    short = base.override({"run.duration_s": 0.01, "run.settle_s": 0.0})
    for executor, chunks in [(Counting(5), [6] * 20), (Counting(), [64, 56])]:
        clutch.sweep(short, {"run.seed": range(1, 121)}, executor=executor)
        assert executor.chunks == chunks


class Failing(Counting):
    """Fails the first attempts of every chunk, then runs it; after some submissions it is broken."""

    def __init__(self, failures, lives=10**9, error=None):
        super().__init__(2)
        self.failures, self.lives = failures, lives
        self.error = error or concurrent.futures.BrokenExecutor("the worker died")
        self.attempts = {}

    def submit(self, function, *arguments):
        self.lives -= 1
        if self.lives < 0:
            raise concurrent.futures.BrokenExecutor("no workers left")
        key = arguments[1][0]
        self.attempts[key] = self.attempts.get(key, 0) + 1
        if self.attempts[key] > self.failures:
            return super().submit(function, *arguments)
        future = concurrent.futures.Future()
        future.set_exception(self.error)
        return future


@pytest.mark.parametrize("error", [None, concurrent.futures.CancelledError(), OSError("link down")])
def test_a_chunk_is_submitted_three_times_more(base, local, error):
    executor = Failing(3, error=error)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        same(local, clutch.sweep(base, SAMPLES, executor=executor, **OPTIONS))
    assert set(executor.attempts.values()) == {4}


def test_a_chunk_that_fails_a_fourth_time_runs_here(base, local):
    with pytest.warns(RuntimeWarning, match="48 of 48 rows .* the worker died") as caught:
        same(local, clutch.sweep(base, SAMPLES, executor=Failing(4), **OPTIONS))
    assert caught[0].filename == __file__


def test_the_rest_runs_here_when_the_executor_breaks(base, local):
    with pytest.warns(RuntimeWarning, match="24 of 48 rows .* no workers left"):
        same(local, clutch.sweep(base, SAMPLES, executor=Failing(0, lives=4), **OPTIONS))


def test_an_executor_that_is_shut_down_loses_nothing(base, local):
    pool = concurrent.futures.ThreadPoolExecutor(2)
    pool.shutdown()
    with pytest.warns(RuntimeWarning, match="48 of 48 rows"):
        same(local, clutch.sweep(base, SAMPLES, executor=pool, **OPTIONS))


def test_a_refused_row_is_not_tried_again(base):
    executor = Failing(0)
    with pytest.raises(clutch.ParamError, match=r"row 3: .*law\.smc\.kp_v") as caught:
        clutch.sweep(base, {"law.smc.kp_v": [3.0, 4.0, 5.0, -1.0]}, executor=executor, chunk=2)
    assert (caught.value.field, caught.value.value) == ("law.smc.kp_v", -1.0)
    assert set(executor.attempts.values()) == {1}
    kept = clutch.sweep(base, {"law.smc.kp_v": [3.0, -1.0]}, executor=Failing(0), errors="keep")
    assert kept.table == clutch.sweep(base, {"law.smc.kp_v": [3.0, -1.0]}, errors="keep").table


def interrupt_in(seconds):
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_ctrl_c_cancels_what_has_not_begun(base):
    class Stuck(Counting):
        def submit(self, function, *arguments):
            if not self.chunks:
                return super().submit(function, *arguments)
            self.chunks.append(concurrent.futures.Future())
            if len(self.chunks) == 3:
                interrupt_in(0.2)
            return self.chunks[-1]

    executor = Stuck()
    result = clutch.sweep(base, {"run.seed": range(1, 31)}, executor=executor, chunk=10)
    assert result.interrupted and len(result) == 10
    assert all(future.cancelled() for future in executor.chunks[1:])


def test_ctrl_c_ends_a_sweep_whose_executor_runs_chunks_at_once_and_here(base):
    class Here(Counting):
        def submit(self, function, *arguments):
            if self.chunks:
                interrupt_in(0.2)
            return super().submit(function, *arguments)

    executor = Here()
    lengths = {"run.duration_s": [1.5, 3600.0, 3600.0]}
    result = clutch.sweep(base, lengths, executor=executor, chunk=1)
    assert result.interrupted and len(result) == 1
    assert executor.chunks == [1, 1]


# --- Workers that are killed -------------------------------------------------------------------


def killing(pids):
    """A progress function that kills one of the processes `pids()` while most is still to be done."""
    killed = []

    def progress(finished, total):
        if not killed and finished < total // 2:
            killed.append(sorted(pids())[0])
            os.kill(killed[0], signal.SIGKILL)

    return progress, killed


#: About two seconds of work for two workers.
LONG = {"run.seed": range(1, 61)}


@pytest.fixture(scope="module")
def long(base):
    return base.override({"run.duration_s": 10.0})


@pytest.fixture(scope="module")
def long_local(long):
    return clutch.sweep(long, LONG)


def test_a_killed_process_loses_no_row(long, long_local):
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        progress, killed = killing(lambda: pool._processes)
        with pytest.warns(RuntimeWarning, match="rows could not be run by the executor"):
            result = clutch.sweep(long, LONG, executor=pool, chunk=2, progress=progress)
    assert killed
    same(long_local, result)


@pytest.fixture(scope="module")
def dask():
    distributed = needed("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        yield client


def test_dask_gives_the_same_bits(base, local, dask):
    assert executors._workers(dask) == executors._workers(dask.get_executor()) == 2
    same(local, clutch.sweep(base, SAMPLES, executor=dask, **OPTIONS))
    same(local, clutch.sweep(base, SAMPLES, executor=dask.get_executor(), **OPTIONS))


def test_a_killed_worker_of_dask_loses_no_row(long, long_local, dask):
    progress, killed = killing(dask.run(os.getpid).values)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        result = clutch.sweep(long, LONG, executor=dask, chunk=2, progress=progress)
    assert killed
    same(long_local, result)


@pytest.fixture(scope="module")
def ray():
    needed("ray")
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    with executors.RayExecutor(num_cpus=2, include_dashboard=False, log_to_driver=False) as ray:
        yield ray


def test_ray_gives_the_same_bits(base, local, ray):
    assert ray.num_workers == executors._workers(ray) == 2
    same(local, clutch.sweep(base, SAMPLES, executor=ray, **OPTIONS))


def test_a_killed_worker_of_ray_loses_no_row(long, long_local, ray):
    # Two tasks at once, so that both workers report their numbers; eval is a function they surely have.
    busy = "[__import__('os').getpid(), __import__('time').sleep(0.3)][0]"
    pids = {future.result() for future in [ray.submit(eval, busy) for _ in range(4)]}
    progress, killed = killing(lambda: pids)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        result = clutch.sweep(long, LONG, executor=ray, chunk=2, progress=progress)
    assert killed
    same(long_local, result)


def test_an_exception_on_ray_is_the_functions_own(ray):
    with pytest.raises(ZeroDivisionError):
        ray.submit(divmod, 1, 0).result()


# --- Futures that are cancelled ------------------------------------------------------------------


@pytest.fixture
def pool(request):
    """An executor of two workers, by its name."""
    if request.param == "threads":
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            yield pool
    elif request.param == "processes":
        with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
            yield pool
    else:
        executor = request.getfixturevalue(request.param)
        yield executor.get_executor() if request.param == "dask" else executor


class Waiting:
    """A task that notes its begin in a file, and runs until another is there. A worker need not have this module."""

    def __init__(self, pool, folder, name, end):
        self.file = folder / name
        self.end = end
        code = f"""
import os, time
open({str(self.file)!r}, "x").close()
while not os.path.exists({str(end)!r}):
    time.sleep(0.01)
"""
        self.future = pool.submit(exec, code)

    def begun(self):
        """Waits until it has."""
        patience = time.monotonic() + 120
        while not self.file.exists():
            assert time.monotonic() < patience, "it does not begin"
            time.sleep(0.01)


POOLS = pytest.mark.parametrize("pool", ["threads", "processes", "dask", "ray"], indirect=True)


@POOLS
def test_a_future_that_was_cancelled_before_it_began_raises_cancelled_error(pool, tmp_path):
    end = tmp_path / "end"
    # More than a pool of processes hands out in advance. Both workers are busy until the end is there.
    first = [Waiting(pool, tmp_path, f"first {n}", end) for n in range(6)]
    try:
        last = Waiting(pool, tmp_path, "last", end)
        assert last.future.cancel() and last.future.done()
        with pytest.raises(concurrent.futures.CancelledError):
            last.future.result()
        assert last.future.cancel(), "still cancelled"
        assert not last.file.exists()
    finally:
        end.touch()
    assert [task.future.result() for task in first] == [None] * 6
    assert not first[0].future.cancel(), "it has ended"
    assert first[0].future.result() is None


@POOLS
def test_a_future_that_was_cancelled_after_it_began_raises_cancelled_error(pool, tmp_path):
    end = tmp_path / "end"
    task = Waiting(pool, tmp_path, "task", end)
    try:
        task.begun()
        if task.future.cancel():
            assert task.future.done()
            with pytest.raises(concurrent.futures.CancelledError):
                task.future.result()
        else:  # threads and processes of this machine finish what has begun
            assert not isinstance(pool, executors.RayExecutor)
            end.touch()
            assert task.future.result() is None
    finally:
        end.touch()


def test_a_call_on_ray_that_is_cancelled_frees_its_worker(ray, tmp_path):
    never = tmp_path / "never"
    both = [Waiting(ray, tmp_path, f"task {n}", never) for n in range(2)]
    for task in both:
        task.begun()
        assert task.future.cancel()
    assert ray.submit(abs, -1).result() == 1


@pytest.mark.parametrize("begun", [False, True])
def test_a_future_of_ray_that_another_cancels_raises_cancelled_error(ray, tmp_path, begun):
    end = tmp_path / "end"
    tasks = [Waiting(ray, tmp_path, f"task {n}", end) for n in range(2 if begun else 3)]
    try:
        for task in tasks[:2]:
            task.begun()
        ray._ray.cancel(tasks[-1].future._reference)
        with pytest.raises(concurrent.futures.CancelledError) as caught:
            tasks[-1].future.result()
        assert caught.value.__cause__ is not None
    finally:
        end.touch()
    assert tasks[0].future.result() is None


def test_a_future_of_ray_that_is_cancelled_while_a_thread_waits_for_it_gives_that_thread_no_result():
    class Ray:
        """Answers with a result or an exception in the moment in which another thread cancels."""

        exceptions = needed("ray").exceptions

        def __init__(self, answer):
            self.answer = answer

        def wait(self, references, timeout):
            return [], references

        def cancel(self, reference):
            pass

        def get(self, reference):
            assert future.cancel()
            return self.answer()

    for answer in [lambda: 1, lambda: 1 // 0]:
        future = executors._RayFuture(Ray(answer), "reference")
        with pytest.raises(concurrent.futures.CancelledError):
            future.result()


def test_a_task_of_ray_that_ends_while_it_is_cancelled_is_cancelled_for_the_thread_that_waits():
    class Ray:
        """Ends the task within the call that cancels it, before that call returns."""

        exceptions = needed("ray").exceptions

        def wait(self, references, timeout):
            return [], references

        def cancel(self, reference):
            with pytest.raises(concurrent.futures.CancelledError):
                future.result()

        def get(self, reference):
            raise RuntimeError("interrupted")

    future = executors._RayFuture(Ray(), "reference")
    assert future.cancel()


def test_a_ray_that_runs_already_is_left_running(ray):
    with executors.RayExecutor() as second:
        assert second.submit(abs, -1).result() == 1
    assert ray.submit(abs, -2).result() == 2


def test_a_worker_that_is_interrupted_alone_loses_nothing(base, local):
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        victim = pool.submit(os.getpid).result()
        timer = threading.Timer(0.2, os.kill, (victim, signal.SIGINT))
        timer.start()
        there = clutch.sweep(base, SAMPLES, executor=pool, chunk=1, **OPTIONS)
        timer.join()
    assert not there.interrupted
    same(local, there)


class Interrupted(Counting):
    """Its worker is interrupted before it has begun what it got, the first time."""

    def submit(self, function, *arguments):
        if self.chunks:
            return super().submit(function, *arguments)
        self.chunks.append(0)
        error = KeyboardInterrupt()
        error.__cause__ = RuntimeError("as a pool of processes hands over the traceback there")
        future = concurrent.futures.Future()
        future.set_exception(error)
        return future


def test_a_worker_that_is_interrupted_between_two_chunks_loses_nothing(base, local):
    same(local, clutch.sweep(base, SAMPLES, executor=Interrupted(), chunk=7, **OPTIONS))
    # The pool of processes does so.
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        error = pool.submit(signal.raise_signal, signal.SIGINT).exception()
    assert isinstance(error, KeyboardInterrupt) and error.__cause__ is not None


def test_an_ended_sweep_leaves_no_chunk_running_in_threads_of_this_process(base, monkeypatch):
    begun, rows_of_chunks = itertools.count(1), []

    def watched(*arguments):
        if next(begun) == 2:
            interrupt_in(0.2)
        result = _sweep_chunk(*arguments)
        rows_of_chunks.append(len(result[0]))
        return result

    _sweep_chunk = _sweep._run_chunk
    monkeypatch.setattr(_sweep, "_run_chunk", watched)
    long = base.override({"run.duration_s": 100.0})
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = clutch.sweep(long, {"run.seed": range(1, 2001)}, executor=pool, chunk=1000, metrics=[])
    # The pool has waited for the two chunks that had begun.
    assert found.interrupted
    assert len(rows_of_chunks) == 2 and max(rows_of_chunks) < 1000, rows_of_chunks
