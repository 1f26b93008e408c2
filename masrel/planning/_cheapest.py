"""The cheapest study that reaches an aim, or the most precise that a budget pays for.

Numbers of raters are tried from the fewest on. For each, the largest number of items
that is no dearer than the best study so far is looked at first: where that does not
reach the aim, nothing with as many raters can be cheaper.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

from masrel.errors import ParameterError
from masrel.planning._plan_question import Question
from masrel.planning._precision import Plan
from masrel.planning._smallest_size import MAX_RATERS, Search

_PATIENCE = 4  # numbers of raters that are no better, after which none will be
_STEPS = ((15, 3), (30, 4), (60, 6), (120, 8), (250, 12), (500, 20), (1000, 40))
_CHEAPER = 1.0 - 1e-9


def cheapest_plan(question: Question) -> Plan:
    """Return the cheapest study that reaches an aim within the budget, if any."""
    _check(question)
    limit = math.inf if question.max_cost is None else question.max_cost
    if question.aim.kind is None:
        return _narrowest(question, limit)
    best = _first_that_reaches(question) if math.isinf(limit) else None
    if best is not None:
        limit = best.cost
    n_worse, has_solved = 0, False
    for search in _searches(question):
        n = search.affordable(limit)
        if n is None or n_worse >= _PATIENCE:
            break
        plan = search.at(n)
        if plan.reaches_aim:
            plan = search.up_to(n)
        if plan.reaches_aim and plan.cost <= limit:
            best, limit, n_worse = plan, plan.cost * _CHEAPER, 0
            has_solved = True  # too few raters may reach nothing: they do not count
        elif has_solved:
            n_worse += 1
    return _beyond_budget(question, limit) if best is None else best


def _check(question: Question) -> None:
    if question.method in ("wald", "goodness-of-fit"):
        raise ParameterError(
            f"n_items, n_raters: needs one of them with method {question.method}; "
            '"auto" finds the cheapest of both'
        )
    per_item, per_rater, per_rating = question.prices
    for what, price in (("an item", per_item), ("a rater", per_rater)):
        if price + per_rating == 0.0:
            raise ParameterError(
                f"prices: needs a price of {what} or of a rating, since no number is "
                f"best of what costs nothing; got {question.prices}"
            )


def _searches(question: Question) -> Iterator[Search]:
    most = min(question.max_raters or MAX_RATERS, MAX_RATERS)
    for n_raters in range(question.min_raters, most + 1):
        yield Search(question, n_items=None, n_raters=n_raters)


def _first_that_reaches(question: Question) -> Plan:
    # sizes that grow on both sides, until one reaches the aim
    most, tried = question.max_raters or MAX_RATERS, None
    for n_items, n_raters in _STEPS:
        n_raters = max(min(n_raters, most), question.min_raters)
        tried = Search(question, n_items=None, n_raters=n_raters).at(n_items)
        if tried.reaches_aim:
            return tried
    last = Search(question, n_items=None, n_raters=n_raters)
    plan = last.reached()
    if plan.reaches_aim:
        return plan
    raise ParameterError(plan.notes[0])


def _narrowest(question: Question, limit: float) -> Plan:
    # what the budget pays for, with the narrowest interval or the largest chance
    best, n_worse = None, 0
    for search in _searches(question):
        n = search.affordable(limit)
        if n is None or n_worse >= _PATIENCE:
            break
        plan = search.at(n)
        if best is None or _is_better(question, plan, best):
            best, n_worse = plan, 0
        else:
            n_worse += 1
    if best is None:
        search = next(_searches(question))
        least = question.cost(search.lowest, question.min_raters)
        raise ParameterError(
            f"max_cost: needs at least {least:g}, of the smallest study; got {limit:g}"
        )
    return best


def _is_better(question: Question, plan: Plan, best: Plan) -> bool:
    if question.aim.is_chance:
        number = question.aim.number
        return bool(getattr(plan, number) > getattr(best, number))
    return plan.expected_half_width < best.expected_half_width


def _beyond_budget(question: Question, limit: float) -> Plan:
    aim = question.aim
    best = _narrowest(replace(question, max_cost=None), limit)
    raise ParameterError(
        f"max_cost: {aim.words} is not reached for {limit:g}; the best that can be had "
        f"is {best.n_items} items and {best.n_raters} raters, which cost "
        f"{best.cost:g} and reach {aim.reached(best)}"
    )
