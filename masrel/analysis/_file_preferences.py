"""Preferences in a file: whether the order of two answers matters, and which is better.

In: a `RatingsFile` whose parts are the answers shown first, and whose grades are the
answers preferred. Out: rows of judges, and of the answers that each preferred.
"""

from collections.abc import Iterator

import numpy as np

from masrel._input import listed, refuse
from masrel.agreement import code_ratings
from masrel.analysis._file_estimates import Answer, Questions, Row, note, placed
from masrel.errors import RatingsError
from masrel.judges import bradley_terry, position_bias
from masrel.ratings import RatingsFile

_OF_BIAS = (
    *("value", "low", "high", "level", "agreement", "agreement_without_ties"),
    *("n_pairs", "n_ties", "n_unpaired"),
)

_Verdict = tuple[str, str, str, str]  # item, shown first, shown second, preferred


def preference_answers(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Return how far order decides what each judge prefers, and how strongly."""
    verdicts, tie = _verdicts(file)
    judges = questions.judging.judges if questions.judging else ()
    refuse(
        *(
            (
                judge not in verdicts,
                f"--judge: needed one of {listed(verdicts)}, got {judge!r}",
            )
            for judge in judges
        )
    )
    answers = [
        _of_judge(file, judge, verdicts[judge], tie, questions.level)
        for judge in judges or list(verdicts)
    ]
    for name, kind, rows in (
        ("preferences", "position", [bias for bias, _ in answers]),
        ("strengths", "strengths", [row for _, of in answers for row in of]),
    ):
        yield Answer(
            name=name,
            rows=rows,
            shown=[
                {**row, "title": row["judge"], "group": "", "texts": _texts(row)}
                for row in rows
            ],
            notes=(
                note(
                    kind,
                    level=questions.level,
                    ties=f" A tie is {tie!r}." if tie else "",
                ),
            ),
        )


def _of_judge(
    file: RatingsFile, judge: str, verdicts: list[_Verdict], tie: str, level: float
) -> tuple[Row, list[Row]]:
    """Return the row of a judge's leaning to a place, and those of its strengths."""
    with placed(file.read["file"], judge):
        bias = position_bias(verdicts, tie=tie, level=level)
        fit = bradley_terry(verdicts, tie=tie, level=level)
    leaning = {
        "judge": judge,
        **{of: getattr(bias, of) for of in _OF_BIAS},
        "p_value": bias.mcnemar.p_value,
        "notes": bias.notes,
    }
    numbers = np.array([fit.strengths, fit.low, fit.high]).T.tolist()
    return leaning, [
        {
            "judge": judge,
            "model": model,
            **dict(zip(("value", "low", "high"), of_model, strict=True)),
            "reason": fit.reason,
            "notes": fit.notes,
        }
        for model, of_model in zip(fit.models, numbers, strict=True)
    ]


def _texts(row: Row) -> list[str]:
    why = row.get("reason")
    return [*([f"undefined: {why}"] if why else []), *row["notes"]]


def _verdicts(file: RatingsFile) -> tuple[dict[str, list[_Verdict]], str]:
    """Return the verdicts of each rater, and the grade that is a tie."""
    shown_first = [str(part.group) for part in file.parts]
    other = [grade for grade in file.scale.grades if grade not in shown_first]
    refuse(
        (
            len(other) > 1,
            "--order: needs the answer that was shown first, as --grade has the "
            f"preferred answer or a tie, but {listed(other)} are never shown first",
        )
    )
    tie = other[0] if other else ""
    answers: dict[str, dict[str, None]] = {}  # of every item
    graded: list[tuple[str, str, str, str]] = []
    for part, first in zip(file.parts, shown_first, strict=True):
        codes = code_ratings(part.ratings).codes.tolist()  # (n_items, n_raters)
        for item, of_item in zip(part.items or (), codes, strict=True):
            of = answers.setdefault(item, {first: None})
            of[first] = None
            for rater, code in zip(part.raters, of_item, strict=True):
                if code >= 0:
                    grade = file.scale.grades[code]
                    of |= {} if grade == tie else {grade: None}
                    graded.append((rater, item, first, grade))
    verdicts: dict[str, list[_Verdict]] = {}
    for rater, item, first, grade in graded:
        pair = answers[item] if len(shown_first) > 2 else dict.fromkeys(shown_first)
        if len(pair) > 2:
            raise RatingsError(
                f"{file.read['file']}: item {item!r} compares {listed(pair)}: --item "
                "also needs the columns that identify the pair"
            )
        for second in pair.keys() - {first}:  # none is known of some in one order
            verdicts.setdefault(rater, []).append((item, first, second, grade))
    return verdicts, tie
