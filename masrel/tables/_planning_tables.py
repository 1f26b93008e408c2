"""Plans as a table, a sentence for a protocol, JSON, TOML, and a curve."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from masrel.agreement import coefficient
from masrel.estimates import _POPULATIONS
from masrel.planning import Plan
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import Column, Table, number, percent, significant, table_of

_EQUAL = 1e-9  # prevalences that differ by less


_COLUMNS = (
    Column(key="line", heading="line of the plan", align="left"),
    Column(key="interval", heading="interval", align="left"),
    Column(key="target", heading="for other", align="left"),
    Column(key="prevalences", heading="prevalences", align="left"),
    Column(key="value", heading="κ or ICC", digits=3),
    Column(key="n_items", heading="items"),
    Column(key="n_raters", heading="raters"),
    Column(key="half_width", heading="half-width", digits=3),
    Column(key="low", heading="low", digits=3),
    Column(key="high", heading="high", digits=3),
    Column(key="assurance", heading="assurance", digits=3),
    Column(key="power", heading="power", digits=3),
    Column(key="coverage", heading="coverage", digits=3),
    Column(key="p_undefined", heading="undefined", digits=3),
    Column(key="reaches", heading="reaches the aim", align="left"),
    Column(key="cost", heading="cost", digits=0),
    Column(key="monte_carlo_error", heading="Monte Carlo error", digits=4),
    Column(key="method", heading="method", align="left"),
)


def planning_table(plans: Sequence[Plan], *, labels: Sequence[str] = ()) -> Table:
    """Return plans, a row each."""
    first = plans[0]
    caption = (
        f"What studies can show of {coefficient(first.coefficient).title}, "
        f"{percent(first.level)} % interval for other {_POPULATIONS[first.target]}, "
        f"model: {first.model}"
        if not labels
        else "Precision of the study, by line of its plan"
    )
    lines: Sequence[str | None] = labels or [None] * len(plans)
    rows = [_row(p) | {"line": line} for p, line in zip(plans, lines, strict=True)]
    # of one plan that reaches its aim that is not said, nor what all plans share
    hidden = {
        "reaches": len(plans) == 1 and first.reaches_aim,
        "prevalences": len({plan.prevalences for plan in plans}) == 1,
        **dict.fromkeys(("interval", "target"), not labels),
    }
    columns = [
        column
        for column in _COLUMNS
        if not hidden.get(column.key)
        and any(row.get(column.key) is not None for row in rows)
    ]
    return table_of("plan", caption, columns, rows, notes=_notes(plans), data="foreign")


def _row(plan: Plan) -> dict[str, Any]:
    values = _values(plan)
    return values | {
        "target": _POPULATIONS[plan.target],
        "prevalences": ", ".join(significant(share, 3) for share in plan.prevalences),
        "reaches": {True: "yes", False: "no", None: None}[plan.reaches_aim],
        "half_width": values["expected_half_width"],
        "low": values["expected_low"],
        "high": values["expected_high"],
        "monte_carlo_error": plan.monte_carlo_error if plan.n_studies else None,
    }


def _values(plan: Plan) -> dict[str, Any]:
    # None for what is not computed
    return {
        key: None if isinstance(value, float) and math.isnan(value) else value
        for key, value in asdict(plan).items()
    }


def _notes(plans: Sequence[Plan]) -> tuple[str, ...]:
    notes = [
        "half-width, low and high are expected values: about half of all studies have "
        "a wider interval"
    ]
    if n := sum(plan.n_studies for plan in plans):
        seeds = sorted({plan.seed for plan in plans if plan.seed is not None})
        notes.append(
            f"{n} simulated studies, seed {', '.join(map(str, seeds))}; the Monte "
            "Carlo error is for the number of the aim, or for the half-width if there "
            "is no aim"
        )
    reaching = [plan for plan in plans if plan.reaches_aim]
    if len(plans) > 1 and reaching:
        best = min(reaching, key=lambda plan: plan.cost)
        notes.append(
            f"the cheapest of these that reaches the aim: {best.n_items} items and "
            f"{best.n_raters} raters, cost {significant(best.cost)}"
        )
    notes += [note for plan in plans for note in plan.notes]
    return tuple(dict.fromkeys(notes))


def planning_sentence(plan: Plan) -> str:
    """Return a plan as a sentence for a protocol."""
    title = coefficient(plan.coefficient).title
    weights = "" if plan.weights == "identity" else f" with {plan.weights} weights"
    how = {
        "exact": "; summed over all possible studies",
        "simulation": f"; {plan.n_studies} simulated studies",
        "": "",
    }.get(plan.method, f"; {plan.method} formula")
    width = (
        " reaches the aim"
        if math.isnan(plan.expected_half_width)
        else f" has an expected half-width of {number(plan.expected_half_width, 3)}"
        + f" ({number(plan.expected_low, 3)} to {number(plan.expected_high, 3)})"
        * (not math.isnan(plan.expected_low))
    )
    chances_of = [
        f"{word} {number(value, 3)}{of}"
        for word, value, of in (
            ("assurance", plan.assurance, _of_what(plan, "assurance")),
            ("power", plan.power, _of_what(plan, "power")),
            ("coverage", plan.coverage, ""),
        )
        if not math.isnan(value)
    ]
    rest = f", with {', '.join(chances_of)}" if chances_of else ""
    sides = "" if plan.sides == 2 else "one-sided "
    return (
        f"With {plan.n_items} items and {plan.n_raters} raters, the {sides}"
        f"{percent(plan.level)} % interval of {title}{weights} for other "
        f"{_POPULATIONS[plan.target]}{width}{rest}, if the "
        f"coefficient is {significant(plan.value, 3)} ({_model(plan)}{how})."
    )


def _of_what(plan: Plan, chance: str) -> str:
    # what an assurance or a power is the chance of
    if chance == "power" and plan.null is not None:
        return f" against {significant(plan.null, 3)}"
    if chance == "assurance" and plan.half_width is not None:
        return f" of a half-width up to {significant(plan.half_width, 3)}"
    ends = ["…" if x is None else significant(x, 3) for x in (plan.lower, plan.upper)]
    return f" of lying inside [{ends[0]}, {ends[1]}]"


def _model(plan: Plan) -> str:
    absent = f", {percent(plan.p_missing)} % missing" if plan.p_missing else ""
    shares = plan.prevalences
    if not shares:
        return f"{plan.model} model{absent}"
    listed = (
        f"all {len(shares)} equal"
        if max(shares) - min(shares) < _EQUAL
        else ", ".join(significant(share, 3) for share in shares)
    )
    return f"{plan.model} model with prevalences {listed}{absent}"


def planning_document(plans: Sequence[Plan]) -> dict[str, object]:
    """Return plans as JSON has them: every digit, null for what is not computed."""
    return {"plans": list(map(_values, plans))}


def planning_toml(plan: Plan, *, line: str | None = None) -> str:
    """Return the lines of a protocol that ask for what was planned, and say why."""
    # line: of a protocol that has it already
    name = line or f"planned-{plan.coefficient.replace('_', '-')}"
    return "\n".join(
        (
            *(() if line else _estimate_lines(plan, name)),
            f"# {planning_sentence(plan)}",
            "[[analysis.sample_sizes]]",
            f'estimate = "{name}"',
            *(f"{key} = {value}" for key, value in _toml_values(plan)),
        )
    )


def _estimate_lines(plan: Plan, name: str) -> tuple[str, ...]:
    entry = coefficient(plan.coefficient)
    kind = "test-retest" if entry.shape == "pairs" else "inter-rater"
    sessions = '["test", "retest"]' if kind == "test-retest" else '["test"]'
    by_name = {"t": "jackknife" if plan.target == "raters" else "analytic"}
    interval = {**by_name, "normal": "analytic"}.get(plan.interval, plan.interval)
    return (
        "[analysis]",
        f"level = {plan.level}",
        "",
        "[[analysis.estimates]]",
        f'id = "{name}"',
        f'kind = "{kind}"',
        f'coefficient = "{plan.coefficient}"',
        f'weights = "{plan.weights}"',
        'models = "standard"',
        f"sessions = {sessions}",
        f'target = "{plan.target}"',
        f'interval = "{interval}"',
        "",
    )


def _toml_values(plan: Plan) -> Iterator[tuple[str, str]]:
    # keys of [[analysis.sample_sizes]]; what is not there is left out
    aims = ("half_width", "lower", "upper", "null")
    computed = {
        key: getattr(plan, key)
        for key in (
            *("expected_half_width", "expected_low", "expected_high"),
            *("assurance", "power", "coverage"),
        )
    }
    for key, value in {
        "n_items": plan.n_items,
        "n_raters": plan.n_raters,
        "value": plan.value,
        "model": f'"{plan.model}"',
        "prevalences": None if plan.table else [*plan.prevalences] or None,
        "table": [[*row] for row in plan.table] or None,
        "p_missing": plan.p_missing or None,
        "sides": plan.sides if plan.sides == 1 else None,
        **{key: getattr(plan, key) for key in aims},
        # four digits, which is more than a plan is exact to
        **{k: round(x, 4) for k, x in computed.items() if not math.isnan(x)},
        "method": f'"{plan.method}"',
        "n_studies": plan.n_studies or None,
        "seed": plan.seed if plan.n_studies else None,
    }.items():
        if value is not None:
            yield key, str(value)


def planning_curves(plans: Sequence[Plan], aim: Mapping[str, float]) -> Drawn:
    """Return what plans aim at, else their half-width, over items or over raters."""
    has_power = not any(math.isnan(plan.power) for plan in plans)
    other_aim = "power" if has_power else "expected_half_width"
    name = "assurance" if "assurance" in aim else other_aim
    several = len({plan.value for plan in plans}) > 1
    over_items = len({plan.n_items for plan in plans}) > 1
    over, other = ("items", "raters") if over_items else ("raters", "items")
    curves: dict[tuple[int, float, tuple[float, ...]], list[tuple[int, float]]] = {}
    for plan in plans:
        key = (getattr(plan, f"n_{other}"), plan.value, plan.prevalences)
        point = (getattr(plan, f"n_{over}"), getattr(plan, name))
        curves.setdefault(key, []).append(point)
    labelled = [
        (f"{n} {other}" + (f", {significant(value)}" if several else ""), points)
        for (n, value, _), points in curves.items()
    ]
    limit = aim.get(name, plans[0].half_width)
    return Drawn(
        "masrel.plots._planning_figure:planning_figure",
        (coefficient(plans[0].coefficient).title, name, over, limit, labelled),
    )
