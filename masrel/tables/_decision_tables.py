"""The tables, the JSON and the curves of a generalizability study."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

from masrel.agreement.decision import DStudy, PlannedDesign, d_study, single_ratings
from masrel.agreement.generalizability import GStudy
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import (
    Column,
    Table,
    counted,
    interval_text,
    joined,
    number,
    percent,
    table_of,
)

Row = dict[str, Any]


_COEFFICIENTS = {
    "generalizability": "Eρ²",
    "dependability": "Φ",
    "cut_dependability": "Φ(λ)",
}


def _ends(of: str, interval: Any) -> Row:
    return (
        {}
        if interval is None
        else {f"{of}low": interval.low, f"{of}high": interval.high}
    )


def _design_row(design: DStudy) -> Row:
    names = ("universe", "relative_error", "absolute_error", "cost")
    row: Row = {**design.sizes, **{name: getattr(design, name) for name in names}}
    for of in _COEFFICIENTS:
        row[of] = getattr(design, of)
        interval = getattr(design, f"{of.removesuffix('_dependability')}_interval")
        row |= _ends(f"{of}_", interval)
    return row


def _interval_columns(of: str) -> list[Column]:
    return [
        Column(key=f"{of}{end.lower()}", heading=end, digits=3)
        for end in ("Low", "High")
    ]


_CAPTIONS = {
    "components": "",
    "d_study": "Reliability of means, by number of levels",
    "single_ratings": "Reliability of single ratings: Φ is ICC, absolute agreement",
    "planned": "Intervals to expect in future studies",
}


def _columns(study: GStudy, plans: Sequence[PlannedDesign]) -> dict[str, list[Column]]:
    # of each table
    reliability = [
        column
        for of, heading in _COEFFICIENTS.items()
        for column in (
            Column(key=of, heading=heading, digits=3),
            *_interval_columns(f"{of}_"),
        )
    ]
    return {
        "components": [
            Column(key="source", heading="Effect", align="left"),
            Column(key="df", heading="df", digits=0),
            Column(key="mean_square", heading="Mean square", digits=4),
            Column(key="variance", heading="Variance", digits=4),
            *_interval_columns(""),
            Column(key="share", heading="Share", digits=3),
        ],
        "d_study": [
            *(Column(key=name, heading=name) for name in study.facets),
            Column(key="universe", heading="Universe", digits=4, where="csv"),
            Column(key="relative_error", heading="σ²(δ)", digits=4),
            Column(key="absolute_error", heading="σ²(Δ)", digits=4),
            *reliability,
            Column(key="cost", heading="Cost", digits=1),
        ],
        "single_ratings": [
            Column(key="shared", heading="Ratings with", align="left"),
            *reliability,
        ],
        "planned": [
            Column(key="n_persons", heading=study.of),
            *(Column(key=name, heading=name) for name in study.facets),
            *(
                Column(key=end, heading=f"{_COEFFICIENTS[plan.of]} {end}", digits=3)
                for plan in plans[:1]
                for end in ("low", "high")
            ),
            *(
                Column(key="chance", heading=f"Low ≥ {plan.aim:g}", digits=3)
                for plan in plans[:1]
                if plan.aim is not None
            ),
            Column(key="monte_carlo_error", heading="± MC", digits=3),
        ],
    }


def study_tables(
    study: GStudy,
    designs: Sequence[DStudy],
    plans: Sequence[PlannedDesign],
    *,
    file: str,
    data: str,
) -> tuple[list[Table], dict[str, object]]:
    """Return components, designs and single ratings as tables, and for JSON."""
    total = sum(max(part, 0.0) for part in study.components.values()) or math.nan
    rows: dict[str, list[Row]] = {
        "components": [
            {
                "source": source,
                "df": study.df.get(source),
                "mean_square": study.mean_squares.get(source),
                "variance": part,
                "share": max(part, 0.0) / total,
                **_ends("", study.intervals[source]),
            }
            for source, part in study.components.items()
        ],
        "d_study": [_design_row(design) for design in designs],
        "single_ratings": [
            {"shared": shared, **_design_row(design)}
            for shared, design in single_ratings(study).items()
        ],
    }
    if plans:
        rows["planned"] = [{**asdict(plan), **plan.sizes} for plan in plans]
    read = (
        f"Read {Path(file).name}: {counted(study.n_ratings, 'rating')} with mean "
        f"{number(study.mean, 3, in_units=True)}; levels: {_levels(study)}; "
        f"components by {study.method}, {percent(study.level)} % intervals for others "
        "of each."
    )
    first, *more = (
        table_of(name, _CAPTIONS[name], of, rows[name], hide_empty=True, data=data)
        for name, of in _columns(study, plans).items()
        if name in rows
    )
    document: Row = {
        name: [
            {key: None if x != x else x for key, x in row.items()} for row in of_table
        ]
        for name, of_table in rows.items()
    }
    document |= {name: getattr(study, name) for name in ("method", "mean", "n_levels")}
    last = rows["d_study"][-1]
    sizes = joined([f"{name} = {last[name]}" for name in study.facets])
    texts = [
        f"{heading} {number(last[of], 3)} "
        f"{interval_text(last[f'{of}_low'], last[f'{of}_high'])}"
        for of, heading in _COEFFICIENTS.items()
        if last[of] is not None
    ]
    cost = "" if last["cost"] is None else f" It costs {number(last['cost'], 1)}."
    result = f"The mean with {sizes} has {joined(texts)}.{cost}"
    first = replace(first, read=(read,), notes=(result, *study.notes))
    return [first, *more], {**document, "notes": [*study.notes]}


def _levels(study: GStudy) -> str:
    return joined([f"{name} {n}" for name, n in study.n_levels.items()])


def study_methods(study: GStudy) -> str:
    """Return how a study was made, in sentences for a paper."""
    (method,) = {of.method for of in study.intervals.values()}
    return (
        f"Components of variance were estimated by {study.method} from "
        f"{counted(study.n_ratings, 'rating')} (levels: {_levels(study)}), with "
        f"{percent(study.level)} % intervals ({method}); reliability and its "
        "intervals were computed from the same components (Brennan, 2001)."
    )


def study_curves(study: GStudy, aim: float | None) -> Drawn:
    """Return the curves of Φ over levels of one facet, one for a few of the others."""
    along, *others = study.facets
    steps = [[study.n_within(of)] if of in study.fixed else (1, 2, 4) for of in others]
    curves = []
    for n_others in product(*steps):
        sizes = dict(zip(others, n_others, strict=True))
        label = ", ".join(f"{name} = {n}" for name, n in sizes.items()) or "Φ"
        points = [
            (n, d_study(study, {along: n, **sizes}).dependability) for n in range(1, 13)
        ]
        curves.append((label, points))
    title = f"Dependability Φ of means over levels of {along}"
    arguments = (title, "reliability", f"levels of {along}", aim, curves)
    return Drawn("masrel.plots._planning_figure:planning_figure", arguments)
