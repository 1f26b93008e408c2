"""Plans as a table, a sentence for a protocol, JSON, TOML, and a curve."""

import math
from collections.abc import Sequence
from dataclasses import asdict

from masrel.agreement import coefficient
from masrel.planning import Plan
from masrel.report._figure_data import PlanCurve, PlanCurves
from masrel.report._tables import Column, Table, number, percent, significant

_COLUMNS = (
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
    Column(key="cost", heading="cost", digits=0),
    Column(key="monte_carlo_error", heading="Monte Carlo error", digits=4),
    Column(key="method", heading="method", align="left"),
)
_TARGETS = {"items": "items", "raters": "raters", "both": "items and raters"}


def planning_table(plans: Sequence[Plan], *, labels: Sequence[str] = ()) -> Table:
    """Return plans, a row each."""
    first = plans[0]
    name = Column(key="line", heading="line of the plan", align="left")
    caption = (
        f"What studies can show of {coefficient(first.coefficient).title}, "
        f"{percent(first.level)} % interval for other {_TARGETS[first.target]}, model: "
        f"{first.model}"
        if not labels
        else "What the study can show, by line of its plan"
    )
    return Table(
        name="plan",
        caption=caption,
        columns=((name,) if labels else ()) + _COLUMNS,
        rows=tuple(
            (*((label,) if labels else ()), *_row(plan))
            for label, plan in zip(labels or [""] * len(plans), plans, strict=True)
        ),
        notes=_notes(plans),
        data="foreign",
    )


def _row(plan: Plan) -> tuple[float | int | str | None, ...]:
    numbers = (
        plan.expected_half_width,
        plan.expected_low,
        plan.expected_high,
        plan.assurance,
        plan.power,
        plan.coverage,
        plan.p_undefined,
        plan.cost,
    )
    shown = [None if math.isnan(x) else x for x in numbers]
    error = plan.monte_carlo_error if plan.n_studies else None
    return (plan.value, plan.n_items, plan.n_raters, *shown, error, plan.method)


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
    notes.update({note: None for plan in plans for note in plan.notes})
    return tuple(notes)


def planning_sentence(plan: Plan) -> str:
    """Return a plan as a sentence for a protocol."""
    title = coefficient(plan.coefficient).title
    weights = "" if plan.weights == "identity" else f" with {plan.weights} weights"
    how = (
        "summed over all studies that there can be"
        if plan.method == "exact"
        else f"{plan.n_studies} simulated studies"
        if plan.method == "simulation"
        else f"{plan.method} formula"
    )
    width = ""
    if not math.isnan(plan.expected_half_width):
        width = (
            f" has an expected half-width of {number(plan.expected_half_width, 3)} "
            f"({number(plan.expected_low, 3)} to {number(plan.expected_high, 3)})"
        )
    also = [
        f"{word} {number(value, 3)}"
        for word, value in (
            ("assurance", plan.assurance),
            ("power", plan.power),
            ("coverage", plan.coverage),
        )
        if not math.isnan(value)
    ]
    rest = f", with {', '.join(also)}" if also else ""
    sides = "" if plan.sides == 2 else "one-sided "
    return (
        f"With {plan.n_items} items and {plan.n_raters} raters, the {sides}"
        f"{percent(plan.level)} % interval of {title}{weights} for other "
        f"{_TARGETS[plan.target]}{width or ' reaches the aim'}{rest}, if the "
        f"coefficient is {significant(plan.value, 3)} ({plan.model} model; {how})."
    )


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


def planning_toml(plan: Plan) -> str:
    """Return the lines of a protocol that ask for what was planned."""
    entry = coefficient(plan.coefficient)
    kind = "test-retest" if entry.shape == "pairs" else "inter-rater"
    sessions = '["test", "retest"]' if kind == "test-retest" else '["test"]'
    return "\n".join(
        (
            f"# {planning_sentence(plan)}",
            "[analysis]",
            f"level = {plan.level}",
            "",
            "[[analysis.estimates]]",
            f'id = "planned-{plan.coefficient.replace("_", "-")}"',
            f'kind = "{kind}"',
            f'coefficient = "{plan.coefficient}"',
            f'weights = "{plan.weights}"',
            'models = "standard"',
            f"sessions = {sessions}",
            f'target = "{plan.target}"',
            f'interval = "{"auto" if plan.interval == "auto" else "analytic"}"',
        )
    )


def planning_curves(plans: Sequence[Plan]) -> PlanCurves:
    """Return power, where a plan has any, or half-width, over the number of items."""
    has_power = all(not math.isnan(plan.power) for plan in plans)
    groups: dict[tuple[int, float], list[Plan]] = {}
    for plan in plans:
        groups.setdefault((plan.n_raters, plan.value), []).append(plan)
    several = len({value for _, value in groups}) > 1
    return PlanCurves(
        title=coefficient(plans[0].coefficient).title,
        what="power" if has_power else "expected half-width",
        curves=tuple(
            PlanCurve(
                label=f"{n_raters} raters"
                + (f", {significant(value)}" if several else ""),
                n_items=tuple(plan.n_items for plan in group),
                numbers=tuple(
                    plan.power if has_power else plan.expected_half_width
                    for plan in group
                ),
            )
            for (n_raters, value), group in groups.items()
        ),
    )
