"""How golden numbers call the package: the one file to edit when its API changes.

Questions go by names that stay: a coefficient, and a method of `METHODS`. A result is
a dictionary of plain values, whatever classes the package returns.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from masrel import agreement, intervals
from masrel.agreement import COEFFICIENTS
from masrel.errors import MasrelError
from tests.golden.call import plain
from tests.golden.drawn import Drawn


@dataclass(frozen=True, slots=True)
class Table(Drawn):
    """A table of ratings, with its weights, level and clusters."""

    seed: int
    weights: str | list[list[float]]
    level: float
    clusters: list[str]  # of each item

    def shaped(self, coefficient: str) -> list:
        """The ratings as the coefficient takes them."""
        is_pairs = COEFFICIENTS[coefficient].shape == "pairs"
        return self.pairs if is_pairs else self.rows

    @property
    def has_gaps(self) -> bool:
        """Whether a rating is missing."""
        return any(cell is None for row in self.rows for cell in row)


@dataclass(frozen=True, slots=True)
class Method:
    """A call of the package; an option "clusters" is replaced by the table's."""

    call: Callable[..., object]
    options: dict[str, Any] = field(default_factory=dict)


def result_of(
    method: str, coefficient: str, table: Table, seed: int = 0
) -> dict[str, Any]:
    """Numbers and texts by name; of a refusal its class, and what it is about."""
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        try:
            answer = plain_result(_call(method, coefficient, table, seed))
        except MasrelError as error:
            # the message begins with the parameter, or the place, that it is about
            place, colon, _ = str(error).partition(":")
            return {"refused": [type(error).__name__, place if colon else ""]}
    if noted:
        answer["warnings"] = sorted({of.category.__name__ for of in noted})
    return answer


def _call(method: str, coefficient: str, table: Table, seed: int = 0) -> Any:
    entry, options = METHODS[method], dict(METHODS[method].options)
    if options.pop("clusters", False):
        options["clusters"] = table.clusters
    if "rng" in options:
        options["rng"] = seed or table.seed + 1
    shared = {"categories": table.categories, "weights": table.weights}
    return entry.call(coefficient, table, **shared | options)


def plain_result(result: Any) -> dict[str, Any]:
    """The result's numbers and texts by the names that they are stored under."""
    if hasattr(result, "equality"):
        return _of_differences(result)
    if not hasattr(result, "interval"):
        return _of_interval(result)
    answer = {
        "value": result.value,
        "error": result.standard_error,
        "n": [result.n_items, result.n_items_paired, result.n_raters,
              result.n_categories],
        "reason": result.reason,
        "near_1": bool(0.0 <= 1.0 - result.chance < 1e-6) or None,
    }  # fmt: skip
    interval = result.interval and _of_interval(result.interval)
    if interval and (why := interval.pop("reason", None)) != result.reason:
        interval["why"] = why
    return _stated(plain(answer | (interval or {})))


def _of_interval(interval: Any) -> dict[str, Any]:
    names = ("low", "high", "median", "method", "n_resamples", "n_undefined", "reason")
    answer = {name: getattr(interval, name) for name in names}
    answer["mce"] = interval.monte_carlo_error
    answer["notes"] = interval.notes
    answer["unit"] = interval.unit
    return _stated(plain(answer))


def _of_differences(result: Any) -> dict[str, Any]:
    first = {"values": result.values, "errors": result.errors, "low": result.low,
             "high": result.high, "p": result.p_values}  # fmt: skip
    n = len(result.names)
    # above the diagonal: below it are the same with the other sign
    answer = {
        name: [array[i, j] for i in range(n) for j in range(i + 1, n)]
        for name, array in first.items()
    }
    answer["quantile"] = result.quantile
    answer["equality"] = [result.equality.statistic, result.equality.p_value]
    answer["why"] = result.equality.reason
    answer["reason"], answer["notes"] = result.reason, result.notes
    answer["method"], answer["n"] = result.method, result.n_units
    return _stated(plain(answer))


def _stated(answer: dict[str, Any]) -> dict[str, Any]:
    """Without what says nothing."""
    return {key: value for key, value in answer.items() if value not in (None, [], 0)
            or isinstance(value, float)}  # fmt: skip


def _value(name: str, table: Table, **options: Any) -> object:
    entry = COEFFICIENTS[name]
    if not entry.weighted:
        options["weights"] = "identity"
    return entry(table.shaped(name), level=table.level, **options)


def _function(name: str, table: Table, **options: Any) -> object:
    """The coefficient by its public function, which has options of its own."""
    return COEFFICIENTS[name].function(table.shaped(name), **options)


def _interval(function: str) -> Callable[..., object]:
    def call(name: str, table: Table, **options: Any) -> object:
        if not COEFFICIENTS[name].weighted or "metric" in options:
            options["weights"] = "identity"
        compute = getattr(intervals, function)
        return compute(name, table.shaped(name), level=table.level, **options)

    return call


def _counted(name: str, table: Table, **options: Any) -> object:
    """The coefficient of counts that do not say who rated what."""
    categories = options.pop("categories")
    if categories is None:
        cells = {cell for row in table.rows for cell in row if cell is not None}
        categories = sorted(cells)
    counts = [[row.count(of) for of in categories] for row in table.rows]
    counted = agreement.count_items(counts, categories=categories)
    return COEFFICIENTS[name].function(counted, **options)


def _cells(name: str, table: Table, **options: Any) -> object:
    """The coefficient of the table of two raters."""
    categories = options.pop("categories")
    cells = agreement.contingency_table(table.rows, categories=categories)
    counted = agreement.count_table(cells, categories=categories)
    return COEFFICIENTS[name].function(counted, **options)


def _difference(name: str, table: Table, *, design: str, **options: Any) -> object:
    ratings = table.shaped(name)
    half = len(table.rows) // 2
    halves = slice(half), slice(half, None)
    if design == "independent":
        first, second = (_items(name, ratings, of) for of in halves)
    else:
        first, second, *_ = _parts(name, ratings)
    if "clusters" in options and design == "independent":
        first_clusters, others = (options["clusters"][of] for of in halves)
        options["clusters"] = [first_clusters, [f"other {of}" for of in others]]
    return intervals.difference(
        name, first, second, design=design, level=table.level, **options
    )


def _differences(name: str, table: Table, **options: Any) -> object:
    sets = _parts(name, table.shaped(name))
    return intervals.differences(name, sets, level=table.level, **options)


def _parts(name: str, ratings: list) -> list[list]:
    """Three sets of ratings of the same items: halves of the raters, and others."""
    n = len(ratings) if COEFFICIENTS[name].shape == "pairs" else len(ratings[0])
    half = max(n // 2, min(n, 2))
    halves = (slice(half), slice(n - half, None), slice(0, None, max(1, n // half)))
    parts = [_raters(name, ratings, of) for of in halves]
    if n < 4:  # the halves are much the same: other items in the place of one
        parts[1] = _items(name, parts[1], slice(None, None, -1))
    return parts


def _raters(name: str, ratings: list, of: slice) -> list:
    is_pairs = COEFFICIENTS[name].shape == "pairs"
    return ratings[of] if is_pairs else [row[of] for row in ratings]


def _items(name: str, ratings: list, of: slice) -> list:
    is_pairs = COEFFICIENTS[name].shape == "pairs"
    return [rater[of] for rater in ratings] if is_pairs else ratings[of]


ITEMS, RATERS, BOTH = ({"target": target} for target in ("items", "raters", "both"))
CLUSTERS = ITEMS | {"clusters": True}
DRAWN = {"rng": 0, "n_resamples": 1000}
KINDS = ("percentile", "basic", "bca", "studentized")


def _methods() -> dict[str, Method]:
    analytic, jackknife, bootstrap, posterior, estimate = map(
        _interval, ("analytic", "jackknife", "bootstrap", "posterior", "estimate")
    )
    alike = {"weights": "identity"}
    posteriors: dict[str, dict[str, Any]] = {
        "auto": {},
        "table": {"model": "table"},
        "patterns": {"model": "patterns"},
        "alike": alike | {"model": "dirichlet-multinomial"},
        "jeffreys": alike | {"prior": "jeffreys"},
        "concentration": alike | {"concentration": 0.5},
    }
    made: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
        "value": (_value, {}),
        "population": (_function, {"population": 1000}),
        "counts": (_counted, {}),
        "cells": (_cells, {}),
        "analytic": (analytic, ITEMS),
        "analytic clusters": (analytic, CLUSTERS),
        "jackknife clusters": (jackknife, CLUSTERS),
        "estimate clusters": (estimate, CLUSTERS),
        "difference clusters": (_difference, {"design": "dependent", "clusters": True}),
        "difference of clusters": (
            _difference,
            {"design": "independent", "clusters": True},
        ),
    }
    for distribution in ("normal", "logit", "fisher"):
        options = ITEMS | {"distribution": distribution}
        made[f"analytic {distribution}"] = analytic, options
    for convention in ("over_n", "irrcac"):
        made[f"analytic {convention}"] = analytic, ITEMS | {"convention": convention}
    for target in (ITEMS, RATERS, BOTH):
        (name,) = target.values()
        made[f"jackknife {name}"] = jackknife, target
        made[f"estimate {name}"] = estimate, target | {"rng": 0}
    for kind in KINDS:
        options = {**DRAWN, "kind": kind}
        made |= {
            f"bootstrap {kind}": (bootstrap, ITEMS | options),
            f"bootstrap {kind} drawn": (bootstrap, ITEMS | options | {"exact": False}),
            f"bootstrap {kind} clusters": (bootstrap, CLUSTERS | options),
            f"bootstrap {kind} raters": (bootstrap, RATERS | options),
            f"bootstrap {kind} both": (bootstrap, BOTH | options),
        }
    for name, options in posteriors.items():
        of_draws = ITEMS | {"n_draws": 1000, "rng": 0}
        made[f"posterior {name}"] = posterior, of_draws | options
    for metric in ("nominal", "ordinal", "interval", "ratio"):
        made[f"metric {metric}"] = estimate, ITEMS | {"metric": metric, "rng": 0}
    for design in ("dependent", "independent"):
        made[f"difference {design}"] = _difference, {"design": design}
    for way in ("max_t", "bonferroni", "scheffe"):
        made[f"differences {way}"] = _differences, {"simultaneous": way}
    return {name: Method(*call) for name, call in made.items()}


METHODS = _methods()
"""Name of a method, as the golden file has it, to the call that it is today."""
