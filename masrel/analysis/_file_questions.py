"""Questions about a file of ratings beside its agreement, and rows that answer them.

In: a `RatingsFile` and how estimates are made. Out: an `Answer`, whose rows are as the
JSON has them; what tables show otherwise stands beside them.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from masrel.agreement import (
    CodedRatings,
    Coefficient,
    LimitsOfAgreement,
    Significance,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    code_ratings,
    coefficient,
    contingency_table,
    kappa_max,
    limits_of_agreement,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    EstimateOptions,
    Note,
    Row,
    category_rows,
    estimate_row,
    group_key,
    on_grades,
)
from masrel.errors import (
    MasrelError,
    ParameterError,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.ratings import RatingsFile, RatingsPart

if TYPE_CHECKING:
    from masrel.intervals import Diagnosis

_T = TypeVar("_T")

_SHOWN = 6  # names that a note lists
_MANY = 8  # raters beyond which only the pairs that agree least are shown
_SHOWN_PAIRS = 20  # of these pairs


# ---- parts of a file ----


def part_names(file: RatingsFile, part: RatingsPart) -> dict[str, str]:
    """Return what tells a part from the others: names of columns, and what they say."""
    names = {}
    if part.group is not None:
        names[str(file.read["by"])] = part.group
    if part.session is not None and len({other.session for other in file.parts}) > 1:
        names[str(file.read["session"])] = part.session
    return names


def label(names: Iterable[str]) -> str:
    """Return what something is called, from the group down."""
    return ": ".join(names)


def named(names: Sequence[str]) -> str:
    """Return names as a note lists them."""
    listed = ", ".join(names[:_SHOWN])
    more = len(names) - _SHOWN
    return f"{listed} and {more} more" if more > 0 else listed


def coded_part(part: RatingsPart, option: str) -> CodedRatings:
    """Return the ratings of a part, of which it must be known who rated what."""
    try:
        return code_ratings(part.ratings)
    except RatingsError as error:
        raise RatingsError(f"{option}: {error}") from error


def without_reference(file: RatingsFile, reference: str) -> RatingsFile:
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


def _two_raters(file: RatingsFile, part: RatingsPart, option: str) -> CodedRatings:
    coded = coded_part(part, option)
    if coded.codes.shape[1] != 2:
        of_part = "".join(f"{name}: " for name in part_names(file, part).values())
        raise RatingsError(
            f"{option}: {of_part}needs two raters, got {coded.codes.shape[1]} "
            f"({named(part.raters)}); --raters chooses two"
        )
    return coded


def _parts(file: RatingsFile) -> Iterator[tuple[RatingsPart, str, Row]]:
    # every part, what it is called, and the same by keys
    for part in file.parts:
        names = part_names(file, part)
        yield part, label(names.values()), {group_key(k): v for k, v in names.items()}


def _heads(file: RatingsFile) -> dict[str, str]:
    return {group_key(name): name for name in part_names(file, file.parts[0])}


def _head(names: Sequence[str]) -> dict[str, str]:
    # one column for all of them
    by = ", ".join(names)
    return {group_key(by): by}


# ---- each category ----


def categories(file: RatingsFile, options: EstimateOptions) -> Answer:
    """Return how well raters tell each category from all others."""
    keys, estimates = [], []
    for part, _, names in _parts(file):
        estimates += category_rows(part, names.values(), file.scale, options)
        keys += [{**names, "category": grade} for grade in file.scale.grades]
    return Answer(
        name="categories",
        rows=keys,
        estimates=tuple(estimates),
        heads=_head([*_heads(file).values(), "category"]),
    )


# ---- two sessions ----


def retest(file: RatingsFile, options: EstimateOptions) -> Answer:
    """Return how well raters agree with themselves, each and all together."""
    if file.read["session"] is None:
        raise ParameterError(
            "--retest: needs --session with the column of the two sessions"
        )
    by = file.read["by"]
    keys: list[Row] = []
    estimates: list[AgreementRow] = []
    sessions, left_out = [], []
    groups = list(dict.fromkeys(part.group for part in file.parts))
    for group in groups:
        parts = [part for part in file.parts if part.group == group]
        of_group = "" if group is None else f"{group}: "
        first, second = _check_sessions(file, parts, of_group)
        raters = _of_both(parts, "a rater", [part.raters for part in parts], of_group)
        items = _of_both(parts, "an item", [part.items for part in parts], of_group)
        ratings = CodedRatings(
            codes=_side_by_side(parts, items, raters), categories=file.scale.values
        )
        rows = _retest_rows(() if group is None else (group,), raters, ratings, options)
        names = {} if by is None else {group_key(by): group}
        of_all = [None] * (len(rows) - len(raters))
        keys += [{**names, "rater": rater} for rater in (*raters, *of_all)]
        estimates += rows
        sessions.append((of_group, {"first": first, "second": second}))
        if texts := _left_out(parts, raters, items):
            values = {"group": of_group, "names": "; ".join(texts)}
            left_out.append(Note("left_out", values))
    # groups that have sessions of the same names share the note
    are_alike = all(names == sessions[0][1] for _, names in sessions)
    heads = {"" if are_alike else group: names for group, names in sessions}
    notes = [Note("sessions", {"group": g, **names}) for g, names in heads.items()]
    return Answer(
        name="retest",
        rows=keys,
        estimates=tuple(estimates),
        heads=_head(["rater"] if by is None else [str(by), "rater"]),
        notes=(*notes, *left_out),
    )


def _retest_rows(
    head: Sequence[str],
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
        name = label([*head, rater])
        row, _ = estimate_row(coefficient("cohen_kappa"), ratings, name, alone)
        estimate = replace(row.estimate, n_raters=min(row.estimate.n_raters, 1))
        rows.append(replace(row, estimate=estimate))
    of_all = ["stratified_kappa"]
    if options.takes_all or "pooled_kappa" in options.names:
        of_all.append("pooled_kappa")
    everybody = label([*head, "all"])
    return rows + [
        estimate_row(coefficient(name), pairs, everybody, every)[0] for name in of_all
    ]


def _check_sessions(
    file: RatingsFile, parts: Sequence[RatingsPart], of_group: str
) -> list[str]:
    column = file.read["session"]
    if parts[0].session is None:
        raise ParameterError(
            f"--retest: compares the sessions of column {column!r}, so that --by must "
            "not take them apart"
        )
    sessions = [str(part.session) for part in parts]
    if len(sessions) != 2:
        raise RatingsError(
            f"--retest: {of_group}needs two sessions in column {column!r}, got "
            f"{len(sessions)} ({named(sessions)})"
        )
    return sessions


def _of_both(
    parts: Sequence[RatingsPart],
    noun: str,
    names: Sequence[tuple[str, ...]],
    of_group: str,
) -> tuple[str, ...]:
    # the names that both sessions have, as they come in the first
    again = set(names[1])
    both = tuple(name for name in names[0] if name in again)
    if not both:
        each = (
            f"{named(of)} in {part.session!r}"
            for of, part in zip(names, parts, strict=True)
        )
        raise RatingsError(
            f"--retest: {of_group}needs {noun} of both sessions, got "
            f"{' and '.join(each)}"
        )
    return both


def _side_by_side(
    parts: Sequence[RatingsPart], items: Sequence[str], raters: Sequence[str]
) -> Any:
    # codes (n_items, 2 n_raters), both sessions of a rater beside each other
    codes = []
    for part in parts:
        row, column = (
            {name: place for place, name in enumerate(names)}
            for names in (part.items, part.raters)
        )
        places = np.ix_([row[i] for i in items], [column[r] for r in raters])
        codes.append(coded_part(part, "--retest").codes[places])
    return np.stack(codes, axis=2).reshape(len(items), -1)


def _left_out(
    parts: Sequence[RatingsPart], raters: Sequence[str], items: Sequence[str]
) -> list[str]:
    # raters and items of one session alone, in words
    texts, of_both = [], {"rater": set(raters), "item": set(items)}
    for part in parts:
        for noun, names in (("rater", part.raters), ("item", part.items)):
            lone = [name for name in names if name not in of_both[noun]]
            texts += [f"{noun} {named(lone)} ({part.session} only)"] if lone else []
    return texts


# ---- two raters ----


def symmetry(file: RatingsFile) -> Answer:
    """Return whether changes between categories go both ways alike often."""
    rows: list[Row] = []
    shown: list[Row] = []
    notes: dict[str, Note] = {}
    for part, name, keys in _parts(file):
        for title, result in _symmetry_tests(file, part).items():
            test, _, kind = title.partition(", ")
            why, reason = "undefined", result.reason
            if reason is None and math.isinf(result.statistic):
                why, reason = "note", "infinite: all items changed, and one way"
            fields = asdict(result)
            del fields["name"], fields["df"]
            key = test.lower().replace("-", "_")
            of_test = {**keys, "test": key, "kind": kind or None}
            rows.append({**of_test, **fields, "df": list(result.df), "reason": reason})
            shown.append({**rows[-1], "test": title})
            is_exact = result.distribution == "binomial"
            values = {"test": title, "hypothesis": result.hypothesis}
            notes[title] = Note("exact_test" if is_exact else "test", values)
            if reason is not None:
                of = label(filter(None, (name, title)))
                notes[of + "?"] = Note(why, {"of": of, "reason": reason})
    return Answer(
        name="symmetry",
        rows=rows,
        shown=shown,
        heads=_heads(file),
        notes=tuple(notes.values()),
    )


def _symmetry_tests(file: RatingsFile, part: RatingsPart) -> dict[str, Significance]:
    table = contingency_table(_two_raters(file, part, "--symmetry"))
    tests: dict[str, Significance] = {}
    if len(table) == 2:
        tests["McNemar, exact"] = mcnemar(table)
        tests["McNemar, corrected"] = mcnemar(table, kind="corrected")
    tests["Bowker"] = bowker(table)
    tests["Stuart-Maxwell"] = stuart_maxwell(table)
    tests["Bhapkar"] = bhapkar(table)
    return tests


_OF_TABLE = {
    "prevalence_index": ("Prevalence index", prevalence_index),
    "bias_index": ("Bias index", bias_index),
    "kappa_max": ("Largest κ", kappa_max),
}


def indices(file: RatingsFile) -> Answer:
    """Return what the margins of two raters and two categories do to kappa."""
    rows = [
        {**keys, **row}
        for part, _, keys in _parts(file)
        for row in _indices(file, part)
    ]
    heads = _heads(file)
    notes = [
        Note("note", {"of": label([*(row[key] for key in heads), row["title"]]),
                      "reason": row["reason"]})
        for row in rows
        if row["reason"] is not None
    ]  # fmt: skip
    return Answer(
        name="indices",
        rows=rows,
        shown=[{**row, "index": row["title"]} for row in rows],
        heads=heads,
        notes=(*map(Note, ("pabak", "on_category", "largest")), *notes),
    )


def _indices(file: RatingsFile, part: RatingsPart) -> Iterator[Row]:
    coded, grades = _two_raters(file, part, "--indices"), file.scale.grades
    if len(grades) != 2:
        raise RatingsError(
            f"--indices: needs a scale of two categories, got {len(grades)} "
            f"({named(grades)})"
        )
    table = contingency_table(coded)

    def row(
        index: str, title: str, value: float, reason: str | None, **more: Any
    ) -> Row:
        of = {"index": index, "title": title, "category": None, "value": value}
        sizes = {"standard_error": None, "n_items": int(table.sum()), "reason": reason}
        return of | sizes | more

    estimate, why = _with_reason(lambda: brennan_prediger(part.counted))
    error = estimate.standard_error
    yield row("pabak", "PABAK", estimate.value, why, standard_error=error)
    for name, (title, function) in _OF_TABLE.items():
        yield row(name, title, *_with_reason(partial(function, table)))
    shares, why = _with_reason(lambda: specific_agreement(table))
    for grade, share in zip(grades, shares, strict=True):
        reason, title = why if math.isnan(share) else None, f"Agreement on {grade}"
        yield row("specific_agreement", title, share, reason, category=grade)


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UndefinedStatisticWarning)
        value = call()
    return value, str(caught[0].message) if caught else None


def limits(file: RatingsFile, options: EstimateOptions, unit: str | None) -> Answer:
    """Return between which bounds the differences of two raters lie."""
    if not file.is_ordered:
        raise ParameterError(
            "--limits-of-agreement: needs grades that are numbers or --categories with "
            "every grade in order, the grades met are text: "
            f"{named(file.scale.grades)}"
        )
    rows: list[Row] = []
    shown: list[Row] = []
    notes: dict[str, Note] = {}
    figure = []
    for part, name, keys in _parts(file):
        coded = _two_raters(file, part, "--limits-of-agreement")
        result = limits_of_agreement(coded, level=options.level)
        rows.append({**keys, **_limits_row(part, result)})
        shown += [{**keys, **row} for row in _limits_shown(result)]
        pair = " less ".join(part.raters)
        notes[pair] = Note("pair", {"pair": pair})
        if result.reason is not None:
            values = {"of": f"{name}: undefined" if name else "undefined"}
            notes[name + "?"] = Note("note", {**values, "reason": result.reason})
        figure.append((name, (part.raters, result)))
    ends = Note("limits"), Note("exact_ends", {"level": options.level})
    return Answer(
        name="limits_of_agreement",
        rows=rows,
        shown=shown,
        heads=_heads(file),
        notes=(*notes.values(), *ends),
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
    pairs = zip(result.outer, result.inner, strict=True)
    (below, lower), (above, upper) = pairs
    for quantity, key, pair in (
        ("Mean", "mean", (None, None)),
        ("Lower limit", "lower", (below, lower)),
        ("Upper limit", "upper", (upper, above)),
    ):
        interval = getattr(result, f"{key}_interval")
        yield {
            "quantity": quantity,
            "value": getattr(result, key),
            "low": interval.low,
            "high": interval.high,
            "pair_low": pair[0],
            "pair_high": pair[1],
            "n_items": result.n_items,
        }


# ---- raters, pairs and categories ----


def diagnosis(
    file: RatingsFile,
    entry: Coefficient,
    options: EstimateOptions,
    reference: str | None,
) -> list[Answer]:
    """Return raters, pairs, categories and confusions of every part of the ratings."""
    parts = list(_diagnoses(file, entry, options, reference))
    results = [result for _, _, result in parts]
    title, by = options.title(entry), ", ".join(_heads(file).values())
    of = {"raters": title, "pairs": title, "confusion": reference or "another rater"}
    grades = file.scale.grades
    answers = {}
    for kind, rows_of in _DIAGNOSES.items():
        rows = [
            (group, keys, row)
            for group, keys, result in parts
            for row in rows_of(grades, result)
        ]
        answers[kind] = Answer(
            name=f"diagnosis_{kind}",
            rows=[{**keys, **row} for _, keys, row in rows],
            shown=[{"group": group, **row} for group, _, row in rows],
            heads={"group": by} if by else {},
            notes=tuple(_diagnosis_notes(kind, results, title)),
            of=of.get(kind, ""),
            has_reference=reference is not None,
        )
    figure = tuple((group, result) for group, _, result in parts)
    pairs = _those_that_agree_least(answers["pairs"], len(results[0].raters))
    answers["pairs"] = replace(pairs, figure=figure)
    shares = [
        {"group": group, **row}
        for group, result in figure
        for row in _confusion_shown(grades, result)
    ]
    answers["confusion"] = replace(answers["confusion"], shown=shares, grades=grades)
    return list(answers.values())


def _diagnoses(
    file: RatingsFile,
    entry: Coefficient,
    options: EstimateOptions,
    reference: str | None,
) -> "Iterator[tuple[str, Row, Diagnosis]]":
    # what each part is called, the same by keys, and its diagnosis
    from masrel.intervals import diagnose

    for part, group, keys in _parts(file):
        ratings = on_grades(coded_part(part, "--diagnose"), entry, file.scale)
        try:
            result = diagnose(
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
        yield group, keys, result


def _diagnosis_notes(
    kind: str, results: "Sequence[Diagnosis]", title: str
) -> Iterator[Note]:
    first = results[0]
    if kind == "confusion":
        yield Note("confusion")
        if not np.isnan(first.share_low).all():
            yield Note("confusion_ends")
        return
    is_of_raters = kind == "raters"
    if is_of_raters and first.reference is not None:
        yield Note("reference", {"rater": first.reference})
    if np.isnan(first.category_low).all():
        if is_of_raters:
            yield Note("no_ends")
        return
    yield Note(f"{kind}_ends", {"level": first.level, "title": title})
    if is_of_raters:
        texts = dict.fromkeys(text for result in results for text in result.notes)
        yield from (Note("text", {"text": text}) for text in texts)


def _those_that_agree_least(answer: Answer, n_raters: int) -> Answer:
    if n_raters <= _MANY:
        return answer
    rows = answer.shown or []
    least = sorted(rows, key=lambda r: math.inf if r["value"] is None else r["value"])
    values = {"n": len(least[:_SHOWN_PAIRS]), "n_all": len(rows)}
    notes = (Note("least", values), *answer.notes)
    return replace(answer, shown=least[:_SHOWN_PAIRS], notes=notes)


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
