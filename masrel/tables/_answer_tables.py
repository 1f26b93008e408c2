"""Tables, JSON, sentences and the figure of answers to questions about a file."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

from masrel._input import refuse
from masrel.agreement import COEFFICIENTS, BandScale, benchmark, strength
from masrel.analysis._file_estimates import AgreementRow, Answer, Explanation, Row
from masrel.estimates import (
    _POPULATIONS,
    Estimate,
    Interval,
    Target,
    _Caution,
    _plain,
    _population,
    as_document,
)
from masrel.plots._drawn_values import FOREST, Drawn
from masrel.tables._estimate_words import (
    Noun,
    forest_row,
    origin,
    pair_words,
    promise,
    sentence,
)
from masrel.tables._tables import SIMULATED, Column, Table, capital, percent, table_of

Detail = Literal["brief", "usual", "all"]
"""How much notes explain: what must be known, how numbers were computed, what
they mean."""

_CAPTIONS = {
    "agreement": "Agreement of the raters in {of}",
    "retest": "Agreement of raters with themselves",
    "categories": "Agreement on each category against all others",
    "symmetry": "Do the changes from one rater to the other balance?",
    "indices": "Prevalence, bias and agreement on each category",
    "limits_of_agreement": "Limits of agreement{in_unit}",
    "limits_with_repeats": "Limits of agreement{in_unit}",
    "limits_that_follow": "Limits of agreement on a line{in_unit}",
    "limits_of_ratios": "Limits of agreement, as ratios",
    "limits_with_mean": "Limits of agreement with the mean{in_unit}",
    "diagnosis_raters": "{of} with and without each rater",
    "diagnosis_pairs": "{of} of every two raters",
    "diagnosis_categories": "Agreement on each category",
    "diagnosis_confusion": "Grades of each rater, by the grade that {of} gave to the "
    "same item",
    "judges": "Can the judge replace a human?",
    "humans": "The judge and each human, both compared with the other humans",
    "judge_reference": "The judge and the human, both compared with the reference",
    "judge_differences": "Differences in advantage between judges",
    "rates": "How often {of} is right",
    "truth": "Classes of the items, estimated from the ratings alone",
    "truth_confusion": "Grades of each rater, by class of the item",
    "effective_number": "How many independent raters they are worth",
    "preferences": "Does it matter which answer is shown first?",
    "strengths": "Which answer is preferred",
    "gates": "Gates",
    "differences": "Differences in agreement between groups",
    "equality": "Equality of agreement in all groups",
    "spans": "Agreement on spans",
}

_P = Column(key="p_value", heading="p", is_p=True)
_ITEMS = Column(key="n_items", heading="{items}")
_VALUE = Column(key="value", heading="Value", digits=3)
_ERROR = Column(key="standard_error", heading="SE", digits=3)
_ENDS = (
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
)
_JUDGE = Column(key="judge", heading="Judge", align="left")
_COEFFICIENT = (
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="title", heading="Coefficient", align="left"),
    Column(key="weights", heading="Weights", where="csv"),
)

_COLUMNS: dict[str, tuple[Column, ...]] = {
    **{
        f"limits_{of}": (
            Column(key="quantity", heading="Quantity", align="left"),
            _VALUE,
            *_ENDS,
            _ITEMS,
        )
        for of in ("with_repeats", "that_follow", "of_ratios", "with_mean")
    },
    "symmetry": (
        Column(key="test", heading="Test", align="left"),
        Column(key="statistic", heading="Statistic", digits=3),
        Column(key="distribution", heading="Distribution", align="left"),
        Column(key="df", heading="df"),
        _P,
        _ITEMS,
    ),
    "indices": (Column(key="index", heading="Index", align="left"), _VALUE, _ERROR),
    "limits_of_agreement": (
        Column(key="quantity", heading="Difference", align="left"),
        _VALUE,
        *_ENDS,
        Column(key="pair_low", heading="Low, both", digits=3),
        Column(key="pair_high", heading="High, both", digits=3),
        _ITEMS,
    ),
    "diagnosis_raters": (
        Column(key="rater", heading="Rater", align="left"),
        Column(key="mean_of_pairs", heading="Mean of pairs", digits=3),
        Column(key="with_reference", heading="With reference", digits=3),
        Column(key="reference_low", heading="Low", digits=3, where="csv"),
        Column(key="reference_high", heading="High", digits=3, where="csv"),
        Column(key="without", heading="All without", digits=3),
        Column(key="change", heading="Change", digits=3),
        _ERROR,
        *_ENDS,
    ),
    "diagnosis_pairs": (
        Column(key="first", heading="First", align="left"),
        Column(key="second", heading="Second", align="left"),
        _VALUE,
        *_ENDS,
        _ITEMS,
    ),
    "diagnosis_categories": (
        Column(key="category", heading="Category", align="left"),
        Column(key="n_ratings", heading="Ratings"),
        Column(key="agreement", heading="Agreement", digits=3),
        *_ENDS,
    ),
    "diagnosis_confusion": (
        Column(key="rater", heading="Rater", align="left"),
        Column(key="of", heading="{of} gave", align="left"),
        Column(key="n", heading="Times"),
    ),
    "judges": (
        _JUDGE,
        Column(key="n_humans", heading="Humans"),
        Column(key="n_rejected", heading="Not worse"),
        Column(key="winning_rate", heading="Winning rate", digits=3),
        Column(key="passes", heading="Passes", align="left"),
        Column(key="advantage", heading="Advantage", digits=3),
        *_ENDS,
        _ITEMS,
    ),
    "humans": (
        _JUDGE,
        Column(key="human", heading="Human", align="left"),
        _ITEMS,
        Column(key="b", heading="Human closer"),
        Column(key="c", heading="Judge closer"),
        Column(key="ties", heading="Ties", where="csv"),
        Column(key="human_share", heading="Human's share", digits=3),
        Column(key="judge_share", heading="Judge's share", digits=3),
        Column(key="difference", heading="Difference", digits=3, where="csv"),
        Column(key="difference_low", heading="Low", where="csv"),
        Column(key="difference_high", heading="High", where="csv"),
        Column(key="test", heading="Test", where="csv"),
        _P,
        Column(key="p_adjusted", heading="p (adjusted)", where="csv"),
        Column(key="not_worse", heading="Not worse", align="left"),
    ),
    "judge_reference": (
        _JUDGE,
        Column(key="human", heading="Human", align="left"),
        Column(key="judge_right", heading="Judge alone right"),
        Column(key="human_right", heading="Human alone right"),
        Column(key="difference", heading="Difference", digits=3),
        *_ENDS,
        _P,
        Column(key="not_worse", heading="Not worse", align="left"),
        _ITEMS,
    ),
    "judge_differences": (
        Column(key="first", heading="First", align="left"),
        Column(key="second", heading="Second", align="left"),
        Column(key="value", heading="Difference", digits=3),
        _ERROR,
        *_ENDS,
        _P,
        Column(key="p_holm", heading="p (Holm)", is_p=True),
        _ITEMS,
    ),
    "rates": (
        _JUDGE,
        Column(key="method", heading="Method", where="csv"),
        Column(key="name", heading="Method", align="left", where="page"),
        Column(key="value", heading="Rate", digits=3),
        *_ENDS,
        Column(key="n_judged", heading="Judged"),
        Column(key="n_labels", heading="Labels"),
        Column(key="assumed", heading="Assumes", align="left", where="page"),
    ),
    "truth": (
        Column(key="class", heading="Class", align="left"),
        Column(key="share", heading="Share", digits=3),
        *_ENDS,
    ),
    "truth_confusion": (
        Column(key="rater", heading="Rater", align="left"),
        Column(key="class", heading="Class", align="left"),
        Column(key="right_low", heading="Right, low", digits=3),
        Column(key="right_high", heading="Right, high", digits=3),
    ),
    "effective_number": (
        Column(key="raters", heading="Raters", align="left"),
        Column(key="value", heading="Worth", digits=2),
        *_ENDS,
        Column(key="mean_correlation", heading="Correlation", digits=3),
        _ITEMS,
    ),
    "preferences": (
        _JUDGE,
        Column(key="value", heading="First gains", digits=3),
        *_ENDS,
        _P,
        Column(key="agreement", heading="Same", digits=3),
        Column(key="agreement_without_ties", heading="Without ties", digits=3),
        Column(key="n_pairs", heading="Pairs"),
        Column(key="n_ties", heading="With a tie"),
        Column(key="n_unpaired", heading="One order"),
    ),
    "strengths": (
        _JUDGE,
        Column(key="model", heading="Answer", align="left"),
        Column(key="value", heading="Strength", digits=3),
        *_ENDS,
    ),
    "gates": (
        Column(key="gate", heading="Gate", align="left"),
        Column(key="number", heading="Number", digits=3),
        Column(key="verdict", heading="Holds", align="left"),
    ),
    "differences": (
        *_COEFFICIENT,
        Column(key="first", heading="First", align="left"),
        Column(key="second", heading="Second", align="left"),
        Column(key="items", heading="Items", align="left"),
        Column(key="difference", heading="Difference", digits=3),
        _ERROR,
        *_ENDS,
        Column(key="level", heading="Level", where="csv"),
        Column(key="t", heading="t", where="csv"),
        Column(key="df", heading="df", where="csv"),
        _P,
        Column(key="p_holm", heading="p (Holm)", is_p=True),
    ),
    "equality": (
        *_COEFFICIENT,
        Column(key="test", heading="Test", align="left"),
        Column(key="statistic", heading="Statistic", digits=2),
        Column(key="distribution", heading="Distribution", align="left", where="csv"),
        Column(key="df", heading="df", align="left"),
        _P,
    ),
}

_OF_ESTIMATES = (
    *_COEFFICIENT,
    _VALUE,
    _ERROR,
    Column(key="median", heading="Median", digits=3),
    *_ENDS,
    Column(key="level", heading="Level", where="csv"),
    Column(key="method", heading="Method", where="csv"),
    Column(key="target", heading="Target", where="csv"),
    Column(key="population", heading="For other", align="left", where="page"),
    _ITEMS,
    Column(key="n_raters", heading="Raters"),
)

_CONVENTIONS = {
    "irrcac": "SE and interval: as irrCAC prints them.",
    "spss": "SE and interval: as SPSS prints them. The SE of Fleiss' κ is valid only "
    "if κ is 0, so the true coverage of its interval may be far lower than stated.",
    "over_n": "SE and interval: delta method over n, as the R packages vcd and psych "
    "print them for Cohen's κ.",
}

_SOURCES = {
    "landis_koch": "Landis and Koch (1977)",
    "altman": "Altman (1991)",
    "fleiss": "Fleiss (1981)",
    "cicchetti": "Cicchetti and Sparrow (1981)",
}

_OF_ESTIMATE = ("coefficient", "weights", "value", "n_items", "n_raters")
_OF_INTERVAL = ("median", "low", "high", "level", "method", "target")


def answer_table(
    answer: Answer,
    *,
    bands: BandScale | None,
    detail: Detail,
    items: str,
    in_sentences: bool,
    data: str,
) -> Table:
    """Return the table of an answer."""
    # bands: whose words for values; items: what they are called; in_sentences: whether
    # notes are for `agreement_sentences`
    estimates = answer.estimates
    shown = answer.rows if answer.shown is None else answer.shown
    notes, after = list(answer.notes), []
    if estimates:
        shown = [_cells(row, answer.heads, bands, detail, items) for row in estimates]
        notes += _errors_note(estimates, in_sentences)
        notes += [] if in_sentences else _paired_note(estimates, items)
        after = [] if bands is None else [words_note(estimates, bands)]
    columns = _columns(answer, shown, bands, items)
    populations = {row.get("population") for row in shown} - {None}
    if detail != "brief" or len(populations) < 2:  # a note, or the sentence, says it
        columns = [column for column in columns if column.key != "population"]
    if detail == "brief":
        notes = [note for note in notes if not isinstance(note, Explanation)]
    # what groups of rows are called in notes
    by = "groups" if answer.name == "differences" else ", ".join(answer.heads.values())
    named = [row for row in shown if "title" in row]
    in_unit = f" ({answer.of})" if answer.of else ""
    return table_of(
        answer.name,
        _CAPTIONS[answer.name].format(of=answer.of, in_unit=in_unit),
        columns,
        shown,
        hide_empty=answer.name.startswith("diagnosis") and not answer.grades,
        in_units=tuple(at for at, row in enumerate(estimates) if is_in_units(row)),
        notes=(*notes, *_row_notes(named, by, detail), *after),
        data=data,
    )


def _row_notes(rows: Sequence[Row], by: str, detail: Detail) -> tuple[str, ...]:
    """Return the notes on rows, what is of the same rows as one note."""
    # A note names its rows, unless it holds for all that it could be of.
    # rows: each with its title, its group, why it is undefined or else its texts, and
    # those of its interval if it has one; by: what groups are called
    rows_of: dict[tuple[str, bool], list[Row]] = {}
    for row in rows:
        undefined = [f"undefined: {row['reason']}"] if row.get("reason") else []
        for text in row.get("texts", undefined):
            rows_of.setdefault((text, False), []).append(row)
        for note in row.get("interval_texts") or ():
            text = getattr(note, "brief", note) if detail == "usual" else note
            if text and (detail != "brief" or isinstance(note, _Caution)):
                rows_of.setdefault((text, True), []).append(row)
    n_intervals = sum(row.get("interval_texts") is not None for row in rows)
    texts_of: dict[str, list[str]] = {}
    for (text, is_of_interval), subset in rows_of.items():
        is_of_all = len(subset) == (n_intervals if is_of_interval else len(rows))
        start = capital(text) if is_of_all else _names(subset, rows, by)
        texts_of.setdefault(start, []).extend([] if is_of_all else [text])
    return tuple(
        f"{start}: {'; '.join(texts)}." if texts else f"{start}."
        for start, texts in texts_of.items()
    )


def _names(subset: Sequence[Row], rows: Sequence[Row], by: str) -> str:
    # The coefficients that a note holds for, with their groups unless it holds for all;
    # three or more that follow each other in the table by the first and the last. The
    # groups alone where it holds for every coefficient of them.
    every: dict[str, list[str]] = {}
    some: dict[str, list[str]] = {}
    for groups_of, of in ((every, rows), (some, subset)):
        for row in of:
            groups_of.setdefault(row["title"], []).append(row.get("group", ""))
    names: list[str] = []
    for groups, of_groups in itertools.groupby(every, key=some.get):
        titles = list(of_groups)
        if groups is None:
            continue
        if by and len(titles) == len(every):
            # of several levels, as North: test, the names say enough
            return (
                "; ".join(groups) if "," in by else f"{capital(by)} {', '.join(groups)}"
            )
        is_of_all = all(every[title] == groups for title in titles)
        which = "" if is_of_all else f" ({', '.join(groups)})"
        if len(titles) > 2:
            titles = [f"{titles[0]} to {titles[-1]}"]
        names += [f"{title}{which}" for title in titles]
    return "; ".join(names)


def _columns(
    answer: Answer, shown: Sequence[Row], bands: BandScale | None, items: str
) -> list[Column]:
    columns = [
        Column(key=key, heading=capital(name), align="left")
        for key, name in answer.heads.items()
    ]
    known = {key for row in shown for key, value in row.items() if value is not None}
    hidden = {"median"} - known
    if len({row.get("group") for row in shown}) == 1:  # nothing to adjust p for
        hidden.add("p_holm")
    if len({row.get("judge") for row in shown}) == 1 and len(shown) > 1:
        hidden.add("judge")
    for column in _COLUMNS.get(answer.name, _OF_ESTIMATES):
        if "reference" in column.key and "with_reference" not in known:
            continue
        heading = column.heading.format(of=capital(answer.of), items=capital(items))
        where = "csv" if column.key in hidden else column.where
        columns.append(replace(column, heading=heading, where=where))
    columns += [Column(key=f"said_{g}", heading=g, digits=2) for g in answer.grades]
    if bands is not None and answer.estimates:
        columns.append(Column(key="words", heading="At least", align="left"))
    return columns


def answer_documents(
    answer: Answer, bands: BandScale | None
) -> list[dict[str, object]]:
    """Return the rows of an answer for JSON: ``nan`` and infinities as None."""
    of_estimates = [
        {
            **row.keys,
            **as_document(row.estimate),
            **({} if bands is None else {"word": word_of(row, bands)}),
            "notes": [*row.notes, *_why_null(row.estimate)],
        }
        for row in answer.estimates
    ]
    return of_estimates or [
        {key: _plain(value) for key, value in row.items()} for row in answer.rows
    ]


def is_in_units(row: AgreementRow) -> bool:
    """Return whether an estimate is in the units of the ratings."""
    entry = COEFFICIENTS.get(row.estimate.coefficient)  # none of kappa of a category
    return entry is not None and entry.in_units


def _cells(
    row: AgreementRow,
    heads: Mapping[str, str],
    bands: BandScale | None,
    detail: Detail,
    items: str,
) -> Row:
    # what columns show, and the texts of notes: how the interval was made, what to know
    # of it, and why a value is undefined
    estimate, interval = row.estimate, row.estimate.interval
    # without observed agreement a statistic as a rule has no error either
    numbers = (estimate.observed, estimate.standard_error)
    has_none = all(map(math.isnan, numbers)) and estimate.reason is None
    undefined = [] if estimate.reason is None else [f"undefined: {estimate.reason}"]
    cells: Row = {
        **{key: getattr(estimate, key) for key in _OF_ESTIMATE},
        **dict.fromkeys(heads, row.group),
        "title": row.title,
        "group": row.group,
        "standard_error": None if has_none else estimate.standard_error,
        "words": None if bands is None else word_of(row, bands),
        "texts": [*undefined, *row.notes],
        "interval_texts": None,
    }
    if interval is not None:
        noun: Noun = "model" if items == "models" else "item"
        texts = [] if interval.reason else [_interval_note(interval, detail, noun)]
        if interval.reason not in (None, estimate.reason):
            why = f"no interval ({interval.method}): {interval.reason}"
            texts.append(_Caution(why))
        cells |= {key: getattr(interval, key) for key in _OF_INTERVAL}
        cells["interval_texts"] = [*texts, *interval.notes]
        cells["population"] = _POPULATIONS[interval.target]
    return cells


def word_of(row: AgreementRow, bands: BandScale) -> str | None:
    """Return the best word that the true value reaches with 95 % probability."""
    estimate = row.estimate
    entry = COEFFICIENTS.get(estimate.coefficient)  # none of kappa of a category
    if (entry is not None and not entry.chance_corrected) or math.isnan(estimate.value):
        return None
    if row.lower_bound is not None:
        return strength(row.lower_bound, scale=bands)
    if not estimate.standard_error > 0.0:  # said in a note rather than warned of
        return "undefined"
    return benchmark(estimate, scale=bands)


def _errors_note(rows: Sequence[AgreementRow], in_sentences: bool) -> list[str]:
    # a sentence has the standard error only where there is no interval
    units = [
        None if row.estimate.interval is None else row.estimate.interval.unit
        for row in rows
        if not math.isnan(row.estimate.standard_error)
        and row.convention is None
        and not (in_sentences and row.estimate.interval is not None)
    ]
    are_clustered = {unit == "clusters" for unit in units}
    samples = {True: "clusters", False: "items"}
    conventions = {row.convention for row in rows}
    notes = [text for name, text in _CONVENTIONS.items() if name in conventions]
    return notes + [
        Explanation(f"SE: delta method, with {sample} as the sample.")
        for is_clustered, sample in samples.items()
        if is_clustered in are_clustered
    ]


def _paired_note(rows: Sequence[AgreementRow], items: str) -> list[str]:
    # how many items the values rest on, where some have no pair of ratings
    fewer = {
        row.group: row.estimate
        for row in rows
        if row.estimate.n_items_paired < row.estimate.n_items
    }
    if not fewer:
        return []
    pair = pair_words(next(iter(fewer.values())))
    is_one = len({row.group for row in rows}) == 1
    counts = [
        f"{of.n_items_paired} of {of.n_items}{'' if is_one else f' ({group})'}"
        for group, of in fewer.items()
    ]
    return [f"{capital(items)} with {pair}: {', '.join(counts)}."]


def _interval_note(interval: Interval, detail: Detail, noun: Noun) -> str:
    ends = "bound" if interval.is_one_sided else "interval"
    kind = f"credible {ends}" if interval.kind == "credible" else "CI"
    name = f"{percent(interval.level)} % {kind}, {interval.method}"
    to = f": generalises to {_population(interval).replace('item', noun)} like these"
    if detail == "all":
        return f"{name}{origin(interval, noun)}{to}: {promise(interval, noun)}"
    return name + to


def words_note(rows: Sequence[AgreementRow], bands: BandScale) -> str:
    """Explain the words for values, and by which distribution they were chosen."""
    named = [row for row in rows if word_of(row, bands) is not None]
    bounded = [row for row in named if row.lower_bound is not None]
    laws = ["its interval (one-sided)"] if bounded else []
    if len(bounded) < len(named):
        none = " where there is none" if bounded else ""
        laws.append(f"a normal distribution around the estimate{none}")
    by = f", by {', or by '.join(laws)}" if laws else ""
    by += (
        "; undefined if the SE is 0, which does not mean that the value is certain"
        * any(
            row.lower_bound is None and row.estimate.standard_error == 0.0
            for row in named
        )
    )
    return (
        f"At least: the highest band of {_SOURCES[bands]} that the true value reaches "
        f"with 95 % probability{by}; the words are conventions."
    )


def agreement_sentences(
    answer: Answer, *, bands: BandScale | None, data: str, items: str = "items"
) -> str:
    """Return a sentence for every estimate, one a line."""
    stamp = f"{SIMULATED}. " if data == "simulated" else ""
    lines = []
    for row in answer.estimates:
        earned = ""
        if bands is not None and (word := word_of(row, bands)) not in (
            None,
            "undefined",
        ):
            earned = f"at least {word} by {_SOURCES[bands]}"
        group = "".join(f"{capital(by)} {row.group}: " for by in answer.heads.values())
        lines.append(
            f"{stamp}{group}{sentence(row.estimate, items=items, word=earned)}"
        )
    return "\n".join(lines)


def _why_null(estimate: Estimate) -> list[str]:
    # why a number of a record is null, where neither `reason` says it
    numbers = ("standard_error", "observed", "chance")
    nulls = [name for name in numbers if math.isnan(getattr(estimate, name))]
    why = []
    if nulls and estimate.reason is None:
        is_error = nulls == ["standard_error"]
        who = "one item" if is_error else COEFFICIENTS[estimate.coefficient].title
        why.append(f"{', '.join(nulls)}: null, {who} has none")
    return why + [
        f"interval.{name}: null, there is no bound"
        for name in ("low", "high")
        if math.isinf(getattr(estimate.interval, name, 0.0))
    ]


def agreement_forest(rows: Sequence[AgreementRow], target: Target) -> Drawn:
    """Return what a figure shows: the estimates and their intervals."""
    # what is in the units of the ratings is on no axis of agreement
    rows = [row for row in rows if not is_in_units(row)]
    refuse(
        (
            not rows,
            "--figure: needs coefficients of agreement, got only estimates in the "
            "units of the ratings",
        )
    )
    intervals = [row.estimate.interval for row in rows if row.estimate.interval]
    targets = {interval.target for interval in intervals}
    # the axis has the population of all, as of an ICC for other items and raters
    common = targets.pop() if len(targets) == 1 else target
    several = len({row.group for row in rows}) > 1
    drawn, label = [], "agreement (1 is perfect)"
    for row in rows:
        # what neither the axis nor the legend says of the interval
        details = []
        if interval := row.estimate.interval:
            details = ["one-sided"] * interval.is_one_sided
            if interval.target != common:
                details.append(f"other {_POPULATIONS[interval.target]}")
        group = row.group if several else ""
        detail = ", ".join(details)
        drawn.append(forest_row(row.title, row.estimate, detail=detail, group=group))
    if any(interval.reason is None for interval in intervals):
        label += f"; intervals for other {_POPULATIONS[common]}"
    return Drawn(FOREST, (tuple(drawn), label))
