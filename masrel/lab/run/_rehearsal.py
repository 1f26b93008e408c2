"""What is never among the ratings: practice, and rehearsals in folders of their own."""

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import msgspec

from masrel.lab.protocol import Protocol, StudyPaths, presented_hash
from masrel.lab.schedule._secret import StudySecret, find_secret, new_secret
from masrel.lab.schedule.presentation import Presentation, Schedule, draw_schedule

_COMPLETE = b'{"event": "complete"'  # how the last line of a finished log begins


def practice_presentations(protocol: Protocol) -> tuple[Presentation, ...]:
    """Return what comes before the first presentation of a schedule."""
    # A schedule's codes begin with digits; a code that is a model's id would name it.
    ids = {model.id.upper() for model in protocol.models}
    codes = (code for n in count(1) if (code := f"P{n}") not in ids)
    return tuple(
        Presentation(position=place, code=code, model=model, repeat=0)
        for place, (model, code) in enumerate(
            zip(protocol.occasions.practice, codes, strict=False), start=1
        )
    )


@dataclass(frozen=True, slots=True)
class RehearsalPaths(StudyPaths):
    """The folder of a study, whose sessions are those of its nth rehearsal."""

    number: int

    @property
    def sessions(self) -> Path:
        """The folder of the rehearsal's logs and recordings."""
        return self.rehearsals / str(self.number)

    def log_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's log."""
        return self.sessions / f"rehearsal_{session}_{rater}.jsonl"


def begin_rehearsal(
    study: StudyPaths, protocol: Protocol, rater: str, session: str
) -> tuple[RehearsalPaths, Schedule, str]:
    """Return the rehearsal that is not finished, or a new one."""
    # Its folder, an order and codes that no session has, and their hash
    secret = find_secret(study) or new_secret(study)
    rehearsals = (
        (RehearsalPaths(study.root, n), *_draw(protocol, rater, session, n, secret))
        for n in count(1)
    )
    return next(
        (paths, schedule, checksum)
        for paths, schedule, checksum in rehearsals
        if not _is_over(paths.log_file(rater, session), checksum)
    )


def last_rehearsal(study: StudyPaths, rater: str, session: str) -> Path | None:
    """Return the log that a rehearsal was last written to; None without one."""
    name = RehearsalPaths(study.root, 1).log_file(rater, session).name
    logs = study.rehearsals.glob(f"*/{name}")
    return max(logs, key=lambda log: log.stat().st_mtime_ns, default=None)


def drawn_rehearsal(
    paths: RehearsalPaths, protocol: Protocol, rater: str, session: str
) -> tuple[Schedule, str] | None:
    """Return what a rehearsal presents, and its hash; None without a secret."""
    secret = find_secret(paths)
    if secret is None:
        return None
    schedule, checksum = _draw(protocol, rater, session, paths.number, secret)
    sha256 = presented_hash(protocol)  # by its log; it has a seed of its own
    return dataclasses.replace(schedule, presented_sha256=sha256), checksum


def _is_over(log: Path, checksum: str) -> bool:
    """Return whether a log is complete, or of another draw: of another secret, say."""
    data = log.read_bytes() if log.exists() else b""
    is_begun = b"\n" in data
    return is_begun and (_COMPLETE in data or checksum.encode() not in data)


def _draw(
    protocol: Protocol, rater: str, session: str, number: int, secret: StudySecret
) -> tuple[Schedule, str]:
    # and the hash that its log has for that of a schedule's file
    name = json.dumps([protocol.schedule.seed, "rehearsal", number])
    seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") >> 1
    scheme = msgspec.structs.replace(
        protocol.schedule, seed=seed, scheme="random-order"
    )
    of_rehearsal = msgspec.structs.replace(protocol, schedule=scheme)
    schedule = draw_schedule(of_rehearsal, rater, session, secret=secret)
    shown = [[p.code, p.model, p.repeat] for p in schedule.presentations]
    return schedule, hashlib.sha256(json.dumps(shown).encode()).hexdigest()
