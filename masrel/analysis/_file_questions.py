"""Further questions about a file of ratings, and the rows that answer them.

In: a `RatingsFile` and how estimates are made. Out: an `Answer`, whose rows are as the
JSON has them; what tables show differently is beside them.
"""

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from masrel._input import listed, refuse
from masrel.agreement import (
    CodedRatings,
    Label,
    RepeatedLimits,
    Significance,
    Weights,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    category_kappa,
    code_ratings,
    coefficient,
    contingency_table,
    kappa_max,
    limits_by_clusters,
    limits_of_agreement,
    limits_with_mean,
    limits_with_repeats,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.agreement._codes import rating_values
from masrel.analysis._file_comparisons import comparisons
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    Questions,
    Row,
    agreement,
    check_order,
    entries,
    estimate_row,
    heads_of,
    note,
    on_grades,
    part_names,
    parts_of,
    placed,
)
from masrel.errors import (
    MasrelWarning,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Interval, as_document
from masrel.ratings import RatingsFile, RatingsPart

if TYPE_CHECKING:
    from masrel.agreement import Coefficient
    from masrel.intervals.diagnosis import Diagnosis

_T = TypeVar("_T")

_MOST_GRADES = 200  # that each have an interval in seconds
_MANY = 8  # raters beyond which only the pairs that agree least are shown
_SHOWN_PAIRS = 20  # of these pairs


Question = Callable[[RatingsFile, Questions], Iterator[Answer]]
"""A function that answers a question about a file."""


def answers(
    file: RatingsFile, questions: Questions, *more: Question
) -> tuple[RatingsFile, list[Answer]]:
    """Return the ratings without a reference, and the answers, agreement first."""
    # more: questions of one command alone
    sessions = list(dict.fromkeys(str(part.session) for part in file.parts))
    of_command = {
        "agree": ", --retest compares them",
        "limits": ", --truth takes them as repeats",
    }
    refuse(
        (
            len(sessions) > 1 and not questions.retest,
            f"{file.read['file']}: has {len(sessions)} sessions "
            f"({', '.join(sessions)}), so raters graded the same item more than once; "
            f"--by {file.read['session']} estimates "
            f"each{of_command.get(questions.command, '')}",
        ),
        error=RatingsError,
    )
    refuse(
        (
            file.read["repeated"] == "each" and questions.truth is None,
            "--repeated each: works only with masrel limits --truth",
        )
    )
    if questions.weights != "identity" and not isinstance(questions.weights, Weights):
        check_order(file, f"--weights {questions.weights}")
    reference = questions.reference
    others = file if reference is None else _without_reference(file, reference)
    between = questions.between_raters(others)
    # Every note is in a result, and so below its table or in the JSON.
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        # what does not fit these tables is said first: it says most
        usual = [
            question
            for name, question in _QUESTIONS.items()
            if name == questions.command or getattr(questions, name, False)
        ]
        further = [of for ask in (*usual, *more) for of in ask(file, questions)]
        first = [] if between is None else [agreement(others, between)]
    return others, first + further


def _without_reference(file: RatingsFile, reference: str) -> RatingsFile:
    """Return the ratings of all but the rater to compare the others with."""
    parts = []
    for part in file.parts:
        with placed(file.read["file"]):
            coded = code_ratings(part.ratings)
        others = [place for place, name in enumerate(part.raters) if name != reference]
        needed = f"needs one of {', '.join(part.raters)}, got {reference!r}"
        refuse((reference not in part.raters, f"--reference: {needed}"))
        raters = tuple(part.raters[place] for place in others)
        ratings = replace(coded, codes=coded.codes[:, others])
        parts.append(replace(part, raters=raters, ratings=ratings))
    return replace(file, parts=tuple(parts))


# ---- each category ----


def _categories(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Give how well raters tell each category from all others."""
    n_grades = len(file.scale.grades)
    refuse(
        (
            n_grades > _MOST_GRADES,
            f"--each-category: takes at most {_MOST_GRADES} different grades, got "
            f"{n_grades}",
        )
    )
    rows = []
    folded = replace(questions, coefficients=["all"], weights="identity")
    for part, _, names in parts_of(file):
        for place, grade in enumerate(file.scale.grades):
            of_grade = category_kappa(part.counted, file.scale.values[place])
            row = AgreementRow(
                keys={**names, "category": grade},
                title="Fleiss' κ, category",
                estimate=replace(of_grade, weights=grade),
            )
            if questions.target is not None and of_grade.reason is None:
                # of the two categories that the scale is folded to
                counted = part.counted
                ratings = counted.coded if counted.knows_raters else counted
                codes = np.where(ratings.codes < 0, -1, ratings.codes != place)
                ratings = replace(ratings, codes=codes, categories=("this", "other"))
                of = estimate_row(
                    coefficient("fleiss_kappa"), ratings, row.keys, folded
                )
                estimate = replace(
                    row.estimate,
                    standard_error=of.estimate.standard_error,
                    interval=of.estimate.interval,
                )
                row = replace(of, title=row.title, estimate=estimate)
            rows.append(row)
    heads = heads_of(", ".join([*part_names(file, file.parts[0]), "category"]))
    yield Answer(name="categories", estimates=tuple(rows), heads=heads)


# ---- two sessions ----


def _retest(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Give how well raters agree with themselves, each and all together."""
    _check_retest(file)
    by, column = file.read["by"], file.read["session"]
    estimates: list[AgreementRow] = []
    sessions, left_out = {}, []
    for group in dict.fromkeys(part.group for part in file.parts):
        parts = [part for part in file.parts if part.group == group]
        names = [str(part.session) for part in parts]
        with placed("--retest", group):
            refuse(
                (
                    len(parts) != 2,
                    f"needs two sessions in column {column!r}, got {len(names)} "
                    f"({listed(names)})",
                ),
                error=RatingsError,
            )
            pairs, raters, lone = _both_sessions(parts, file.scale.values)
        keys = {} if by is None else dict.fromkeys(heads_of(by), group)
        estimates += _retest_rows(keys, raters, pairs, questions)
        of_group = "" if group is None else f"{group}: "
        sessions[of_group] = names
        if lone:
            left_out.append(note("left_out", group=of_group, names="; ".join(lone)))
    # groups that have sessions of the same names share the note
    if all(names == other for other in sessions.values()):
        sessions = {"": names}
    notes = [
        note("sessions", group=of, first=first, second=second)
        for of, (first, second) in sessions.items()
    ]
    yield Answer(
        name="retest",
        estimates=tuple(estimates),
        heads=heads_of("rater" if by is None else f"{by}, rater"),
        notes=(*notes, *left_out),
    )


def _check_retest(file: RatingsFile) -> None:
    """Refuse a file whose ratings have no two sessions, or no names of items."""
    column = file.read["session"]
    refuse(
        (
            column is None,
            "--retest: needs --session with the column of the two sessions",
        ),
        (
            file.parts[0].session is None,
            f"--retest: compares the sessions of column {column!r}, so --by cannot "
            "name that column",
        ),
        (
            not file.parts[0].items,
            "--retest: needs items with names, so it cannot be combined with "
            "--frequency",
        ),
    )


def _both_sessions(
    parts: Sequence[RatingsPart], grades: tuple[Label, ...]
) -> tuple[CodedRatings, list[str], list[str]]:
    """Return ratings of both sessions, their raters, and what only one of them has."""
    import pandas as pd  # of all questions this one alone needs it

    both, lone = {}, []
    for noun in ("rater", "item"):
        names = [dict.fromkeys(getattr(part, f"{noun}s")) for part in parts]
        both[noun] = [name for name in names[0] if name in names[1]]
        refuse(
            (
                not both[noun],
                f"needs {'an' if noun == 'item' else 'a'} {noun} of both sessions, got "
                f"{listed(names[0])} in {parts[0].session!r} and {listed(names[1])} in "
                f"{parts[1].session!r}",
            ),
            error=RatingsError,
        )
        for part, mine, others in zip(parts, names, names[::-1], strict=True):
            if left := [name for name in mine if name not in others]:
                lone.append(f"{noun} {listed(left)} ({part.session} only)")
    tables = [
        pd.DataFrame(code_ratings(part.ratings).codes, part.items, part.raters)
        for part in parts
    ]
    codes = [of.loc[both["item"], both["rater"]].to_numpy() for of in tables]
    # (n_items, 2 n_raters), both sessions of a rater beside each other
    pairs = np.stack(codes, axis=2).reshape(len(both["item"]), -1)
    return CodedRatings(codes=pairs, categories=grades), both["rater"], lone


def _retest_rows(
    names: Mapping[str, str | None],
    raters: Sequence[str],
    pairs: CodedRatings,
    questions: Questions,
) -> list[AgreementRow]:
    # of both sessions of each rater in pairs, (n_items, 2 n_raters)
    every = replace(questions, coefficients=["all"])
    # a single rater says nothing of other raters
    alone = replace(every, target=None if questions.target != "items" else "items")
    rows = []
    for place, rater in enumerate(raters):
        ratings = replace(pairs, codes=pairs.codes[:, 2 * place : 2 * place + 2])
        row = estimate_row(
            coefficient("cohen_kappa"), ratings, {**names, "rater": rater}, alone
        )
        estimate = replace(row.estimate, n_raters=min(row.estimate.n_raters, 1))
        rows.append(replace(row, estimate=estimate))
    is_pooled = questions.takes_all or "pooled_kappa" in questions.names
    return rows + [
        estimate_row(coefficient(name), pairs, {**names, "rater": None}, every)
        for name in ("stratified_kappa", *["pooled_kappa"] * is_pooled)
    ]


# ---- two raters ----


def _two_raters(part: RatingsPart) -> CodedRatings:
    coded = code_ratings(part.ratings)
    refuse(
        (
            coded.codes.shape[1] != 2,
            f"needs two raters, got {coded.codes.shape[1]} "
            f"({listed(part.raters)}); --raters chooses two",
        ),
        error=RatingsError,
    )
    return coded


def _table(
    name: str,
    file: RatingsFile,
    rows_of: Callable[[RatingsPart], Iterable[tuple[Row, ...]]],
    start: str = "",
) -> Answer:
    """Return rows of two raters of each part, and what a table shows of each."""
    # start: the option that a refusal begins with, where there is one
    # rows_of: a row for JSON, and the cells of each row of a table that it becomes
    rows, shown = [], []
    for part, group, keys in parts_of(file):
        with placed(start or file.read["file"], group):
            for row, *cells in rows_of(part):
                rows.append({**keys, **row})
                shown += [{**rows[-1], "group": group, **of} for of in cells]
    return Answer(
        name=name,
        rows=rows,
        shown=shown,
        heads=heads_of(*part_names(file, file.parts[0])),
    )


def _symmetry(file: RatingsFile, _: Questions) -> Iterator[Answer]:
    """Give whether changes between categories go both ways alike often."""
    answer = _table("symmetry", file, _symmetry_rows, "--symmetry")
    texts = {"binomial": "exact_test", "chi-squared": "test"}
    notes = [
        note(texts[row["distribution"]], test=row["test"], hypothesis=row["hypothesis"])
        for row in answer.shown or ()
    ]
    yield replace(answer, notes=tuple(dict.fromkeys(notes)))


_OF_TEST = ("hypothesis", "statistic", "distribution", "p_value", "n_items")


def _symmetry_rows(part: RatingsPart) -> Iterator[tuple[Row, Row]]:
    table = contingency_table(_two_raters(part))
    tests: dict[str, Significance] = {
        "Bowker": bowker(table),
        "Stuart-Maxwell": stuart_maxwell(table),
        "Bhapkar": bhapkar(table),
    }
    if len(table) == 2:
        tests = {
            "McNemar, exact": mcnemar(table),
            "McNemar, corrected": mcnemar(table, kind="corrected"),
            **tests,
        }
    for title, result in tests.items():
        name, _, kind = title.partition(", ")
        why = result.reason
        if why is None and math.isinf(result.statistic):
            why = "infinite: all items changed, all in one direction"
        row = {
            "test": name.lower().replace("-", "_"),
            "kind": kind or None,
            **{of: getattr(result, of) for of in _OF_TEST},
            "reason": why,
            "df": result.df,
        }
        texts = {"texts": [why]} if why != result.reason else {}
        yield row, {"test": title, "title": title, **texts}


def _indices(file: RatingsFile, _: Questions) -> Iterator[Answer]:
    """Give what the margins of two raters and two categories do to kappa."""
    yield replace(
        _table("indices", file, partial(_of_margins, file.scale.grades), "--indices"),
        notes=tuple(map(note, ("pabak", "on_category", "largest"))),
    )


_OF_TABLE = {
    "prevalence_index": ("Prevalence index", prevalence_index),
    "bias_index": ("Bias index", bias_index),
    "kappa_max": ("Largest κ", kappa_max),
}


def _of_margins(grades: Sequence[str], part: RatingsPart) -> Iterator[tuple[Row, Row]]:
    table = contingency_table(_two_raters(part))
    refuse(
        (
            len(grades) != 2,
            f"needs a scale of two categories, got {len(grades)} ({listed(grades)})",
        ),
        error=RatingsError,
    )

    of_all, why = _with_reason(lambda: brennan_prediger(part.counted))
    indices: list[tuple[str, str, float, str | None, Row]] = [
        (
            *("pabak", "PABAK", of_all.value, why),
            {"standard_error": of_all.standard_error},
        )
    ]
    indices += [
        (name, title, *_with_reason(partial(function, table)), {})
        for name, (title, function) in _OF_TABLE.items()
    ]
    shares, why = _with_reason(lambda: specific_agreement(table))
    indices += [
        ("specific_agreement", f"Agreement on {grade}", share, why, {"category": grade})
        for grade, share in zip(grades, shares, strict=True)
    ]
    for index, title, value, why, more in indices:
        row: Row = {
            "index": index,
            "title": title,
            "category": None,
            "value": value,
            "standard_error": None,
            "n_items": int(table.sum()),
            "reason": why if math.isnan(value) else None,
            **more,
        }
        yield row, {"index": title, "texts": [why] if row["reason"] else []}


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(
        record=True, action="always", category=UndefinedStatisticWarning
    ) as caught:
        value = call()
    return value, str(caught[0].message) if caught else None


_QUANTITIES = {"mean": "Mean", "lower": "Lower limit", "upper": "Upper limit"}
# What limits are of to the name of their answer, and of the notes on it
_LIMITS = {
    "once": ("limits_of_agreement", "limits", "exact_ends"),
    "mean": ("limits_with_mean", "limits_with_mean", "mean_ends"),
    "difference": ("limits_with_repeats", "limits_with_repeats", "mover_ends"),
    "proportional": ("limits_that_follow", "limits_that_follow", "mover_ends"),
    "ratio": ("limits_of_ratios", "limits_of_ratios", "mover_ends"),
}


def _limits(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Give between which bounds the measurements of raters differ."""
    check_order(file, file.read["file"])
    is_clustered = file.read.get("clusters") is not None
    refuse(
        (
            is_clustered and questions.kind == "proportional",
            "--clusters: limits on a line treat items as independent: needed "
            "--clusters or --kind proportional, got both",
        )
    )
    panels: list[tuple[Sequence[str], Any]] = []
    truth, has_more = questions.truth, any(len(of.raters) > 2 for of in file.parts)
    of_what: str = questions.kind or ("once" if truth is None else "difference")
    if questions.kind is None and truth != "varying" and has_more:
        of_what = "mean"
    if of_what == "once" and is_clustered:
        of_what = "difference"  # the same limits, whose intervals can be others
    name, *texts = _LIMITS[of_what]
    if is_clustered:
        texts[1:] = ["cluster_ends"]
    rows_of = _of_pairs if of_what == "once" else partial(_of_more, of_what)
    answer = _table(name, file, partial(rows_of, questions, panels))
    pairs = (
        f"{row['first']} minus {row['second']}"
        for row in answer.rows
        if "first" in row and of_what != "ratio"
    )
    counts = [np.sum(of.get("n_measurements", 0)) for of in answer.rows]
    groups = (group for _, group, _ in parts_of(file))
    yield replace(
        answer,
        notes=(
            *(note("pair", pair=pair) for pair in dict.fromkeys(pairs)),
            *(note(of, n=sum(counts)) for of in (truth,) if of is not None),
            *(note(of, level=questions.level) for of in texts),
        ),
        of="" if of_what == "ratio" else questions.unit or "",
        figure=tuple(zip(groups, panels, strict=True)),
    )


def _of_pairs(
    questions: Questions, panels: list[Any], part: RatingsPart
) -> Iterator[tuple[Row, ...]]:
    result = limits_of_agreement(_two_raters(part), level=questions.level)
    panels.append((part.raters, result))
    first, second = part.raters
    of_result = ("n_items", "mean", "sd", "lower", "upper", "share")
    intervals = {key: getattr(result, f"{key}_interval") for key in _QUANTITIES}
    ends = {key: {"low": of.low, "high": of.high} for key, of in intervals.items()}
    row: Row = {
        "first": first,
        "second": second,
        **{key: getattr(result, key) for key in of_result},
        "level": result.mean_interval.level,
        **{f"{key}_interval": of for key, of in ends.items()},
        **{key: getattr(result, key) for key in ("inner", "outer", "reason")},
    }
    low, high = zip(result.outer, result.inner, strict=True)
    of_both = {"lower": low, "upper": high[::-1]}
    cells = [
        {"title": title, "quantity": title, "value": row[key], **ends[key]}
        | dict(zip(("pair_low", "pair_high"), of_both.get(key, ()), strict=False))
        for key, title in _QUANTITIES.items()
    ]
    yield row, *cells


# which no rater is called: names have no blanks around
_ITEM, _CLUSTER = " item", " cluster"


def _of_more(
    of_what: str, questions: Questions, panels: list[Any], part: RatingsPart
) -> Iterator[tuple[Row, ...]]:
    import pandas as pd  # of all questions this and that of sessions need it

    coded = code_ratings(part.ratings) if of_what == "mean" else _two_raters(part)
    values, columns = rating_values(coded, None), list(part.raters)
    frame = pd.DataFrame(values, columns=columns)  # a row a time
    frame[_ITEM] = part.items or range(len(values))
    measure = _measure(of_what, questions, columns)
    if part.clusters:
        frame[_CLUSTER] = part.clusters
        result = limits_by_clusters(
            frame, measure, clusters=_CLUSTER, level=questions.level
        )
    else:
        result = measure(frame)
    panels.append((part.raters, result))
    if of_what == "mean":
        of_all = {"Limit, ±": result.limit, "SEM": result.sem, "MDC95": result.mdc}
        shown = [(title, of.value, of.interval) for title, of in of_all.items()]
        of_sem = {key: getattr(result.sem, key) for key in ("n_items", "reason")}
        row: Row = {"raters": part.raters, **of_sem}
    else:
        shown = _of_line(result)
        row = dict(zip(("first", "second"), part.raters, strict=True))
    cells = [
        {"title": title, "quantity": title, "value": value}
        # the limits, beside low and high ends of each
        | {f"{end}_limit": getattr(result, end, None) for end in ("low", "high")}
        | (
            {}
            if of is None
            else {key: getattr(of, key) for key in ("low", "high", "reason")}
            | {"interval_texts": of.notes}
        )
        for title, value, of in shown
    ]
    yield {**row, **as_document(result)}, *cells


def _measure(
    of_what: str, questions: Questions, columns: list[str]
) -> Callable[[Any], Any]:
    """Return what computes limits of rows of measurements."""
    if of_what == "mean":
        return partial(
            limits_with_mean, item=_ITEM, observers=columns, level=questions.level
        )
    return partial(
        limits_with_repeats,
        item=_ITEM,
        first=columns[0],
        second=columns[1],
        truth=questions.truth or "constant",
        kind=questions.kind or "difference",
        level=questions.level,
    )


def _of_line(limits: RepeatedLimits) -> list[tuple[str, float, Interval]]:
    """Return the limits, at both ends of where items are if they follow a line."""
    follows = limits.kind == "proportional" and limits.reason is None
    ends = (limits.averages.min(), limits.averages.max()) if follows else (math.nan,)
    return [
        *(
            (
                f"{title} at {of.average:.4g}" if follows else title,
                getattr(of, name),
                getattr(of, f"{name}_interval"),
            )
            for of in map(limits.at, ends)
            for name, title in zip(
                ("bias", "low", "high"), _QUANTITIES.values(), strict=True
            )
        ),
        ("Slope", limits.slope, limits.slope_interval),
    ]


# ---- raters, pairs and categories ----


def _diagnosis(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Give raters, pairs, categories and confusions of every part of the ratings."""
    if questions.coefficients is None and questions.metric is None:
        questions = replace(questions, coefficients=["fleiss_kappa"])
    refuse(
        (
            questions.takes_all or len(questions.names) > 1,
            f"--coefficients: needs one coefficient, got {','.join(questions.names)}",
        )
    )
    (entry,) = entries(questions, file, file.parts)
    title, grades = questions.title(entry), file.scale.grades
    parts = [*_diagnoses(file, entry, questions)]
    notes = _diagnosis_notes([result for *_, result, _ in parts], title, questions)
    by = ", ".join(part_names(file, file.parts[0]))
    of = {
        "raters": title,
        "pairs": title,
        "confusion": questions.reference or "another rater",
    }
    for kind, texts in notes.items():
        shown = [
            {"group": group, **row}
            for group, *_, rows in parts
            for row in rows.get(f"{kind}_shown", rows[kind])
        ]
        if kind == "pairs" and len(parts[0][2].raters) > _MANY:
            known = [row for row in shown if row["value"] is not None]
            least = sorted(known, key=itemgetter("value"))[:_SHOWN_PAIRS]
            texts.insert(0, note("least", n=len(least), n_all=len(shown)))
            shown = least
        explained = [
            note(key)
            for key in ("change", "standard_error", "agreement")
            if any(row.get(key) is not None for row in shown)
        ]
        yield Answer(
            name=f"diagnosis_{kind}",
            rows=[{**keys, **row} for _, keys, _, rows in parts for row in rows[kind]],
            shown=shown,
            heads={"group": by} if by else {},
            notes=(*explained, *texts),
            of=of.get(kind, ""),
            grades=grades if kind == "confusion" else (),
            figure=tuple((group, result) for group, _, result, _ in parts)
            if kind == "pairs"
            else (),
        )


def _diagnoses(
    file: RatingsFile, entry: "Coefficient", questions: Questions
) -> Iterator[tuple[str, Row, "Diagnosis", dict[str, list[Row]]]]:
    """Give the group and keys of every part, its diagnosis, and the rows of that."""
    from masrel.intervals.diagnosis import diagnose

    for part, group, keys in parts_of(file):
        with placed(file.read["file"], group):
            result = diagnose(
                on_grades(code_ratings(part.ratings), entry, file),
                coefficient=entry,
                target=None if questions.target is None else "items",
                raters=part.raters,
                reference=questions.reference,
                weights=questions.weights_of(entry),
                level=questions.level,
            )
        yield group, keys, result, _diagnosis_rows(file.scale.grades, result)


def _diagnosis_rows(grades: Sequence[str], result: "Diagnosis") -> dict[str, list[Row]]:
    # of each table
    raters, scale = np.array(result.raters), np.array(grades)
    pair = np.triu_indices(len(raters), 1)
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
        **_confusion_rows(raters, scale, result),
    }


def _confusion_rows(
    raters: NDArray[Any], scale: NDArray[Any], result: "Diagnosis"
) -> dict[str, list[Row]]:
    # as the JSON has them, and as they are shown
    rater, of, graded = np.indices(result.confusion.shape)
    n_rated = result.confusion.sum(axis=2)
    met = np.nonzero(n_rated)  # the others have no shares
    shares = zip(scale, result.shares[met].T, strict=True)
    return {
        "confusion": _rows(
            rater=raters[rater],
            of=scale[of],
            said=scale[graded],
            n=result.confusion,
            share=result.shares,
            low=result.share_low,
            high=result.share_high,
        ),
        # one row per rater and grade of another rater, one column per grade
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
    results: "Sequence[Diagnosis]", title: str, questions: Questions
) -> dict[str, list[str]]:
    # of each table
    reference, has_ends = results[0].reference, questions.target is not None
    ends = {
        kind: [note(f"{kind}_ends", level=questions.level, title=title)] * has_ends
        for kind in ("raters", "pairs", "categories", "confusion")
    }
    right = [] if reference is None else [note("reference", rater=reference)]
    texts = dict.fromkeys(f"{text}." for result in results for text in result.notes)
    return {
        **ends,
        "raters": [*right, *(ends["raters"] or [note("no_ends")]), *texts],
        "confusion": [note("confusion"), *ends["confusion"]],
    }


# Options and commands to what answers them, in the order in which it is shown
_QUESTIONS = {
    "retest": _retest,
    "each_category": _categories,
    "diagnose": _diagnosis,
    "symmetry": _symmetry,
    "indices": _indices,
    "limits": _limits,
    "compare": comparisons,
}
