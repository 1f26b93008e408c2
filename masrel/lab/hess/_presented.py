"""What a presentation leaves: its recording, the facts about it, and its fault."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.lab.hess._spool import Columns, read_spool, recorded_columns
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RAMPS,
    Channel,
    Recording,
    _Fact,
    _main_stretch,
)

_FAULT = RAMPS.index("fault")

# A sensor is stuck, or at the end of its range, that gives one number to the last bit
# for so long while the torque that is sent changes by so much; what it is still on its
# way to at the end of that time does not count.
_STUCK_S = 0.1
_STUCK_NM = 1.0
_LAG_S = 0.01


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
        **_channel_facts(columns, channels),
    }
    recording = Recording(columns=columns, facts=facts, channels=channels)
    felt = _main_stretch(recording)
    of_the_stretch: dict[str, _Fact] = {
        "phases": "" if felt is None else ", ".join(felt.phases),
        "catch_angle_deg": None if felt is None else felt.catch_angle_deg,
        "mean_speed_deg_s": None if felt is None else felt.mean_speed_deg_s,
    }
    return Presented(
        recording=replace(recording, facts={**facts, **of_the_stretch}),
        fault=fault,
        n_missed_ticks=n_missed_ticks,
    )


def _channel_facts(columns: Columns, channels: tuple[Channel, ...]) -> dict[str, _Fact]:
    # how many numbers each channel missed, and in words what failed: looked at once it
    # is over, for the loop does not act on channels
    if not channels:
        return {}
    read = columns["ramp"] != _FAULT  # the ramp after a fault has no readings
    n_read = int(np.count_nonzero(read))
    facts: dict[str, _Fact] = {}
    faults = []
    for channel in channels:
        name = channel.column
        n_missing = int(np.count_nonzero(np.isnan(columns[name][read])))
        facts[f"n_missing_{name}"] = n_missing
        if n_missing:
            faults.append(f"{name}: no number in {n_missing} of {n_read} samples")
    if MEASURED_TORQUE in channels:
        faults += _stuck({name: column[read] for name, column in columns.items()})
    facts["channel_faults"] = "; ".join(faults) or None
    return facts


def _stuck(columns: Columns) -> list[str]:
    # where the torque sensor stays while the torque does not
    time, sent = columns["time_s"], columns["command_torque_nm"]
    name = MEASURED_TORQUE.column
    worst = max(
        (
            (float(np.ptp(sent[first:last])), first, last)
            for first, last in _long_runs(time, columns[name])
        ),
        default=(0.0, 0, 0),
    )
    change, first, last = worst
    if change <= _STUCK_NM:
        return []
    return [
        f"{name}: stays at {columns[name][first]:.2f} N·m for "
        f"{time[last] - time[first]:.2f} s while the torque that is sent changes by "
        f"{change:.2f} N·m"
    ]


def _long_runs(
    time: NDArray[np.float64], values: NDArray[np.float64]
) -> list[tuple[int, int]]:
    # first sample of each long run of equal numbers, and where its last moment begins
    starts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    lasts = np.append(starts, values.size)[1:] - 1
    runs = []
    for first, last in zip(starts.tolist(), lasts.tolist(), strict=True):
        if time[last] - time[first] >= _STUCK_S:
            shorter = np.searchsorted(time, time[last] - _LAG_S, side="right")
            runs.append((first, int(shorter)))
    return runs
