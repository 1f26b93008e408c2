"""Plans of many sizes and truths at once, on one process, on many, or on a cluster.

In: ranges. Out: a `Plan` for every cell. Its studies are drawn in tasks with seeds of
their own and added up in their order, so that who draws them changes no number, and a
file of the tasks that are done lets a grid go on where it stopped.
"""

import hashlib
import itertools
import json
import re
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from masrel._files import write_file
from masrel.agreement import Label, WeightsLike
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._aims import Aim
from masrel.planning._item_models import LatentModel
from masrel.planning._plan_question import RATER_SHARE, Question, pose_question
from masrel.planning._precision import Plan, plan_from
from masrel.planning._smallest_size import Search
from masrel.planning._studies import StudyDesign, StudySums
from masrel.planning._tasks import TASK, exact_sums, is_enumerable, run_task

Executor = Literal["processes", "dask"]
GridProgress = Callable[[int, int], None]  # tasks that are done, and of how many

_EXACT = -1  # the task of a cell that is summed over all studies
_ADDRESS = re.compile(r"(\w+://)?[^\s/]+:[0-9]+/?")
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


@dataclass(frozen=True, slots=True)
class _SizeTask:
    """A cell of which one size is solved for."""

    question: Question
    n_items: int | None
    n_raters: int | None

    def run(self) -> Plan:
        """Solve for it, or return the best that can be had."""
        search = Search(self.question, n_items=self.n_items, n_raters=self.n_raters)
        return search.reached()

    @property
    def key(self) -> str:
        """What tells it from any other."""
        text = repr((self.question, self.n_items, self.n_raters))
        return hashlib.sha256(text.encode()).hexdigest()


def plan_grid(
    coefficient: str,
    *,
    n_items: int | Sequence[int] | None,
    n_raters: int | Sequence[int] | None,
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
    power: float | None = None,
    assurance: float | None = None,
    prices: tuple[float, float, float] = (0.0, 0.0, 1.0),
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    n_studies: int = 20_000,
    executor: Executor | None = None,
    scheduler: str | None = None,
    file: Path | None = None,
    progress: GridProgress | None = None,
    rng: np.random.Generator | int | None = None,
) -> tuple[Plan, ...]:
    """Say what studies of many sizes, and under several truths, can show.

    Parameters
    ----------
    coefficient : str
        Its name.
    n_items, n_raters : int or sequence of int, or None
        Sizes. Where one is None it is solved for in every cell.
    value : float or sequence of float, or None
        True coefficients.
    weights, categories : optional
        As of `sample_size`.
    prevalences : sequence of float, or several of them, optional
        Of the categories; with model "table" one table.
    model, target, p_missing, level, sides : optional
        What else is taken to be true, and the interval, as of `sample_size`.
    half_width, lower, upper, null, power, assurance : float, optional
        The aim, as of `sample_size`: the plans say which of them reach it.
    prices, interval, rater_share : optional
        As of `sample_size`.
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
        of them varying first. Where a size is solved for and none reaches the aim, the
        best that can be had, whose `reaches_aim` is False.

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
    _check_executor(executor, scheduler)
    if n_studies < 1:
        raise ParameterError(f"n_studies: needs at least 1, got {n_studies}")
    is_solved = _check_sizes(n_items, n_raters, file)
    aim = Aim(
        half_width=half_width,
        lower=lower,
        upper=upper,
        null=null,
        power=power,
        assurance=assurance,
    ).checked(needs_chance=is_solved or power is not None or assurance is not None)
    questions: list[Question] = []
    truths = itertools.product(
        _several(value), _several_prevalences(prevalences, model)
    )
    for truth, shares in truths:
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
            aim=aim,
            prices=prices,
            max_cost=None,
            rng=questions[0].seed if questions else rng,
            rater_share=rater_share,
        )
        questions.append(question)
    sizes = itertools.product(questions, _several(n_items), _several(n_raters))
    if is_solved:
        return _solved(
            [_SizeTask(*cell) for cell in sizes], executor, scheduler, progress
        )
    cells = [(question, question.design(n or 0, r or 0)) for question, n, r in sizes]
    return _described(cells, n_studies, executor, scheduler, file, progress)


def _check_executor(executor: str | None, scheduler: str | None) -> None:
    if executor not in (None, "processes", "dask"):
        raise ParameterError(
            f"executor: needs one of processes, dask, got {executor!r}"
        )
    if scheduler is not None and executor != "dask":
        raise ParameterError(
            f'scheduler: is of executor "dask" alone, got {executor!r}'
        )


def _check_sizes(n_items: object, n_raters: object, file: Path | None) -> bool:
    # whether one of both is solved for
    if n_items is None and n_raters is None:
        raise ParameterError("n_items, n_raters: a grid needs one of them, got none")
    is_solved = n_items is None or n_raters is None
    if is_solved and file is not None:
        raise ParameterError("file: is of grids of which both sizes are known")
    return is_solved


def _solved(
    tasks: list[_SizeTask],
    executor: Executor | None,
    scheduler: str | None,
    progress: GridProgress | None,
) -> tuple[Plan, ...]:
    if tasks and tasks[0].question.aim.kind is None:
        raise ParameterError(
            "half_width: needs an aim, where one of the sizes is solved for; got none"
        )
    plans: dict[str, Plan] = {}
    for task, plan in _results(tasks, executor, scheduler):
        plans[task.key] = plan
        if progress is not None:
            progress(len(plans), len(tasks))
    return tuple(plans[task.key] for task in tasks)


def _described(
    cells: list[tuple[Question, StudyDesign]],
    n_studies: int,
    executor: Executor | None,
    scheduler: str | None,
    file: Path | None,
    progress: GridProgress | None,
) -> tuple[Plan, ...]:
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


_Value = TypeVar("_Value")
_T = TypeVar("_T", _GridTask, _SizeTask)


def _several(values: _Value | Sequence[_Value]) -> Sequence[_Value]:
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
    progress: GridProgress | None,
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
    tasks: Sequence[_T], executor: Executor | None, scheduler: str | None
) -> Iterator[tuple[_T, Any]]:
    if executor is None or not tasks:
        yield from ((task, task.run()) for task in tasks)
    elif executor == "processes":
        yield from _by_processes(tasks)
    else:
        yield from _by_dask(tasks, scheduler)


def _run(task: _GridTask | _SizeTask) -> StudySums | Plan:
    return task.run()


def _by_processes(tasks: Sequence[_T]) -> Iterator[tuple[_T, Any]]:
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(mp_context=context) as pool:
        futures = {pool.submit(_run, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _by_dask(tasks: Sequence[_T], scheduler: str | None) -> Iterator[tuple[_T, Any]]:
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise ParameterError(
            'executor: "dask" needs Dask: pip install "masrel[dask]"'
        ) from error
    # a client that never connected takes long to give up
    if scheduler is not None and not _ADDRESS.fullmatch(scheduler):
        raise ParameterError(
            f"scheduler: needs an address as tcp://127.0.0.1:8786, got {scheduler!r}"
        )
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
        futures = client.map(_run, tasks, key=[t.key for t in tasks])
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
