"""Plans as a table, a sentence for a protocol, JSON, TOML, and a curve."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict

from masrel.agreement import coefficient
from masrel.planning import Plan
from masrel.plots._drawn_values import PlanCurve, PlanCurves
from masrel.tables._tables import (
    Column,
    Table,
    number,
    percent,
    rounded,
    significant,
)

_TARGETS = {"items": "items", "raters": "raters", "both": "items and raters"}
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
_EQUAL = 1e-9  # prevalences that differ by less
_OF_LINES = ("line", "interval", "target")  # what differs by line of a plan


def planning_table(plans: Sequence[Plan], *, labels: Sequence[str] = ()) -> Table:
    """Return plans, a row each."""
    first = plans[0]
    caption = (
        f"What studies can show of {coefficient(first.coefficient).title}, "
        f"{percent(first.level)} % interval for other {_TARGETS[first.target]}, model: "
        f"{first.model}"
        if not labels
        else "What the study can show, by line of its plan"
    )
    lines: Sequence[str | None] = labels or [None] * len(plans)
    rows = [_row(plan, line) for line, plan in zip(lines, plans, strict=True)]
    shown = _shown(plans, has_lines=bool(labels), rows=rows)
    return Table(
        name="plan",
        caption=caption,
        columns=tuple(column for column in _COLUMNS if column.key in shown),
        rows=tuple(
            tuple(
                value
                for column, value in zip(_COLUMNS, row, strict=True)
                if column.key in shown
            )
            for row in rows
        ),
        notes=_notes(plans),
        data="foreign",
    )


def _row(plan: Plan, label: str | None) -> tuple[float | int | str | None, ...]:
    numbers = (
        plan.expected_half_width,
        plan.expected_low,
        plan.expected_high,
        plan.assurance,
        plan.power,
        plan.coverage,
        plan.p_undefined,
    )
    reaches = {True: "yes", False: "no", None: None}[plan.reaches_aim]
    return (
        label,
        plan.interval,
        _TARGETS[plan.target],
        ", ".join(significant(share, 3) for share in plan.prevalences),
        plan.value,
        plan.n_items,
        plan.n_raters,
        *(None if math.isnan(x) else x for x in numbers),
        reaches,
        None if math.isnan(plan.cost) else plan.cost,
        plan.monte_carlo_error if plan.n_studies else None,
        plan.method,
    )


def _shown(
    plans: Sequence[Plan],
    *,
    has_lines: bool,
    rows: Sequence[tuple[float | int | str | None, ...]],
) -> set[str]:
    # columns that say something: of lines, what differs, and what was computed
    shown = {
        column.key
        for place, column in enumerate(_COLUMNS)
        if any(row[place] is not None for row in rows)
    }
    shown -= set() if has_lines else set(_OF_LINES)
    if len({plan.prevalences for plan in plans}) < 2:
        shown -= {"prevalences"}
    is_solved = len(plans) == 1 and plans[0].reaches_aim is True
    return shown - ({"reaches"} if is_solved else set())


def _notes(plans: Sequence[Plan]) -> tuple[str, ...]:
    notes = {
        "half-width, low and high are expected ones: about half of all studies have a "
        "wider interval": None
    }
    if any(plan.n_studies for plan in plans):
        seeds = sorted({plan.seed for plan in plans if plan.seed is not None})
        n = sum(plan.n_studies for plan in plans)
        notes[
            f"{n} simulated studies, seed {', '.join(map(str, seeds))}; the Monte "
            "Carlo error is that of the number aimed at, else of the half-width"
        ] = None
    reaching = [plan for plan in plans if plan.reaches_aim]
    if len(plans) > 1 and reaching:
        best = min(reaching, key=lambda plan: plan.cost)
        notes[
            f"the cheapest of these that reaches the aim: {best.n_items} items and "
            f"{best.n_raters} raters, cost {significant(best.cost)}"
        ] = None
    notes.update({note: None for plan in plans for note in plan.notes})
    return tuple(notes)


def planning_sentence(plan: Plan) -> str:
    """Return a plan as a sentence for a protocol."""
    title = coefficient(plan.coefficient).title
    weights = "" if plan.weights == "identity" else f" with {plan.weights} weights"
    how = {
        "exact": "; summed over all studies that there can be",
        "simulation": f"; {plan.n_studies} simulated studies",
        "": "",
    }.get(plan.method, f"; {plan.method} formula")
    width = ""
    if not math.isnan(plan.expected_half_width):
        width = (
            f" has an expected half-width of {number(plan.expected_half_width, 3)} "
            f"({number(plan.expected_low, 3)} to {number(plan.expected_high, 3)})"
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
        f"{_TARGETS[plan.target]}{width or ' reaches the aim'}{rest}, if the "
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
    listed = ", ".join(significant(share, 3) for share in shares)
    if max(shares) - min(shares) < _EQUAL:
        listed = f"all {len(shares)} equal"
    return f"{plan.model} model with prevalences {listed}{absent}"


def planning_document(plans: Sequence[Plan]) -> dict[str, object]:
    """Return plans as JSON has them: every digit, null for what is not computed."""
    return {"plans": [_without_nan(asdict(plan)) for plan in plans]}


def _without_nan(values: dict[str, object]) -> dict[str, object]:
    return {
        key: None
        if isinstance(value, float) and not math.isfinite(value)
        else dict(value)
        if isinstance(value, dict)
        else value
        for key, value in values.items()
    }


def planning_toml(plan: Plan, *, line: str | None = None) -> str:
    """Return the lines of a protocol that ask for what was planned, and say why."""
    # line: of a protocol that has it already
    name = line or f"planned-{plan.coefficient.replace('_', '-')}"
    head = () if line else _estimate_lines(plan, name)
    return "\n".join(
        (
            *head,
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
    shares = () if plan.table else plan.prevalences
    for key, value in (
        ("n_items", plan.n_items),
        ("n_raters", plan.n_raters),
        ("value", plan.value),
        ("model", f'"{plan.model}"'),
        ("prevalences", [*shares] or None),
        ("table", [[*row] for row in plan.table] or None),
        ("p_missing", plan.p_missing or None),
        ("sides", plan.sides if plan.sides == 1 else None),
        *(
            (key, getattr(plan, key))
            for key in ("half_width", "lower", "upper", "null")
        ),
        *((key, _to_digits(plan, key)) for key in _COMPUTED),
        ("method", f'"{plan.method}"'),
        ("n_studies", plan.n_studies or None),
        ("seed", plan.seed if plan.n_studies else None),
    ):
        if value is not None:
            yield key, str(value)


_COMPUTED = (
    "expected_half_width",
    "expected_low",
    "expected_high",
    "assurance",
    "power",
    "coverage",
)


def _to_digits(plan: Plan, key: str) -> float | None:
    # four digits, which is more than a plan is exact to
    value = getattr(plan, key)
    return None if math.isnan(value) else rounded(value, 4)


def planning_curves(
    plans: Sequence[Plan],
    *,
    power: float | None = None,
    assurance: float | None = None,
) -> PlanCurves:
    """Return what plans aim at, else their half-width, over items or over raters."""
    name, what, limit = _drawn(plans, power, assurance)
    several = len({plan.value for plan in plans}) > 1
    over_items = len({plan.n_items for plan in plans}) > 1
    groups: dict[tuple[int, float, tuple[float, ...]], list[Plan]] = {}
    for plan in plans:
        n_others = plan.n_raters if over_items else plan.n_items
        groups.setdefault((n_others, plan.value, plan.prevalences), []).append(plan)
    other = "raters" if over_items else "items"
    return PlanCurves(
        title=coefficient(plans[0].coefficient).title,
        what=what,
        over="items" if over_items else "raters",
        limit=limit,
        curves=tuple(
            PlanCurve(
                label=f"{n} {other}" + (f", {significant(value)}" if several else ""),
                sizes=tuple(
                    plan.n_items if over_items else plan.n_raters for plan in group
                ),
                numbers=tuple(getattr(plan, name) for plan in group),
            )
            for (n, value, _), group in groups.items()
        ),
    )


def _drawn(
    plans: Sequence[Plan], power: float | None, assurance: float | None
) -> tuple[str, str, float | None]:
    # which number of the plans, its name, and what it is to reach
    if assurance is not None:
        return "assurance", "assurance", assurance
    if all(not math.isnan(plan.power) for plan in plans):
        return "power", "power", power
    return "expected_half_width", "expected half-width", plans[0].half_width
