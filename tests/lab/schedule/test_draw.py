"""A draw is what its rule says, uniform, blinded, and nobody else's business."""

import itertools
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ScheduleError
from masrel.lab.protocol import read_protocol
from masrel.lab.schedule.presentation import Schedule, check_schedule, draw_schedule
from tests.lab.schedule.studies import protocol_of, words_of

PUBLISHED = Path(__file__).parents[3] / "studies" / "hess2012" / "protocol.toml"


def codes(schedule: Schedule) -> list[str]:
    return [shown.code for shown in schedule.presentations]


# Derived from the rule alone: see the test that follows.
GOLDEN_ORDER = "D03 D07 HM3 D01 D06 D10 D11 D08 D12 D04 D05 D02 D09 HM4 HM2 HM1"
GOLDEN_CODES = "56D 67C 65N 53W 27T 47W 54U 23K 17M 93K 50T 00H 06B 81D 66C 49Y"


def test_the_draw_of_a_fixed_seed_never_changes() -> None:
    drawn = draw_schedule(read_protocol(PUBLISHED), "R1", "test")
    order = [shown.model for shown in drawn.presentations]
    assert order == GOLDEN_ORDER.split()
    assert codes(drawn) == GOLDEN_CODES.split()


def test_the_draw_is_what_the_rule_gives_in_python_integers() -> None:
    # Fisher and Yates from the last place down, each index a word modulo its range
    # (a word is rejected with probability below 16 / 2**64, so none is here).
    words = words_of('["masrel",2012,"schedule","test","R1"]')
    models = ["HM1", "HM2", "HM3", "HM4", *(f"D{n:02d}" for n in range(1, 13))]
    for i in range(15, 0, -1):
        j = next(words) % (i + 1)
        models[i], models[j] = models[j], models[i]
    assert models == GOLDEN_ORDER.split()
    # Two digits and one of 18 letters; no two of the first 16 are the same.
    drawn = itertools.islice(words_of('["masrel",2012,"codes","test","R1"]'), 16)
    letters = "ABCDFGHJKMNPTUVWXY"
    names = [f"{w % 1800 // 18:02d}{letters[w % 1800 % 18]}" for w in drawn]
    assert names == GOLDEN_CODES.split()


@given(
    seed=st.integers(0, 2**63 - 1),
    n_models=st.integers(1, 40),
    repeats=st.integers(1, 5),
)
def test_every_model_comes_once_per_repeat_under_codes_that_differ(
    seed: int, n_models: int, repeats: int
) -> None:
    names = tuple(f"M{n}" for n in range(n_models))
    protocol = protocol_of(models=names, seed=seed, repeats=repeats)
    drawn = draw_schedule(protocol, "R1", "test")
    shown = Counter((each.model, each.repeat) for each in drawn.presentations)
    expected = itertools.product(names, range(1, repeats + 1))
    assert shown == Counter(expected)
    positions = [each.position for each in drawn.presentations]
    assert positions == list(range(1, n_models * repeats + 1))
    assert len(set(codes(drawn))) == n_models * repeats
    check_schedule(drawn, protocol)


def test_adding_raters_and_sessions_moves_nobody_elses_schedule() -> None:
    few = protocol_of(raters=("R2",))
    many = protocol_of(raters=("R1", "R2", "R3"), sessions=("before", "test", "after"))
    before, after = (draw_schedule(each, "R2", "test") for each in (few, many))
    assert before.presentations == after.presentations
    check_schedule(before, many)


def test_no_code_is_the_id_of_a_model() -> None:
    # All codes of one letter taken as ids: none of them is drawn for any rater.
    names = tuple(f"{n:02d}k" for n in range(100))
    protocol = protocol_of(models=names, repeats=5)
    drawn = codes(draw_schedule(protocol, "R1", "test"))
    assert len(drawn) == 500
    assert [code for code in drawn if code.endswith("K")] == []


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (protocol_of(seed=2), "before a change"),
        (protocol_of(models=("HM1", "HM2")), "before a change"),
        (protocol_of(repeats=2), "before a change"),
        (protocol_of(study="other"), "needed study other, got tiny"),
        (protocol_of(raters=("R2",)), "rater: needed one of R2"),
        (protocol_of(sessions=("again",)), "session: needed one of again"),
    ],
)
def test_a_schedule_that_no_longer_fits_is_refused(other: object, message: str) -> None:
    drawn = draw_schedule(protocol_of(), "R1", "test")
    with pytest.raises(ScheduleError, match=message):
        check_schedule(drawn, other)  # type: ignore[arg-type]
