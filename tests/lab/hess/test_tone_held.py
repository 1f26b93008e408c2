"""Every kind of tone in people's hands: many stretches, held and brought back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.hess import HandTraits
from masrel.lab.recording import stretches

from .tone_held import (
    HOLD_S,
    KINDS,
    N_STRETCHES,
    NOTICE_S,
    SEEDS,
    Outcome,
    outcome,
    presented,
    raters,
    row,
)

PAGE = Path(__file__).parents[3] / "docs" / "tone.md"
GUARDED = [kind for kind, model in KINDS.items() if not model.is_passive]


def assert_held(outcomes: list[Outcome]) -> None:
    faults = [o.fault for o in outcomes if o.fault is not None or o.lost]
    assert len(faults) <= 0.01 * len(outcomes)
    assert all(o.is_law for o in outcomes)
    assert all(o.ramps for o in outcomes)
    assert max((o.slip_s or 0.0) for o in outcomes) <= NOTICE_S


@pytest.mark.parametrize("kind", KINDS)
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
def test_three_hands_that_let_go_are_told_from_three_that_hold(kind: str) -> None:
    assert_held([outcome(rater) for rater in raters(kind, range(3))])


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_hands_hold_a_kind_and_those_that_let_go_are_noticed(
    kind: str,
) -> None:
    outcomes = [outcome(rater) for rater in raters(kind, SEEDS)]
    assert row(kind, outcomes) in PAGE.read_text(encoding="utf-8")
    assert all(o.is_law and o.ramps for o in outcomes)
    assert max((o.slip_s or 0.0) for o in outcomes) <= NOTICE_S
