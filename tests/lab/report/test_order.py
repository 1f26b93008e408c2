"""Effects of order, against values worked by hand."""

import re
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import ttest_1samp

from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.report._document import ReportFiles
from masrel.scales import MODIFIED_ASHWORTH
from tests.lab.analysis.studies import protocol_with
from tests.lab.report.pages import page, rows_of, written


def presented(**orders: str) -> Ratings:
    """A session per rater: "HM1=1 HM2=3" is the models in their order, with grades."""
    rows: list[dict[str, Any]] = []
    for rater, order in orders.items():
        for position, text in enumerate(order.split(), start=1):
            model, grade = text.split("=")
            row = {"session": "test", "rater": rater, "model": model, "grade": grade}
            rows.append({**row, "position": position})
    return ratings_from_rows(rows, MODIFIED_ASHWORTH)


PLACE = "Second half of a session less first half"
NEIGHBOUR = "After a model graded higher less after one graded lower"
AGAIN = "Second presentation in a session less first"


def reported(folder: Path, rows: Ratings) -> ReportFiles:
    return written(folder, protocol_with(sections=("order",)), rows)


def effects(folder: Path, rows: Ratings) -> dict[str, tuple[Any, ...]]:
    """By question: raters, pairs, equal ones, mean, ends, and why there are none."""
    files = reported(folder, rows)
    why = dict(re.findall(r"^(.*): no interval, as (.*)\.$", page(files), re.M))
    return {
        question: (*(float(n or "nan") for n in numbers), why.get(question))
        for row in rows_of(files, "order_effects")
        for question, *numbers, _ in [row.values()]
    }


def test_the_second_half_is_held_against_the_first(tmp_path: Path) -> None:
    rows = presented(R1="HM1=0 HM2=3", R2="HM2=2 HM1=1")
    # steps: HM1 0 of R1 and 1 of R2, HM2 4 and 3; so half a step below the mean of the
    # model in the first half and half a step above in the second, for both
    n_raters, _, _, mean, *_, reason = effects(tmp_path, rows)[PLACE]
    assert (n_raters, mean) == (2, pytest.approx(1.0))
    assert reason == "it is the same for every rater"


def test_the_interval_is_students_t_over_raters(tmp_path: Path) -> None:
    rows = presented(
        R1="HM1=0 HM2=1 HM3=2 HM4=3",
        R2="HM4=4 HM3=3 HM2=1+ HM1=0",
        R3="HM2=1 HM1=1 HM4=4 HM3=1+",
    )
    steps = {
        "HM1": {"R1": 0, "R2": 0, "R3": 1},
        "HM2": {"R1": 1, "R2": 2, "R3": 1},
        "HM3": {"R1": 3, "R2": 4, "R3": 2},
        "HM4": {"R1": 4, "R2": 5, "R3": 5},
    }
    deviation = {
        (rater, model): of[rater] - sum(of.values()) / 3
        for model, of in steps.items()
        for rater in of
    }
    later = {"R1": ("HM3", "HM4"), "R2": ("HM2", "HM1"), "R3": ("HM4", "HM3")}
    half = {True: 0.5, False: -0.5}
    by_rater = [
        sum(deviation[rater, model] * half[model in last] for model in steps)
        for rater, last in later.items()
    ]
    expected = ttest_1samp(by_rater, 0.0).confidence_interval(0.95)
    numbers = (sum(by_rater) / 3, expected.low, expected.high)
    assert effects(tmp_path, rows)[PLACE][3:6] == pytest.approx(numbers)


def test_a_grade_drawn_to_the_one_before_is_an_effect_of_the_neighbour(
    tmp_path: Path,
) -> None:
    # HM2 after the severe HM4 is graded a step higher than after the mild HM1
    orders = {
        "R1": "HM4=3 HM2=2 HM1=1 HM2=1+",
        "R2": "HM1=1 HM2=1+ HM4=3 HM2=2",
    }
    rows = []
    for rater, order in orders.items():
        seen: dict[str, int] = {}
        for position, text in enumerate(order.split(), start=1):
            model, grade = text.split("=")
            seen[model] = seen.get(model, 0) + 1
            row = {"rater": rater, "model": model, "grade": grade}
            rows.append({**row, "position": position, "repeat": seen[model]})
    found = effects(tmp_path, ratings_from_rows(rows, MODIFIED_ASHWORTH))
    # R1: HM2 after HM4 +1/2, HM1 after HM2 0, so 1/4 after a higher one; HM2 after HM1
    # -1/2 after a lower one: 3/4. R2: HM2 after HM1 -1/2 and HM4 after HM2 0, so -1/4
    # after a lower one; HM2 after HM4 +1/2: 3/4.
    assert found[NEIGHBOUR][3] == pytest.approx(0.75)
    # the second time HM2 is a step lower for R1 and a step higher for R2
    n_raters, n_pairs, n_equal, mean, low, high, _ = found[AGAIN]
    assert (n_raters, n_pairs, n_equal, mean) == (2, 2, 0, 0.0)
    assert low < 0.0 < high


def test_a_session_is_held_against_the_one_before(tmp_path: Path) -> None:
    rows = [
        {"session": session, "rater": rater, "model": model, "grade": grade}
        for session, rater, model, grade in (
            ("test", "R1", "HM1", "1"),
            ("test", "R1", "HM2", "2"),
            ("test", "R2", "HM1", "1"),
            ("test", "R3", "HM1", "0"),
            ("retest", "R1", "HM1", "1+"),
            ("retest", "R1", "HM2", "2"),
            ("retest", "R2", "HM1", "1"),
        )
    ]
    made = ratings_from_rows(rows, MODIFIED_ASHWORTH)
    ((question, found),) = effects(tmp_path, made).items()
    # R1 half a step up on average, R2 none; R3 has no second grade
    assert question == "Session retest less session test"
    assert found[:4] == (2, 3, 2, 0.25)


def test_models_that_are_milder_or_more_severe_are_no_effect(tmp_path: Path) -> None:
    # grades that depend on the model alone: nothing is left once that is taken off
    models = {"HM1": "0", "HM2": "1", "HM3": "2", "HM4": "4"}
    orders = (("HM1", "HM2", "HM3", "HM4"), ("HM4", "HM2", "HM1", "HM3"))
    rows = presented(
        **{
            f"R{n}": " ".join(f"{model}={models[model]}" for model in order)
            for n, order in enumerate(orders, start=1)
        }
    )
    found = effects(tmp_path, rows)
    assert {name: of[3] for name, of in found.items()} == {PLACE: 0.0, NEIGHBOUR: 0.0}
    places = rows_of(reported(tmp_path, rows), "grades_by_place")
    assert {float(row["deviation_steps"]) for row in places} == {0.0}


def test_one_rater_has_no_interval(tmp_path: Path) -> None:
    rows = [
        {"session": session, "rater": "R1", "model": "HM1", "grade": grade}
        for session, grade in (("test", "1"), ("retest", "1+"))
    ]
    made = ratings_from_rows(rows, MODIFIED_ASHWORTH)
    (found,) = effects(tmp_path, made).values()
    assert (found[3], found[-1]) == (1.0, "one rater has no spread")
    assert found[4] != found[4]
