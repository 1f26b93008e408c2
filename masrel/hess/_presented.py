"""What a presentation leaves: its recording, the facts about it, and its fault."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from masrel.hess._channels import channel_facts
from masrel.hess._spool import Columns, read_spool, recorded_columns
from masrel.recording import PHASES, RAMPS, Channel, Recording, _Fact

_CATCH, _END = PHASES.index("catch"), RAMPS.index("end")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What stopped a presentation.

    Attributes
    ----------
    kind : str
        One word: a limit such as ``"torque"``, ``"frozen"`` or ``"overrun"``,
        ``"no-answer"``, ``"device"``, ``"model"``, ``"controller"`` or
        ``"emergency-stop"``.
    message : str
        What was needed and what came.
    time_s : float
        When it was noticed, s since the presentation began.
    torque_nm : float
        The torque that the device held then, N·m.
    """

    kind: str
    message: str
    time_s: float
    torque_nm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Presented:
    """One presentation, as it went.

    Attributes
    ----------
    recording : Recording
        Every tick that was run; its facts repeat the fields below.
    fault : Fault or None
        What stopped it; None when nothing did.
    n_missed_ticks : int
        Ticks skipped because the loop came too late for them.
    """

    recording: Recording
    fault: Fault | None
    n_missed_ticks: int


def cut_off(spool: Path) -> Presented | None:
    """Read what a presentation left whose process died.

    Parameters
    ----------
    spool : Path
        The file that `run_presentation` kept its samples in.

    Returns
    -------
    Presented or None
        Its recording, with a fault that says so; None when it had not begun.

    Raises
    ------
    RecordingError
        If it is no such file.
    """
    left = read_spool(spool)
    if left is None:
        return None
    threshold = float(left.facts.pop("speed_threshold") or 0.0)
    columns = recorded_columns(left.columns, left.channels)
    time_s = columns["time_s"]
    fault = Fault(
        kind="process",
        message="process: needs one that keeps its recording, this one ended before",
        time_s=float(time_s[-1]),
        torque_nm=float(columns["command_torque_nm"][-1]),
    )
    # What is missing between the first and the last tick; nobody counted why
    n_due = round(float(np.ptp(time_s)) * float(left.facts["rate_hz"] or 0))
    return as_presented(
        columns,
        {**left.facts, "scheduling": None},
        channels=left.channels,
        speed_threshold=threshold,
        ended="fault",
        fault=fault,
        grip_lost=None,
        n_missed_ticks=max(0, n_due + 1 - time_s.size),  # a ramp adds rows
        n_missed_replies=None,
    )


def as_presented(
    columns: Columns,
    facts: dict[str, _Fact],
    *,
    channels: tuple[Channel, ...] = (),
    speed_threshold: float,
    ended: str,
    fault: Fault | None,
    grip_lost: bool | None,
    n_missed_ticks: int,
    n_missed_replies: int | None,
) -> Presented:
    """Add what is known of a presentation once it is over; None for what is not."""
    facts = {
        **facts,
        "n_missed_ticks": n_missed_ticks,
        "n_missed_replies": n_missed_replies,
        "fault": fault.message if fault else None,
        "fault_kind": fault.kind if fault else None,
        "fault_time_s": fault.time_s if fault else None,
        "fault_torque_nm": fault.torque_nm if fault else None,
        "ended": ended,
        "grip_lost": grip_lost,
        **movement_facts(columns, speed_threshold, fault is not None),
        **channel_facts(columns, channels),
    }
    return Presented(
        recording=Recording(columns=columns, facts=facts, channels=channels),
        fault=fault,
        n_missed_ticks=n_missed_ticks,
    )


def movement_facts(
    columns: Columns, speed_threshold: float, stopped: bool
) -> dict[str, _Fact]:
    """Return the phases, the catch and the mean speed of a movement."""
    # What the law did while the torque was taken away at the end, nobody felt.
    n_felt = int(np.count_nonzero(columns["ramp"] != _END))
    columns = {name: column[:n_felt] for name, column in columns.items()}
    catch = catch_angle_deg(columns)
    # A stretch that was stopped before the catch has no mean speed of its own.
    has_speed = not stopped or catch is not None
    return {
        "phases": ", ".join(phase_sequence(columns)),
        "catch_angle_deg": catch,
        "mean_speed_deg_s": (
            mean_speed_deg_s(columns, speed_threshold) if has_speed else None
        ),
    }


def phase_sequence(columns: Columns) -> tuple[str, ...]:
    """Return the names of the phases in the order they came."""
    codes = columns["phase"].astype(np.int64)
    if codes.size == 0:
        return ()
    changes = np.flatnonzero(np.diff(codes)) + 1
    return tuple(PHASES[codes[index]] for index in (0, *changes))


def catch_angle_deg(columns: Columns) -> float | None:
    """Return the angle where the first catch began."""
    catches = np.flatnonzero(columns["phase"] == _CATCH)
    return float(columns["angle_deg"][catches[0]]) if catches.size else None


def mean_speed_deg_s(columns: Columns, speed_threshold: float) -> float | None:
    """Return the mean speed before the catch, as Table V reports it."""
    # Angle travelled over time, deg/s, from the onset to the first catch: v̄ of (2). An
    # arm that was slower than ν_th in between has begun anew. Without a catch, from the
    # first to the last sample at ν_th or above; None without extension.
    moving = columns["velocity_deg_s"] >= math.degrees(speed_threshold)
    catches = np.flatnonzero(columns["phase"] == _CATCH)
    if catches.size:
        last = int(catches[0])
        slower = np.flatnonzero(~moving[:last])
        onset = int(slower[-1]) + 1 if slower.size else 0
    else:
        fast = np.flatnonzero(moving)
        onset, last = (int(fast[0]), int(fast[-1])) if fast.size else (0, 0)
    if last <= onset:
        return None
    travel = columns["angle_deg"][last] - columns["angle_deg"][onset]
    return float(travel / (columns["time_s"][last] - columns["time_s"][onset]))
