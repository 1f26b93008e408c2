"""What a presentation leaves on disk: its recording, or what a dead process left."""

import dataclasses
import os
from dataclasses import dataclass
from pathlib import Path

from masrel.hess import Presented, cut_off
from masrel.protocol import Protocol
from masrel.recording import write_recording
from masrel.run.chain import Fact
from masrel.run.fault import FaultRecord, fault_record
from masrel.run.grades import Asked

__all__ = ["Shown", "keep", "recover", "spool_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What a presentation left."""

    sha256: str  # checksum of the recording
    # mean speed before the catch, deg/s; None when the arm never moved
    mean_speed_deg_s: float | None
    n_missed_ticks: int  # ticks the loop skipped
    fault: FaultRecord | None  # what stopped it, or None
    simulated: bool  # whether no hardware moved


def spool_of(file: Path) -> Path:
    """Return where samples are kept while the recording is made."""
    return file.with_suffix(".partial")


def recover(protocol: Protocol, asked: Asked, *, file: Path) -> Shown | None:
    """Make a recording of what a process left that died while presenting."""
    spool = spool_of(file)
    if not spool.exists():
        return None
    presented = cut_off(spool)
    if presented is None:
        spool.unlink()
        return None
    return keep(presented, protocol, asked, file)


def keep(presented: Presented, protocol: Protocol, asked: Asked, file: Path) -> Shown:
    """Write a recording, and remove what was kept while it was made."""
    shown, recording = asked.presentation, presented.recording
    facts: dict[str, Fact] = {
        **recording.facts,
        "study": protocol.study.id,
        "rater": asked.rater,
        "session": asked.session,
        "code": shown.code,
        "model": shown.model,
        "repeat": shown.repeat,
        "position": shown.position,
        "attempt": asked.attempt,
    }
    try:
        checksum = write_recording(dataclasses.replace(recording, facts=facts), file)
    except OSError as error:
        error.filename = str(file)  # a full disk does not say which file it was
        raise
    for written in (file, file.with_suffix(".json")):
        _sync(written)  # before the log says that they are there
    spool_of(file).unlink(missing_ok=True)  # only now is it of no use
    speed = facts["mean_speed_deg_s"]
    return Shown(
        sha256=checksum,
        mean_speed_deg_s=None if speed is None else float(speed),
        n_missed_ticks=presented.n_missed_ticks,
        fault=fault_record(presented),
        simulated=bool(facts["simulated"]),
    )


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
