"""Rehearsals of a session: in a folder of their own, and never among the ratings."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import msgspec

from masrel.protocol import Protocol, StudyPaths
from masrel.schedule import Schedule, draw_schedule

_COMPLETE = b'{"event": "complete"'  # how the last line of a finished log begins


@dataclass(frozen=True, slots=True)
class RehearsalPaths(StudyPaths):
    """The folder of a study, whose sessions are those of its nth rehearsal."""

    number: int

    @property
    def sessions(self) -> Path:
        """The folder of the rehearsal's logs and recordings."""
        return self.root / "rehearsals" / str(self.number)

    def log_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's log."""
        return self.sessions / f"rehearsal_{session}_{rater}.jsonl"

    def recording_file(self, rater: str, session: str, code: str) -> Path:
        """Return the file of the recording of one presentation."""
        return self.sessions / f"rehearsal_{session}_{rater}" / f"{code}.npz"


def next_rehearsal(study: StudyPaths, rater: str, session: str) -> RehearsalPaths:
    """Return the rehearsal that is not finished, or a new one."""
    paths = RehearsalPaths(study.root, 1)
    while _is_complete(paths.log_file(rater, session)):
        paths = RehearsalPaths(study.root, paths.number + 1)
    return paths


def _is_complete(log: Path) -> bool:
    return log.exists() and _COMPLETE in log.read_bytes()


def rehearsal_schedule(
    protocol: Protocol, rater: str, session: str, number: int
) -> tuple[Schedule, str]:
    """Draw an order and codes that no session has, and return them with their hash."""
    name = json.dumps([protocol.schedule.seed, "rehearsal", number])
    seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") >> 1
    scheme = msgspec.structs.replace(protocol.schedule, seed=seed)
    drawn = draw_schedule(
        msgspec.structs.replace(protocol, schedule=scheme), rater, session
    )
    shown = json.dumps([[p.code, p.model, p.repeat] for p in drawn.presentations])
    return drawn, hashlib.sha256(shown.encode()).hexdigest()
