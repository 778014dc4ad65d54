#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The work of an evaluation: pairs and matchers, cut into tasks that other processes can run."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..core.disparity_map import DisparityMap
from ..core.errors import LiteStereoError, UsageError
from ..core.filters import FilterChain
from ..core.settings import MatcherSettings
from ..core.speckle import SpeckleFilter
from ..data.datasets import StereoPair
from ..data.regions import regions
from ..data.samples import Sample, SampleFiles
from .matchers import is_shared, open_matcher
from .metrics import beyond_range, measure_map
from .parallel import in_processes, on_cluster


@dataclass(frozen=True)
class LoadedSample:
    """A pair that is in memory already, in place of `SampleFiles`."""

    name:  str
    pair:  StereoPair
    ndisp: int | None = None

    @property
    def files(self) -> list[Path]:
        """The files that are read: none."""
        return []

    def load(self) -> Sample:
        """Return the pair with its regions."""
        return Sample(self.name, self.pair.left, self.pair.right, self.pair.truth, regions(self.pair.truth))


#: A pair, and the settings to match it with.
Job = tuple[SampleFiles | LoadedSample, MatcherSettings]


@dataclass(frozen=True)
class Row:
    """Metrics, by their names in `metrics.METRICS`, of the map of one pair by one matcher in one region.

    `notes` is what has to be said of the pair, a line each.
    """

    pair:    str
    matcher: str
    region:  str
    metrics: dict[str, float]
    notes:   tuple[str, ...] = ()


@dataclass(frozen=True)
class Task:
    """Pairs for one matcher, one after the other."""

    matcher: str
    jobs:    tuple[Job, ...]
    speckle: SpeckleFilter
    filters: FilterChain = field(default_factory=FilterChain)


def tasks_of(matchers: Sequence[str], jobs: Sequence[Job], speckle: SpeckleFilter,
             filters: FilterChain | None = None) -> list[Task]:
    """Return the tasks for all pairs and matchers: one per pair, or one for all pairs if a device takes one host."""
    tasks: list[Task] = []
    for matcher in matchers:
        parts  = [(job,) for job in jobs] if is_shared(matcher) else [tuple(jobs)]
        tasks += [Task(matcher, part, speckle, filters or FilterChain()) for part in parts]
    return tasks


def rows_of(task: Task, done: Callable[[], None] | None = None) -> list[Row]:
    """Run a task, and call `done` after each pair; return a row for each pair and region.

    Raises
    ------
    LiteStereoError
        A matcher cannot be opened, or fails; a pair cannot be read, or does not fit the matcher; a filter needs the
        cameras.
    """
    rows: list[Row] = []
    with contextlib.closing(open_matcher(task.matcher)) as matcher:
        for source, settings in task.jobs:
            sample    = source.load()
            disparity = task.speckle.apply(matcher.match(sample.left, sample.right, settings), settings)
            task.filters.reset() # Each pair is of another scene.
            filtered  = task.filters.process(DisparityMap(disparity, settings))
            pixels    = filtered.in_images(disparity.shape)
            beyond    = beyond_range(sample.truth, settings.min_disparity, settings.disparities)
            notes     = (*sample.notes, *([f"{source.name}: {beyond}"] if beyond else []))
            rows     += [Row(source.name, task.matcher, name,
                             measure_map(pixels, sample.truth, region, source.ndisp), notes)
                         for name, region in sample.regions.items()]
            if done is not None:
                done()
    return rows


def _rows_elsewhere(task: Task) -> list[Row] | LiteStereoError:
    """Run a task in another process, and return its error: not every error can be pickled, but its text can."""
    try:
        return rows_of(task)
    except UsageError as error:
        return UsageError(str(error))
    except LiteStereoError as error:
        return LiteStereoError(str(error))


def evaluate(tasks: Sequence[Task], done: Callable[[int], None], processes: int = 1,
             cluster: str | None = None) -> list[Row]:
    """Run all tasks.

    Parameters
    ----------
    tasks
        See `tasks_of`.
    done
        Called with the number of pairs that were matched since the last call.
    processes
        Number of processes on this computer; with 1 this process does the work.
    cluster
        Address of the scheduler of a Dask cluster, to work there instead; its workers must see the same files.

    Returns
    -------
    The rows in the order of the tasks.

    Raises
    ------
    LiteStereoError
        As `rows_of`; the first error ends the evaluation.
    WorkerError, MissingExtraError
        A process was ended from outside; the cluster is not there, or Dask is not installed.
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
