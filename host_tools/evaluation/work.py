#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The work of an evaluation: pairs and matchers, cut into tasks that may run elsewhere."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..core.errors import LiteStereoError, UsageError
from ..core.images import disparity_pixels
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from ..data.datasets import StereoPair
from ..data.regions import regions
from ..data.samples import Sample, SampleFiles
from .matchers import is_shared, open_matcher
from .metrics import measure
from .parallel import in_processes, on_cluster


@dataclass(frozen=True)
class LoadedSample:
    """A pair that is in memory already, where `SampleFiles` says where it is."""

    name:  str
    pair:  StereoPair
    ndisp: int | None = None

    def load(self) -> Sample:
        """The pair with its regions."""
        return Sample(self.name, self.pair.left, self.pair.right, self.pair.truth, regions(self.pair.truth))


#: A pair, and what it is matched with.
Job = tuple[SampleFiles | LoadedSample, MatcherSettings]


@dataclass(frozen=True)
class Row:
    """Metrics, by their names in `metrics.METRICS`, of the map of one pair by one matcher in one region."""

    pair:    str
    matcher: str
    region:  str
    metrics: dict[str, float]


@dataclass(frozen=True)
class Task:
    """Pairs that one matcher matches, one after the other."""

    matcher: str
    jobs:    tuple[Job, ...]
    speckle: SpeckleFilter


def tasks_of(matchers: Sequence[str], jobs: Sequence[Job], speckle: SpeckleFilter) -> list[Task]:
    """All pairs by all matchers: a task for each pair, or one for all of them where a device has one host at a time."""
    tasks: list[Task] = []
    for matcher in matchers:
        parts  = [(job,) for job in jobs] if is_shared(matcher) else [tuple(jobs)]
        tasks += [Task(matcher, part, speckle) for part in parts]
    return tasks


def rows_of(task: Task, done: Callable[[], None] | None = None) -> list[Row]:
    """Does a task; `done` is called after each pair.

    Raises
    ------
    LiteStereoError
        A matcher cannot be opened, or fails; a pair cannot be read, or does not suit the matcher.
    """
    rows: list[Row] = []
    with contextlib.closing(open_matcher(task.matcher)) as matcher:
        for source, settings in task.jobs:
            sample    = source.load()
            disparity = task.speckle.apply(matcher.match(sample.left, sample.right, settings), settings)
            pixels    = disparity_pixels(disparity, settings.invalid)
            rows     += [Row(source.name, task.matcher, name, measure(pixels, sample.truth, region, source.ndisp))
                         for name, region in sample.regions.items()]
            if done is not None:
                done()
    return rows


def _rows_elsewhere(task: Task) -> list[Row] | LiteStereoError:
    """As `rows_of`, for another process: not every error comes back from there, but every text does."""
    try:
        return rows_of(task)
    except UsageError as error:
        return UsageError(str(error))
    except LiteStereoError as error:
        return LiteStereoError(str(error))


def evaluate(tasks: Sequence[Task], done: Callable[[int], None], processes: int = 1,
             cluster: str | None = None) -> list[Row]:
    """Does all tasks.

    Parameters
    ----------
    tasks
        See `tasks_of`.
    done
        Is called with the number of pairs that were matched since the last call.
    processes
        Number of processes of this computer; 1 is this one.
    cluster
        Address of the scheduler of a Dask cluster, whose workers see the same files, in place of processes.

    Returns
    -------
    The rows in the order of the tasks.

    Raises
    ------
    LiteStereoError
        As `rows_of`; the first error ends the evaluation.
    WorkerError, MissingExtraError
        A process was ended; there is no such cluster, or Dask is not installed.
    """
    if cluster is None and processes == 1:
        return [row for task in tasks for row in rows_of(task, lambda: done(1))]
    if cluster is not None:
        results = on_cluster(_rows_elsewhere, tasks, cluster)
    else:
        results = in_processes(_rows_elsewhere, tasks, processes)
    rows: dict[int, list[Row]] = {}
    with contextlib.closing(results):
        for index, result in results:
            if isinstance(result, LiteStereoError):
                raise result
            rows[index] = result
            done(len(tasks[index].jobs))
    return [row for index in sorted(rows) for row in rows[index]]
