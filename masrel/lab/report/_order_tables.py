"""How even the orders of drawn schedules are: tables, plain values, the figure."""

from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise

from masrel.lab.schedule._balance import OrderBalance
from masrel.tables._tables import Column, Table

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


def count_tables(balance: OrderBalance) -> list[Table]:
    """Return a table of places, and one of ordered pairs unless there are too many."""
    of_session = f"session {balance.session}" + (
        "" if balance.site is None else f", site {balance.site}"
    )
    parts = _parts(balance.n_places)
    tables = [
        Table(
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
    ]
    if len(balance.models) <= _MAX_COLUMNS:
        tables.append(
            Table(
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
        )
    return tables


def _parts(n_places: int) -> list[tuple[int, int]]:
    # every place, or parts of a session as even as can be: first, and after the last
    n_parts = n_places if n_places <= _MAX_COLUMNS else _N_PARTS
    ends = [n_places * part // n_parts for part in range(n_parts + 1)]
    return list(pairwise(ends))


def _part(first: int, end: int) -> str:
    return str(end) if end == first + 1 else f"{first + 1}–{end}"


def order_document(balances: Sequence[OrderBalance]) -> dict[str, object]:
    """Return every count as plain values."""
    return {"note": _CONCEALED, "sessions": [asdict(balance) for balance in balances]}
