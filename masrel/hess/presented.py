"""What a presentation leaves: when it ends, and when its process does."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from masrel.hess.fault import Fault
from masrel.hess.movement import movement_facts
from masrel.hess.samples import recorded_columns
from masrel.hess.spool import read_spool
from masrel.recording import Fact, Recording

__all__ = ["Presented", "cut_off", "fault_facts"]


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
        What `run_presentation` was given.

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
    columns = recorded_columns(left.columns)
    fault = Fault(
        kind="process",
        words="process: needs one that keeps its recording, this one ended before",
        time_s=float(columns["time_s"][-1]),
        torque_nm=float(columns["command_torque_nm"][-1]),
    )
    # What is missing between the first and the last tick; nobody counted why
    n_due = round(float(np.ptp(columns["time_s"])) * float(left.facts["rate_hz"] or 0))
    n_missed = max(0, n_due + 1 - columns["time_s"].size)  # a ramp adds rows
    facts: dict[str, Fact] = {
        **left.facts,
        "scheduling": None,
        "n_missed_ticks": n_missed,
        "n_missed_replies": None,
        **fault_facts(fault),
        "ended": "fault",
        "grip_lost": None,
        **movement_facts(columns, threshold, True),
    }
    recording = Recording(columns=columns, facts=facts)
    return Presented(recording=recording, fault=fault, n_missed_ticks=n_missed)


def fault_facts(fault: Fault | None) -> dict[str, Fact]:
    """Return what a recording's facts say of a fault."""
    if fault is None:
        return {
            "fault": None,
            "fault_kind": None,
            "fault_time_s": None,
            "fault_torque_nm": None,
        }
    return {
        "fault": fault.words,
        "fault_kind": fault.kind,
        "fault_time_s": fault.time_s,
        "fault_torque_nm": fault.torque_nm,
    }
