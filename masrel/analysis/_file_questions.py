"""Questions about a file of ratings beside its agreement, and rows that answer them.

In: a `RatingsFile` and how estimates are made. Out: an `Answer`, whose rows are as the
JSON has them; what tables show otherwise stands beside them.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import (
    CodedRatings,
    Coefficient,
    LimitsOfAgreement,
    Significance,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    category_kappa,
    coefficient,
    contingency_table,
    kappa_max,
    limits_of_agreement,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.analysis._file_comparisons import difference_rows, equality_rows
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    EstimateOptions,
    Questions,
    Row,
    agreement,
    check_order,
    coded_part,
    entries,
    estimate_row,
    group_key,
    heads_of,
    note,
    on_grades,
    part_names,
    parts_of,
)
from masrel.errors import (
    MasrelError,
    MasrelWarning,
    ParameterError,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.ratings import RatingsFile, RatingsPart

if TYPE_CHECKING:
    from masrel.intervals.diagnosis import Diagnosis

_T = TypeVar("_T")

_SHOWN = 6  # names that a note lists
_MANY = 8  # raters beyond which only the pairs that agree least are shown
_SHOWN_PAIRS = 20  # of these pairs


def answers(
    file: RatingsFile, options: EstimateOptions, questions: Questions
) -> tuple[RatingsFile, list[Answer]]:
    """Return the ratings without a reference, and the answers, agreement first."""
    sessions = list(dict.fromkeys(str(part.session) for part in file.parts))
    if len(sessions) > 1 and not questions.retest:
        raise RatingsError(
            f"{file.read['file']}: holds {len(sessions)} sessions "
            f"({', '.join(sessions)}), so that raters graded the same item more than "
            f"once; --by {file.read['session']} estimates each"
        )
    if options.weights != "identity" and not file.is_ordered:
        raise ParameterError(
            f"--weights {options.weights}: needs --categories with every grade of the "
            f"scale in order, the grades met are text: {', '.join(file.scale.grades)}"
        )
    others = file
    if questions.reference is not None:
        others = _without_reference(file, questions.reference)
    between = questions.between_raters(others, options)
    with warnings.catch_warnings():
        # Every note is in a result, and so below its table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        # what does not fit these tables is said first: it says most
        further = list(_further_answers(file, others, options, between, questions))
        first = [] if between is None else [agreement(others, between)]
    return others, first + further


def _further_answers(
    file: RatingsFile,
    others: RatingsFile,
    options: EstimateOptions,
    between: EstimateOptions | None,
    questions: Questions,
) -> Iterator[Answer]:
    # others: the ratings without a reference; between: what is estimated of raters
    if questions.retest:
        yield _retest(file, options)
    if questions.each_category:
        yield _categories(others, options)
    if questions.diagnose:
        yield from _diagnosis(file, options, questions.reference)
    if questions.symmetry:
        yield _symmetry(others)
    if questions.indices:
        yield _indices(others)
    if questions.limits_of_agreement:
        yield _limits(others, options, questions.unit)
    if questions.compare and between is not None:
        of_all = entries(between, _n_raters(others), others)
        yield difference_rows(others, of_all, between)
        if len(others.parts) > 2:  # of two the difference says it
            yield equality_rows(others, of_all, between)


def _n_raters(file: RatingsFile) -> int:
    n_raters = max(len(part.raters) for part in file.parts)
    return n_raters or int(file.read["n_raters"])


def _named(names: Sequence[str]) -> str:
    # as a note lists them
    listed = ", ".join(names[:_SHOWN])
    more = len(names) - _SHOWN
    return f"{listed} and {more} more" if more > 0 else listed


def _without_reference(file: RatingsFile, reference: str) -> RatingsFile:
    """Return the ratings of all but the rater whom the others are held against."""
    parts = []
    for part in file.parts:
        coded = coded_part(part, "--diagnose")
        if reference not in part.raters:
            raise ParameterError(
                f"--reference: needs one of {', '.join(part.raters)}, got {reference!r}"
            )
        others = [place for place, name in enumerate(part.raters) if name != reference]
        raters = tuple(part.raters[place] for place in others)
        ratings = replace(coded, codes=coded.codes[:, others])
        parts.append(replace(part, raters=raters, ratings=ratings))
    findings = tuple(
        finding
        for finding in file.warnings
        if (finding.code, finding.facts.get("column")) != ("named rater", reference)
    )
    return replace(file, parts=tuple(parts), warnings=findings)


# ---- each category ----


def _categories(file: RatingsFile, options: EstimateOptions) -> Answer:
    """Return how well raters tell each category from all others."""
    rows = []
    for part, _, names in parts_of(file):
        for place, grade in enumerate(file.scale.grades):
            row = AgreementRow(
                keys={**names, "category": grade},
                title="Fleiss' κ, category",
                estimate=category_kappa(part.counted, file.scale.values[place]),
            )
            if options.target is not None and row.estimate.reason is None:
                row = _with_interval(row, part, place, options)
            estimate = replace(row.estimate, weights=grade)
            rows.append(replace(row, estimate=estimate))
    heads = heads_of(file, "category")
    return Answer(name="categories", estimates=tuple(rows), heads=heads)


def _with_interval(
    row: AgreementRow, part: RatingsPart, place: int, options: EstimateOptions
) -> AgreementRow:
    # that of Fleiss' kappa of the two categories that the scale is folded to
    if not part.counted.knows_raters:
        none = "no interval: counts do not say who rated what"
        return replace(row, notes=(none,))
    coded = part.counted.coded
    codes = np.where(coded.codes < 0, -1, coded.codes != place)
    folded = CodedRatings(codes=codes, categories=("this", "other"))
    plain = replace(options, coefficients=None, weights="identity")
    of, _ = estimate_row(coefficient("fleiss_kappa"), folded, row.keys, plain)
    estimate = replace(row.estimate, interval=of.estimate.interval)
    return replace(of, title=row.title, estimate=estimate)


# ---- two sessions ----


def _retest(file: RatingsFile, options: EstimateOptions) -> Answer:
    """Return how well raters agree with themselves, each and all together."""
    by = file.read["by"]
    estimates: list[AgreementRow] = []
    sessions, left_out = {}, []
    for group in dict.fromkeys(part.group for part in file.parts):
        of_group = "" if group is None else f"{group}: "
        parts = [part for part in file.parts if part.group == group]
        first, second = _two_sessions(file, parts, of_group)
        raters = _of_both(parts, "rater", of_group)
        items = _of_both(parts, "item", of_group)
        ratings = CodedRatings(
            codes=_side_by_side(parts, items, raters), categories=file.scale.values
        )
        names = {} if by is None else {group_key(by): group}
        estimates += _retest_rows(names, raters, ratings, options)
        sessions[of_group] = {"first": first, "second": second}
        lone = [*_left_out(parts, "rater", raters), *_left_out(parts, "item", items)]
        if lone:
            left_out.append(note("left_out", group=of_group, names="; ".join(lone)))
    # groups that have sessions of the same names share the note
    pairs = list(sessions.values())
    if pairs.count(pairs[0]) == len(pairs):
        sessions = {"": pairs[0]}
    notes = [note("sessions", group=of, **names) for of, names in sessions.items()]
    heads = ", ".join(["rater"] if by is None else [str(by), "rater"])
    return Answer(
        name="retest",
        estimates=tuple(estimates),
        heads={group_key(heads): heads},
        notes=(*notes, *left_out),
    )


def _retest_rows(
    names: dict[str, str | None],
    raters: Sequence[str],
    pairs: CodedRatings,
    options: EstimateOptions,
) -> list[AgreementRow]:
    # of both sessions of each rater in pairs, (n_items, 2 n_raters)
    every = replace(options, coefficients=None)
    # a single rater says nothing of other raters
    alone = replace(every, target=None if options.target != "items" else "items")
    rows = []
    for place, rater in enumerate(raters):
        ratings = replace(pairs, codes=pairs.codes[:, 2 * place : 2 * place + 2])
        keys = {**names, "rater": rater}
        row, _ = estimate_row(coefficient("cohen_kappa"), ratings, keys, alone)
        estimate = replace(row.estimate, n_raters=min(row.estimate.n_raters, 1))
        rows.append(replace(row, estimate=estimate))
    of_all = ["stratified_kappa"]
    if options.takes_all or "pooled_kappa" in options.names:
        of_all.append("pooled_kappa")
    everybody = {**names, "rater": None}
    return rows + [
        estimate_row(coefficient(name), pairs, everybody, every)[0] for name in of_all
    ]


def _two_sessions(
    file: RatingsFile, parts: Sequence[RatingsPart], of_group: str
) -> list[str]:
    column = file.read["session"]
    if column is None:
        raise ParameterError(
            "--retest: needs --session with the column of the two sessions"
        )
    if parts[0].session is None:
        raise ParameterError(
            f"--retest: compares the sessions of column {column!r}, so that --by must "
            "not take them apart"
        )
    sessions = [str(part.session) for part in parts]
    if len(sessions) != 2:
        raise RatingsError(
            f"--retest: {of_group}needs two sessions in column {column!r}, got "
            f"{len(sessions)} ({_named(sessions)})"
        )
    return sessions


def _of_both(
    parts: Sequence[RatingsPart], noun: Literal["rater", "item"], of_group: str
) -> list[str]:
    # the names that both sessions have, as they come in the first
    first, second = (getattr(part, f"{noun}s") for part in parts)
    again = set(second)
    both = [name for name in first if name in again]
    if not both:
        article = "an" if noun == "item" else "a"
        raise RatingsError(
            f"--retest: {of_group}needs {article} {noun} of both sessions, got "
            f"{_named(first)} in {parts[0].session!r} and {_named(second)} in "
            f"{parts[1].session!r}"
        )
    return both


def _left_out(
    parts: Sequence[RatingsPart], noun: Literal["rater", "item"], both: Sequence[str]
) -> Iterator[str]:
    # those of one session alone, in words
    known = set(both)
    for part in parts:
        lone = [name for name in getattr(part, f"{noun}s") if name not in known]
        if lone:
            yield f"{noun} {_named(lone)} ({part.session} only)"


def _side_by_side(
    parts: Sequence[RatingsPart], items: list[str], raters: list[str]
) -> NDArray[np.signedinteger]:
    # codes (n_items, 2 n_raters), both sessions of a rater beside each other
    import pandas as pd  # of all questions this one alone needs it

    tables = [
        pd.DataFrame(coded_part(part, "--retest").codes, part.items, part.raters)
        for part in parts
    ]
    codes = [table.loc[items, raters].to_numpy() for table in tables]
    return np.stack(codes, axis=2).reshape(len(items), -1)


# ---- two raters ----


def _two_raters(file: RatingsFile, part: RatingsPart, option: str) -> CodedRatings:
    coded = coded_part(part, option)
    if coded.codes.shape[1] != 2:
        of_part = "".join(f"{name}: " for name in part_names(file, part).values())
        raise RatingsError(
            f"{option}: {of_part}needs two raters, got {coded.codes.shape[1]} "
            f"({_named(part.raters)}); --raters chooses two"
        )
    return coded


def _symmetry(file: RatingsFile) -> Answer:
    """Return whether changes between categories go both ways alike often."""
    rows: list[Row] = []
    shown: list[Row] = []
    notes = []
    for part, name, keys in parts_of(file):
        for title, result in _symmetry_tests(file, part).items():
            test, _, kind = title.partition(", ")
            row = asdict(result)
            del row["name"], row["df"]
            row["df"] = list(result.df)
            if result.reason is None and math.isinf(result.statistic):
                row["reason"] = "infinite: all items changed, and one way"
            key = test.lower().replace("-", "_")
            rows.append({**keys, "test": key, "kind": kind or None, **row})
            shown.append({**rows[-1], "test": title})
            is_exact = result.distribution == "binomial"
            what = "exact_test" if is_exact else "test"
            notes.append(note(what, test=title, hypothesis=result.hypothesis))
            if row["reason"] is not None:
                why = "note" if result.reason is None else "undefined"
                of = ": ".join(filter(None, (name, title)))
                notes.append(note(why, of=of, reason=row["reason"]))
    return Answer(
        name="symmetry",
        rows=rows,
        shown=shown,
        heads=_heads(file),
        notes=tuple(dict.fromkeys(notes)),
    )


def _heads(file: RatingsFile) -> dict[str, str]:
    # a column for each of what tells parts apart
    return {group_key(name): name for name in part_names(file, file.parts[0])}


def _symmetry_tests(file: RatingsFile, part: RatingsPart) -> dict[str, Significance]:
    table = contingency_table(_two_raters(file, part, "--symmetry"))
    of_two = {}
    if len(table) == 2:
        corrected = mcnemar(table, kind="corrected")
        of_two = {"McNemar, exact": mcnemar(table), "McNemar, corrected": corrected}
    return {
        **of_two,
        "Bowker": bowker(table),
        "Stuart-Maxwell": stuart_maxwell(table),
        "Bhapkar": bhapkar(table),
    }


def _indices(file: RatingsFile) -> Answer:
    """Return what the margins of two raters and two categories do to kappa."""
    rows, notes = [], []
    for part, name, keys in parts_of(file):
        for row in _of_margins(file, part):
            rows.append({**keys, **row})
            if row["reason"] is not None:
                of = ": ".join(filter(None, (name, row["title"])))
                notes.append(note("note", of=of, reason=row["reason"]))
    return Answer(
        name="indices",
        rows=rows,
        shown=[{**row, "index": row["title"]} for row in rows],
        heads=_heads(file),
        notes=(*map(note, ("pabak", "on_category", "largest")), *notes),
    )


_OF_TABLE = {
    "prevalence_index": ("Prevalence index", prevalence_index),
    "bias_index": ("Bias index", bias_index),
    "kappa_max": ("Largest κ", kappa_max),
}


def _of_margins(file: RatingsFile, part: RatingsPart) -> Iterator[Row]:
    coded, grades = _two_raters(file, part, "--indices"), file.scale.grades
    if len(grades) != 2:
        raise RatingsError(
            f"--indices: needs a scale of two categories, got {len(grades)} "
            f"({_named(grades)})"
        )
    table = contingency_table(coded)
    row = {
        "index": "pabak",
        "title": "PABAK",
        "category": None,
        "value": None,
        "standard_error": None,
        "n_items": int(table.sum()),
        "reason": None,
    }
    estimate, why = _with_reason(lambda: brennan_prediger(part.counted))
    error = estimate.standard_error
    yield row | {"value": estimate.value, "standard_error": error, "reason": why}
    for name, (title, function) in _OF_TABLE.items():
        value, why = _with_reason(partial(function, table))
        yield row | {"index": name, "title": title, "value": value, "reason": why}
    shares, why = _with_reason(lambda: specific_agreement(table))
    for grade, share in zip(grades, shares, strict=True):
        yield row | {
            "index": "specific_agreement",
            "title": f"Agreement on {grade}",
            "category": grade,
            "value": share,
            "reason": why if math.isnan(share) else None,
        }


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UndefinedStatisticWarning)
        value = call()
    return value, str(caught[0].message) if caught else None


def _limits(file: RatingsFile, options: EstimateOptions, unit: str | None) -> Answer:
    """Return between which bounds the differences of two raters lie."""
    check_order(file, "--limits-of-agreement")
    rows: list[Row] = []
    shown: list[Row] = []
    notes, figure = [], []
    for part, name, keys in parts_of(file):
        coded = _two_raters(file, part, "--limits-of-agreement")
        result = limits_of_agreement(coded, level=options.level)
        rows.append({**keys, **_limits_row(part, result)})
        shown += [{**keys, **row} for row in _limits_shown(result)]
        notes.append(note("pair", pair=" less ".join(part.raters)))
        if result.reason is not None:
            of = f"{name}: undefined" if name else "undefined"
            notes.append(note("note", of=of, reason=result.reason))
        figure.append((name, (part.raters, result)))
    ends = note("limits"), note("exact_ends", level=options.level)
    return Answer(
        name="limits_of_agreement",
        rows=rows,
        shown=shown,
        heads=_heads(file),
        notes=(*dict.fromkeys(notes), *ends),
        of=unit or "",
        figure=tuple(figure),
    )


def _limits_row(part: RatingsPart, result: LimitsOfAgreement) -> Row:
    keys = ("n_items", "mean", "sd", "lower", "upper", "share")
    intervals = ("mean_interval", "lower_interval", "upper_interval")
    ends = {key: getattr(result, key) for key in intervals}
    return {
        "first": part.raters[0],
        "second": part.raters[1],
        **{key: getattr(result, key) for key in keys},
        "level": result.mean_interval.level,
        **{key: {"low": of.low, "high": of.high} for key, of in ends.items()},
        "inner": list(result.inner),
        "outer": list(result.outer),
        "reason": result.reason,
    }


def _limits_shown(result: LimitsOfAgreement) -> Iterator[Row]:
    nothing = (None, None)
    ends_of_both = tuple(zip(result.outer, result.inner, strict=True))
    for quantity, key, both in (
        ("Mean", "mean", nothing),
        ("Lower limit", "lower", ends_of_both[0]),
        ("Upper limit", "upper", ends_of_both[1][::-1]),
    ):
        interval = getattr(result, f"{key}_interval")
        yield {
            "quantity": quantity,
            "value": getattr(result, key),
            "low": interval.low,
            "high": interval.high,
            "pair_low": both[0],
            "pair_high": both[1],
            "n_items": result.n_items,
        }


# ---- raters, pairs and categories ----


def _diagnosis(
    file: RatingsFile, options: EstimateOptions, reference: str | None
) -> Iterator[Answer]:
    """Return raters, pairs, categories and confusions of every part of the ratings."""
    if options.takes_all or (options.coefficients is None and options.metric is None):
        options = replace(options, coefficients=["fleiss_kappa"])
    if len(options.names) > 1:
        raise ParameterError(
            "--diagnose: needs one coefficient, got --coefficients "
            f"{','.join(options.names)}"
        )
    (entry,) = entries(options, _n_raters(file), file)
    parts = [
        (group, keys, _diagnosed(file, part, group, entry, options, reference))
        for part, group, keys in parts_of(file)
    ]
    title, grades = options.title(entry), file.scale.grades
    by = ", ".join(_heads(file).values())
    of = {"raters": title, "pairs": title, "confusion": reference or "another rater"}
    results = [result for *_, result in parts]
    for kind, rows_of in _DIAGNOSES.items():
        rows = [
            (group, keys, row)
            for group, keys, result in parts
            for row in rows_of(grades, result)
        ]
        answer = Answer(
            name=f"diagnosis_{kind}",
            rows=[{**keys, **row} for _, keys, row in rows],
            shown=[{"group": group, **row} for group, _, row in rows],
            heads={"group": by} if by else {},
            notes=tuple(_diagnosis_notes(kind, results, title)),
            of=of.get(kind, ""),
            has_reference=reference is not None,
        )
        if kind == "pairs":
            figure = tuple((group, result) for group, _, result in parts)
            answer = replace(_those_that_agree_least(answer, results), figure=figure)
        if kind == "confusion":
            shares = [
                {"group": group, **row}
                for group, _, result in parts
                for row in _confusion_shown(grades, result)
            ]
            answer = replace(answer, shown=shares, grades=grades)
        yield answer


def _diagnosed(
    file: RatingsFile,
    part: RatingsPart,
    group: str,
    entry: Coefficient,
    options: EstimateOptions,
    reference: str | None,
) -> "Diagnosis":
    from masrel.intervals.diagnosis import diagnose

    ratings = on_grades(coded_part(part, "--diagnose"), entry, file)
    try:
        return diagnose(
            ratings,
            coefficient=entry,
            target=None if options.target is None else "items",
            raters=part.raters,
            reference=reference,
            weights=options.weights_of(entry),
            level=options.level,
        )
    except MasrelError as error:
        where = f"{group}: " if group else ""
        raise type(error)(f"--diagnose: {where}{error}") from error


def _diagnosis_notes(
    kind: str, results: "Sequence[Diagnosis]", title: str
) -> Iterator[str]:
    first, is_of_raters = results[0], kind == "raters"
    if kind == "confusion":
        yield note("confusion")
        if not np.isnan(first.share_low).all():
            yield note("confusion_ends")
        return
    if is_of_raters and first.reference is not None:
        yield note("reference", rater=first.reference)
    if not np.isnan(first.category_low).all():
        yield note(f"{kind}_ends", level=first.level, title=title)
        if is_of_raters:
            texts = dict.fromkeys(text for result in results for text in result.notes)
            yield from (f"{text}." for text in texts)
    elif is_of_raters:
        yield note("no_ends")


def _those_that_agree_least(answer: Answer, results: "Sequence[Diagnosis]") -> Answer:
    if len(results[0].raters) <= _MANY:
        return answer
    rows = answer.shown or []
    least = sorted(rows, key=lambda r: math.inf if r["value"] is None else r["value"])
    shown = least[:_SHOWN_PAIRS]
    notes = (note("least", n=len(shown), n_all=len(rows)), *answer.notes)
    return replace(answer, shown=shown, notes=notes)


def _rater_rows(_: Sequence[str], result: "Diagnosis") -> Iterator[Row]:
    columns = {
        "mean_of_pairs": result.mean_values,
        "with_reference": result.reference_values,
        "reference_low": result.reference_low,
        "reference_high": result.reference_high,
        "without": result.without_values,
        "change": result.changes,
        "standard_error": result.change_errors,
        "low": result.change_low,
        "high": result.change_high,
    }
    for place, rater in enumerate(result.raters):
        cells = {key: _known(values[place]) for key, values in columns.items()}
        yield {"rater": rater, **cells}


def _pair_rows(_: Sequence[str], result: "Diagnosis") -> Iterator[Row]:
    for at in itertools.combinations(range(len(result.raters)), 2):
        yield {
            "first": result.raters[at[0]],
            "second": result.raters[at[1]],
            "value": _known(result.pair_values[at]),
            "low": _known(result.pair_low[at]),
            "high": _known(result.pair_high[at]),
            "n_items": int(result.pair_items[at]),
        }


def _category_rows(grades: Sequence[str], result: "Diagnosis") -> Iterator[Row]:
    for place, grade in enumerate(grades):
        yield {
            "category": grade,
            "n_ratings": int(result.category_counts[place]),
            "agreement": _known(result.category_values[place]),
            "low": _known(result.category_low[place]),
            "high": _known(result.category_high[place]),
        }


def _confusion_rows(grades: Sequence[str], result: "Diagnosis") -> Iterator[Row]:
    places = range(len(grades))
    for at in itertools.product(range(len(result.raters)), places, places):
        place, row, column = at
        yield {
            "rater": result.raters[place],
            "of": grades[row],
            "said": grades[column],
            "n": int(result.confusion[at]),
            "share": _known(result.shares[at]),
            "low": _known(result.share_low[at]),
            "high": _known(result.share_high[at]),
        }


_DIAGNOSES = {
    "raters": _rater_rows,
    "pairs": _pair_rows,
    "categories": _category_rows,
    "confusion": _confusion_rows,
}


def _confusion_shown(grades: Sequence[str], result: "Diagnosis") -> Iterator[Row]:
    # a row a rater and grade of another, a column a grade
    for place, rater in enumerate(result.raters):
        for row, grade in enumerate(grades):
            n = int(result.confusion[place, row].sum())
            shares = result.shares[place, row]
            if n:  # else there is nothing to tell
                cells = {
                    f"said_{g}": _known(s) for g, s in zip(grades, shares, strict=True)
                }
                yield {"rater": rater, "of": grade, "n": n, **cells}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else float(value)
