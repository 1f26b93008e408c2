"""The agreement in a file of ratings: its table, its figure and its record."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import masrel
from masrel.agreement import COEFFICIENTS, BandScale, benchmark, strength
from masrel.analysis._file_estimates import AgreementRow
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval, Target, as_document
from masrel.scales import Scale
from masrel.tables._estimate_words import (
    aside,
    forest_row,
    origin,
    pair_words,
    promise,
    sentence,
)
from masrel.tables._row_notes import NotedRow, row_notes
from masrel.tables._tables import SIMULATED, Column, Table, Value, capital, percent

if TYPE_CHECKING:
    from masrel.plots._drawn_values import Forest, ForestRow

_POPULATIONS = {"items": "items", "raters": "raters", "both": "items and raters"}

_SOURCES = {
    "landis_koch": "Landis and Koch (1977)",
    "altman": "Altman (1991)",
    "fleiss": "Fleiss (1981)",
    "cicchetti": "Cicchetti and Sparrow (1981)",
}

_COLUMNS = (
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="title", heading="Coefficient", align="left"),
    Column(key="weights", heading="Weights", where="csv"),
    Column(key="value", heading="Value", digits=3),
    Column(key="standard_error", heading="SE", digits=3),
    Column(key="median", heading="Median", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="level", heading="Level", where="csv"),
    Column(key="method", heading="Method", where="csv"),
    Column(key="target", heading="Target", where="csv"),
    Column(key="n_items", heading="Items"),
    Column(key="n_raters", heading="Raters"),
)

_CHOSEN = "chosen for other "
"""Start of the note that says why an interval was chosen."""

_PRIORS = (", so the prior weighs: ", " rests on the prior, too: ")
"""Where a note goes on with the interval under another prior."""

_VARIANCES = "ratings are missing; variances by REML: "
"""Start of the note on the variances that an ICC is made of."""


def agreement_table(
    rows: Sequence[AgreementRow],
    *,
    caption: str,
    by: str | None = None,
    bands: BandScale | None = None,
    read: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
    explain: bool = False,
    in_sentences: bool = False,
    data: str = "foreign",
) -> Table:
    """Return the table of estimates, with what intervals are in the notes."""
    # by: heading of the column that names the groups, if there is one;
    # bands: whose words for values; read, notes: what to say of the ratings;
    # explain: whether notes say what an interval promises and why it was chosen;
    # in_sentences: whether the notes are for `agreement_sentences`
    columns = list(_COLUMNS)
    intervals = [row.estimate.interval for row in rows]
    if not any(of is not None and of.median is not None for of in intervals):
        at = [column.key for column in columns].index("median")
        columns[at] = replace(columns[at], where="csv")
    cells = [_cells(row) for row in rows]
    if bands is not None:
        columns.append(Column(key="words", heading="At least", align="left"))
        words = [_word(row, bands) for row in rows]
        cells = [(*rest, word) for rest, word in zip(cells, words, strict=True)]
    if by is not None:
        key = group_key(by)
        columns.insert(0, Column(key=key, heading=capital(by), align="left"))
        cells = [(row.group, *rest) for row, rest in zip(rows, cells, strict=True)]
    return Table(
        name="agreement",
        caption=caption,
        columns=tuple(columns),
        rows=tuple(cells),
        in_units=tuple(at for at, row in enumerate(rows) if _is_in_units(row)),
        read=read,
        notes=(
            *notes,
            *_errors_note(rows, in_sentences),
            *(() if in_sentences else _paired_note(rows)),
            *row_notes([_noted(row, explain) for row in rows], by),
            *_words_note(rows, bands),
        ),
        data=data,
    )


def _is_in_units(row: AgreementRow) -> bool:
    entry = COEFFICIENTS.get(row.estimate.coefficient)  # none of kappa of a category
    return entry is not None and entry.in_units


def _cells(row: AgreementRow) -> tuple[Value, ...]:
    estimate, interval = row.estimate, row.estimate.interval
    ends: tuple[Value, ...] = (None,) * 6
    if interval is not None:
        interval_ends = (interval.median, interval.low, interval.high)
        ends = (*interval_ends, interval.level, interval.method, interval.target)
    return (
        estimate.coefficient,
        row.title,
        estimate.weights,
        estimate.value,
        estimate.standard_error if _has_error(estimate) else None,
        *ends,
        estimate.n_items,
        estimate.n_raters,
    )


def _has_error(estimate: Estimate) -> bool:
    # without observed agreement a statistic as a rule has no error either
    parts = (estimate.observed, estimate.standard_error)
    return not all(map(math.isnan, parts)) or estimate.reason is not None


def _word(row: AgreementRow, bands: BandScale) -> str | None:
    """Return the best word that the true value reaches with 95 % probability."""
    estimate = row.estimate
    entry = COEFFICIENTS.get(estimate.coefficient)  # none of kappa of a category
    is_raw = entry is not None and not entry.chance_corrected
    if is_raw or math.isnan(estimate.value):
        return None
    if row.lower_bound is not None:
        return strength(row.lower_bound, scale=bands)
    if not estimate.standard_error > 0.0:  # said in a note rather than warned of
        return "undefined"
    return benchmark(estimate, scale=bands)


def _errors_note(rows: Sequence[AgreementRow], in_sentences: bool) -> tuple[str, ...]:
    # a sentence has the standard error only where there is no interval
    shown = [
        row
        for row in rows
        if not math.isnan(row.estimate.standard_error)
        and not (in_sentences and row.estimate.interval is not None)
    ]
    clustered = [row for row in shown if _is_clustered(row.estimate)]
    samples = ["clusters"] if clustered else []
    samples += ["items"] if len(clustered) < len(shown) else []
    return tuple(f"SE: delta method, {sample} as the sample." for sample in samples)


def _is_clustered(estimate: Estimate) -> bool:
    return estimate.interval is not None and estimate.interval.unit == "clusters"


def _paired_note(rows: Sequence[AgreementRow]) -> tuple[str, ...]:
    # how many items the values rest on, where some have no pair of ratings
    fewer = {
        row.group: row.estimate
        for row in rows
        if row.estimate.n_items_paired < row.estimate.n_items
    }
    if not fewer:
        return ()
    of, *_ = fewer.values()
    pair = pair_words(of)
    if len({row.group for row in rows}) == 1:
        return (f"{of.n_items_paired} of {of.n_items} items have {pair}.",)
    of_groups = (
        f"{of.n_items_paired} of {of.n_items} ({group})" for group, of in fewer.items()
    )
    return (f"Items that have {pair}: {', '.join(of_groups)}.",)


def _noted(row: AgreementRow, explain: bool) -> NotedRow:
    # how its interval was made, what to know of it, and why a value is undefined
    estimate, interval = row.estimate, row.estimate.interval
    texts = [] if estimate.reason is None else [f"undefined: {estimate.reason}"]
    texts += row.notes
    of_interval = None
    if interval is not None:
        of_interval = []
        if interval.reason is None:
            of_interval.append(_interval_note(interval, explain))
        elif interval.reason != estimate.reason:
            of_interval.append(f"no interval ({interval.method}): {interval.reason}")
        brief = filter(None, map(_brief, interval.notes))
        of_interval += interval.notes if explain else brief
    return NotedRow(
        title=row.title,
        group=row.group,
        texts=tuple(texts),
        interval_texts=None if of_interval is None else tuple(of_interval),
    )


def _brief(note: str) -> str:
    """Return a note of an interval without what only `--explain` shows."""
    if note.startswith((_CHOSEN, _VARIANCES)):
        return ""
    for words in _PRIORS:
        before, words_there, _ = note.partition(words)
        if words_there:
            return f"{before}{words.removesuffix(': ')} (--explain says by how much)"
    return note


def _interval_note(interval: Interval, explain: bool) -> str:
    kind = "CI"
    if interval.kind == "credible":
        kind = "credible bound" if interval.is_one_sided else "credible interval"
    name = f"{percent(interval.level)} % {kind}, {interval.method}"
    population = _POPULATIONS[interval.target]
    if interval.unit == "clusters":
        population = f"clusters of {population}"
    to = f"generalises to other {population} like these"
    if not explain:
        return f"{name}: {to}"
    promised = promise(interval, "item")
    return f"{name}{origin(interval, 'item')}: {to}: {promised}"


def _words_note(
    rows: Sequence[AgreementRow], bands: BandScale | None
) -> tuple[str, ...]:
    if bands is None:
        return ()
    named = [row for row in rows if _word(row, bands) is not None]
    laws = []
    if any(row.lower_bound is not None for row in named):
        laws.append("its interval (one-sided)")
    if any(row.lower_bound is None for row in named):
        none = " where there is none" if laws else ""
        laws.append(f"a normal law around the estimate{none}")
    by = f", by {', or by '.join(laws)}" if laws else ""
    if any(r.lower_bound is None and r.estimate.standard_error == 0.0 for r in named):
        by += "; undefined where the SE is 0, which does not mean that it is certain"
    return (
        f"At least: the best word of {_SOURCES[bands]} that the true value reaches "
        f"with 95 % probability{by}; the words are conventions.",
    )


def agreement_sentences(
    rows: Sequence[AgreementRow],
    *,
    by: str | None = None,
    bands: BandScale | None = None,
    data: str = "foreign",
) -> str:
    """Return a sentence for every estimate, one a line."""
    stamp = f"{SIMULATED}. " if data == "simulated" else ""
    heads = ["" if by is None else f"{capital(by)} {row.group}: " for row in rows]
    return "\n".join(
        f"{stamp}{head}{sentence(row.estimate, word=_reached(row, bands))}"
        for head, row in zip(heads, rows, strict=True)
    )


def _reached(row: AgreementRow, bands: BandScale | None) -> str:
    word = None if bands is None else _word(row, bands)
    if bands is None or word in (None, "undefined"):
        return ""
    return f"at least {word} after {_SOURCES[bands]}"


def agreement_record(
    rows: Sequence[AgreementRow],
    *,
    read: Mapping[str, object],
    options: Mapping[str, object],
    scale: Scale,
    notes: tuple[str, ...] = (),
    by: str | None = None,
    bands: BandScale | None = None,
) -> dict[str, object]:
    """Return all that made the estimates, and them, as plain values for JSON."""
    # read: of what was read, plain already; the others as of `agreement_table`
    of_file = dict(read)
    return {
        "masrel": masrel.__version__,
        "file": of_file.pop("file"),
        "sha256": of_file.pop("sha256"),
        "options": dict(options),
        "scale": {
            "name": scale.name,
            "grades": list(scale.grades),
            "values": list(scale.values),
        },
        "read": of_file,
        "notes": list(notes),
        "estimates": estimate_documents(rows, by=by, bands=bands),
    }


def estimate_documents(
    rows: Sequence[AgreementRow],
    *,
    by: str | None = None,
    bands: BandScale | None = None,
) -> list[dict[str, object]]:
    """Return every estimate with what is to be said of it, as plain values."""
    documents = []
    for row in rows:
        group = {} if by is None else {group_key(by): row.group}
        word = {} if bands is None else {"word": _word(row, bands)}
        estimate = as_document(row.estimate)
        why = [*row.notes, *_why_null(row.estimate)]
        documents.append({**group, **estimate, **word, "notes": why})
    return documents


def group_key(by: str) -> str:
    """Return what groups are called in a CSV and a record, unlike all else there."""
    fields = set(Estimate.__dataclass_fields__) | set(Interval.__dataclass_fields__)
    return f"group_{by}" if by in fields | {"title", "word", "words", "data"} else by


def _why_null(estimate: Estimate) -> list[str]:
    # why a number of a record is null, where neither `reason` says it
    why, interval = [], estimate.interval
    if math.isnan(estimate.standard_error) and estimate.reason is None:
        if _has_error(estimate):
            why.append("standard_error: null, one item has none")
        else:
            title = COEFFICIENTS[estimate.coefficient].title
            why.append(f"standard_error, observed, chance: null, {title} has none")
    elif math.isnan(estimate.observed) and estimate.reason is None:
        title = COEFFICIENTS[estimate.coefficient].title
        why.append(f"observed, chance: null, {title} has none")
    if interval is not None:
        ends = (("low", interval.low), ("high", interval.high))
        why += [
            f"interval.{name}: null, there is no bound"
            for name, end in ends
            if math.isinf(end)
        ]
    return why


def agreement_forest(rows: Sequence[AgreementRow], target: Target) -> "Forest":
    """Return what a figure shows: the estimates and their intervals."""
    from masrel.plots._drawn_values import Forest

    # what is in the units of the ratings is on no axis of agreement
    rows = [row for row in rows if not _is_in_units(row)]
    if not rows:
        raise ParameterError(
            "--figure: shows coefficients of agreement, got only estimates in the "
            "units of the ratings"
        )
    population = _POPULATIONS[target]
    several = len({row.group for row in rows}) > 1
    return Forest(
        rows=tuple(_forest_row(row, target, has_group=several) for row in rows),
        axis_label=f"agreement (1 is perfect); intervals for other {population}",
    )


def _forest_row(row: AgreementRow, target: Target, *, has_group: bool) -> "ForestRow":
    interval = row.estimate.interval
    # what neither the axis nor the legend says of the interval
    details = []
    if interval is not None:
        details.append(aside(interval))
        if interval.target != target:
            details.append(f"other {_POPULATIONS[interval.target]}")
    return forest_row(
        row.title,
        row.estimate,
        detail=", ".join(filter(None, details)),
        group=row.group if has_group else "",
    )
