"""People's hands on the simulated arm, held and let go, before and after.

``before`` is how a lost grip was noticed once: by a fall of speed by more than 40 deg/s
within 10 ms, or by an arm that moved backwards faster than 20 deg/s. An arm that stood
for half a second under 2 N·m was a fault once, however it had come to rest.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.elbow._torque import _stepped
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    HandDistribution,
    HandTraits,
    HumanHand,
    Presented,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import PHASES

START, END = radians(30.0), radians(146.0)
FREE_END_DEG = 143.0  # beyond it the joint itself may stop the arm
MODELS = ("HM1", "HM2", "HM3", "HM4")
NOTICE_S = 0.020
BANDS = ((10.0, 20.0), (20.0, 60.0), (60.0, 600.0))  # of stiffness, N·m/rad
PRE_CATCH, CATCH = PHASES.index("pre-catch"), PHASES.index("catch")


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """A hand, and what it does with it: one of the sampled ones."""

    traits: HandTraits
    model: str
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
    lost_before: bool
    clamp_stood: bool  # a clamp of the same stiffness and damping, for half a second
    clamp_lost_before: bool
    slip_s: float  # until the model was released


def people(n_hands: int, seed: int) -> Iterator[Person]:
    """Yield hands of people, the four models in turn, at 60 to 130 deg/s."""
    rng = np.random.default_rng(seed)
    for index in range(n_hands):
        yield Person(
            traits=HandDistribution().sample(rng),
            model=MODELS[index % 4],
            mean_speed=radians(rng.uniform(60.0, 130.0)),
            slips=rng.random(),
        )


def presented(
    person: Person, slip_time: float | None = None, **options: float
) -> Presented:
    """Present the model to a hand."""
    return _presented(person, _hand(person, slip_time), **options)


def _hand(person: Person, slip_time: float | None) -> HumanHand:
    return HumanHand(
        person.traits,
        start=START,
        end=END,
        mean_speed=person.mean_speed,
        slip_time=slip_time,
    )


def _presented(person: Person, hand: SimulatedHand, **options: float) -> Presented:
    clock = SimulatedClock()
    model = STANDARD_MODELS[person.model]
    controller = Controller(model, start_angle=START, **options)
    with open_device("simulated", clock=clock, hand=hand, range_end=END) as device:
        return run_presentation(
            device, controller, clock=clock, limits=DeviceLimits(), end_angle=END
        )


def outcome(person: Person) -> Outcome:
    """Present to the hand while it holds on, while it lets go, and to a clamp."""
    made = presented(person)
    clamp = _presented(
        person,
        SimulatedHand(
            start=START,
            end=END,
            mean_speed=person.mean_speed,
            stiffness=person.traits.stiffness,
            damping=person.traits.damping,
        ),
    )
    columns, clamped = _held(made), _held(clamp)
    stood = _stood_at(clamped)
    clamped = {name: column[:stood] for name, column in clamped.items()}
    return Outcome(
        person=person,
        fault=_kind(made),
        lost=bool(made.recording.facts["grip_lost"]),
        is_law=_is_law(person, columns),
        recoiled=_recoiled(columns),
        lost_before=_lost_before(columns),
        clamp_stood=stood is not None,
        clamp_lost_before=_lost_before(clamped),
        slip_s=_released_after(person, columns),
    )


def _held(made: Presented) -> dict[str, NDArray[np.float64]]:
    # Without the ramp at the end
    n_rows = made.recording.n_presented
    return {name: column[:n_rows] for name, column in made.recording.columns.items()}


def _stood_at(columns: dict[str, NDArray[np.float64]]) -> int | None:
    # Where an arm had stood for half a second under 2 N·m, which was a fault once
    moved = np.flatnonzero(np.diff(columns["angle_deg"], prepend=math.nan) != 0.0)
    since = np.searchsorted(moved, np.arange(columns["time_s"].size), side="right")
    stood = columns["time_s"] - columns["time_s"][moved[since - 1]]
    at = np.flatnonzero((stood > 0.5) & (np.abs(columns["command_torque_nm"]) > 2.0))
    return int(at[0]) if at.size else None


def _kind(made: Presented) -> str | None:
    return None if made.fault is None else made.fault.kind


def _is_law(person: Person, columns: dict[str, NDArray[np.float64]]) -> bool:
    torques, _ = _stepped(
        STANDARD_MODELS[person.model],
        START,
        columns["time_s"],
        np.rint(columns["angle_deg"] / 0.005) * radians(0.005),  # as it was read
        np.radians(columns["velocity_deg_s"]),
    )
    return bool(np.allclose(columns["model_torque_nm"], torques, rtol=0.0, atol=1e-9))


def _recoiled(columns: dict[str, NDArray[np.float64]]) -> bool:
    phase = columns["phase"]
    ended = np.flatnonzero((phase[:-1] == CATCH) & (phase[1:] == PRE_CATCH))
    return ended.size > 0


def _lost_before(columns: dict[str, NDArray[np.float64]]) -> bool:
    velocity = columns["velocity_deg_s"]
    drop = np.zeros_like(velocity)
    drop[10:] = velocity[:-10] - velocity[10:]
    sudden = (drop > 40.0) & (columns["angle_deg"] < FREE_END_DEG)
    # What a sample decides by is the phase of the one before
    in_catch = columns["phase"][:-1] != PRE_CATCH
    return bool(np.any(in_catch & (sudden | (velocity < -20.0))[1:]))


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
    "| stiffness, N·m/rad | hands | clamp: grip lost before | clamp: standing torque "
    "| hand: grip lost before | grip lost | standing torque | torque of the law "
    "| sprang back | slip noticed, ms | latest |\n" + "|---" * 11 + "|"
)


def row(low: float, high: float, outcomes: list[Outcome]) -> str:
    """Return a row of the page's table, of the hands in a band of stiffness."""
    chosen = [o for o in outcomes if low <= o.person.traits.stiffness <= high]
    slips = [1e3 * o.slip_s for o in chosen]
    counts = (
        sum(o.clamp_lost_before for o in chosen),
        sum(o.clamp_stood for o in chosen),
        sum(o.lost_before for o in chosen),
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
