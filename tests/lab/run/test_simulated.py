"""Simulated raters are as accurate as they say, in any order."""

import hashlib
import json
import math
from collections.abc import Callable

import msgspec
import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import Protocol, SimulatedRaters, StudyPaths
from masrel.lab.run import GradeRequest, SimulatedGrades
from masrel.lab.schedule import Presentation

Made = Callable[..., tuple[StudyPaths, Protocol]]
Small = tuple[StudyPaths, Protocol]


def with_settings(protocol: Protocol, **settings: float) -> Protocol:
    return msgspec.structs.replace(
        protocol, simulated_raters=SimulatedRaters(**settings)
    )


def asked(
    model: str, *, rater: str = "R1", session: str = "test", repeat: int = 1
) -> GradeRequest:
    return GradeRequest(
        rater=rater,
        session=session,
        presentation=Presentation(position=1, code="X", model=model, repeat=repeat),
        n_presentations=3,
        attempt=1,
    )


def share(n_hits: int, n: int, expected: float) -> bool:
    """Whether a share is within 4.5 standard errors: false alarm 7 in a million."""
    return abs(n_hits / n - expected) < 4.5 * math.sqrt(expected * (1 - expected) / n)


def test_accuracy_is_what_it_says_and_the_rest_are_neighbours(small: Small) -> None:
    grades = SimulatedGrades(with_settings(small[1], accuracy=0.7))
    given = [grades.grade(asked("HM3", repeat=n)) for n in range(4000)]
    assert set(given) == {"1+", "2", "3"}
    assert share(given.count("2"), 4000, 0.7)
    assert share(given.count("3"), 4000, 0.15)


def test_a_dummy_between_two_grades_gets_either_in_proportion(
    new_study: Made,
) -> None:
    # H 1.575 is an eighth of the way: rank 1.25, so grade "1+" with probability 0.25.
    _, protocol = new_study(("= 2.1", "= 1.575"))
    grades = SimulatedGrades(with_settings(protocol, accuracy=1.0))
    given = [grades.grade(asked("D1", repeat=n)) for n in range(4000)]
    assert set(given) == {"1", "1+"}
    assert share(given.count("1+"), 4000, 0.25)


def test_a_retest_repeats_the_first_grade_as_often_as_it_says(small: Small) -> None:
    settings = {"accuracy": 0.5, "retest_agreement": 0.6}
    grades = SimulatedGrades(with_settings(small[1], **settings))
    n = 4000
    same = sum(
        grades.grade(asked("HM3", repeat=i))
        == grades.grade(asked("HM3", session="retest", repeat=i))
        for i in range(n)
    )
    # Anew, two independent grades of shares 0.5, 0.25, 0.25 are equal with 0.375.
    assert share(same, n, 0.6 + 0.4 * 0.375)


def test_a_draw_is_the_hash_the_documentation_describes(small: Small) -> None:
    protocol = with_settings(small[1], seed=3, accuracy=0.5)
    key = json.dumps([3, "accuracy", "R1", "test", "HM1", 1]).encode()
    word = int.from_bytes(hashlib.sha256(key).digest(), "big") >> (256 - 52)
    is_accurate = (word + 0.5) / 2**52 < 0.5
    grade = SimulatedGrades(protocol).grade(asked("HM1"))
    assert (grade == "1") is is_accurate


def test_without_an_intended_grade_nobody_can_be_accurate(new_study: Made) -> None:
    _, protocol = new_study(('intended_grade = "1"', ""), ('intended_grade = "2"', ""))
    with pytest.raises(ProtocolError, match="need a model with an intended_grade"):
        SimulatedGrades(protocol)


def test_at_the_end_of_the_scale_there_is_one_neighbour(new_study: Made) -> None:
    _, protocol = new_study(('intended_grade = "1"', 'intended_grade = "0"'))
    grades = SimulatedGrades(with_settings(protocol, accuracy=0.0))
    assert {grades.grade(asked("HM1", repeat=n)) for n in range(50)} == {"1"}


@pytest.mark.parametrize(("agreement", "equal"), [(1.0, True), (0.0, False)])
def test_a_retest_can_repeat_everything_or_nothing(
    small: Small, agreement: float, equal: bool
) -> None:
    settings = {"accuracy": 0.5, "retest_agreement": agreement}
    grades = SimulatedGrades(with_settings(small[1], **settings))
    first, second = (
        [grades.grade(asked("HM3", session=s, repeat=i)) for i in range(40)]
        for s in ("test", "retest")
    )
    assert (first == second) is equal
