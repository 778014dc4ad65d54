#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Work in several processes of this computer, or on a Dask cluster; results are yielded as they become ready."""

from __future__ import annotations

import concurrent.futures
import concurrent.futures.process
import logging
import multiprocessing
import signal
from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

from ..core.errors import WorkerError
from ..core.extras import import_extra

Item   = TypeVar("Item")
Result = TypeVar("Result")

#: Yields the index of an item and its result, as they become ready. Closing it early ends the work.
Results = Generator[tuple[int, Result], None, None]

_CLUSTER_TIMEOUT_S = 10


def in_processes(work: Callable[[Item], Result], items: Sequence[Item], processes: int) -> Results[Result]:
    """Call `work`, a function of a module, with each of the items in a pool of processes.

    Raises
    ------
    WorkerError
        A process was ended from outside.
    """
    # Spawned, not forked: a fork does not copy OpenCV's threads.
    pool = concurrent.futures.ProcessPoolExecutor(processes, multiprocessing.get_context("spawn"), _end_by_interrupt)
    try:
        # An interrupt waits, in the new processes too, until these have installed their handler.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            futures = {pool.submit(work, item): index for index, item in enumerate(items)}
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        for future in concurrent.futures.as_completed(futures):
            yield futures[future], future.result()
    except concurrent.futures.process.BrokenProcessPool:
        raise WorkerError("a process was ended by the system: is there enough memory? Take fewer --jobs") from None
    finally:
        pool.shutdown(cancel_futures=True)


def _end_by_interrupt() -> None:
    """Let an interrupt, which the terminal sends to all processes, end this one silently."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def on_cluster(work: Callable[[Item], Result], items: Sequence[Item], address: str) -> Results[Result]:
    """Call `work` with each of the items on the cluster whose scheduler is at `address`.

    Raises
    ------
    WorkerError
        There is no scheduler or no worker, or a worker fails.
    MissingExtraError
        Dask is not installed.
    """
    distributed: Any = import_extra("distributed", "cluster", "--cluster needs")
    # Dask would log pages about a lost cluster.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with _client(distributed, address) as client:
        if not client.scheduler_info()["workers"]:
            raise WorkerError(f"{address}: the cluster has no workers: start some with `dask worker {address}`")
        # Not pure: a device may give another result, so Dask must not reuse one.
        futures = {client.submit(work, item, pure=False): index for index, item in enumerate(items)}
        for future in distributed.as_completed(futures, loop=client.loop):
            try:
                result = future.result()
            except Exception as error:
                # Any error: a package that the worker lacks, another version, or the worker's death.
                raise WorkerError(f"{address}: a worker failed: {' '.join(str(error).split())}: it needs litestereo "
                                  "of this version") from None
            yield futures[future], result


def _client(distributed: Any, address: str) -> Any:
    """Connect to the scheduler at `address`; raise WorkerError if there is none."""
    client = distributed.Client.__new__(distributed.Client)
    try:
        client.__init__(address, timeout=_CLUSTER_TIMEOUT_S, set_as_default=False)
    except (OSError, TimeoutError, TypeError, ValueError):
        # Without this Python closes the client when it frees it. If another one starts at that moment, both wait for
        # ever.
        client.close()
        raise WorkerError(f"{address}: no Dask scheduler answers there: start one with `dask scheduler`, and workers "
                          "with `dask worker`") from None
    return client
