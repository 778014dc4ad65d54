#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Work in several processes of this computer, or on a Dask cluster; results come when they are ready."""

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

#: What comes when it is ready: the place of its item, and the result. Closed early it ends what it has begun.
Results = Generator[tuple[int, Result], None, None]

_CLUSTER_TIMEOUT_S = 10


def in_processes(work: Callable[[Item], Result], items: Sequence[Item], processes: int) -> Results[Result]:
    """Does `work`, a function of a module, with all `items`; raises WorkerError if a process is ended from outside."""
    # Spawned and not forked: OpenCV's threads do not live through a fork.
    pool = concurrent.futures.ProcessPoolExecutor(processes, multiprocessing.get_context("spawn"), _end_by_interrupt)
    try:
        # Held back, also in the new processes, until these know how to end.
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
    """Makes an interrupt, which comes from the terminal to all processes, end this one without a word."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def on_cluster(work: Callable[[Item], Result], items: Sequence[Item], address: str) -> Results[Result]:
    """Does `work` with all `items` on the cluster whose scheduler is at `address`.

    Raises
    ------
    WorkerError
        There is no scheduler or no worker, or a worker fails.
    MissingExtraError
        Dask is not installed.
    """
    distributed: Any = import_extra("distributed", "cluster", "--cluster needs")
    # What Dask has to say about a lost cluster it says on stderr, for pages.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with _client(distributed, address) as client:
        if not client.scheduler_info()["workers"]:
            raise WorkerError(f"{address}: the cluster has no workers: start some with `dask worker {address}`")
        # Not pure: a device may answer otherwise the next time.
        futures = {client.submit(work, item, pure=False): index for index, item in enumerate(items)}
        for future in distributed.as_completed(futures, loop=client.loop):
            try:
                result = future.result()
            except Exception as error:
                # Whatever a worker's installation lacks, or how it died.
                raise WorkerError(f"{address}: a worker failed: {' '.join(str(error).split())}: it needs litestereo "
                                  "of this version") from None
            yield futures[future], result


def _client(distributed: Any, address: str) -> Any:
    """Dask's connection to the scheduler at `address`; raises WorkerError if there is none."""
    client = distributed.Client.__new__(distributed.Client)
    try:
        client.__init__(address, timeout=_CLUSTER_TIMEOUT_S, set_as_default=False)
    except (OSError, TimeoutError, TypeError, ValueError):
        # Else Python closes it when it frees it, and if another one is starting at that moment, both wait for ever.
        client.close()
        raise WorkerError(f"{address}: no Dask scheduler answers there: start one with `dask scheduler`, and workers "
                          "with `dask worker`") from None
    return client
