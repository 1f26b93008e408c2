"""How often intervals of limits of agreement with repeats hold the true ones."""

import math
from collections.abc import Iterator
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from docs.make.coverage.study import Answer, Cell, answer, one_by_one
from masrel.agreement import (
    limits_by_clusters,
    limits_with_mean,
    limits_with_repeats,
)

SIZES, N_STUDIES, SEED, Z = (10, 20, 50, 100), 2000, 20261130, 1.959963984540054
BIAS, MEAN, ITEMS, MOVED = 0.3, 50.0, 10.0, 5.0  # the last two are SDs
# SD of what sets methods (or observers) apart on an item, and of single measurements
ERRORS = {"of items": (1.0, 0.5), "of repeats": (0.1, 1.0)}
SLOPE, OBSERVERS, GROWING = 0.1, {"1": 5, "2": 3}, 0.1
KINDS = {
    "constant": ("1", "2", "1 to 4"),
    "varying": ("3",),
    "line": ("1", "3"),
    "spread grows": ("1",),
    "with mean": ("1", "2"),
    "clusters": ("1",),
}
# of clusters, of which every one is left out, there are fewer studies
N_OF_CLUSTERS = 500


def cells() -> list[Cell]:
    """Return the cells: limits, repeats, items, errors."""
    every = [
        (kind, *cell)
        for kind, repeats in KINDS.items()
        for cell in product(repeats, SIZES, ERRORS)
    ]
    names = ("limits", "repeats", "n_items", "errors")
    return [
        Cell(
            at=dict(zip(names, cell, strict=True)),
            ask=partial(one_by_one, partial(study, *cell)),
            seed=(SEED, place),
            n_studies=N_OF_CLUSTERS if cell[0] == "clusters" else N_STUDIES,
        )
        for place, cell in enumerate(every)
    ]


def study(
    kind: str, repeats: str, n: int, errors: str, rng: np.random.Generator
) -> Iterator[Answer]:
    """Draw a study, and yield its intervals."""
    low, *high = map(int, repeats.split(" to "))
    item = np.arange(n).repeat(rng.integers(low, (high or [low])[0] + 1, n))
    between, within = ERRORS[errors]
    values = rng.normal(MEAN, ITEMS, n)[item]
    if kind == "with mean":
        yield from _with_mean(item, values, OBSERVERS[repeats], errors, rng)
        return
    if kind == "clusters":
        yield from _in_clusters(n, errors, rng)
        return
    slope = SLOPE if kind == "line" else 0.0
    if kind == "varying":
        values = values + rng.normal(0.0, MOVED, len(item))
    single = GROWING * values if kind == "spread grows" else within
    own = BIAS + slope * values + rng.normal(0.0, between, n)[item]
    x, y = values + own + rng.normal(0.0, single), values + rng.normal(0.0, single)
    if np.ndim(single) == 0:
        x, y = (values + of + rng.normal(0.0, within, len(item)) for of in (own, 0.0))
    result = limits_with_repeats(
        pd.DataFrame({"item": item, "x": x, "y": y}),
        item="item",
        first="x",
        second="y",
        truth="varying" if kind == "varying" else "constant",
        kind="proportional" if kind == "line" else "difference",
    )
    # of items' means: differences d on averages a, both normal
    d2 = (slope * ITEMS) ** 2 + between**2 + 2.0 * within**2 / low
    a2 = ((1.0 + 0.5 * slope) * ITEMS) ** 2 + between**2 / 4.0 + within**2 / low / 2.0
    of_both = slope * (1.0 + 0.5 * slope) * ITEMS**2 + between**2 / 2.0
    bias, sd = BIAS, math.sqrt(between**2 + 2.0 * within**2)
    if kind == "line":  # one SD of averages away from their mean
        away, lean = math.sqrt(a2), of_both / a2
        result = result.at(MEAN * (1.0 + 0.5 * slope) + 0.5 * BIAS + away)
        bias = BIAS + slope * MEAN + lean * away
        sd = math.sqrt(d2 - of_both * lean + 2.0 * within**2 * (1.0 - 1.0 / low))
        yield answer("slope", result.slope_interval, lean)
    if kind == "spread grows":  # there is no slope but by what sets methods apart
        noise = GROWING**2 * (MEAN**2 + ITEMS**2)
        a2 = ITEMS**2 + between**2 / 4.0 + noise / 2.0
        yield answer("slope", result.slope_interval, between**2 / 2.0 / a2)
        return
    yield from _of_limits(result, bias, sd)


def _of_limits(result: Any, bias: float, sd: float) -> Iterator[Answer]:
    yield answer("bias", result.bias_interval, bias)
    yield answer("limit", result.low_interval, bias - Z * sd)
    yield answer("limit", result.high_interval, bias + Z * sd)


def _with_mean(
    item: Any, values: Any, n_observers: int, errors: str, rng: np.random.Generator
) -> Iterator[Answer]:
    between, within = ERRORS[errors]
    shape = (n_observers, len(item))
    # an observer's own mean, and own view of an item
    own = rng.normal(0.0, between, (n_observers, 1))
    views = rng.normal(0.0, 0.5, (n_observers, item[-1] + 1))[:, item]
    table = values + own + views + rng.normal(0.0, within, shape)
    names = [f"o{k}" for k in range(n_observers)]
    frame = pd.DataFrame(dict(zip(names, table, strict=True))).assign(item=item)
    result = limits_with_mean(frame, item="item", observers=names)
    sem = math.sqrt(between**2 + 0.5**2 + within**2)
    yield answer(
        "limit", result.limit.interval, Z * math.sqrt(1.0 - 1.0 / n_observers) * sem
    )


def _in_clusters(n: int, errors: str, rng: np.random.Generator) -> Iterator[Answer]:
    # two items in each of n clusters, which share half of what sets methods apart
    between, within = ERRORS[errors]
    cluster, share = np.arange(n).repeat(2), between / math.sqrt(2.0)
    values, own = (
        rng.normal(MEAN, ITEMS, n)[cluster],
        rng.normal(0.0, share, n)[cluster],
    )
    own = BIAS + own + rng.normal(0.0, share, 2 * n)
    x, y = values + rng.normal(0.0, within, (2, 2 * n)) + [own, 0.0 * own]
    frame = pd.DataFrame({"cluster": cluster, "item": range(2 * n), "x": x, "y": y})
    measure = partial(limits_with_repeats, item="item", first="x", second="y")
    result = limits_by_clusters(frame, measure, clusters="cluster")
    yield from _of_limits(result, BIAS, math.sqrt(between**2 + 2.0 * within**2))
