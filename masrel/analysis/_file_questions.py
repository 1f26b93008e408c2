"""Questions about a file of ratings beside its agreement, and rows that answer them.

In: a `RatingsFile` and how estimates are made. Out: an `Answer`, whose rows are as the
JSON has them; what tables show otherwise stands beside them.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from masrel._input import refuse
from masrel.agreement import (
    CodedRatings,
    Significance,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    category_kappa,
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
from masrel.analysis._file_comparisons import difference_rows, equality_rows
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    EstimateOptions,
    Questions,
    Row,
    agreement,
    check_order,
    entries,
    estimate_row,
    group_key,
    heads_of,
    note,
    on_grades,
    part_names,
    parts_of,
    placed,
)
from masrel.errors import (
    MasrelWarning,
    ParameterError,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Interval
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
        of_all = entries(between, others, others.parts)
        yield difference_rows(others, of_all, between)
        if len(others.parts) > 2:  # of two the difference says it
            yield equality_rows(others, of_all, between)


def _named(names: Collection[str]) -> str:
    # as a note lists them
    more = len(names) - _SHOWN
    listed = ", ".join(itertools.islice(names, _SHOWN))
    return f"{listed} and {more} more" if more > 0 else listed


def _without_reference(file: RatingsFile, reference: str) -> RatingsFile:
    """Return the ratings of all but the rater whom the others are held against."""
    parts = []
    for part in file.parts:
        with placed("--diagnose"):
            coded = code_ratings(part.ratings)
        others = [place for place, name in enumerate(part.raters) if name != reference]
        if len(others) == len(part.raters):
            raise ParameterError(
                f"--reference: needs one of {', '.join(part.raters)}, got {reference!r}"
            )
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
    plain = replace(options, coefficients=None, weights="identity")
    for part, _, names in parts_of(file):
        for place, grade in enumerate(file.scale.grades):
            estimate = category_kappa(part.counted, file.scale.values[place])
            row = AgreementRow(
                keys={**names, "category": grade},
                title="Fleiss' κ, category",
                estimate=replace(estimate, weights=grade),
            )
            if options.target is not None and estimate.reason is None:
                # of the two categories that the scale is folded to
                counted = part.counted
                ratings = counted.coded if counted.knows_raters else counted
                codes = np.where(ratings.codes < 0, -1, ratings.codes != place)
                folded = replace(ratings, codes=codes, categories=("this", "other"))
                of, _ = estimate_row(
                    coefficient("fleiss_kappa"), folded, row.keys, plain
                )
                interval = of.estimate.interval
                estimate = replace(row.estimate, interval=interval)
                row = replace(of, title=row.title, estimate=estimate)
            rows.append(row)
    heads = heads_of(file, "category")
    return Answer(name="categories", estimates=tuple(rows), heads=heads)


# ---- two sessions ----


def _retest(file: RatingsFile, options: EstimateOptions) -> Answer:
    """Return how well raters agree with themselves, each and all together."""
    by, column = file.read["by"], file.read["session"]
    refuse(
        (
            column is None,
            "--retest: needs --session with the column of the two sessions",
        ),
        (
            file.parts[0].session is None,
            f"--retest: compares the sessions of column {column!r}, so that --by must "
            "not take them apart",
        ),
    )
    estimates: list[AgreementRow] = []
    sessions, left_out = {}, []
    for group in dict.fromkeys(part.group for part in file.parts):
        parts = [part for part in file.parts if part.group == group]
        names = [str(part.session) for part in parts]
        with placed("--retest", group):
            if len(parts) != 2:
                raise RatingsError(
                    f"needs two sessions in column {column!r}, got {len(names)} "
                    f"({_named(names)})"
                )
            raters, lone_raters = _of_both(parts, "rater")
            items, lone_items = _of_both(parts, "item")
            codes = _side_by_side(parts, items, raters)
        pairs = CodedRatings(codes=codes, categories=file.scale.values)
        keys = {} if by is None else {group_key(by): group}
        estimates += _retest_rows(keys, raters, pairs, options)
        of_group = "" if group is None else f"{group}: "
        sessions[of_group] = names
        if lone := [*lone_raters, *lone_items]:
            left_out.append(note("left_out", group=of_group, names="; ".join(lone)))
    # groups that have sessions of the same names share the note
    if all(names == other for other in sessions.values()):
        sessions = {"": names}
    notes = [
        note("sessions", group=of, first=first, second=second)
        for of, (first, second) in sessions.items()
    ]
    heads = "rater" if by is None else f"{by}, rater"
    return Answer(
        name="retest",
        estimates=tuple(estimates),
        heads={group_key(heads): heads},
        notes=(*notes, *left_out),
    )


def _of_both(
    parts: Sequence[RatingsPart], noun: Literal["rater", "item"]
) -> tuple[list[str], list[str]]:
    # names that both sessions have, as they come in the first; those of one, in words
    first, second = (dict.fromkeys(getattr(part, f"{noun}s")) for part in parts)
    both = [name for name in first if name in second]
    if not both:
        article = "an" if noun == "item" else "a"
        raise RatingsError(
            f"needs {article} {noun} of both sessions, got {_named(first)} in "
            f"{parts[0].session!r} and {_named(second)} in "
            f"{parts[1].session!r}"
        )
    words = []
    for part, names, others in zip(
        parts, (first, second), (second, first), strict=True
    ):
        if lone := [name for name in names if name not in others]:
            words.append(f"{noun} {_named(lone)} ({part.session} only)")
    return both, words


def _side_by_side(
    parts: Sequence[RatingsPart], items: list[str], raters: list[str]
) -> NDArray[np.signedinteger]:
    # codes (n_items, 2 n_raters), both sessions of a rater beside each other
    import pandas as pd  # of all questions this one alone needs it

    tables = [
        pd.DataFrame(code_ratings(part.ratings).codes, part.items, part.raters)
        for part in parts
    ]
    codes = [table.loc[items, raters].to_numpy() for table in tables]
    return np.stack(codes, axis=2).reshape(len(items), -1)


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


# ---- two raters ----


def _two_raters(part: RatingsPart) -> CodedRatings:
    coded = code_ratings(part.ratings)
    if coded.codes.shape[1] != 2:
        raise RatingsError(
            f"needs two raters, got {coded.codes.shape[1]} "
            f"({_named(part.raters)}); --raters chooses two"
        )
    return coded


def _heads(file: RatingsFile) -> dict[str, str]:
    # a column for each of what tells parts apart
    return {group_key(name): name for name in part_names(file, file.parts[0])}


def _of_two(
    name: str,
    file: RatingsFile,
    rows_of: Callable[[RatingsPart], Iterator[tuple[Row, Row]]],
) -> Answer:
    """Return rows of two raters of each part, and what a table shows otherwise."""
    rows, shown = [], []
    for part, group, keys in parts_of(file):
        with placed(f"--{name}", group):
            for row, cells in rows_of(part):
                rows.append({**keys, **row})
                shown.append({**rows[-1], "group": group, **cells})
    return Answer(name=name, rows=rows, shown=shown, heads=_heads(file))


def _symmetry(file: RatingsFile) -> Answer:
    """Return whether changes between categories go both ways alike often."""
    answer = _of_two("symmetry", file, _symmetry_rows)
    texts = {"binomial": "exact_test", "chi-squared": "test"}
    notes = [
        note(texts[row["distribution"]], test=row["test"], hypothesis=row["hypothesis"])
        for row in answer.shown or ()
    ]
    return replace(answer, notes=tuple(dict.fromkeys(notes)))


def _symmetry_rows(part: RatingsPart) -> Iterator[tuple[Row, Row]]:
    table = contingency_table(_two_raters(part))
    of_two = {}
    if len(table) == 2:
        corrected = mcnemar(table, kind="corrected")
        of_two = {"McNemar, exact": mcnemar(table), "McNemar, corrected": corrected}
    tests: dict[str, Significance] = {
        **of_two,
        "Bowker": bowker(table),
        "Stuart-Maxwell": stuart_maxwell(table),
        "Bhapkar": bhapkar(table),
    }
    for title, result in tests.items():
        name, _, kind = title.partition(", ")
        key = name.lower().replace("-", "_")
        row = {"test": key, "kind": kind or None, **asdict(result)}
        del row["name"]
        row["df"] = row.pop("df")  # last, as in the first records
        cells: Row = {"test": title, "title": title}
        if result.reason is None and math.isinf(result.statistic):
            row["reason"] = "infinite: all items changed, and one way"
            cells["texts"] = [row["reason"]]
        yield row, cells


def _indices(file: RatingsFile) -> Answer:
    """Return what the margins of two raters and two categories do to kappa."""
    answer = _of_two("indices", file, partial(_of_margins, file.scale.grades))
    notes = tuple(map(note, ("pabak", "on_category", "largest")))
    return replace(answer, notes=notes)


_OF_TABLE = {
    "prevalence_index": ("Prevalence index", prevalence_index),
    "bias_index": ("Bias index", bias_index),
    "kappa_max": ("Largest κ", kappa_max),
}


def _of_margins(grades: Sequence[str], part: RatingsPart) -> Iterator[tuple[Row, Row]]:
    table = contingency_table(_two_raters(part))
    if len(grades) != 2:
        raise RatingsError(
            f"needs a scale of two categories, got {len(grades)} ({_named(grades)})"
        )

    def row(index: str, title: str, value: float, why: str | None, **more: Any) -> Any:
        cells = {
            "index": index,
            "title": title,
            "category": None,
            "value": value,
            "standard_error": None,
            "n_items": int(table.sum()),
            "reason": why,
            **more,
        }
        return cells, {"index": title, "texts": [] if why is None else [why]}

    estimate, why = _with_reason(lambda: brennan_prediger(part.counted))
    error = estimate.standard_error
    yield row("pabak", "PABAK", estimate.value, why, standard_error=error)
    for name, (title, function) in _OF_TABLE.items():
        yield row(name, title, *_with_reason(partial(function, table)))
    shares, why = _with_reason(lambda: specific_agreement(table))
    for grade, share in zip(grades, shares, strict=True):
        reason = why if math.isnan(share) else None
        title = f"Agreement on {grade}"
        yield row("specific_agreement", title, share, reason, category=grade)


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UndefinedStatisticWarning)
        value = call()
    return value, str(caught[0].message) if caught else None


def _ends(interval: Interval) -> dict[str, float]:
    return {"low": interval.low, "high": interval.high}


def _limits(file: RatingsFile, options: EstimateOptions, unit: str | None) -> Answer:
    """Return between which bounds the differences of two raters lie."""
    check_order(file, "--limits-of-agreement")
    rows, shown, notes, figure = [], [], [], []
    for part, group, keys in parts_of(file):
        with placed("--limits-of-agreement", group):
            result = limits_of_agreement(_two_raters(part), level=options.level)
        first, second = part.raters
        of_result = ("n_items", "mean", "sd", "lower", "upper", "share")
        row: Row = {
            **keys,
            "first": first,
            "second": second,
            **{key: getattr(result, key) for key in of_result},
            "level": result.mean_interval.level,
            "mean_interval": _ends(result.mean_interval),
            "lower_interval": _ends(result.lower_interval),
            "upper_interval": _ends(result.upper_interval),
            **{key: getattr(result, key) for key in ("inner", "outer", "reason")},
        }
        low, high = zip(result.outer, result.inner, strict=True)
        for quantity, key, pair in (
            ("Mean", "mean", (None, None)),
            ("Lower limit", "lower", low),
            ("Upper limit", "upper", high[::-1]),
        ):
            of_both = {"pair_low": pair[0], "pair_high": pair[1]}
            cells = {"quantity": quantity, "value": row[key], **row[f"{key}_interval"]}
            shown.append({**row, **cells, **of_both, "title": quantity, "group": group})
        rows.append(row)
        notes.append(note("pair", pair=f"{first} less {second}"))
        figure.append((group, (part.raters, result)))
    notes += [note("limits"), note("exact_ends", level=options.level)]
    return Answer(
        name="limits_of_agreement",
        rows=rows,
        shown=shown,
        heads=_heads(file),
        notes=tuple(dict.fromkeys(notes)),
        of=unit or "",
        figure=tuple(figure),
    )


# ---- raters, pairs and categories ----


def _diagnosis(
    file: RatingsFile, options: EstimateOptions, reference: str | None
) -> Iterator[Answer]:
    """Return raters, pairs, categories and confusions of every part of the ratings."""
    from masrel.intervals.diagnosis import diagnose

    if options.takes_all or (options.coefficients is None and options.metric is None):
        options = replace(options, coefficients=["fleiss_kappa"])
    several = f"--coefficients {','.join(options.names)}"
    needed = f"--diagnose: needs one coefficient, got {several}"
    refuse((len(options.names) > 1, needed))
    (entry,) = entries(options, file, file.parts)
    title, grades = options.title(entry), file.scale.grades
    parts = []
    for part, group, keys in parts_of(file):
        with placed("--diagnose", group):
            result = diagnose(
                on_grades(code_ratings(part.ratings), entry, file),
                coefficient=entry,
                target=None if options.target is None else "items",
                raters=part.raters,
                reference=reference,
                weights=options.weights_of(entry),
                level=options.level,
            )
        parts.append((group, keys, result, _diagnosis_rows(grades, result)))
    notes = _diagnosis_notes([result for *_, result, _ in parts], title, options)
    by = ", ".join(_heads(file).values())
    of = {"raters": title, "pairs": title, "confusion": reference or "another rater"}
    of_kind: dict[str, Row] = {
        "pairs": {"figure": tuple((group, result) for group, _, result, _ in parts)},
        "confusion": {"grades": grades},
    }
    for kind, texts in notes.items():
        shown = [
            {"group": group, **row}
            for group, _, _, rows in parts
            for row in rows.get(f"{kind}_shown", rows[kind])
        ]
        if kind == "pairs" and len(parts[0][2].raters) > _MANY:
            known = [row for row in shown if row["value"] is not None]
            least = sorted(known, key=itemgetter("value"))[:_SHOWN_PAIRS]
            texts.insert(0, note("least", n=len(least), n_all=len(shown)))
            shown = least
        yield Answer(
            name=f"diagnosis_{kind}",
            rows=[{**keys, **row} for _, keys, _, rows in parts for row in rows[kind]],
            shown=shown,
            heads={"group": by} if by else {},
            notes=tuple(texts),
            of=of.get(kind, ""),
            has_reference=reference is not None,
            **of_kind.get(kind, {}),
        )


def _diagnosis_rows(grades: Sequence[str], result: "Diagnosis") -> dict[str, list[Row]]:
    # of each table
    raters, scale = np.array(result.raters), np.array(grades)
    pair = np.triu_indices(len(raters), 1)
    rater, of, graded = np.indices(result.confusion.shape)
    n_rated = result.confusion.sum(axis=2)
    met = np.nonzero(n_rated)  # else there is nothing to tell
    shares = zip(grades, result.shares[met].T, strict=True)
    return {
        "raters": _rows(
            rater=raters,
            mean_of_pairs=result.mean_values,
            with_reference=result.reference_values,
            reference_low=result.reference_low,
            reference_high=result.reference_high,
            without=result.without_values,
            change=result.changes,
            standard_error=result.change_errors,
            low=result.change_low,
            high=result.change_high,
        ),
        "pairs": _rows(
            first=raters[pair[0]],
            second=raters[pair[1]],
            value=result.pair_values[pair],
            low=result.pair_low[pair],
            high=result.pair_high[pair],
            n_items=result.pair_items[pair],
        ),
        "categories": _rows(
            category=scale,
            n_ratings=result.category_counts,
            agreement=result.category_values,
            low=result.category_low,
            high=result.category_high,
        ),
        "confusion": _rows(
            rater=raters[rater],
            of=scale[of],
            said=scale[graded],
            n=result.confusion,
            share=result.shares,
            low=result.share_low,
            high=result.share_high,
        ),
        # a row a rater and grade of another, a column a grade
        "confusion_shown": _rows(
            rater=raters[met[0]],
            of=scale[met[1]],
            n=n_rated[met],
            **{f"said_{grade}": column for grade, column in shares},
        ),
    }


def _rows(**columns: NDArray[Any]) -> list[Row]:
    # a row for each place of columns, in which nan is nothing
    table = [column.ravel().tolist() for column in columns.values()]
    return [
        {key: None if x != x else x for key, x in zip(columns, row, strict=True)}
        for row in zip(*table, strict=True)
    ]


def _diagnosis_notes(
    results: "Sequence[Diagnosis]", title: str, options: EstimateOptions
) -> dict[str, list[str]]:
    # of each table
    reference, has_ends = results[0].reference, options.target is not None
    ends = {
        kind: [note(f"{kind}_ends", level=options.level, title=title)] * has_ends
        for kind in ("raters", "pairs", "categories", "confusion")
    }
    right = [] if reference is None else [note("reference", rater=reference)]
    texts = dict.fromkeys(f"{text}." for result in results for text in result.notes)
    of_raters = [*right, *(ends["raters"] or [note("no_ends")]), *texts]
    confusion = [note("confusion"), *ends["confusion"]]
    return {**ends, "raters": of_raters, "confusion": confusion}
