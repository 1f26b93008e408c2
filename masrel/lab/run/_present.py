"""One presentation: on the device, on disk, and what came of its stretches."""

import contextlib
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from masrel.lab._study_files import Fact, Facts, sha256_of
from masrel.lab.conduct._calibrations import Calibration
from masrel.lab.elbow import JointModel
from masrel.lab.elbow.tone import _caught
from masrel.lab.hess import (
    Clock,
    DeviceLimits,
    EmergencyStop,
    HandTraits,
    HumanHand,
    PresentationStatus,
    Presented,
    RealClock,
    SimulatedHand,
    StretchRules,
    cut_off,
    open_device,
    run_presentation,
)
from masrel.lab.hess._stop import stop_on_signals, watched
from masrel.lab.protocol import PresentationRules, Protocol, joint_model
from masrel.lab.recording import (
    RECORDING_COLUMNS,
    Recording,
    Stretch,
    read_recording,
    stretches,
    write_recording,
)
from masrel.lab.run._grade_sources import GradeRequest
from masrel.lab.run._settings import (
    backend_options,
    calibrated,
    device_limits,
    has_simulated_hand,
    model_controller,
    use_calibration,
)
from masrel.lab.run._simulated_raters import (
    hand_seed,
    intended_speeds,
    key_of,
    sensor_seed,
)
from masrel.lab.run._state import Felt
from masrel.lab.schedule.presentation import _hidden


class StatusOfHand(PresentationStatus):
    """Of a presentation to a simulated hand, which is done when it has made its way.

    One that holds is done when it brings the arm back after the last stretch.
    """

    __slots__ = ("_holds", "_is_armed", "_n_over", "_n_planned")

    def __init__(self, n_planned: int, *, holds: bool = False) -> None:
        self._n_planned = n_planned
        self._holds = holds
        super().__init__()

    @property
    def is_armed(self) -> bool:
        """Whether the next extension begins a stretch."""
        return self._is_armed

    @is_armed.setter
    def is_armed(self, is_armed: bool) -> None:
        self._is_armed = is_armed
        if is_armed and self._n_over >= self._n_planned:
            self.done()

    @property
    def n_stretches(self) -> int:
        """Stretches that are over."""
        return self._n_over

    @n_stretches.setter
    def n_stretches(self, n_over: int) -> None:
        self._n_over = n_over
        if n_over >= self._n_planned and not self._holds:
            self.done()


def stretch_rules(rules: PresentationRules, slowest_s: float) -> StretchRules:
    """Return the rules of the loop; a hand that needs longer for a stretch gets it."""
    n = rules.stretches
    if isinstance(n, tuple):
        n = len(n)
    return StretchRules(
        n=n if isinstance(n, int) else None,
        time_limit=rules.time_limit_s,
        stretch_limit=max(rules.stretch_limit_s, slowest_s),
    )


def _felt(made: Sequence[Stretch], joint: JointModel, start: float) -> Felt:
    if not any(stretch.reached_threshold for stretch in made):
        return "below-threshold"
    if any(stretch.catch_angle_deg is not None for stretch in made):
        return "felt"
    speeds = (s.mean_speed_deg_s for s in made if s.mean_speed_deg_s is not None)
    if any(_caught(joint, start, math.radians(speed)) for speed in speeds):
        return "no-catch"
    return "felt"  # a model without a catch at such a speed has nothing to miss


def _tardieu_angles(
    made: Sequence[Stretch], cues: Mapping[int, str], recording: Recording
) -> tuple[float | None, float | None]:
    # -> R1 and R2, deg, as `elbow.Tardieu` has them: R1 is R2 without a catch
    angle, number = recording.columns["angle_deg"], recording.columns["stretch"]
    slow = [stretch.number for stretch in made if cues.get(stretch.number) == "slow"]
    fast = [stretch for stretch in made if cues.get(stretch.number) == "fast"]
    r2_deg = max((float(angle[number == n].max()) for n in slow), default=None)
    caught = (s.catch_angle_deg for s in fast if s.catch_angle_deg is not None)
    return next(caught, r2_deg) if fast else None, r2_deg


Listening = Callable[
    [GradeRequest, EmergencyStop], contextlib.AbstractContextManager[object]
]
"""Listens to whoever is with the rater, as long as a presentation lasts."""

# After this a presentation of one stretch ends, wherever the arm is.
_ONE_STRETCH_S = 10.0

_REST_S = 0.3  # of a simulated hand between two ways

# How much of the recording before a fault goes into the log
_BEFORE_FAULT_S = 0.2

_FORMATS = {
    "time_s": "{:.6f}",
    "angle_deg": "{:.4f}",
    "velocity_deg_s": "{:.2f}",
    "model_torque_nm": "{:.4f}",
    "command_torque_nm": "{:.4f}",
    "phase": "{:.0f}",
    "ramp": "{:.0f}",
    "stretch": "{:.0f}",
}


class Outcome(NamedTuple):
    """What a presentation left, as a log says it, whatever it was for."""

    logged: dict[str, Facts]
    fault: dict[str, Facts]  # what stopped it; empty where nothing did


def present(
    protocol: Protocol,
    request: GradeRequest,
    *,
    clock: Clock,
    file: Path,
    stop: EmergencyStop,
    listening: Listening,
    calibration: tuple[Calibration, str] | None = None,
) -> Outcome:
    """Present a model once on the protocol's device and write the recording.

    What was kept while it was made stays beside it until the log names it.
    """
    # Signals that would end the process, and with a real clock whoever is listened to,
    # can press the emergency stop while the device is open.
    measured, sha256 = calibration or (None, None)
    protocol = calibrated(protocol, measured)
    limits = device_limits(protocol.device)
    status = request.status or presentation_status(protocol, request)
    spool = spool_of(file)
    with contextlib.ExitStack() as stack:
        stack.enter_context(stop_on_signals(stop))
        if isinstance(clock, RealClock):
            shown = dataclasses.replace(request, status=status, samples=spool)
            stack.enter_context(listening(shown, stop))
        presented = _on_device(
            protocol, request, status, clock, limits, stop, spool, measured
        )
    return _keep(presented, protocol, request, file, sha256)


def recover(protocol: Protocol, request: GradeRequest, *, file: Path) -> Outcome | None:
    """Return what a process left that died while presenting, as a recording."""
    spool = spool_of(file)
    if not spool.exists():
        return None
    if file.exists():  # it died between the recording and the log
        checksum = sha256_of(file.read_bytes())
        model = request.presentation.model
        return _outcome(read_recording(file), protocol, model, file, checksum)
    presented = cut_off(spool)
    if presented is None:
        spool.unlink()
        return None
    return _keep(presented, protocol, request, file)


def spool_of(file: Path) -> Path:
    """Return where samples are kept until the recording is logged."""
    return file.with_suffix(".partial")


def _on_device(
    protocol: Protocol,
    request: GradeRequest,
    status: PresentationStatus,
    clock: Clock,
    limits: DeviceLimits,
    stop: EmergencyStop,
    spool: Path,
    calibration: Calibration | None,
) -> Presented:
    settings, stretch = protocol.device, protocol.stretch
    model = request.presentation.model
    range_end = joint_model(protocol, model).range_end
    start = math.radians(stretch.start_deg)
    end = min(math.radians(stretch.end_deg), range_end)  # of a contracture sooner
    hand, longest_s = None, 0.0
    if speeds := _hand_speeds(protocol, request):
        hand = _hand(protocol, request.rater, speeds, start, end)
        # A simulated hand that means to be slow gets the time it needs.
        longest_s = 2.0 * (end - start) / min(speeds)
    rules = stretch_rules(protocol.presentation, longest_s)
    with contextlib.ExitStack() as stack:
        device = stack.enter_context(
            open_device(
                settings.backend,
                clock=clock,
                hand=hand,
                range_end=range_end,
                options=backend_options(
                    settings, hand, sensor_seed(protocol, key_of(request))
                ),
            )
        )
        if calibration is not None:
            use_calibration(device, calibration)
        watchdog = watched(device, limits.watchdog_time)
        if watchdog is not None:
            stack.enter_context(watchdog)
        return run_presentation(
            device,
            model_controller(protocol, model),
            clock=clock,
            limits=limits,
            rate_hz=settings.rate_hz,
            max_duration_s=_max_duration_s(protocol.presentation, rules, longest_s),
            end_angle=end,
            stretches=rules,
            status=status,
            stop=stop,
            watchdog=watchdog,
            spool=spool,
        )


def presentation_status(
    protocol: Protocol, request: GradeRequest
) -> PresentationStatus:
    """Return the status of a presentation that has not begun."""
    speeds = _hand_speeds(protocol, request)
    if not speeds or protocol.presentation.stretches != "free":
        return PresentationStatus()
    return StatusOfHand(len(speeds), holds=protocol.simulated_raters.hold_s > 0.0)


def _hand_speeds(protocol: Protocol, request: GradeRequest) -> list[float]:
    # rad/s of the simulated hand, by stretch; none when a person moves the arm
    if not has_simulated_hand(protocol.device):
        return []
    speeds = intended_speeds(protocol, key_of(request))
    return [math.radians(speed) for speed in speeds]


def _hand(
    protocol: Protocol, rater: str, speeds: list[float], start: float, end: float
) -> SimulatedHand:
    settings, (first, *again) = protocol.simulated_raters, speeds
    make: Callable[..., SimulatedHand] = SimulatedHand
    if settings.hand == "person":
        rng = np.random.default_rng(hand_seed(protocol, rater))
        make = functools.partial(HumanHand, HandTraits.sample(rng))
    return make(
        start=start,
        end=end,
        mean_speed=first,
        again=again,
        rest=_REST_S + settings.hold_s,
        # Of a number of stretches the last is over when the arm is brought back
        returns=settings.hold_s > 0.0 or protocol.presentation.stretches != "free",
    )


def _max_duration_s(
    protocol_rules: PresentationRules, rules: StretchRules, longest_s: float
) -> float | None:
    if rules.n != 1:
        return None  # the limits of the rules
    if protocol_rules.stretches == 1:
        return max(_ONE_STRETCH_S, longest_s)
    return rules.stretch_limit  # of the one that is cued


def _keep(
    presented: Presented,
    protocol: Protocol,
    request: GradeRequest,
    file: Path,
    calibration_sha256: str | None = None,
) -> Outcome:
    presentation, recording = request.presentation, presented.recording
    facts: dict[str, Fact] = {
        **recording.facts,
        "study": protocol.study.id,
        "rater": request.rater,
        "session": request.session,
        "code": presentation.code,
        **_named(request),
        "position": presentation.position,
        "attempt": request.attempt,
    }
    if request.rehearsal:
        facts["rehearsal"] = True
    if request.practice:
        facts["practice"] = True
    if calibration_sha256 is not None:
        facts["calibration_sha256"] = calibration_sha256
    checksum = write_recording(dataclasses.replace(recording, facts=facts), file)
    return _outcome(recording, protocol, presentation.model, file, checksum)


def _named(request: GradeRequest) -> dict[str, Fact]:
    # which model it was, unless nobody is to know
    shown = _hidden(request.presentation) if request.sealed else request.presentation
    return {"model": shown.model, "repeat": shown.repeat}


def _outcome(
    recording: Recording, protocol: Protocol, model: str, file: Path, sha256: str
) -> Outcome:
    facts, made = recording.facts, stretches(recording)
    speed, lost = facts["mean_speed_deg_s"], facts.get("grip_lost")
    asked_for = protocol.presentation.stretches
    cues = dict(enumerate(asked_for if isinstance(asked_for, tuple) else (), start=1))
    r1_deg, r2_deg = _tardieu_angles(made, cues, recording)
    felt, fault = None, dict[str, Facts]()
    if facts["fault"] is None:
        start = math.radians(protocol.stretch.start_deg)
        felt = _felt(made, joint_model(protocol, model), start)
    else:
        time_s = float(facts["fault_time_s"] or 0.0)
        fault = {
            "kind": str(facts["fault_kind"]),
            "words": str(facts["fault"]),
            "time_s": time_s,
            "torque_nm": float(facts["fault_torque_nm"] or 0.0),
            "last_200_ms": _before(time_s, recording),
        }
    of_each: list[dict[str, Fact]] = [
        {
            **dataclasses.asdict(stretch),
            "phases": ", ".join(stretch.phases),
            "cue": cues.get(stretch.number),
        }
        for stretch in made
    ]
    beside = file.with_suffix(".json").read_bytes()
    logged: dict[str, Facts] = {
        "recording": f"{file.parent.name}/{file.name}",
        "sha256": sha256,
        "facts_sha256": sha256_of(beside),
        # before the catch; None when the arm never moved
        "mean_speed_deg_s": None if speed is None else float(speed),
        "n_missed_ticks": int(facts["n_missed_ticks"] or 0),
        "fault": fault.get("words"),
        "simulated": bool(facts["simulated"]),
        "stretches": of_each,
        "ended": str(facts["ended"]),
        "n_stretches": len(made),
        "felt": felt,
        # of cued stretches: where a fast one catches, how far a slow one goes
        "r1_deg": r1_deg,
        "r2_deg": r2_deg,
        "grip_lost": None if lost is None else bool(lost),
    }
    return Outcome(logged, fault)


def _before(time_s: float, recording: Recording) -> str:
    # the rows from 200 ms before a fault until the torque was zero, as CSV
    columns = recording.columns
    first = int(np.searchsorted(columns["time_s"], time_s - _BEFORE_FAULT_S))
    lines = [",".join(RECORDING_COLUMNS)]
    for row in range(first, recording.n_samples):
        cells = (
            _FORMATS[name].format(float(columns[name][row]))
            for name in RECORDING_COLUMNS
        )
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"
