"""Every kind of tone in people's hands: stretched, held, brought back, and let go."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.lab.elbow.tone import (
    ClaspKnife,
    Clonus,
    Cogwheel,
    Contracture,
    Dystonia,
    LeadPipe,
    ThresholdReflex,
    ToneModel,
)
from masrel.lab.hess import (
    DeviceLimits,
    HandTraits,
    HumanHand,
    Presented,
    StretchRules,
)
from masrel.lab.recording import Recording, stretches

from .rig import END, START, assert_straight_ramp, controls, law_of, present
from .test_hands import NOTICE_S, held_columns

N_STRETCHES, HOLD_S = 3, 1.5
SEEDS = range(200, 300)  # of the hands of the page; the rule was set on 0 to 99
LIMITS = DeviceLimits(active_speed=radians(240.0))  # as in studies/tone
FELT_NM = 3.0  # from which torque on a lost grip is noticed in time
RETURN_SPEED = radians(60.0)
AFTER_S = 0.5  # so long a presentation goes on after the hand has let go

KINDS: dict[str, ToneModel] = {
    "lead-pipe": LeadPipe(),
    "cogwheel": Cogwheel(),
    "clasp-knife": ClaspKnife(),
    "contracture": Contracture(range_end=radians(126.0)),  # that of studies/tone
    "dystonia": Dystonia(),
    "clonus": Clonus(),
    "clonus that does not fade": Clonus.of_tardieu(4),
    "threshold reflex": ThresholdReflex(),
    "reflex stiffening with speed": ThresholdReflex.stiffening_with_speed(),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Rater:
    """One of the sampled hands, what it holds and how it stretches it."""

    traits: HandTraits
    kind: str
    speeds: tuple[float, ...]  # of its stretches, rad/s
    end: float  # where its stretches are meant to end, rad
    slips: float  # where among the samples it may be lost at, 0 to 1


def raters(kind: str, seeds: Iterable[int]) -> Iterator[Rater]:
    """Yield the hand of each seed, which stretches at 60 to 130 deg/s."""
    for seed in seeds:
        rng = np.random.default_rng([seed, list(KINDS).index(kind)])
        range_end = min(END, KINDS[kind].range_end)
        traits = HandTraits.sample(rng)
        speeds = rng.uniform(60.0, 130.0, N_STRETCHES)
        yield Rater(
            traits=traits,
            kind=kind,
            speeds=tuple(np.radians(speeds).tolist()),
            # One half press against the joint's end, the other half stop before it
            end=range_end if seed % 2 else range_end - radians(rng.uniform(5.0, 30.0)),
            slips=rng.random(),
        )


def presented(
    rater: Rater,
    slip_time: float | None = None,
    limits: DeviceLimits | None = None,
    **options: float,
) -> Presented:
    """Present until the hand has held its last stretch, or let go a while ago."""
    model = KINDS[rater.kind]
    first, *again = rater.speeds
    hand = HumanHand(
        rater.traits,
        start=START,
        end=rater.end,
        mean_speed=first,
        slip_time=slip_time,
        again=again,
        return_speed=RETURN_SPEED,
        rest=HOLD_S,
        returns=True,
    )
    return present(
        controls(model, **options),
        hand=hand,
        range_end=model.range_end,
        limits=limits or LIMITS,
        max_duration_s=hand.final_time if slip_time is None else slip_time + AFTER_S,
        end_angle=rater.end,
        stretches=StretchRules(n=None),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of a hand that held on, and of the same that let go."""

    rater: Rater
    fault: str | None
    lost: bool
    is_law: bool  # whether the torque is that of the law, fed what was read
    off: float  # rms from the law fed the angle and a speed without delay, N·m
    beats_missed: int  # of those that a clonus has in the holds
    slip_s: float | None  # until the guard stopped it; None where nothing was to slip


def outcome(rater: Rater) -> Outcome:
    """Present to a hand while it holds on, and while it lets go."""
    made = presented(rater)
    columns, n_held = held_columns(made), made.recording.n_presented
    law = law_of(KINDS[rater.kind], made.recording)[:n_held]
    slip_time, slip_s = _slip_time(rater, columns), None
    if slip_time is not None:
        slipped = presented(rater, slip_time)
        slip_s = (slipped.fault.time_s if slipped.fault else math.inf) - slip_time
        assert_straight_ramp(slipped, "slip")
    return Outcome(
        rater=rater,
        fault=None if made.fault is None else made.fault.kind,
        lost=bool(made.recording.facts["grip_lost"]),
        is_law=np.allclose(columns["model_torque_nm"], law, rtol=0.0, atol=1e-9),
        off=_off(rater, made.recording),
        beats_missed=_beats_missed(rater, columns),
        slip_s=slip_s,
    )


def _off(rater: Rater, recording: Recording) -> float:
    # The speed over 10 ms before and after: it comes without delay
    n_held, width = recording.n_presented, np.ones(21) / 21.0
    angle = np.radians(recording.columns["angle_deg"])
    padded = np.pad(angle, 10, mode="edge")
    velocity = np.gradient(np.convolve(padded, width, mode="valid"), 1e-3)
    goal = law_of(KINDS[rater.kind], recording, velocity)
    off = recording.columns["model_torque_nm"] - goal
    return float(np.sqrt(np.mean(off[:n_held] ** 2)))


def _beats_missed(rater: Rater, columns: dict[str, NDArray[np.float64]]) -> int:
    # Each train has to go on until a second and a half after it was set off
    if KINDS[rater.kind].kind != Clonus.kind:
        return 0
    begun = np.flatnonzero(np.diff(columns["phase"]) > 0.0)
    beats = [int(columns["phase"][n + 1 : n + 1501].sum() // 200) for n in begun]
    return 7 * N_STRETCHES - sum(min(n, 7) for n in sorted(beats)[-N_STRETCHES:])


def _slip_time(rater: Rater, columns: dict[str, NDArray[np.float64]]) -> float | None:
    model = KINDS[rater.kind]
    if model.is_passive:  # nothing is guarded
        return None
    free_end = math.degrees(model.range_end) - 3.0
    free = columns["angle_deg"] < free_end
    # It takes some milliseconds to notice: what is over by then, a beat, is nothing
    sent = np.abs(columns["command_torque_nm"])
    felt = np.lib.stride_tricks.sliding_window_view(sent, 21).min(axis=1) >= FELT_NM
    where = np.flatnonzero(felt & free[:-20] & free[20:])
    if where.size == 0:
        return None
    return float(columns["time_s"][where[int(rater.slips * where.size)]])


HEAD = (
    "| kind | hands | slip | standing torque | other faults | torque of the law "
    "| off, N·m | beats missed | let go | noticed within 20 ms | latest, ms |\n"
    + "|---" * 11
    + "|"
)


def row(kind: str, outcomes: list[Outcome]) -> str:
    """Return a row of the page's table."""
    slips = [1e3 * o.slip_s for o in outcomes if o.slip_s is not None]
    faults = [o.fault for o in outcomes if o.fault is not None]
    known = ("slip", "standing-torque")
    cells = [kind, str(len(outcomes)), *(str(faults.count(name)) for name in known)]
    cells += [str(sum(name not in known for name in faults))]
    cells += [str(sum(o.is_law for o in outcomes))]
    cells += [f"{np.median([o.off for o in outcomes]):.2f}"]
    is_clonus = KINDS[kind].kind == Clonus.kind
    cells += [str(sum(o.beats_missed for o in outcomes)) if is_clonus else ""]
    cells += [str(len(slips)) if slips else "not guarded"]
    cells += [str(sum(s <= 1e3 * NOTICE_S for s in slips)) if slips else ""]
    cells += [f"{max(slips):.0f}" if slips else ""]
    return "| " + " | ".join(cells) + " |"


# What came of them

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "tone" / "index.md"
GUARDED = [kind for kind, model in KINDS.items() if not model.is_passive]


def assert_held(outcomes: list[Outcome]) -> None:
    faults = [o.fault for o in outcomes if o.fault is not None or o.lost]
    assert len(faults) <= 0.01 * len(outcomes)
    assert all(o.is_law for o in outcomes)
    assert max((o.slip_s or 0.0) for o in outcomes) <= NOTICE_S


QUICK = ("contracture", "clonus", "threshold reflex")


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[] if kind in QUICK else pytest.mark.slow)
        for kind in KINDS
    ],
)
def test_a_kind_is_stretched_held_and_brought_back(kind: str) -> None:
    # an ordinary hand, which does not press against the joint's end
    (rater,) = raters(kind, [5])
    made = presented(replace(rater, traits=HandTraits()))
    assert made.fault is None
    assert made.recording.facts["grip_lost"] is False
    assert len(stretches(made.recording)) == N_STRETCHES
    angle = made.recording.columns["angle_deg"]
    far = angle > angle.max() - 20.0
    assert np.sum(far) * 1e-3 > N_STRETCHES * HOLD_S


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_begins_from_nothing_and_gives_up_softly(kind: str) -> None:
    traits = HandTraits.sample(np.random.default_rng(1001))
    hand = HumanHand(
        traits,
        start=START,
        end=END,
        mean_speed=radians(90.0),
        again=(radians(80.0), radians(100.0)),
        returns=True,
        rest=1.0,
    )
    presented = present(KINDS[kind], hand=hand, stretches=StretchRules(n=3))
    torque = presented.recording.columns["command_torque_nm"]
    assert torque[0] == 0.0
    assert abs(np.diff(torque[:101])).max() <= 0.25
    if kind.startswith("clonus"):
        assert presented.fault is None
        assert np.diff(torque).min() >= -0.25


def test_clonus_beats_as_long_as_even_a_soft_hand_holds_it() -> None:
    (rater,) = raters("clonus that does not fade", [5])
    soft = HandTraits(stiffness=30.0, damping=1.5)
    made = presented(replace(rater, traits=soft))
    assert made.fault is None
    columns = made.recording.columns
    beats = columns["model_torque_nm"] > 4.5
    begun = columns["time_s"][1:][beats[1:] & ~beats[:-1]]
    gaps = np.diff(begun)
    assert np.sum(np.abs(gaps - 0.2) < 0.002) >= 5.0 * N_STRETCHES * HOLD_S - 6
    assert np.sum(gaps > 0.3) == N_STRETCHES - 1  # between two trains alone
    flexed = columns["velocity_deg_s"][:-1][beats[1:]]
    assert flexed.min() < -20.0  # though a beat throws the arm back faster than ν_th


@pytest.mark.slow
@pytest.mark.parametrize("kind", GUARDED)
def test_a_hand_that_lets_go_is_told_from_one_that_holds(kind: str) -> None:
    assert_held([outcome(rater) for rater in raters(kind, [0])])


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_hands_hold_a_kind_and_those_that_let_go_are_noticed(
    kind: str,
) -> None:
    outcomes = [outcome(rater) for rater in raters(kind, SEEDS)]
    assert row(kind, outcomes) in PAGE.read_text(encoding="utf-8")
    assert all(o.is_law for o in outcomes)
    assert max((o.slip_s or 0.0) for o in outcomes) <= NOTICE_S
