"""Plans of many sizes and truths at once, on one process, on many, or on a cluster.

In: ranges. Out: a `Plan` for every cell. Its studies are drawn in tasks with seeds of
their own and added up in their order, so that who draws them changes no number, and a
file of the tasks that are done lets a grid go on where it stopped.
"""

import hashlib
import itertools
import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

from masrel._files import write_file
from masrel.agreement import Label, WeightsLike
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._aims import RATER_SHARE, Aim, Question, pose_question
from masrel.planning._item_models import LatentModel
from masrel.planning._precision import Plan, plan_from
from masrel.planning._studies import StudyDesign, StudySums
from masrel.planning._tasks import TASK, exact_sums, is_enumerable, run_task

Executor = Literal["processes", "dask"]

_EXACT = -1  # the task of a cell that is summed over all studies
_PERIOD_S = 2.0  # between two writings of what is done


@dataclass(frozen=True, slots=True)
class _GridTask:
    cell: int
    design: StudyDesign
    seed: int
    task: int
    rater_share: float

    def run(self) -> StudySums:
        """Draw its studies, or sum over all."""
        if self.task == _EXACT:
            return exact_sums(self.design)
        return run_task(self.design, self.seed, self.task, TASK, self.rater_share)

    @property
    def key(self) -> str:
        """What tells it from any other task of any grid."""
        text = repr((self.design, self.seed, self.task, self.rater_share, TASK))
        return hashlib.sha256(text.encode()).hexdigest()


def plan_grid(
    coefficient: str,
    *,
    n_items: int | Sequence[int],
    n_raters: int | Sequence[int],
    value: float | Sequence[float] | None,
    weights: WeightsLike = "identity",
    categories: int | Sequence[Label] | None = None,
    prevalences: object = None,
    model: str | LatentModel | None = None,
    target: Target,
    p_missing: float = 0.0,
    level: float = 0.95,
    sides: int = 2,
    half_width: float | None = None,
    lower: float | None = None,
    upper: float | None = None,
    null: float | None = None,
    prices: tuple[float, float, float] = (0.0, 0.0, 1.0),
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    n_studies: int = 20_000,
    executor: Executor | None = None,
    scheduler: str | None = None,
    file: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    rng: np.random.Generator | int | None = None,
) -> tuple[Plan, ...]:
    """Say what studies of many sizes, and under several truths, can show.

    Parameters
    ----------
    coefficient : str
        Its name; see `sample_size`, which has the same parameters.
    n_items, n_raters : int or sequence of int
        Sizes.
    value : float or sequence of float, or None
        True coefficients.
    weights : str or array_like, optional
        How much two categories agree.
    categories : int or sequence, optional
        How many there are, or the scale in order.
    prevalences : sequence of float, or several of them, optional
        Of the categories; with model "table" one table.
    model : str or LatentModel, optional
        How the ratings of an item come about.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    p_missing : float, optional
        Chance of every rating to be missing.
    level : float, optional
        Nominal level of the interval.
    sides : {1, 2}, optional
        How many tails share 1 - level.
    half_width, lower, upper, null : float, optional
        What assurance and power are of; see `precision`.
    prices : tuple of float, optional
        Of an item, a rater, and a rating.
    interval : {"auto", "t", "normal"}, optional
        The interval that is planned.
    rater_share : float, optional
        Of the error of icc_a1, how much the levels of the raters make.
    n_studies : int, optional
        Studies of a cell that is simulated, in whole tasks of 10 000.
    executor : {"processes", "dask"}, optional
        Who runs the tasks; this process when not given. Dask is the extra
        ``masrel[dask]``.
    scheduler : str, optional
        Address of a Dask scheduler; a cluster on this machine when not given.
    file : Path, optional
        Where the tasks that are done are kept; those in it are not run again.
    progress : callable, optional
        Called with how many tasks are done, and of how many.
    rng : numpy.random.Generator or int, optional
        Seed of simulated studies.

    Returns
    -------
    tuple of Plan
        One for each value, prevalences, number of items and number of raters, the last
        of them varying first.

    Raises
    ------
    ParameterError
        If an argument is out of range, Dask is not installed, or `file` is no file of
        a grid.

    Examples
    --------
    >>> plans = plan_grid(
    ...     "scott_pi",
    ...     value=0.6,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_items=[20, 40],
    ...     n_raters=2,
    ...     interval="normal",
    ... )
    >>> [round(plan.expected_half_width, 3) for plan in plans]
    [0.383, 0.274]
    """
    aim = Aim(half_width=half_width, lower=lower, upper=upper, null=null)
    if executor not in (None, "processes", "dask"):
        raise ParameterError(
            f"executor: needs one of processes, dask, got {executor!r}"
        )
    if n_studies < 1:
        raise ParameterError(f"n_studies: needs at least 1, got {n_studies}")
    first: Question | None = None
    cells: list[tuple[Question, StudyDesign]] = []
    for truth, shares in itertools.product(
        _several(value), _several_prevalences(prevalences, model)
    ):
        question = pose_question(
            coefficient=coefficient,
            value=truth,
            weights=weights,
            categories=categories,
            prevalences=shares,
            model=model,
            target=target,
            p_missing=p_missing,
            level=level,
            sides=sides,
            interval=interval,
            method="auto",
            aim=aim.checked(needs_chance=False),
            prices=prices,
            max_cost=None,
            rng=rng if first is None else first.seed,
            rater_share=rater_share,
        )
        first = first or question
        cells += [
            (question, question.design(n, r))
            for n, r in itertools.product(_several(n_items), _several(n_raters))
        ]
    tasks = [
        _GridTask(cell, design, question.seed, task, question.rater_share)
        for cell, (question, design) in enumerate(cells)
        for task in _task_numbers(design, n_studies)
    ]
    sums = _sums_of(tasks, executor, scheduler, file, progress)
    plans = []
    for cell, (question, design) in enumerate(cells):
        parts = [sums[task.key] for task in tasks if task.cell == cell]
        total = StudySums(np.sum([part.sums for part in parts], axis=0))
        is_exact = is_enumerable(design)
        plans.append(plan_from(question, design, total, is_exact))
    return tuple(plans)


_T = TypeVar("_T")


def _several(values: _T | Sequence[_T]) -> Sequence[_T]:
    return values if isinstance(values, Sequence) else (values,)


def _several_prevalences(prevalences: object, model: object) -> Sequence[object]:
    if isinstance(prevalences, Sequence) and model != "table":
        is_rows = len(prevalences) > 0 and isinstance(prevalences[0], Sequence)
        return prevalences if is_rows else [prevalences]
    return [prevalences]


def _task_numbers(design: StudyDesign, n_studies: int) -> Iterable[int]:
    if is_enumerable(design):
        return (_EXACT,)
    return range(max(1, -(-n_studies // TASK)))


def _sums_of(
    tasks: list[_GridTask],
    executor: Executor | None,
    scheduler: str | None,
    file: Path | None,
    progress: Callable[[int, int], None] | None,
) -> dict[str, StudySums]:
    sums = _read(file)
    due = [task for task in tasks if task.key not in sums]
    n_done, written = len(tasks) - len(due), time.monotonic()
    try:
        for task, result in _results(due, executor, scheduler):
            sums[task.key] = result
            n_done += 1
            if progress is not None:
                progress(n_done, len(tasks))
            if file is not None and time.monotonic() - written > _PERIOD_S:
                _write(file, sums)
                written = time.monotonic()
    finally:
        if file is not None:
            _write(file, sums)
    return sums


def _results(
    tasks: list[_GridTask], executor: Executor | None, scheduler: str | None
) -> Iterator[tuple[_GridTask, StudySums]]:
    if executor is None or not tasks:
        yield from ((task, task.run()) for task in tasks)
    elif executor == "processes":
        yield from _by_processes(tasks)
    else:
        yield from _by_dask(tasks, scheduler)


def _by_processes(tasks: list[_GridTask]) -> Iterator[tuple[_GridTask, StudySums]]:
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(mp_context=context) as pool:
        futures = {pool.submit(_GridTask.run, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _by_dask(
    tasks: list[_GridTask], scheduler: str | None
) -> Iterator[tuple[_GridTask, StudySums]]:
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise ParameterError(
            'executor: "dask" needs Dask: pip install "masrel[dask]"'
        ) from error
    try:
        client = Client(  # type: ignore[no-untyped-call]
            scheduler, set_as_default=False, timeout="10s"
        )
    except OSError as error:
        raise ParameterError(
            f"scheduler: needs the address of a Dask scheduler, got {scheduler}: "
            f"{error}"
        ) from error
    with client, client.as_current():
        # A task whose worker dies is run again by another.
        futures = client.map(_GridTask.run, tasks, key=[t.key for t in tasks])
        of_key = {task.key: task for task in tasks}
        done = as_completed(futures, with_results=True)  # type: ignore[no-untyped-call]
        for future, result in done:
            yield of_key[future.key], result


def _read(file: Path | None) -> dict[str, StudySums]:
    if file is None or not file.exists():
        return {}
    try:
        held = json.loads(file.read_text("utf-8"))
        return {key: StudySums(np.array(sums)) for key, sums in held.items()}
    except (ValueError, AttributeError) as error:
        raise ParameterError(
            f"file: needs what a grid has written, got {file}: {error}"
        ) from error


def _write(file: Path, sums: dict[str, StudySums]) -> None:
    lines = {key: result.sums.tolist() for key, result in sums.items()}
    write_file(file, json.dumps(lines, indent=0))
