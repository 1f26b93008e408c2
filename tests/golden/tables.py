"""Cases of the agreement library: coefficients, intervals and tests of drawn tables."""

from collections.abc import Callable
from functools import partial

from masrel import agreement, intervals
from masrel.agreement import COEFFICIENTS
from tests.golden.call import Case, Stream, outcome
from tests.golden.drawn import N_TABLES, Drawn, drawn

WEIGHTS = ("identity", "linear", "quadratic")

BOOTSTRAPS = (
    {"target": "items", "exact": False, "n_resamples": 200},
    {"target": "items", "exact": False, "n_resamples": 200, "kind": "bca"},
    {"target": "items", "exact": False, "n_resamples": 200, "kind": "studentized"},
    {"target": "items", "exact": False, "n_resamples": 200, "kind": "basic"},
    {"target": "raters"},
    {"target": "raters", "kind": "bca"},
    {"target": "both"},
)

SEED = {"rng": 7}

METHODS: tuple[tuple[str, dict[str, object]], ...] = (
    ("analytic", {"target": "items"}),
    *(("jackknife", {"target": target}) for target in ("items", "raters", "both")),
    *(("bootstrap", {**options, **SEED}) for options in BOOTSTRAPS),
    ("posterior", {"target": "items", **SEED}),
    ("posterior", {"target": "items", "prior": "jeffreys", **SEED}),
    *(("estimate", {"target": t, **SEED}) for t in ("items", "raters", "both")),
    ("estimate", {"target": "items", "level": 0.8, **SEED}),
)
"""Function of `masrel.intervals` and its options."""

OF_COUNTED = (
    "percent_agreement",
    "fleiss_kappa",
    "brennan_prediger",
    "gwet_ac",
    "krippendorff_alpha",
)

OF_POSTERIOR = ("fleiss_kappa", "scott_pi", "krippendorff_alpha")


PICKED = (
    "percent_agreement", "cohen_kappa", "conger_kappa", "fleiss_kappa", "light_kappa",
    "scott_pi", "brennan_prediger", "gwet_ac", "krippendorff_alpha", "stratified_kappa",
    "pooled_kappa", "kendall_w", "robinson_a", "icc_1", "icc_1k", "icc_c1", "icc_ck",
    "icc_a1", "icc_ak",
)  # fmt: skip
"""Coefficients whose intervals are stored, picked by their places here."""

VALUED = (*PICKED, "lin_ccc", "sem", "sem_consistency", "mdc", "mdc_consistency")
"""Coefficients whose values are stored. A new one stands in no table of before."""


def cases() -> list[Case]:
    """One case a table and group."""
    groups = {"agreement": _coefficients, "intervals": _intervals, "tests": _tests}
    made = [
        Case(group, f"table-{seed:03}", partial(make, seed))
        for group, make in groups.items()
        for seed in range(0, N_TABLES, 2 if group == "tests" else 1)
    ]
    return made + [
        Case("agreement", f"cells-{seed:02}", partial(_large, seed))
        for seed in range(40)
    ]


def _weights(name: str, seed: int) -> str:
    return WEIGHTS[seed % 3] if COEFFICIENTS[name].weighted else "identity"


def _shaped(table: Drawn, name: str) -> object:
    return table.pairs if COEFFICIENTS[name].shape == "pairs" else table.rows


def _coefficients(seed: int) -> dict:
    table = drawn(seed)
    made: dict = {"ratings": _text(table), "categories": table.categories}
    if table.is_counts:
        return made | _from_counts(table, seed)
    for name in VALUED:
        options = {"categories": table.categories, "weights": _weights(name, seed)}
        made[name] = outcome(COEFFICIENTS[name], _shaped(table, name), **options)
    return made


def _large(seed: int) -> dict:
    # counts up to 10¹⁰; where one cell outweighs all others, chance is next to 1
    stream, q = Stream(f"cells {seed}"), 2 + seed % 3
    most = 2 if seed % 2 else 10
    cells = [
        [stream.below(10 ** (1 + stream.below(most))) for _ in range(q)]
        for _ in range(q)
    ]
    cells[0][0] = 10 ** (4 + stream.below(7))
    counted, weights = agreement.count_table(cells), WEIGHTS[seed % 3]
    made: dict = {"cells": cells}
    for function in (agreement.cohen_kappa, agreement.scott_pi):
        made[f"{function.__name__}_from_table"] = outcome(
            lambda cells, of=function, **options: of(
                agreement.count_table(cells), **options
            ),
            cells,
            weights=weights,
        )
    for name in OF_COUNTED:
        function = getattr(agreement, name)
        made[name] = outcome(function, counted, weights=weights)
    return made


def _text(table: Drawn) -> str:
    return " | ".join(
        " ".join("." if cell is None else str(cell) for cell in row)
        for row in table.rows
    )


def _from_counts(table: Drawn, seed: int) -> dict:
    return {
        f"{name}_from_counts": outcome(
            lambda rows, of=entry, **options: of(
                agreement.count_items(rows), **options
            ),
            table.rows,
            weights=WEIGHTS[seed % 3],
        )
        for name, entry in sorted((name, COEFFICIENTS[name]) for name in PICKED)
        if entry.formula and not entry.tells_raters_apart
    }


def _intervals(seed: int) -> dict:
    # five of all pairs of a method and a coefficient, others for every table
    table, made = drawn(seed), {}
    if table.is_counts:
        return _of_counted_cells(seed)
    for k in range(5):
        method, options = METHODS[(5 * seed + k) % len(METHODS)]
        names = _applicable(table, method, every=seed % 10 == 0)
        name = names[(5 * seed + 7 * k) % len(names)]
        weights = "identity" if method == "posterior" else _weights(name, seed // 2 + k)
        made[_title(name, method, options)] = outcome(
            getattr(intervals, method),
            name,
            _shaped(table, name),
            categories=table.categories,
            weights=weights,
            **options,
        )
    return made


def _applicable(table: Drawn, method: str, *, every: bool) -> list[str]:
    # all names where refusals are to be seen, too
    two = len(table.rows[0]) == 2
    return [
        name
        for name in PICKED
        if every or _applies(COEFFICIENTS[name], method, two=two)
    ]


def _applies(entry: agreement.Coefficient, method: str, *, two: bool) -> bool:
    has_interval = entry.formula and not entry.has_interval
    if method == "estimate" and entry.name != "kendall_w":
        has_interval = entry.formula or entry.has_interval
    if not has_interval or (entry.n_raters == (2, 2) and not two):
        return False
    is_modelled = entry.shape == "ratings" and (two or entry.name in OF_POSTERIOR)
    return method != "posterior" or is_modelled


def _title(name: str, method: str, options: dict[str, object]) -> str:
    words = (str(value) for key, value in options.items() if key != "rng")
    return " ".join([name, method, *words])


def _of_counted_cells(seed: int) -> dict:
    # estimates of cells, and intervals of the same items one by one
    cells = _contingency(seed)
    rows = [
        [k, m]
        for k, row in enumerate(cells)
        for m, count in enumerate(row)
        for _ in range(count)
    ]
    weights, options = WEIGHTS[seed % 3], {"categories": list(range(len(cells)))}
    made: dict = {"cells": cells}
    for function in (agreement.cohen_kappa, agreement.scott_pi):
        made[f"{function.__name__}_from_table"] = outcome(
            lambda cells, of=function, **options: of(
                agreement.count_table(cells), **options
            ),
            cells,
            weights=weights,
        )
    made["counted"] = outcome(
        agreement.fleiss_kappa, agreement.count_table(cells), weights=weights
    )
    for k, name in enumerate(("cohen_kappa", "fleiss_kappa", "gwet_ac")):
        method, more = METHODS[(seed // 5 + 6 * k) % len(METHODS)]
        made[_title(name, method, more)] = outcome(
            getattr(intervals, method), name, rows, **options, **more
        )
    return made


def _contingency(seed: int) -> list[list[int]]:
    rows = drawn(seed).rows
    q = len(rows[0])
    return [[rows[(k * q + m) % len(rows)][m] for m in range(q)] for k in range(q)]


def _tests(seed: int) -> dict:
    table = drawn(seed)
    if table.is_counts:
        return _of_cells(_contingency(seed))
    calls: dict[str, Callable[[], object]] = {
        "kendall_w_test": partial(agreement.kendall_w_test, table.rows),
        "uncorrected": partial(agreement.kendall_w, table.rows, ties=False),
        "fleiss_null": partial(agreement.fleiss_null, table.rows),
        "icc_f_test": partial(agreement.icc_f_test, table.rows),
        "category_kappa": partial(
            agreement.category_kappa, table.rows, table.rows[0][0]
        ),
    }
    made = {
        name: outcome(function, categories=table.categories)
        for name, function in calls.items()
    }
    made |= _differences(seed, table)
    made["p_value"] = outcome(_p_and_bands, table)
    if len(table.rows[0]) == 2:
        made |= _of_cells(agreement.contingency_table(table.rows).tolist())
    return made


def _p_and_bands(table: Drawn) -> list[object]:
    estimate = agreement.fleiss_kappa(table.rows, categories=table.categories)
    return [
        agreement.p_value(estimate),
        agreement.bands(estimate),
        agreement.benchmark(estimate),
    ]


def _differences(seed: int, table: Drawn) -> dict:
    # the same items in two halves of the raters, and other items of as many raters
    entries = [COEFFICIENTS[name] for name in PICKED]
    entries = [e for e in entries if e.formula and not e.has_interval]
    names = [e.name for e in entries if e.shape == "ratings"]
    name, half = names[seed // 2 % len(names)], len(table.rows[0]) // 2
    first = [row[:half] for row in table.rows] if half > 1 else table.rows
    second = [row[-half:] for row in table.rows] if half > 1 else table.rows[::-1]
    cut = len(table.rows) // 2
    halves = {
        "dependent": (first, second),
        "independent": (table.rows[:cut], table.rows[cut:]),
    }
    return {
        f"difference of {name}, {design}": outcome(
            intervals.difference, name, *both, design=design,
            categories=table.categories, weights=_weights(name, seed // 2),
        )
        for design, both in halves.items()
    }  # fmt: skip


def _of_cells(cells: list[list[int]]) -> dict:
    made: dict = {"cells": cells}
    for name in ("mcnemar", "bowker", "stuart_maxwell", "bhapkar", "kappa_max",
                 "prevalence_index", "bias_index"):  # fmt: skip
        made[name] = outcome(getattr(agreement, name), cells)
    for kind in ("uncorrected", "corrected") if len(cells) == 2 else ():
        made[f"mcnemar {kind}"] = outcome(agreement.mcnemar, cells, kind=kind)
    return made
