"""Judges in a file compared with its humans, and rates corrected for their errors.

In: a `RatingsFile` some of whose raters are judges. Out: rows of judges, of humans, and
of rates corrected for a judge.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from itertools import compress, product
from typing import Any

import numpy as np

from masrel._input import listed, refuse
from masrel.agreement import code_ratings
from masrel.analysis._file_estimates import (
    Answer,
    Questions,
    Row,
    check_order,
    heads_of,
    note,
    part_names,
    parts_of,
    placed,
)
from masrel.analysis._file_preferences import preference_answers
from masrel.analysis._gates import read_gate
from masrel.analysis._judging import Judging
from masrel.estimates import _population, as_document
from masrel.judges import (
    HumanBesideJudge,
    advantage,
    advantage_differences,
    alternative_annotator_test,
    dawid_skene_intervals,
    effective_number,
    rate_estimates,
    reference_difference,
    score_test,
)
from masrel.ratings import RatingsFile
from masrel.ratings._doubts import called_gold, called_model

_Grades = dict[str, Any]  # by item


_MARGIN = (
    "--epsilon, --annotators: needed one of them: ε is how much worse than a human a "
    "judge may be because it costs less; --annotators sets it to 0.2 (expert), 0.15 "
    "(skilled) or 0.1 (crowd)"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """The grades of one part of a file by rater and item, and who is who."""

    file: RatingsFile
    questions: Questions
    judging: Judging
    judges: tuple[str, ...]
    humans: tuple[str, ...]
    texts: Mapping[str, _Grades]  # grades as they are called
    values: Mapping[str, _Grades]  # and their values
    clusters: Mapping[str, str] | None


_Made = Iterator[tuple[str, Row, Row]]  # name of an answer, a row, and cells beside it


def judging_answers(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Return what is told of the judges of every part of the ratings."""
    judging = questions.judging or Judging()
    ask = _answers if judging.order is None else preference_answers
    yield from _with_gates([*ask(file, questions)], judging.require)


def _answers(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    judging = questions.judging or Judging()
    is_asked = {
        _beside_humans: judging.margin is not None,
        _differences: judging.margin is not None,
        _rates: judging.rate is not None,
        _truth: judging.truth,
    }
    refuse((not any(is_asked.values()), _MARGIN))
    rows: dict[str, list[tuple[Row, Row]]] = {}
    who: dict[str, None] = {}
    for part, group, keys in _parts(file, questions, judging):
        who[
            note(
                "roles",
                judges=listed(part.judges) or "none",
                humans=listed(part.humans) or "none",
            )
        ] = None
        for make in compress(is_asked, is_asked.values()):
            with placed(file.read["file"], group):
                for name, row, cells in make(part):
                    both = {**keys, **row}, {**keys, **row, "group": group, **cells}
                    rows.setdefault(name, []).append(both)
    for name, several in rows.items():
        of_json, shown = map(list, zip(*several, strict=True))
        yield Answer(
            name=name,
            rows=of_json,
            shown=shown,
            heads=heads_of(*part_names(file, file.parts[0])),
            notes=(*who, *_notes(name, of_json, questions)),
            of=judging.rate or "",
            grades=file.scale.grades if name == "truth_confusion" else (),
        )
        who = {}  # below the first


def _parts(
    file: RatingsFile, questions: Questions, judging: Judging
) -> Iterator[tuple[_Part, str, Row]]:
    # with what each is called
    scale = file.scale
    texts, values = (
        np.array([*of, None], object) for of in (scale.grades, scale.values)
    )
    for part, group, keys in parts_of(file):
        judges, humans = _roles(
            judging, questions.reference, part.raters, file.read.get("kinds", {})
        )
        with placed(file.read["file"], group):
            codes = code_ratings(part.ratings).codes.T  # (n_raters, n_items)
        items = part.items or tuple(map(str, range(1, codes.shape[1] + 1)))
        of_texts, of_values = (
            {
                rater: dict(zip(items, column, strict=True))
                for rater, column in zip(part.raters, labels[codes], strict=True)
            }
            for labels in (texts, values)
        )
        made = _Part(
            file=file,
            questions=questions,
            judging=judging,
            judges=judges,
            humans=humans,
            texts=of_texts,
            values=of_values,
            clusters=dict(zip(items, part.clusters, strict=True))
            if part.clusters
            else None,
        )
        yield made, group, keys


def _roles(
    judging: Judging,
    reference: str | None,
    raters: Sequence[str],
    kinds: Mapping[str, str],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the judges and the humans, or refuse who is neither."""
    # kinds: what raters are, where the file says it
    models = tuple(name for name in raters if kinds.get(name) == "model")
    named = {
        "--judge": judging.judges or models,
        "--humans": tuple(judging.humans or ()),
        "--reference": () if reference is None else (reference,),
    }
    for option, names in named.items():
        for name in names:
            near = get_close_matches(name, raters, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            known = f"needed one of {listed(raters)}, got {name!r}{hint}"
            refuse((name not in raters, f"{option}: {known}"))
    several = [name for names in named.values() for name in names]
    twice = [name for name in dict.fromkeys(several) if several.count(name) > 1]
    judges, humans, _ = named.values()
    refuse(
        (
            twice,
            f"{', '.join(named)}: needed a different rater for each, got "
            f"{listed(twice)} twice",
        ),
        (
            not (judges or judging.truth),
            "--judge: needed the rater who is the judge",
        ),
    )
    if humans:
        return judges, humans
    several += [name for name, kind in kinds.items() if kind != "human"]
    humans = tuple(name for name in raters if name not in several)
    for name in humans:
        refuse(
            (
                called_gold(name),
                f"--humans: {name!r} looks like a gold standard, not a human: "
                f"--reference {name} uses it as the reference; if it is a human, list "
                "all humans with --humans",
            ),
            (
                called_model(name),
                f"--humans: {name!r} looks like a model, not a human: --judge {name} "
                "tests it as a judge; if it is a human, list all humans with --humans",
            ),
        )
    return judges, humans


# ---- judges beside humans ----

_YES = {True: "yes", False: "no"}
_OF_TEST = (
    *("winning_rate", "advantage", "is_passed", "n_items", "n_clusters", "epsilon"),
    *("score", "test", "min_items", "thresholds"),
)


def _beside_humans(part: _Part) -> _Made:
    """Give each judge and each human beside it; one human against a reference."""
    reference, judging = part.questions.reference, part.judging
    if len(part.humans) == 1 and reference is not None:
        yield from _against_reference(part, reference)
        return
    refuse(
        (
            len(part.humans) < 2,
            "--judge: needs two humans, because each human and the judge are compared "
            f"with the other humans, got {listed(part.humans) or 'none'}; one is "
            "enough with --reference",
        )
    )
    how, level = _how(part), part.questions.level
    for judge in part.judges:
        result = alternative_annotator_test(
            {name: part.values[name] for name in part.humans},
            part.values[judge],
            epsilon=judging.margin or 0.0,
            test=judging.test,
            level=1.0 - level,
            **how,
        )
        left_out = [f"{name} ({n} items)" for name, n in result.left_out]
        row = {
            "judge": judge,
            "n_humans": len(result.humans),
            "n_rejected": sum(human.is_rejected for human in result.humans),
            **{key: getattr(result, key) for key in _OF_TEST},
            "left_out": [name for name, _ in result.left_out],
        }
        texts = [f"left out: {', '.join(left_out)}"] if left_out else []
        yield "judges", *_with_interval(part, judge, row, texts)
        for human in result.humans:
            yield "humans", *_human_row(part, judge, human)


def _human_row(part: _Part, judge: str, human: HumanBesideJudge) -> tuple[Row, Row]:
    """Return the row of a human beside a judge, and what a table shows otherwise."""
    row = {
        "judge": judge,
        "human": human.name,
        **{of.name: getattr(human, of.name) for of in fields(human)[1:]},
        "ties": human.n_items - human.b - human.c,
        "difference": human.human_share - human.judge_share,
    }
    if part.clusters is None:  # else it would be too short
        level = part.questions.level
        ends = score_test(human.b, human.c, human.n_items, level=level)
        row |= {"difference_low": ends.low, "difference_high": ends.high}
    title = f"{human.name}, {judge}"
    return row, {"title": title, "not_worse": _YES[human.is_rejected]}


def _how(part: _Part) -> dict[str, Any]:
    """Return how grades are compared, as functions of judges take it."""
    judging, score = part.judging, part.judging.score
    if score != "accuracy":
        check_order(part.file, f"--score {score}")
    return {
        "score": score
        if score in ("accuracy", "neg_rmse")
        else (score, part.file.scale.values),
        "min_items": judging.min_items,
        "clusters": part.clusters,
    }


def _with_interval(
    part: _Part, judge: str, row: Row, texts: list[str]
) -> tuple[Row, Row]:
    """Return a judge's row with the interval of the advantage, and cells beside it."""
    cells: Row = {"title": judge, "texts": texts, "passes": _YES[row["is_passed"]]}
    target = part.questions.target
    if target is None:
        return {**row, "standard_error": None, "interval": None}, cells
    estimate = advantage(
        {name: part.values[name] for name in part.humans},
        part.values[judge],
        target=target,
        level=part.questions.level,
        **_how(part),
    )
    interval: Any = estimate.interval
    row |= {
        "standard_error": estimate.standard_error,
        "interval": as_document(interval),
    }
    why = [] if interval.reason is None else [f"no interval: {interval.reason}"]
    cells |= {
        **{key: getattr(interval, key) for key in ("low", "high", "level")},
        "population": _population(interval),
        "interval_texts": [*why, *interval.notes],
    }
    return row, cells


def _differences(part: _Part) -> _Made:
    """Give how much more advantage a judge has than another on the same items."""
    questions = part.questions
    if len(part.judges) < 2 or len(part.humans) < 2 or questions.target is None:
        return
    humans, judges = (
        {name: part.values[name] for name in names}
        for names in (part.humans, part.judges)
    )
    for pair in advantage_differences(
        humans, judges, target=questions.target, level=questions.level, **_how(part)
    ):
        row = {of.name: getattr(pair, of.name) for of in fields(pair)}
        cells = {
            "low": pair.interval.low,
            "high": pair.interval.high,
            "group": f"{pair.first} and {pair.second}",
        }
        yield "judge_differences", row, cells


def _against_reference(part: _Part, reference: str) -> _Made:
    """Give how much more often than the one human each judge is right."""
    (human,), epsilon = part.humans, part.judging.margin or 0.0
    for judge in part.judges:
        test = reference_difference(
            *(part.texts[name] for name in (human, judge, reference)),
            epsilon=epsilon,
            level=part.questions.level,
        )
        row: Row = {
            "judge": judge,
            "human": human,
            "reference": reference,
            "n_items": test.n,
            "judge_right": test.b,
            "human_right": test.c,
            "difference": test.value,
            "low": test.low,
            "high": test.high,
            "level": test.level,
            "epsilon": epsilon,
            "p_value": test.p_greater,
            "is_passed": test.p_greater <= 1.0 - test.level,
            "reason": test.reason,
        }
        cells = {"title": judge, "not_worse": _YES[row["is_passed"]]}
        yield "judge_reference", row, cells


# ---- rates ----

_METHODS = {
    "naive": "Judge alone",
    "rogan_gladen": "Rogan-Gladen",
    "prediction_powered": "PPI++",
    "labels_alone": "Labels alone",
}
_ASSUMED = {
    "judge_is_right": "the judge makes no errors",
    "errors_carry_over": "its error rates are the same on all items",
    "labels_are_random": "labelled items were drawn at random",
}
_RATE_NOTES = {
    "few_labels": "there are few labels: the true coverage may be below the level of "
    "the interval",
    "whole_range": "the interval is the whole range from 0 to 1, so the labels show "
    "nothing",
}


def _rates(part: _Part) -> _Made:
    """Give how often a grade is right, in four ways for each judge."""
    grade, reference = part.judging.rate, part.questions.reference
    labels = part.humans if reference is None else (reference,)
    refuse(
        (
            len(labels) != 1,
            "--rate: needs --reference with the rater whose grades are the labels, or "
            f"exactly one human, got {listed(labels) or 'none'}",
        ),
        (
            grade not in part.file.scale.grades,
            f"--rate: needed one of {listed(part.file.scale.grades)}, got {grade!r}",
        ),
    )
    for judge in part.judges:
        result = rate_estimates(
            part.texts[labels[0]],
            part.texts[judge],
            grade=grade,
            level=part.questions.level,
        )
        for of in result.rows:
            is_default = of.method == result.default
            row = {
                "judge": judge,
                "labels": labels[0],
                "grade": grade,
                **{field.name: getattr(of, field.name) for field in fields(of)},
                "is_default": is_default,
                "sensitivity": result.sensitivity[0],
                "specificity": result.specificity[0],
            }
            title = _METHODS[of.method]
            yield (
                "rates",
                row,
                {
                    "title": f"{title}, {judge}" if len(part.judges) > 1 else title,
                    "name": f"{title} (default)" if is_default else title,
                    "assumed": _ASSUMED[of.assumption],
                    "texts": [
                        *([f"undefined: {of.reason}"] if of.reason else []),
                        *(_RATE_NOTES[key] for key in of.notes),
                    ],
                    "naive": result.rows[0].value,
                },
            )


# ---- who is right ----


def _truth(part: _Part) -> _Made:
    """Give shares of classes, errors of raters, and what they are worth together."""
    questions, raters = part.questions, (*part.judges, *part.humans)
    result = dawid_skene_intervals(
        [
            (item, rater, grade)
            for rater in raters
            for item, grade in part.texts[rater].items()
            if grade is not None
        ],
        level=questions.level,
        rng=questions.seed,
    )
    fit = result.fit
    chosen = fit.posterior.argmax(axis=1)
    for k, category in enumerate(fit.categories):
        of_class = zip(fit.items, fit.posterior.tolist(), chosen == k, strict=True)
        row: Row = {
            "class": category,
            "share": float(fit.shares[k]),
            "low": float(result.shares_low[k]),
            "high": float(result.shares_high[k]),
            "level": result.level,
            "log_likelihood": fit.log_likelihood,
            "start": fit.start,
            "items": {str(item): p[k] for item, p, is_chosen in of_class if is_chosen},
            "reason": result.reason,
        }
        cells: Row = {
            "title": category,
            "texts": [text.rstrip(".") for text in dict.fromkeys(result.notes)],
            "is_default": bool(k == fit.shares.argmax()),
        }
        yield "truth", row, cells
    for (r, rater), (k, category) in product(
        enumerate(fit.raters), enumerate(fit.categories)
    ):
        shares = dict(zip(fit.categories, fit.confusion[r, k].tolist(), strict=True))
        row = {
            "rater": str(rater),
            "class": category,
            "right": float(fit.confusion[r, k, k]),
            "right_low": float(result.confusion_low[r, k, k]),
            "right_high": float(result.confusion_high[r, k, k]),
            "shares": shares,
        }
        cells = {f"said_{of}": shares.get(of, 0.0) for of in part.file.scale.grades}
        cells["n"] = len(fit.items) * float(fit.shares[k])
        yield "truth_confusion", row, cells
    yield from _effective_number(part, raters if len(part.judges) < 2 else part.judges)


def _effective_number(part: _Part, raters: Sequence[str]) -> _Made:
    """Give how many raters those are worth who err together, against a reference."""
    gold = part.texts.get(part.questions.reference or "", {})
    if not any(gold.values()):
        return
    graded = zip(*(part.texts[rater].values() for rater in raters), strict=True)
    # items that all have graded, and whose right grade is known
    wrong = [
        [of != right for of in row]
        for right, row in zip(gold.values(), graded, strict=True)
        if None not in (right, *row)
    ]
    refuse(
        (
            not wrong,
            f"--reference: needs an item that {listed(raters)} have graded, too",
        )
    )
    errors = dict(zip(raters, zip(*wrong, strict=True), strict=True))
    worth = effective_number(errors, level=part.questions.level)
    keys = ("value", "low", "high", "mean_correlation", "n_judges", "n_items", "reason")
    row = {"raters": ", ".join(raters), **{key: getattr(worth, key) for key in keys}}
    yield "effective_number", row, {"title": "Effective number", "texts": worth.notes}


# ---- notes and gates ----

_TESTS = {
    "exact": "exact and unconditional",
    "score": "Tango's score test",
    "t": "Student's t, which rejects too often if few items differ",
    "clusters": "Tango's score test with the design effect of clusters",
}


_BELOW = {
    "judges": ("advantage",),
    "humans": ("closer", "worse"),
    "judge_reference": ("right",),
    "judge_differences": ("judge_difference",),
    "truth_confusion": ("classes",),
    "effective_number": ("worth",),
    "rates": ("labels",),
}


def _notes(name: str, rows: Sequence[Row], questions: Questions) -> list[str]:
    """Return the notes below the table of an answer."""
    level, is_of_humans = questions.level, name == "humans"
    tests = dict.fromkeys(_TESTS[row["test"]] for row in rows if is_of_humans)
    values = {
        **rows[0],
        "tests": ", ".join(tests),
        "level": 1.0 - level if is_of_humans else level,
    }
    kinds = [*_BELOW.get(name, ())]
    kinds += ["no_ends"] * (name == "judges" and questions.target is None)
    return [note(kind, **values) for kind in kinds]


# Answers to what a gate on their rows may be about
_GATED = {
    "judges": ("winning_rate", "advantage", "low", "high"),
    "judge_reference": ("difference", "low", "high"),
    "rates": ("value", "low", "high"),
    "preferences": ("value", "low", "high", "agreement"),
}


def _with_gates(answers: Sequence[Answer], require: Sequence[str]) -> Iterator[Answer]:
    """Give answers, and what ``rate.low >= 0.8`` is checked against."""
    yield from answers
    if not require:
        return
    rows: dict[str, tuple[tuple[str, ...], Row]] = {}
    for answer in answers:
        numbers, is_rate = _GATED.get(answer.name, ()), answer.name == "rates"
        for row in answer.shown or () if numbers else ():
            if row.get("is_default", True):
                start = f"{row['group']}: " if row["group"] else ""
                rows[f"{start}{row['judge']}{'.rate' * is_rate}"] = numbers, row
                if is_rate:  # of the first judge
                    rows.setdefault(f"{start}rate", (numbers, row))
    numbers_of = {name: numbers for name, (numbers, _) in rows.items()}
    about = {"what": "a judge or rate", "example": "gpt-4o.winning_rate >= 0.5"}
    results = []
    for text in require:
        gate = read_gate(text, numbers_of, where="--require", **about)
        row = rows[gate.estimate][1]
        number, reason = row.get(gate.number), row.get("reason")
        if number is None:
            number, reason = math.nan, "no interval was asked for: --target items"
        results.append(gate.hold(number, reason))
    yield Answer(
        name="gates",
        rows=[result.record() for result in results],
        shown=[
            {
                **result.record(),
                "title": str(result.gate),
                "holds": result.holds,
                "verdict": _YES[result.holds],
                "result": str(result),
            }
            for result in results
        ],
    )
