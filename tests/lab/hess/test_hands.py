"""Hands that move the arm: what they intend, and what the driver makes of people's."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.lab.elbow import STANDARD_MODELS, JointModel
from masrel.lab.hess import (
    Controller,
    HandTraits,
    HumanHand,
    Presented,
    SimulatedClock,
    SimulatedHand,
    open_device,
)
from masrel.lab.recording import Recording

from .rig import CATCH, END, MODELS, PRE_CATCH, START, law_and_phases, present

DOCS = Path(__file__).parents[3] / "docs"
STRETCH = {"start": 0.5, "end": 2.5, "mean_speed": 1.5}
CALM = HandTraits(stiffness=30.0, damping=1.5, inertia=0.06, tremor=0.0)


def clamp(**change: object) -> SimulatedHand:
    return SimulatedHand(**{**STRETCH, **change})


def human(traits: HandTraits = CALM, **change: float) -> HumanHand:
    return HumanHand(traits, **{**STRETCH, **change})


# What they intend


def test_the_intention_by_hand() -> None:
    # Rest to 0.1 s, 0.2 s up, 0.4 s down, 1 rad/s between, 2 rad in all: the ramps
    # take 0.1 and 0.2 rad, the rest 1.7 s. Brake at 2.0 s, at rest at 2.4 s.
    stretch = clamp(
        mean_speed=1.0, delay=0.1, ramp_up=0.2, ramp_down=0.4, follow_through=0.0
    )
    expected = {
        0.0: (0.5, 0.0),
        0.1: (0.5, 0.0),
        0.2: (0.525, 0.5),
        0.3: (0.6, 1.0),
        1.3: (1.6, 1.0),
        2.0: (2.3, 1.0),
        2.2: (2.45, 0.5),
        2.4: (2.5, 0.0),
        9.0: (2.5, 0.0),
    }
    for time_s, (angle, speed) in expected.items():
        assert stretch.intended(time_s) == pytest.approx((angle, speed), abs=1e-12)


def test_it_means_to_press_against_the_end_and_may_bring_the_arm_back() -> None:
    assert clamp().intended(10.0)[0] == pytest.approx(2.5 + radians(2.5))
    moved = clamp(rest=1.0, returns=True)
    assert moved.intended(2.4)[0] == pytest.approx(2.5 + radians(2.5))
    assert moved.intended(moved.final_time + 1.0) == (0.5, 0.0)


# What people's are like


def test_a_drawn_hand_lies_within_the_ranges_of_the_page() -> None:
    rng = np.random.default_rng(4)
    drawn = [HandTraits.sample(rng) for _ in range(300)]
    assert drawn[0] == HandTraits.sample(np.random.default_rng(4))
    page = (DOCS / "reference/driver.md").read_text("utf-8")
    page = page.partition("| least to largest |")[2]
    rows = [line.split("|") for line in page.splitlines()[2:9]]
    made = {
        "stiffness": [traits.stiffness for traits in drawn],
        "damping / stiffness": [traits.damping / traits.stiffness for traits in drawn],
        "inertia": [traits.inertia for traits in drawn],
        "tremor, amplitude / torque": [traits.tremor for traits in drawn],
        "tremor, frequency": [traits.tremor_hz for traits in drawn],
        "reaction delay": [traits.reaction_delay for traits in drawn],
        "correction time": [traits.correction_time for traits in drawn],
    }
    assert [row[1].strip() for row in rows] == list(made)
    for (_, _, ends, *_), values in zip(rows, made.values(), strict=True):
        low, high = (float(words.split()[0]) for words in ends.split(" to "))
        assert low * (1 - 1e-12) <= min(values) <= max(values) <= high * (1 + 1e-12)
        # uniform in the logarithm: half of them below the geometric mean; the share
        # of 300 leaves 0.4 to 0.6 with probability 0.0005
        assert 0.4 < np.mean(np.array(values) < math.sqrt(low * high)) < 0.6


def test_its_mass_moves_with_the_arm_until_it_lets_go() -> None:
    # A soft hand, and 5 N·m that push the arm for 20 ms: it has 0.0597 kg·m² by itself;
    # what friction takes differs by a little
    soft = HandTraits(stiffness=1e-3, damping=1e-3, inertia=0.0597, tremor=0.0)
    ways = []
    for slip_time in (0.0, None):
        clock, moved = SimulatedClock(), human(soft, slip_time=slip_time)
        with open_device("simulated", clock=clock, hand=moved) as device:
            device.read()
            device.command(-5.0)
            clock.sleep_until_ns(clock.now_ns() + 20_000_000)
            ways.append(device.read().angle - 0.5)
    assert ways[0] / ways[1] == pytest.approx(2.0, rel=0.02)


def test_it_corrects_for_where_the_arm_was_a_reaction_ago() -> None:
    # 0.1 rad behind for 1 s: 30 N·m/rad · 0.1 rad · (1 s - 0.15 s) / 0.5 s = 5.1 N·m
    plan = clamp(ramp_up=0.15, ramp_down=0.15)
    late, calm = human(), human()
    for tick in range(1, 1001):
        time_s = tick * 1e-3
        behind = plan.intended(time_s)[0] - 0.1
        late.feel(time_s, 30.0 * (late.intended(time_s)[0] - behind))
        added = 30.0 * (late.intended(time_s)[0] - calm.intended(time_s)[0])
        if tick < 150:
            assert added == pytest.approx(0.0, abs=1e-12)
    # The lag is felt through spring and damper, 50 ms late
    assert added == pytest.approx(5.1, abs=0.35)
    for tick in range(1001, 6001):  # a correction is not endless
        late.feel(tick * 1e-3, 100.0)
    added = 30.0 * (late.intended(6.0)[0] - calm.intended(6.0)[0])
    assert added == pytest.approx(15.0)


def test_it_trembles_by_a_share_of_what_it_feels() -> None:
    traits = HandTraits(
        stiffness=30.0, damping=1.5, tremor=0.02, tremor_hz=10.0, tremor_phase=0.3
    )
    moved = human(traits)
    moved.feel(9.0, 10.0)  # long after the stretch
    times = 9.0 + np.arange(1000) * 1e-3
    torque = 30.0 * np.array([moved.intended(t)[0] for t in times])
    assert np.ptp(torque) == pytest.approx(2 * 0.02 * 10.0, rel=1e-3)
    crossings = np.sum(np.diff(np.sign(torque - torque.mean())) != 0)
    assert crossings == pytest.approx(20, abs=1)


# What the driver makes of them

FREE_END_DEG = 143.0  # beyond it the joint itself may stop the arm
NOTICE_S = 0.020
BANDS = ((10.0, 20.0), (20.0, 60.0), (60.0, 600.0))  # of stiffness, N·m/rad


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """A hand, and what it does with it: one of the sampled ones."""

    traits: HandTraits
    model: str | Controller
    mean_speed: float  # rad/s
    slips: float  # where among the samples it may be lost at, 0 to 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of one hand that held on, and of the same that let go."""

    person: Person
    fault: str | None
    lost: bool
    is_law: bool  # whether the torque is that of the law, fed what was read
    recoiled: bool  # whether the arm sprang back so fast that the law ended the catch
    slip_s: float  # until the model was released


def people(n_hands: int, seed: int) -> Iterator[Person]:
    """Yield hands of people, the four models in turn, at 60 to 130 deg/s."""
    rng = np.random.default_rng(seed)
    for index in range(n_hands):
        yield Person(
            traits=HandTraits.sample(rng),
            model=MODELS[index % 4],
            mean_speed=radians(rng.uniform(60.0, 130.0)),
            slips=rng.random(),
        )


def presented(person: Person, slip_time: float | None = None) -> Presented:
    """Present the model to a hand."""
    way = {"start": START, "end": END, "mean_speed": person.mean_speed}
    hand = HumanHand(person.traits, slip_time=slip_time, **way)
    return present(person.model, hand=hand)


def outcome(person: Person) -> Outcome:
    """Present to the hand while it holds on, and while it lets go."""
    made = presented(person)
    columns = held_columns(made)
    phase = columns["phase"]
    return Outcome(
        person=person,
        fault=None if made.fault is None else made.fault.kind,
        lost=bool(made.recording.facts["grip_lost"]),
        is_law=_is_law(STANDARD_MODELS[person.model], made.recording),
        recoiled=bool(np.any((phase[:-1] == CATCH) & (phase[1:] == PRE_CATCH))),
        slip_s=_released_after(person, columns),
    )


def _is_law(model: JointModel, recording: Recording) -> bool:
    """Whether the torque is the law's, but where that catches twice in one push.

    The law takes an arm that its catch throws back for one that is flexed, and catches
    again when the hand goes on; the driver stays before a catch until the arm has been
    flexed by 5 deg or for 100 ms. The first catch is always both's.
    """
    law, phases = law_and_phases(model, recording)
    asked, phase = (recording.columns[name] for name in ("model_torque_nm", "phase"))
    begins = (phases == CATCH) & (np.roll(phases, 1) == PRE_CATCH)
    is_again = (np.cumsum(begins) > 1) & (phases != PRE_CATCH) & (phase == PRE_CATCH)
    return np.allclose(asked[~is_again], law[~is_again], rtol=0.0, atol=1e-9)


def held_columns(made: Presented) -> dict[str, NDArray[np.float64]]:
    """Return the columns without the ramp at the end."""
    n_rows = made.recording.n_presented
    return {name: column[:n_rows] for name, column in made.recording.columns.items()}


def slip_time(person: Person, held: dict[str, NDArray[np.float64]]) -> float:
    """Return when a hand lets go, s: in a catch or after, 20 ms before the end."""
    ahead = held["angle_deg"] + NOTICE_S * np.maximum(held["velocity_deg_s"], 0.0)
    at = np.flatnonzero((held["phase"] != PRE_CATCH) & (ahead < FREE_END_DEG))
    return float(held["time_s"][at[int(person.slips * at.size)]]) + 0.0003


def _released_after(person: Person, held: dict[str, NDArray[np.float64]]) -> float:
    slip_s = slip_time(person, held)
    slipped = presented(person, slip_s).recording.columns
    free = (slipped["time_s"] > slip_s) & (slipped["phase"] == PRE_CATCH)
    return float(slipped["time_s"][np.flatnonzero(free)[0]]) - slip_s


def shares(columns: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the speed lost in 5 ms as a share of what a loose arm would lose."""
    velocity = np.radians(columns["velocity_deg_s"])
    torque = columns["command_torque_nm"]
    late, gain = np.zeros_like(torque), -math.expm1(-0.18)
    for index in range(1, torque.size):
        late[index] = late[index - 1] + gain * (torque[index - 1] - late[index - 1])
    taken = np.cumsum(late) * 1e-3 / 0.06  # rad/s
    share = np.zeros_like(velocity)
    share[5:] = (velocity[:-5] - velocity[5:]) / np.maximum(taken[5:] - taken[:-5], 0.1)
    return share


HEAD = (
    "| stiffness, N·m/rad | hands | grip lost | standing torque | torque of the law "
    "| sprang back | slip noticed, ms | latest |\n" + "|---" * 8 + "|"
)


def row(low: float, high: float, outcomes: list[Outcome]) -> str:
    """Return a row of the page's table, of the hands in a band of stiffness."""
    chosen = [o for o in outcomes if low <= o.person.traits.stiffness <= high]
    slips = [1e3 * o.slip_s for o in chosen]
    counts = (
        sum(o.lost for o in chosen),
        sum(o.fault is not None for o in chosen),
        sum(o.is_law for o in chosen),
        sum(o.recoiled for o in chosen),
    )
    cells = [f"{low:g} to {high:g}", f"{len(chosen)}", *(f"{n}" for n in counts)]
    cells += [f"{np.median(slips):.0f}", f"{max(slips):.0f}"]
    return "| " + " | ".join(cells) + " |"


def table(outcomes: list[Outcome]) -> str:
    """Return the page's table."""
    rows = [row(low, high, outcomes) for low, high in (*BANDS, (10.0, 600.0))]
    return "\n".join([HEAD, *rows])


def test_the_inertia_of_the_arm_need_not_be_known_well() -> None:
    # Held by any hand it loses so little that a number wrong by a fifth does no harm
    for person in people(6, seed=9):
        columns = presented(person).recording.columns
        held = columns["phase"] != PRE_CATCH
        held &= columns["angle_deg"] < FREE_END_DEG
        assert 1.2 * shares(columns)[held].max() < 0.5


def assert_told_apart(outcomes: list[Outcome]) -> None:
    n_hands = len(outcomes)
    assert sum(o.lost for o in outcomes) <= 0.01 * n_hands
    assert sum(o.fault is not None for o in outcomes) <= 0.01 * n_hands
    assert all(o.is_law for o in outcomes)
    assert max(o.slip_s for o in outcomes) <= NOTICE_S


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed_deg_s", [60.0, 130.0])
def test_the_hand_of_the_defect_holds_every_model(
    model: str, speed_deg_s: float
) -> None:
    traits = HandTraits(stiffness=30.0, damping=1.5)
    speed = radians(speed_deg_s)
    held = Person(traits=traits, model=model, mean_speed=speed, slips=0.5)
    assert_told_apart([outcome(held)])


@pytest.mark.parametrize(
    ("n", "seed"), [(4, 2), pytest.param(20, 3, marks=pytest.mark.slow)]
)
def test_soft_hands_are_told_from_lost_grips(n: int, seed: int) -> None:
    outcomes = [outcome(person) for person in people(n, seed)]
    assert_told_apart(outcomes)
    assert not any(o.recoiled for o in outcomes if o.person.traits.stiffness > 30.0)


@pytest.mark.long
def test_a_thousand_hands_are_told_from_lost_grips() -> None:
    outcomes = [outcome(person) for person in people(1000, seed=0)]
    assert_told_apart(outcomes)
    page = (DOCS / "evidence/driver.md").read_text("utf-8")
    for low, high in (*BANDS, (10.0, 600.0)):
        assert row(low, high, outcomes) in page
