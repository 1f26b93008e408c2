"""How large a study must be: the smallest size, the cheapest design, grids of both."""

import itertools
import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal

from masrel._input import refuse
from masrel.errors import ParameterError
from masrel.planning._formulas import (
    check_has_numbers,
    items_by_half,
    items_nearby,
    numbers_by_formula,
    size_by_formula,
)
from masrel.planning._studies import shown
from masrel.planning._study_plan import (
    FORMULAS,
    Plan,
    Progress,
    Study,
    aim_words,
    chance_of,
    check_aim,
    has_aim,
    is_met,
    number_of,
    reached_words,
)
from masrel.planning._truth import Design, design_of

_FEWEST_ITEMS, _MAX_ITEMS, _MAX_RATERS = 2, 100_000, 60
_SOME_ITEMS = 20  # of a study that is looked at first, where no formula says a size
_FAR = 1.3  # times a size: where a formula asks for more, the size does not do
_MAX_SCAN = 1_500_000  # tables that are looked at around a size
_PATIENCE = 4  # numbers of raters that are no better, after which none will be
# studies that are looked at first, fewer where intervals are chosen, and how many
# of their Monte Carlo errors leave no doubt
_FEW_STUDIES, _FEW_CHOSEN, _SURE = 1_000, 250, 5.0
_CHEAPER = 1.0 - 1e-9
# sizes that grow on both sides, until one reaches the aim
_STEPS = ((15, 3), (30, 4), (60, 6), (120, 8), (250, 12), (500, 20), (1000, 40))


def precision(study: Study, *, progress: Progress | None = None) -> Plan:
    """Compute what a study of a given size can show.

    Parameters
    ----------
    study : Study
        With `n_items` and `n_raters`. With `half_width`, `lower` or `upper` the plan's
        assurance is the chance of an interval as narrow, or inside these; with `null`
        its power is the chance of an interval that excludes it.
    progress : callable, optional
        Called as studies are drawn, with how many there are and how many there will be.

    Returns
    -------
    Plan
        What the study shows.

    Raises
    ------
    ParameterError
        If something does not fit the coefficient, or a size is missing.

    Examples
    --------
    >>> study = Study(
    ...     "icc_1", value=0.6, n_items=100, n_raters=3, target="both", half_width=0.1
    ... )
    >>> plan = precision(study)
    >>> round(plan.expected_half_width, 4), round(plan.assurance, 3)
    (0.0995, 0.513)
    """
    refuse(
        (
            None in (study.n_items, study.n_raters),
            "n_items, n_raters: needs both to show a study",
        )
    )
    check_aim(study, is_solved=False)
    design = design_of(study)
    check_has_numbers(design)
    return _plan_of(design, progress)


def sample_size(study: Study, *, progress: Progress | None = None) -> Plan:
    """Solve for the number of items or of raters that a study needs.

    Parameters
    ----------
    study : Study
        With exactly one of `n_items` and `n_raters`: the other is solved for. With
        `prices` neither: the cheapest study is.
    progress : callable, optional
        As of `precision`, for each size that is looked at.

    Returns
    -------
    Plan
        The smallest study that reaches the aim, or the cheapest, and what it shows.

    Raises
    ------
    ParameterError
        If something does not fit the coefficient, or nothing reaches the aim; the
        message then says what is the best that can be had.

    Notes
    -----
    A chance is not monotone in the number of items: an exact plan with `assurance` or
    `power` gives the size from which on it holds, and notes the first.

    Examples
    --------
    How many items have an expected half-width of 0.15?

    >>> study = Study(
    ...     "scott_pi",
    ...     value=0.5,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_raters=2,
    ...     half_width=0.15,
    ...     interval="normal",
    ... )
    >>> plan = sample_size(study)
    >>> plan.n_items, plan.method
    (154, 'exact')
    """
    n_known = (study.n_items is not None) + (study.n_raters is not None)
    got = "both" if n_known else "neither, and no prices to find the cheapest"
    refuse(
        (
            n_known == 2 or (n_known == 0 and study.prices is None),
            "n_items, n_raters: needs exactly one of them, because the other is "
            f"solved for, got {got}",
        )
    )
    check_aim(study, is_solved=True)
    design = design_of(study)
    if n_known == 0:
        return _cheapest(design, progress)
    return _reaching(_Search(design, progress).reached())


def plan_grid(
    study: Study,
    *,
    n_items: int | Sequence[int] | None = None,
    n_raters: int | Sequence[int] | None = None,
    value: float | Sequence[float] | None = None,
    prevalences: object = None,
    executor: Literal["dask"] | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> tuple[Plan, ...]:
    """Compute what studies of many sizes can show, under several true values.

    Parameters
    ----------
    study : Study
        What all of them share. Its method is "auto".
    n_items, n_raters : int or sequence of int, optional
        Sizes; those of `study` when not given. One that is None is solved for in every
        cell.
    value : float or sequence of float, optional
        True coefficients.
    prevalences : sequence of float, or several of them, optional
        Shares of the categories; with model "table" one table.
    executor : {"dask"}, optional
        Who plans the cells; this process when not given. Dask is the extra
        ``masrel[dask]``.
    scheduler : str, optional
        Address of a Dask scheduler; a cluster on this machine when not given.
    progress : callable, optional
        Called with how many cells are done, and of how many.

    Returns
    -------
    tuple of Plan
        One for each value, prevalences, number of items and number of raters, the last
        of them varying first. If a size is solved for and none reaches the aim, the
        best plan, whose `reaches_aim` is False.

    Raises
    ------
    ParameterError
        If something does not fit the coefficient, or Dask is not installed.

    Examples
    --------
    >>> study = Study(
    ...     "scott_pi",
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_raters=2,
    ...     interval="normal",
    ... )
    >>> plans = plan_grid(study, value=0.6, n_items=[20, 40])
    >>> [round(plan.expected_half_width, 3) for plan in plans]
    [0.383, 0.274]
    """
    sizes = [
        _several(study.n_items if n_items is None else n_items),
        _several(study.n_raters if n_raters is None else n_raters),
    ]
    shares: Any = study.prevalences if prevalences is None else prevalences
    is_rows = isinstance(shares, Sequence) and isinstance(shares[0], Sequence)
    truths = itertools.product(
        _several(study.value if value is None else value),
        shares if is_rows and study.model != "table" else (shares,),
    )
    is_solved = [None in several for several in sizes]
    refuse(
        (all(is_solved), "n_items, n_raters: a grid needs one of them, got none"),
        (
            study.method != "auto",
            "method: a grid needs auto, which is exact if possible, got "
            f"{study.method}",
        ),
        (
            executor not in (None, "dask"),
            f'executor: needs "dask", or nothing for this process, got {executor!r}',
        ),
        (
            scheduler is not None and executor is None,
            'scheduler: needs executor "dask", got none',
        ),
    )
    check_aim(study, is_solved=any(is_solved))
    cells = [
        design_of(replace(study, value=truth, prevalences=share, n_items=n, n_raters=r))
        for (truth, share), n, r in itertools.product(truths, *sizes)
    ]
    planned = map(_planned, cells) if executor is None else _by_dask(cells, scheduler)
    plans: list[Plan] = []
    for plan in planned:
        plans.append(plan)
        if progress is not None:
            progress(len(plans), len(cells))
    return tuple(plans)


def _several(values: Any) -> Sequence[Any]:
    return values if isinstance(values, Sequence) else (values,)


def _planned(design: Design) -> Plan:
    # a cell of a grid: the best that can be had, where nothing reaches the aim
    is_known = None not in (design.study.n_items, design.study.n_raters)
    return _plan_of(design) if is_known else _Search(design).reached()


def _by_dask(cells: Sequence[Design], scheduler: str | None) -> Iterator[Plan]:
    try:
        from distributed import Client
    except ImportError as error:
        raise ParameterError(
            'executor: "dask" needs Dask: pip install "masrel[dask]"'
        ) from error
    try:
        client = Client(scheduler, set_as_default=False, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise ParameterError(
            "scheduler: needs an address such as tcp://127.0.0.1:8786, got "
            f"{scheduler!r}: {error}"
        ) from error
    with client:  # a cell whose worker dies is planned again by another
        for future in client.map(_planned, cells, pure=False):
            yield future.result()


# -- one size -------------------------------------------------------------------------


def _plan_of(design: Design, progress: Progress | None = None) -> Plan:
    """Return what a design shows."""
    study, model = design.study, design.model
    repeated = (
        *("coefficient", "n_items", "n_raters", "target", "interval", "level"),
        *("sides", "p_missing", "half_width", "lower", "upper", "null"),
    )
    is_formula = study.method in FORMULAS
    numbers, errors, n_studies = (
        (numbers_by_formula(design), {}, 0) if is_formula else shown(design, progress)
    )
    by_studies = "simulation" if n_studies else "exact"
    plan = Plan(
        **{name: getattr(study, name) for name in repeated},
        value=design.value,
        weights=study.weights if isinstance(study.weights, str) else "custom",
        model=model.name,
        prevalences=model.prevalences,
        table=model.table,
        cost=design.cost,
        method=study.method if is_formula else by_studies,
        monte_carlo_error=errors.get(number_of(study), 0.0),
        errors=errors,
        n_studies=n_studies,
        seed=study.seed if n_studies else None,
        **numbers,  # type: ignore[arg-type]
    )
    if is_formula or not has_aim(study):
        return plan
    return replace(plan, reaches_aim=is_met(study, plan))


def _shifted(plan: Plan, side: int) -> Plan:
    # with all numbers far enough within their error, worse (-1) or better (1)
    falls = ("expected_half_width", "expected_high")
    numbers: dict[str, Any] = {
        name: getattr(plan, name)
        + (-side if name in falls else side) * _SURE * max(error, 1.0 / plan.n_studies)
        for name, error in plan.errors.items()
    }
    return replace(plan, **numbers)


def _reaching(plan: Plan) -> Plan:
    # the plan, or the refusal that is its note
    refuse((plan.reaches_aim is False, "".join(plan.notes[:1])))
    return plan


class _Search:
    """The smallest number of items, or of raters, that reaches an aim."""

    def __init__(self, design: Design, progress: Progress | None = None) -> None:
        self.design, self._progress = design, progress
        self._plans: dict[int, Plan] = {}
        self._name, self.lowest = "raters", design.min_raters
        self.highest = int(min(design.max_raters, _MAX_RATERS))
        if design.study.n_items is None:
            self._name, self.highest = "items", _MAX_ITEMS
            self.lowest = _FEWEST_ITEMS + design.is_icc

    def sized(self, n: int) -> Design:
        """Return the design of a size."""
        return self.design.of_size(**{f"n_{self._name}": n})

    def cost(self, n: int) -> float:
        """Return what a size costs."""
        return self.sized(n).cost

    def at(self, n: int) -> Plan:
        """Return the plan of a size, computed once."""
        if n not in self._plans:
            self._plans[n] = _plan_of(self.sized(n), self._progress)
        return self._plans[n]

    def reached(self) -> Plan:
        """Return the plan of the smallest size, or the best, with what it lacks."""
        study = self.design.study
        if study.method in FORMULAS:
            plan = self.at(size_by_formula(self.design))
        elif not has_aim(study):
            plan = self.at(self._affordable_size())
        else:
            plan = self.up_to(self.highest)
        limit = study.max_cost
        if limit is None or plan.cost <= limit or plan.reaches_aim is False:
            return plan
        n = self._affordable_size()
        note = (
            f"max_cost: {aim_words(study)[1]} needs {plan.n_items} items and "
            f"{plan.n_raters} raters, which cost {plan.cost:g}; {limit:g} pays for {n} "
            f"{self._name}"
        )
        if study.method not in FORMULAS:
            plan = self.at(n)
            note += f", which reach {reached_words(study, plan)}"
        return replace(plan, notes=(note,), reaches_aim=False)

    def up_to(self, highest: int) -> Plan:
        """Return the plan of the smallest size that is no larger than one."""
        study, is_items = self.design.study, self._name == "items"
        guess = max(self._guess() if is_items else 1, self.lowest)
        # by growing steps from the guess: none below low reaches the aim, high may
        low, high, step = self.lowest, min(guess, highest), 1 + guess // 30
        if guess > _FAR * highest:
            low = highest + 1
        while low < high and self._is_met(below := max(low, high - step)):
            high, step = below, 2 * step
        low = max(low, high - step + 1)
        while low <= highest and not self._is_met(high):
            low, high, step = high + 1, min(high + step, highest), 2 * step
        if low <= highest:
            sizes = range(low, high)
            return self._stable(low + bisect_left(sizes, True, key=self._is_met))
        # of fewer, where their ratings are drawn one by one
        is_slow = is_items and not self.sized(20).has_rows
        n = min(highest, 200) if is_slow else highest
        best, (name, words) = self.at(n), aim_words(study)
        note = (
            f"{name}: {words} needs more than {highest} {self._name}; the best with "
            f"{n} is {reached_words(study, best)}"
        )
        return replace(best, notes=(note,), reaches_aim=False)

    def _guess(self) -> int:
        # about how many items reach the aim
        if (n := items_nearby(self.design)) is None:
            half = math.sqrt(_SOME_ITEMS) * self.at(_SOME_ITEMS).expected_half_width
            n = items_by_half(self.design, half)
        return _SOME_ITEMS if math.isnan(n) else math.ceil(n)

    def _is_met(self, n: int) -> bool:
        # by few studies where these leave no doubt
        design = self.sized(n)
        if n in self._plans or design.is_exact or design.study.n_studies:
            return bool(self.at(n).reaches_aim)
        n_studies = _FEW_CHOSEN if design.is_chosen else _FEW_STUDIES
        study = replace(design.study, n_studies=n_studies)
        few = _plan_of(replace(design, study=study))
        met = {is_met(study, _shifted(few, side)) for side in (-1, 1)}
        return met.pop() if len(met) == 1 else bool(self.at(n).reaches_aim)

    def _stable(self, n: int) -> Plan:
        # An exact chance goes up and down with n: from where on it holds.
        plan, study = self.at(n), self.design.study
        is_exact = plan.method == "exact" and not self.design.is_icc
        if chance_of(study) is None or not is_exact or self._name == "raters":
            return plan
        around = range(max(self.lowest, int(0.85 * n)), int(1.25 * n) + 2)
        if sum(self.sized(size).n_tables for size in around) > _MAX_SCAN:
            note = (
                "larger sizes were not tried; the probability can fall when one is "
                "added"
            )
            return replace(plan, notes=(note,))
        first = next(size for size in around if self._is_met(size))
        stable = 1 + max((n for n in around if not self._is_met(n)), default=n - 1)
        note = (
            f"{first} {self._name} reach the aim first, but {stable - 1} do not, "
            "because the probability goes up and down"
        )
        return replace(self.at(stable), notes=() if first == stable else (note,))

    def affordable(self, limit: float) -> int:
        """Return the largest size that costs no more than a limit; 0 if none does."""
        sizes = range(self.lowest, self.highest + 1)
        n_sizes = bisect_right(sizes, limit * (1.0 + 1e-12), key=self.cost)
        return self.lowest + n_sizes - 1 if n_sizes else 0

    def _affordable_size(self) -> int:
        limit = self.design.study.max_cost or 0.0
        n = self.affordable(limit)
        refuse(
            (
                n in (0, self.highest),
                f"max_cost: needs a limit from {self.cost(self.lowest):g}, the cost of "
                f"the smallest study, to below {self.cost(self.highest):g}, the cost "
                f"of the largest, got {limit:g}",
            )
        )
        return n


# -- both sizes, by what they cost ----------------------------------------------------


def _cheapest(design: Design, progress: Progress | None) -> Plan:
    """Return the cheapest study that reaches an aim, or the most a budget pays for."""
    # Numbers of raters are tried from the fewest on. For each, the largest number of
    # items that is no dearer than the best study so far is looked at first: where that
    # does not reach the aim, nothing with as many raters can be cheaper.
    study, n_worse = design.study, 0
    _check_prices(study)
    limit, is_counted = study.max_cost or math.inf, not has_aim(study)
    most = int(min(design.max_raters, _MAX_RATERS))
    smallest = _Search(design.of_size(n_raters=design.min_raters), progress)
    least = smallest.cost(smallest.lowest)
    refuse(
        (
            limit < least,
            f"max_cost: needs at least {least:g}, the cost of the smallest study, got "
            f"{limit:g}",
        )
    )
    best = smallest.at(smallest.lowest)
    if math.isinf(limit):
        best = _first_that_reaches(design, most, progress)
        limit = best.cost
    for n_raters in range(design.min_raters, most + 1):
        search = _Search(design.of_size(n_raters=n_raters), progress)
        n = search.affordable(limit)
        if n == 0 or n_worse >= _PATIENCE:
            break
        plan = search.at(n)
        if plan.reaches_aim:
            plan = search.up_to(n)
        if _merit(study, plan) >= _merit(study, best):
            best, n_worse = plan, 0
            if plan.reaches_aim:  # too few raters may reach nothing: they do not count
                limit, is_counted = plan.cost * _CHEAPER, True
        else:
            n_worse += is_counted
    refuse(
        (
            best.reaches_aim is False,
            f"max_cost: {aim_words(study)[1]} is not reached for {limit:g}; the best "
            f"study has {best.n_items} items and {best.n_raters} raters, which cost "
            f"{best.cost:g} and reach {reached_words(study, best)}",
        )
    )
    return best


def _merit(study: Study, plan: Plan) -> tuple[bool, float]:
    # the price of a study that reaches its aim, else how near it comes
    number = getattr(plan, number_of(study))
    nearness = -number if chance_of(study) is None else number
    return bool(plan.reaches_aim), -plan.cost if plan.reaches_aim else nearness


def _check_prices(study: Study) -> None:
    per_item, per_rater, per_rating = study.prices or (0.0, 0.0, 1.0)
    free = "an item" if per_item + per_rating == 0.0 else "a rater"
    refuse(
        (
            study.method in FORMULAS,
            f"n_items, n_raters: needs one of them with method {study.method}; "
            '"auto" finds the cheapest of both',
        ),
        (
            min(per_item, per_rater) + per_rating == 0.0,
            f"prices: needs a price for {free} or for a rating, because there is no "
            f"best number of what costs nothing, got {study.prices}",
        ),
    )


def _first_that_reaches(design: Design, most: int, progress: Progress | None) -> Plan:
    for n_items, n_raters in _STEPS:
        n_raters = max(min(n_raters, most), design.min_raters)
        search = _Search(design.of_size(n_raters=n_raters), progress)
        if (plan := search.at(n_items)).reaches_aim:
            return plan
    return _reaching(search.reached())
