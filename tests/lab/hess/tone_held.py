"""Every kind of tone in people's hands: stretched, held, brought back, and let go."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow._torque import _stepped
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
    Controller,
    DeviceLimits,
    HandDistribution,
    HandTraits,
    HumanHand,
    Presented,
    SimulatedClock,
    StretchRules,
    open_device,
    run_presentation,
)

START, END = radians(30.0), radians(146.0)
N_STRETCHES, HOLD_S = 3, 1.5
SEEDS = range(200, 300)  # of the hands of the page; the rule was set on 0 to 99
LIMITS = DeviceLimits(active_speed=radians(240.0))  # as in studies/tone
FELT_NM = 3.0  # from which torque on a lost grip is noticed in time
RETURN_SPEED = radians(60.0)
NOTICE_S = 0.020
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
        traits = HandDistribution().sample(rng)
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
    clock, model = SimulatedClock(), KINDS[rater.kind]
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
    with open_device(
        "simulated", clock=clock, hand=hand, range_end=model.range_end
    ) as device:
        return run_presentation(
            device,
            Controller(model, start_angle=START, **options),
            clock=clock,
            limits=limits or LIMITS,
            max_duration_s=_duration_s(hand, slip_time),
            end_angle=rater.end,
            stretches=StretchRules(n=None),
        )


def _duration_s(hand: HumanHand, slip_time: float | None) -> float:
    return hand.final_time if slip_time is None else slip_time + AFTER_S


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
    ramps: bool  # whether its torque then went straight to zero within 50 ms


def outcome(rater: Rater) -> Outcome:
    """Present to a hand while it holds on, and while it lets go."""
    made = presented(rater)
    columns = _held(made)
    slip_time = _slip_time(rater, columns)
    slipped = None if slip_time is None else presented(rater, slip_time)
    return Outcome(
        rater=rater,
        fault=None if made.fault is None else made.fault.kind,
        lost=bool(made.recording.facts["grip_lost"]),
        is_law=np.allclose(
            columns["model_torque_nm"], _law(rater, columns), rtol=0.0, atol=1e-9
        ),
        off=_off(rater, columns),
        beats_missed=_beats_missed(rater, columns),
        slip_s=None if slipped is None else _noticed_after(slipped, slip_time or 0.0),
        ramps=slipped is None or _ramps(slipped),
    )


def _held(made: Presented) -> dict[str, NDArray[np.float64]]:
    # Without the ramp at the end
    n_rows = made.recording.n_presented
    return {name: column[:n_rows] for name, column in made.recording.columns.items()}


def _law(
    rater: Rater,
    columns: dict[str, NDArray[np.float64]],
    velocity: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    angle = np.rint(columns["angle_deg"] / 0.005) * radians(0.005)  # as it was read
    if velocity is None:
        velocity = np.radians(columns["velocity_deg_s"])
    return _stepped(KINDS[rater.kind], START, columns["time_s"], angle, velocity)[0]


def _off(rater: Rater, columns: dict[str, NDArray[np.float64]]) -> float:
    # The speed over 10 ms before and after: it comes without delay
    width = np.ones(21) / 21.0
    padded = np.pad(np.radians(columns["angle_deg"]), 10, mode="edge")
    velocity = np.gradient(np.convolve(padded, width, mode="valid"), 1e-3)
    goal = _law(rater, columns, velocity)
    return float(np.sqrt(np.mean((columns["model_torque_nm"] - goal) ** 2)))


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


def _noticed_after(slipped: Presented, slip_time: float) -> float:
    fault = slipped.fault
    return math.inf if fault is None else fault.time_s - slip_time


def _ramps(slipped: Presented) -> bool:
    fault, columns = slipped.fault, slipped.recording.columns
    if fault is None:
        return False
    since = columns["time_s"] - fault.time_s
    line = fault.torque_nm * (1.0 - np.clip(since, 0.0, 0.05) / 0.05)
    sent = columns["command_torque_nm"]
    return bool(np.allclose(sent[since > -1e-9], line[since > -1e-9], atol=1e-6))


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
