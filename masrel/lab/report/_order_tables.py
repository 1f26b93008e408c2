"""Orders: whether grades depend on them, and how even drawn schedules are."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import pairwise

from masrel.lab.analysis._report_numbers import (
    OrderEffect,
    compared,
    order_effects,
    place_summaries,
)
from masrel.lab.ratings import Ratings
from masrel.lab.report._material import Lacking, Material, sentence
from masrel.lab.schedule._balance import OrderBalance
from masrel.pages._sections import Content, Paragraph
from masrel.tables._tables import Column, Table, percent


def order_needs(material: Material) -> Ratings | Lacking:
    """Return the ratings that are analysed, if they can show any effect of order."""
    ratings = material.ratings.without(material.analysis.excluded)
    lacks = Lacking(sentence("order", "nothing"))
    return ratings if compared(material.protocol, ratings) else lacks


def order_section(material: Material, ratings: Ratings) -> Iterator[Content]:
    """Show grades by place, after other models, and when a model came again."""
    protocol, level = material.protocol, material.analysis.level
    effects = order_effects(protocol, ratings, level)
    yield Paragraph(text=sentence("order", "steps"))
    if places := place_summaries(protocol, ratings):
        yield Table(
            name="grades_by_place",
            caption="Grades by the place of the presentation in its session",
            columns=(
                Column(key="places", heading="Places", align="left"),
                Column(key="session", heading="Session", align="left"),
                Column(key="n_ratings", heading="Ratings"),
                Column(key="deviation_steps", heading="Mean difference", digits=2),
                Column(key="n_standard", heading="Of standard models"),
                Column(key="n_intended", heading="As intended"),
            ),
            rows=tuple(
                (
                    _part(of.first - 1, of.last),
                    of.session,
                    of.n,
                    of.deviation,
                    of.n_standard,
                    of.n_intended,
                )
                for of in places
            ),
            data=material.data,
        )
    else:
        yield Paragraph(text=sentence("order", "no_places"), absent=True)
    yield Table(
        name="order_effects",
        caption="Differences of grades by order",
        columns=(
            Column(key="effect", heading="Difference", align="left"),
            Column(key="n_raters", heading="Raters"),
            Column(key="n_pairs", heading="Pairs"),
            Column(key="n_equal", heading="Equal pairs"),
            Column(key="mean_steps", heading="Mean", digits=2),
            Column(key="low", heading="Low", digits=2),
            Column(key="high", heading="High", digits=2),
        ),
        rows=tuple(
            (
                _question(of),
                of.n_raters,
                of.n_pairs,
                of.n_equal,
                of.mean,
                of.low,
                of.high,
            )
            for of in effects
        ),
        notes=(
            sentence("order", "intervals", level=percent(level)),
            *(
                f"{_question(of)}: no interval, as {of.reason}."
                for of in effects
                if of.reason is not None
            ),
        ),
        data=material.data,
    )


def _question(effect: OrderEffect) -> str:
    first, *_, last = (*effect.sessions, effect.sessions[-1])
    return sentence("order", effect.kind, first=first, last=last)


_CONCEALED = (
    "Not for raters: it names the models, and counts of few schedules give orders away."
)
_MAX_COLUMNS = 16  # of places or models
_N_PARTS = 8  # of a session with more places


def summary_table(balances: Sequence[OrderBalance]) -> Table:
    """Return the fewest and most of each count, a row each session (and site)."""
    has_sites = any(balance.site is not None for balance in balances)
    site = (Column(key="site", heading="Site", align="left"),) if has_sites else ()
    return Table(
        name="orders",
        caption="Orders of the drawn schedules",
        columns=(
            Column(key="session", heading="Session", align="left"),
            *site,
            Column(key="n_schedules", heading="Schedules"),
            Column(key="n_places", heading="Places"),
            Column(key="in_a_place", heading="Model in a place"),
            Column(key="ordered_pair", heading="Ordered pair"),
            Column(key="twice_in_a_row", heading="Model twice in a row"),
            Column(key="model_run", heading="Run of a model"),
            Column(key="grade_run", heading="of a grade"),
            Column(key="standard_run", heading="of standards"),
        ),
        rows=tuple(
            (
                balance.session,
                *((balance.site,) if has_sites else ()),
                balance.n_schedules,
                balance.n_places,
                _range([freq for row in balance.places for freq in row]),
                _range(balance.of_others),
                balance.n_with_repeats,
                max(balance.model_runs),
                max(balance.grade_runs),
                max(balance.standard_runs),
            )
            for balance in balances
        ),
        read=(_CONCEALED,),
        notes=(
            "How often a model stands in one place of the session, and an ordered pair "
            "of two models side by side: fewest to most. Twice in a row: schedules in "
            "which a model follows itself. Runs: the longest of any schedule.",
        ),
        data="recorded",
    )


def _range(counts: Sequence[int]) -> str:
    if not counts:
        return "–"
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def count_tables(balance: OrderBalance) -> Iterator[Table]:
    """Yield a table of places, and one of ordered pairs unless there are too many."""
    of_session = f"session {balance.session}" + (
        "" if balance.site is None else f", site {balance.site}"
    )
    # every place, or parts of a session as even as can be: first, and after the last
    n_places = balance.n_places
    n_parts = n_places if n_places <= _MAX_COLUMNS else _N_PARTS
    parts = list(pairwise(n_places * part // n_parts for part in range(n_parts + 1)))
    yield Table(
        name="places",
        caption=f"How often each model stands in each place, {of_session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            *(Column(key=f"p{a}", heading=_part(a, b)) for a, b in parts),
        ),
        rows=tuple(
            (model, *(sum(row[a:b]) for a, b in parts))
            for model, row in zip(balance.models, balance.places, strict=True)
        ),
        data="recorded",
    )
    if len(balance.models) <= _MAX_COLUMNS:
        yield Table(
            name="pairs",
            caption=f"How often each model comes right after another, {of_session}",
            columns=(
                Column(key="first", heading="First", align="left"),
                *(Column(key=model, heading=model) for model in balance.models),
            ),
            rows=tuple(
                (model, *row)
                for model, row in zip(balance.models, balance.pairs, strict=True)
            ),
            data="recorded",
        )


def _part(first: int, end: int) -> str:
    return str(end) if end == first + 1 else f"{first + 1}–{end}"


def order_document(balances: Sequence[OrderBalance]) -> dict[str, object]:
    """Return every count as plain values."""
    return {"note": _CONCEALED, "sessions": [asdict(balance) for balance in balances]}
