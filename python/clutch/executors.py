"""Executors, which run the chunks of a sweep when this machine is not enough.

`clutch.sweep` takes any object with ``submit(function, *arguments)`` that returns a future with ``done()``,
``result()`` and ``cancel()``: the executors of ``concurrent.futures``, loky and mpi4py, a
``distributed.Client`` or its ``get_executor()``, and `RayExecutor`, which gives Ray that interface.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import Any, Protocol

from clutch._extras import needed

__all__ = ["Executor", "Future", "RayExecutor"]

#: Times that a chunk is submitted before it runs in this process.
_ATTEMPTS = 4
#: Longest time between two checks of the futures, s. Ctrl-C is answered within it.
_LONGEST_WAIT_S = 0.05


class Future(Protocol):
    """The result of an executor's ``submit``.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor() as pool:
    ...     future = pool.submit(abs, -1)
    ...     future.result(), future.done(), future.cancel()
    (1, True, False)
    """

    def done(self) -> bool:
        """True if it has ended, with a result or an exception."""
        ...

    def result(self) -> Any:
        """The function's result, or its exception; ``concurrent.futures.CancelledError`` if it was cancelled."""
        ...

    def cancel(self) -> Any:
        """Ask it not to begin. A true answer says that it is cancelled."""
        ...


class Executor(Protocol):
    """The interface that `clutch.sweep` needs of an executor.

    Examples
    --------
    >>> import clutch
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(2) as pool:
    ...     result = clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}, executor=pool)
    >>> result.table["law.smc.kp_v"].tolist()
    [3.0, 4.0]
    """

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future:
        """Run the function somewhere, some time."""
        ...


class _RayFuture:
    def __init__(self, ray: Any, reference: Any) -> None:
        self._ray, self._reference = ray, reference
        # Kept here: what Ray answers for a cancelled task depends on whether it had begun, and how far it came.
        self._cancelled = False

    def done(self) -> bool:
        if self._cancelled:
            return True
        ready, _ = self._ray.wait([self._reference], timeout=0)
        return bool(ready)

    def result(self) -> Any:
        try:
            result = None if self._cancelled else self._ray.get(self._reference)
        except Exception as e:
            # By another thread meanwhile, or by somebody who has the reference.
            if self._cancelled or isinstance(e, self._ray.exceptions.TaskCancelledError):
                raise CancelledError from e
            raise
        if self._cancelled:
            raise CancelledError
        return result

    def cancel(self) -> bool:
        if not self.done():
            # First: a thread that waits for the result may see the end of the task before this one goes on.
            self._cancelled = True
            self._ray.cancel(self._reference)
        return self._cancelled


class RayExecutor:
    """Runs a sweep's chunks on Ray.

    Ray is started with the given options if it does not run yet, and is shut down at the end only if it was
    started here. The workers need clutch installed.

    Parameters
    ----------
    **ray_init
        Passed to ``ray.init``, as ``address="auto"`` for a running cluster or ``num_cpus=4``.

    Raises
    ------
    ImportError
        Ray is not installed: ``pip install 'clutch-control[ray]'``.

    Examples
    --------
    >>> from clutch.executors import RayExecutor
    >>> with RayExecutor(num_cpus=2) as ray:                                      # doctest: +SKIP
    ...     result = clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}, executor=ray)
    """

    def __init__(self, **ray_init: Any) -> None:
        with needed("ray", "RayExecutor"):
            self._ray: Any = importlib.import_module("ray")
        self._started = not self._ray.is_initialized()
        if self._started:
            self._ray.init(**ray_init)
        self._call = self._ray.remote(_call)

    @property
    def num_workers(self) -> int:
        """CPUs of the cluster.

        Examples
        --------
        >>> RayExecutor(num_cpus=2).num_workers                                   # doctest: +SKIP
        2
        """
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future:
        """Run a function on a worker.

        Parameters
        ----------
        function
            Any callable that can be pickled.
        *arguments
            Its arguments.

        Returns
        -------
        Future
            With ``done()``, ``result()`` and ``cancel()``. Cancelling also stops a call that has begun: its worker
            is interrupted, as by Ctrl-C. ``cancel()`` is false, and changes nothing, once the call has ended.

        Examples
        --------
        >>> RayExecutor(num_cpus=2).submit(abs, -1).result()                      # doctest: +SKIP
        1
        """
        return _RayFuture(self._ray, self._call.remote(function, *arguments))

    def shutdown(self) -> None:
        """Shut Ray down if it was started here.

        Examples
        --------
        >>> RayExecutor(num_cpus=2).shutdown()                                    # doctest: +SKIP
        """
        if self._started:
            self._ray.shutdown()
            self._started = False

    def __enter__(self) -> RayExecutor:
        return self

    def __exit__(self, *exception: object) -> None:
        self.shutdown()


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(*arguments)


def _workers(executor: Any) -> int | None:
    """Number of chunks that run at once, if the executor reports it."""
    for name in ("_max_workers", "num_workers"):
        n = getattr(executor, name, None)
        if isinstance(n, int) and n > 0:
            return n
    ncores: Any = getattr(getattr(executor, "_client", executor), "ncores", None)
    return None if ncores is None else sum(ncores().values()) or None


def _run(
    executor: Any,
    function: Callable[..., Any],
    chunks: list[tuple[Any, ...]],
    done: Callable[[int, Any], None],
) -> dict[int, BaseException]:
    """Call ``function(*chunk, attempt)`` for each chunk, and ``done(number, result)`` for each that ended.

    A chunk that fails is submitted again, up to four times in all: if one worker died, another may live.

    Returns
    -------
    dict
        The chunks that the executor could not run, by number, each with its last exception.
    """
    # dask's own futures wake nobody up while its event loop is busy; those of its executor do.
    if hasattr(executor, "get_executor"):
        executor = executor.get_executor()
    failed: dict[int, BaseException] = {}
    pending: dict[int, tuple[Future, int]] = {}

    def submit(number: int, attempt: int) -> None:
        try:
            # The number of the attempt makes the call another one for a scheduler that answers equal
            # calls with one result, as dask: it would answer with the failure again.
            pending[number] = (executor.submit(function, *chunks[number], attempt), attempt)
        except Exception as e:  # the executor itself is broken or shut down
            failed[number] = e

    def take(number: int) -> None:
        future, attempt = pending.pop(number)
        try:
            result = future.result()
        except (Exception, KeyboardInterrupt) as e:
            # A worker's KeyboardInterrupt comes with the worker's traceback as its cause; Ctrl-C here has none.
            if isinstance(e, KeyboardInterrupt) and e.__cause__ is None:
                raise
            if attempt < _ATTEMPTS:
                submit(number, attempt + 1)
            else:
                failed[number] = e
        else:
            done(number, result)

    try:
        for number in range(len(chunks)):
            submit(number, 1)
            # An executor that runs a chunk at once: its progress is to be seen, and kept after Ctrl-C.
            if number in pending and pending[number][0].done():
                take(number)
        wait = 1e-3
        while pending:
            ended = [number for number, (future, _) in pending.items() if future.done()]
            wait = min(2.0 * wait, _LONGEST_WAIT_S) if not ended else 1e-3
            for number in ended:
                take(number)
            if not ended:
                time.sleep(wait)
    finally:
        for future, _ in pending.values():
            future.cancel()
    return failed
