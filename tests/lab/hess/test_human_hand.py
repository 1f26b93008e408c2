"""The hands of people: what they are like, and what the driver makes of them."""

import math
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import (
    HandDistribution,
    HandTraits,
    HumanHand,
    SimulatedClock,
    SimulatedHand,
    open_device,
)

from .held import (
    BANDS,
    FREE_END_DEG,
    MODELS,
    NOTICE_S,
    PRE_CATCH,
    Outcome,
    Person,
    outcome,
    people,
    presented,
    row,
    shares,
)

PAGE = Path(__file__).parents[3] / "docs" / "driver.md"
STRETCH = {"start": 0.5, "end": 2.5, "mean_speed": 1.5}
CALM = HandTraits(stiffness=30.0, damping=1.5, inertia=0.06, tremor=0.0)


def hand(traits: HandTraits = CALM, **change: float) -> HumanHand:
    return HumanHand(traits, **{**STRETCH, **change})


# What a hand is like


def test_a_drawn_hand_lies_within_the_ranges() -> None:
    rng = np.random.default_rng(4)
    drawn = [HandDistribution().sample(rng) for _ in range(300)]
    ranges = HandDistribution()
    names = ("stiffness", "inertia", "tremor", "tremor_hz", "reaction_delay")
    for name in (*names, "correction_time"):
        low, high = getattr(ranges, name)
        values = [getattr(traits, name) for traits in drawn]
        assert low <= min(values) <= max(values) <= high
        # uniform in the logarithm: half of them below the geometric mean; the share
        # of 300 leaves 0.4 to 0.6 with probability 0.0005
        assert 0.4 < np.mean(np.array(values) < math.sqrt(low * high)) < 0.6
    times = [traits.damping / traits.stiffness for traits in drawn]
    low, high = ranges.damping_time
    assert low * (1 - 1e-12) <= min(times) <= max(times) <= high * (1 + 1e-12)


def test_the_same_generator_draws_the_same_hand() -> None:
    draws = [HandDistribution().sample(np.random.default_rng(7)) for _ in range(2)]
    assert draws[0] == draws[1]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"stiffness": 0.0}, "stiffness: needs more than 0, got 0.0"),
        ({"damping": math.inf}, "damping: needs more than 0"),
        ({"inertia": -1.0}, "inertia: needs more than 0"),
        ({"tremor": -0.1}, "tremor: needs 0 or more"),
        ({"tremor_hz": math.nan}, "tremor_hz: needs more than 0"),
        ({"tremor_phase": math.inf}, "tremor_phase: needs 0 or more"),
        ({"reaction_delay": -0.1}, "reaction_delay: needs 0 or more"),
        ({"correction_time": 0.0}, "correction_time: needs more than 0"),
    ],
)
def test_an_impossible_hand_is_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        HandTraits(**change)


@pytest.mark.parametrize("ends", [(0.0, 1.0), (2.0, 1.0), (1.0, math.inf)])
def test_an_impossible_distribution_is_refused(ends: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="stiffness: needs two finite values"):
        HandDistribution(stiffness=ends)


# What it does


def pushed(slip_time: float | None) -> float:
    # A soft hand, and 5 N·m that push the arm for 20 ms -> how far, rad
    soft = HandTraits(stiffness=1e-3, damping=1e-3, inertia=0.0597, tremor=0.0)
    clock = SimulatedClock()
    moved = hand(soft, slip_time=slip_time)
    with open_device("simulated", clock=clock, hand=moved) as device:
        device.read()
        device.command(-5.0)
        clock.sleep_until_ns(clock.now_ns() + 20_000_000)
        return device.read()[1] - 0.5


def test_its_mass_moves_with_the_arm_until_it_lets_go() -> None:
    # The arm has 0.0597 kg·m² by itself; what friction takes differs by a little
    assert pushed(slip_time=0.0) / pushed(None) == pytest.approx(2.0, rel=0.02)


def test_it_corrects_for_where_the_arm_was_a_reaction_ago() -> None:
    # 0.1 rad behind for 1 s: 30 N·m/rad · 0.1 rad · (1 s - 0.15 s) / 0.5 s = 5.1 N·m
    plan = SimulatedHand(**STRETCH, ramp_up=0.15, ramp_down=0.15)
    late, calm = hand(), hand()
    for tick in range(1, 1001):
        time_s = tick * 1e-3
        behind = plan.intended(time_s)[0] - 0.1
        late.feel(time_s, 30.0 * (late.intended(time_s)[0] - behind))
        added = 30.0 * (late.intended(time_s)[0] - calm.intended(time_s)[0])
        if tick < 150:
            assert added == pytest.approx(0.0, abs=1e-12)
    # The lag is felt through spring and damper, 50 ms late
    assert added == pytest.approx(5.1, abs=0.35)


def test_a_correction_is_not_endless() -> None:
    moved, calm = hand(), hand()
    for tick in range(1, 5001):
        moved.feel(tick * 1e-3, 100.0)
    added = 30.0 * (moved.intended(5.0)[0] - calm.intended(5.0)[0])
    assert added == pytest.approx(15.0)


def test_it_trembles_by_a_share_of_what_it_feels() -> None:
    traits = HandTraits(
        stiffness=30.0, damping=1.5, tremor=0.02, tremor_hz=10.0, tremor_phase=0.3
    )
    moved = hand(traits)
    moved.feel(9.0, 10.0)  # long after the stretch
    times = 9.0 + np.arange(1000) * 1e-3
    torque = 30.0 * np.array([moved.intended(t)[0] for t in times])
    assert np.ptp(torque) == pytest.approx(2 * 0.02 * 10.0, rel=1e-3)
    crossings = np.sum(np.diff(np.sign(torque - torque.mean())) != 0)
    assert crossings == pytest.approx(20, abs=1)


def test_before_the_catch_it_is_as_fast_as_it_means_to_be() -> None:
    for person in people(12, seed=11):
        speed = presented(person).recording.facts["mean_speed_deg_s"]
        assert 0.85 < speed / math.degrees(person.mean_speed) < 1.02


# What the driver makes of it


def assert_told_apart(outcomes: list[Outcome]) -> None:
    n_hands = len(outcomes)
    assert sum(o.lost for o in outcomes) <= 0.01 * n_hands
    assert sum(o.fault is not None for o in outcomes) <= 0.01 * n_hands
    assert all(o.is_law for o in outcomes)
    assert max(o.slip_s for o in outcomes) <= NOTICE_S


def test_a_soft_hand_is_told_from_a_lost_grip() -> None:
    outcomes = [outcome(person) for person in people(8, seed=2)]
    assert_told_apart(outcomes)


@pytest.mark.slow
def test_forty_hands_are_told_from_lost_grips() -> None:
    outcomes = [outcome(person) for person in people(40, seed=3)]
    assert_told_apart(outcomes)
    assert sum(o.lost_before for o in outcomes) > 0  # which they were not, once
    assert not any(o.recoiled for o in outcomes if o.person.traits.stiffness > 30.0)


@pytest.mark.long
def test_a_thousand_hands_are_told_from_lost_grips() -> None:
    outcomes = [outcome(person) for person in people(1000, seed=0)]
    assert_told_apart(outcomes)
    page = PAGE.read_text(encoding="utf-8")
    for low, high in (*BANDS, (10.0, 600.0)):
        assert row(low, high, outcomes) in page


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed_deg_s", [60.0, 130.0])
def test_the_hand_of_the_defect_holds_every_model(
    model: str, speed_deg_s: float
) -> None:
    traits = HandTraits(stiffness=30.0, damping=1.5)
    held = Person(
        traits=traits, model=model, mean_speed=radians(speed_deg_s), slips=0.5
    )
    made = outcome(held)
    assert (made.fault, made.lost, made.is_law) == (None, False, True)
    assert made.slip_s <= NOTICE_S


def test_the_inertia_of_the_arm_need_not_be_known_well() -> None:
    # Held by any hand it loses so little that a number wrong by a fifth does no harm
    for person in people(12, seed=9):
        columns = presented(person).recording.columns
        held = columns["phase"] != PRE_CATCH
        held &= columns["angle_deg"] < FREE_END_DEG
        assert 1.2 * shares(columns)[held].max() < 0.5
