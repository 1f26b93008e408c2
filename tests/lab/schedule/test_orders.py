"""Each scheme draws the orders that it promises, and no others."""

import itertools
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.errors import ScheduleError
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
)
from masrel.lab.schedule.presentation import check_schedule, draw_schedule
from masrel.lab.schedule.sheets import schedule_problems, write_schedules
from tests.lab.protocol.documents import VALID, changed, problems_of
from tests.lab.schedule.studies import SECRET, protocol_of

MODELS = tuple("ABCDEFGH")
GRADES = {"A": "1", "B": "1", "C": "2", "D": "2"}


def order(
    protocol: Protocol, rater: str, row: int | None = None, secret: bytes = SECRET
) -> list[str]:
    drawn = draw_schedule(protocol, rater, "test", secret=secret, row=row)
    if secret == SECRET:
        check_schedule(drawn, protocol)
    return [shown.model for shown in drawn.presentations]


def raters(n: int) -> tuple[str, ...]:
    return tuple(f"R{number}" for number in range(1, n + 1))


def rows(protocol: Protocol, first: int, n: int) -> list[list[str]]:
    return [order(protocol, "R1", row) for row in range(first, first + n)]


def pairs(orders: list[list[str]]) -> Counter[tuple[str, str]]:
    return Counter(pair for each in orders for pair in itertools.pairwise(each))


def each_place_has_each_model_equally_often(orders: list[list[str]]) -> bool:
    places = [Counter(column) for column in zip(*orders, strict=True)]
    models = set(orders[0])
    return all(set(freq) == models and len(set(freq.values())) == 1 for freq in places)


@pytest.mark.parametrize(
    ("n_models", "n_rows", "each"), [(2, 2, 1), (8, 8, 1), (3, 6, 2), (7, 14, 2)]
)
def test_a_williams_design_has_each_ordered_pair_equally_often(
    n_models: int, n_rows: int, each: int
) -> None:
    protocol = protocol_of(models=MODELS[:n_models], scheme="williams")
    for replicate in range(3):
        design = rows(protocol, 1 + replicate * n_rows, n_rows)
        assert each_place_has_each_model_equally_often(design)
        assert pairs(design) == dict.fromkeys(
            itertools.permutations(MODELS[:n_models], 2), each
        )


def test_in_a_latin_square_each_model_stands_once_in_each_place() -> None:
    protocol = protocol_of(models=MODELS, scheme="latin-square")
    for replicate in range(3):
        design = rows(protocol, 1 + replicate * 8, 8)
        assert all(sorted(row) == list(MODELS) for row in design)
        assert each_place_has_each_model_equally_often(design)


@pytest.mark.parametrize("scheme", ["williams", "latin-square"])
@pytest.mark.parametrize("n_models", [2, 3, 8])
def test_repeats_of_a_design_are_balanced_each_and_none_comes_twice_in_a_row(
    scheme: str, n_models: int
) -> None:
    n_rows = 2 * n_models if scheme == "williams" and n_models % 2 else n_models
    protocol = protocol_of(models=MODELS[:n_models], scheme=scheme, repeats=5)
    design = rows(protocol, 1, n_rows)
    assert each_place_has_each_model_equally_often(design)
    assert all(a != b for a, b in pairs(design))
    for repeat in range(5):
        part = [row[repeat * n_models : (repeat + 1) * n_models] for row in design]
        assert all(sorted(line) == list(MODELS[:n_models]) for line in part)
        if scheme == "williams":
            assert len(set(pairs(part).values())) == 1


def test_a_new_replicate_another_session_and_another_site_have_other_permutations() -> (
    None
):
    sites = {"R1": "north", "R2": "south"}
    protocol = protocol_of(
        models=MODELS,
        sessions=("test", "retest"),
        scheme="williams",
        sites=sites,
        strata="site",
    )
    designs = [
        tuple(
            tuple(
                shown.model
                for shown in draw_schedule(
                    protocol, rater, session, secret=SECRET, row=row
                ).presentations
            )
            for row in range(first, first + 8)
        )
        for rater in ("R1", "R2")
        for session in ("test", "retest")
        for first in (1, 9)
    ]
    assert len({frozenset(design) for design in designs}) == 8


def test_blocks_by_repeat_show_every_model_before_any_comes_again() -> None:
    protocol = protocol_of(models=MODELS, repeats=3, scheme="blocks", raters=raters(20))
    for rater in raters(20):
        drawn = order(protocol, rater)
        blocks = [drawn[i : i + 8] for i in (0, 8, 16)]
        assert all(sorted(block) == list(MODELS) for block in blocks)


def test_blocks_by_role_keep_each_role_together_and_either_comes_first() -> None:
    protocol = protocol_of(
        models=MODELS,
        dummies=tuple("EFGH"),
        repeats=2,
        scheme="blocks",
        blocks_by="role",
        raters=raters(40),
    )
    first = set()
    for rater in raters(40):
        roles = [model in "ABCD" for model in order(protocol, rater)]
        assert roles == [roles[0]] * 8 + [not roles[0]] * 8
        first.add(roles[0])
    assert first == {True, False}


def no_pair(of: Callable[[str], object]) -> Callable[[list[str]], bool]:
    """Whether no two neighbours have the same of something that is not None."""
    return lambda drawn: all(
        of(a) is None or of(a) != of(b) for a, b in itertools.pairwise(drawn)
    )


@pytest.mark.parametrize(
    ("rules", "is_kept"),
    [
        ({"scheme": "no-immediate-repeat"}, no_pair(lambda model: model)),
        (
            {"scheme": "restricted", "standards_apart": True},
            no_pair(lambda model: "standard" if model in "ABCD" else None),
        ),
        ({"scheme": "restricted", "max_same_grade": 1}, no_pair(GRADES.get)),
    ],
)
def test_limits_are_kept_by_every_order(
    rules: dict[str, object], is_kept: Callable[[list[str]], bool]
) -> None:
    protocol = protocol_of(
        models=MODELS,
        dummies=tuple("EFGH"),
        grades=GRADES,
        repeats=5,
        raters=raters(40),
        **rules,
    )
    drawn = [order(protocol, rater) for rater in raters(40)]
    assert all(is_kept(each) for each in drawn)
    assert len({tuple(each) for each in drawn}) == 40
    at_random = protocol_of(models=MODELS, repeats=5, raters=raters(40))
    assert not all(is_kept(order(at_random, rater)) for rater in raters(40))


def test_orders_are_equally_likely_where_they_are_nearly_as_many_as_words() -> None:
    # 6 standards among 15 dummies, C(16, 6) 6! 15! orders, 2.4 times of which are 2^64:
    # if words beyond the second time were taken, 46 % would begin with a standard.
    models = tuple("ABCDEFGHIJKLMNOPQRSTU")
    protocol = protocol_of(
        models=models, dummies=models[6:], scheme="restricted", standards_apart=True
    )
    drawn = [
        order(protocol, "R1", secret=number.to_bytes(16, "big"))
        for number in range(1000)
    ]
    n_first = sum(each[0] in models[:6] for each in drawn)
    # 6/16 of them, within four standard errors: fails once in 16 000 choices of secrets
    assert n_first == pytest.approx(375, abs=61)


@pytest.mark.parametrize(
    "rules",
    [
        {"scheme": "blocks"},
        {"scheme": "no-immediate-repeat"},
        {"scheme": "restricted", "max_same_grade": 3},
    ],
)
def test_repeats_are_numbered_as_they_come(rules: dict[str, object]) -> None:
    protocol = protocol_of(models=MODELS, grades=GRADES, repeats=4, **rules)
    drawn = draw_schedule(protocol, "R1", "test", secret=SECRET)
    for model in MODELS:
        repeats = [s.repeat for s in drawn.presentations if s.model == model]
        assert repeats == [1, 2, 3, 4]


def of_models(
    rules: dict[str, object], *models: tuple[str, str, str | None]
) -> dict[str, object]:
    """A document with models of a role and a grade, by id."""
    document = changed("schedule", to={"seed": 1, **rules})
    first = VALID["models"][1]  # which has no grade
    document["models"] = [
        {**first, "id": name, "role": role}
        | ({} if grade is None else {"intended_grade": grade})
        for name, role, grade in models
    ]
    return document


@pytest.mark.parametrize(
    ("rules", "models", "sentence"),
    [
        (
            {"scheme": "no-immediate-repeat", "repeats": 3},
            [("A", "standard", None)],
            "schedule.scheme: needed two models or more so that none comes twice in a "
            "row, got one 3 times",
        ),
        (
            {"scheme": "restricted", "standards_apart": True, "repeats": 2},
            [("A", "standard", "1"), ("B", "standard", "2"), ("C", "dummy", None)],
            "schedule.standards_apart: needed an order without two standards in a row, "
            "got 4 presentations of standards, between which 2 of dummies leave room "
            "for 3",
        ),
        (
            {"scheme": "restricted", "max_same_grade": 1, "repeats": 4},
            [("A", "standard", "1"), ("B", "standard", "1"), ("C", "dummy", None)],
            "schedule.max_same_grade: needed an order with at most 1 of one grade in a "
            'row, got 8 presentations of grade "1", between which 4 others leave room '
            "for 5",
        ),
        (
            {"scheme": "blocks", "blocks_by": "role"},
            [("A", "standard", "1"), ("B", "standard", "1")],
            "schedule.blocks_by: needed standards and dummies among the models with "
            '"role", got standards only',
        ),
    ],
)
def test_a_scheme_that_no_order_keeps_is_refused_with_the_reason(
    tmp_path: Path,
    rules: dict[str, object],
    models: list[tuple[str, str, str | None]],
    sentence: str,
) -> None:
    assert problems_of(of_models(rules, *models), tmp_path)[0] == sentence


def many_graded(repeats: int) -> Protocol:
    """Standards and dummies of four grades, under both limits."""
    return protocol_of(
        models=tuple("ABCDEFGHIJKL"),
        dummies=tuple("EFGHIJKL"),
        grades={model: str(i % 4) for i, model in enumerate("ABCDEFGHIJKL")},
        repeats=repeats,
        scheme="restricted",
        standards_apart=True,
        max_same_grade=1,
    )


def test_both_limits_hold_where_dummies_have_grades_too() -> None:
    drawn = order(many_graded(repeats=2), "R1")
    assert no_pair(lambda m: "standard" if m in "ABCD" else None)(drawn)
    assert no_pair(lambda m: "ABCDEFGHIJKL".index(m) % 4)(drawn)
    # runs are as long as allowed
    grades = {model: str(i % 2) for i, model in enumerate(MODELS)}
    rules = {"scheme": "restricted", "standards_apart": True, "max_same_grade": 2}
    protocol = protocol_of(models=MODELS, dummies=tuple("EFGH"), grades=grades, **rules)
    secrets = (number.to_bytes(16, "big") for number in range(100))
    runs = {
        len(list(run))
        for secret in secrets
        for _, run in itertools.groupby(
            order(protocol, "R1", secret=secret), grades.get
        )
    }
    assert runs == {1, 2}


def test_orders_that_cannot_be_counted_or_are_not_there_are_named(
    tmp_path: Path,
) -> None:
    study = StudyPaths(tmp_path)
    none = protocol_of(
        models=("A", "B"),
        dummies=("B",),
        grades={"A": "1", "B": "1"},
        scheme="restricted",
        standards_apart=True,
        max_same_grade=1,
    )
    for protocol, sentence in (
        (many_graded(repeats=5), "schedule.max_same_grade: needed orders that can be"),
        (none, "schedule.scheme: needed one that some order of the models keeps"),
    ):
        with pytest.raises(ScheduleError) as caught:
            write_schedules(protocol, study)
        (problem,) = schedule_problems(protocol, study)
        assert problem == str(caught.value)
        assert problem.startswith(f"{study.protocol}: {sentence}")
    assert list(tmp_path.iterdir()) == []
