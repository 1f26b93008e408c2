"""The runner of one session: present, ask for the grade, and log both at once."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import masrel
from masrel._event_log import SessionLog
from masrel.conduct._study_log import stated
from masrel.errors import SessionLogError
from masrel.protocol import Protocol, StudyPaths, presented_hash, protocol_hash
from masrel.recording import _Fact
from masrel.run._grade_sources import GradeRequest, GradeSource, Skip
from masrel.run._presenter import ClockName, Presenter
from masrel.run._rehearsal import RehearsalPaths
from masrel.run._settings import moves_hardware
from masrel.run._state import SessionState, replay
from masrel.schedule import Presentation, Schedule

_FORMAT = 2
_FORMATS = (1, _FORMAT)  # a session begun with one of these is finished as it was begun


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionSummary:
    """What came of running a session.

    Attributes
    ----------
    rater, session : str
        Whose session.
    n_presentations : int
        Presentations of the schedule.
    n_graded : int
        Those that have a grade: all but those skipped or corrected to missing.
    n_graded_before : int
        Those already graded when it was started.
    n_again : int
        Presentations beyond the first of a code, in this run.
    n_faults : int
        Presentations a fault stopped, in this run.
    simulated : bool
        Whether grades or device are simulated.
    rehearsal : bool
        Whether it was a rehearsal, of which nothing enters the study's ratings.
    log_file : Path
        Its log.
    """

    rater: str
    session: str
    n_presentations: int
    n_graded: int
    n_graded_before: int
    n_again: int
    n_faults: int
    simulated: bool
    rehearsal: bool
    log_file: Path


class SessionRunner:
    """One run of one session; what it does is on disk before it goes on."""

    def __init__(
        self,
        study: StudyPaths,
        protocol: Protocol,
        schedule: Schedule,
        grades: GradeSource,
        clock: ClockName,
        log: SessionLog,
    ) -> None:
        self._study = study
        self._protocol = protocol
        self._schedule = schedule
        self._grades = grades
        self._clock = clock
        self._log = log
        self._state: SessionState = replay(log.path, log.events)
        self._n_graded_before = len(self._state.grades)
        self._presenter = Presenter(
            protocol,
            grades,
            clock,
            log,
            occasion=f"session {schedule.session} of {schedule.rater}",
            named_by=("code", "position"),
        )

    @property
    def _is_simulated(self) -> bool:
        return self._grades.simulated or not moves_hardware(self._protocol.device)

    @property
    def _is_rehearsal(self) -> bool:
        return isinstance(self._study, RehearsalPaths)

    def begin(self, schedule_sha256: str) -> None:
        """Log which session this is; check that it is the same when it is resumed."""
        protocol, schedule = self._protocol, self._schedule
        same: dict[str, _Fact] = {
            "format": _FORMAT,
            "study": protocol.study.id,
            "rater": schedule.rater,
            "session": schedule.session,
            "presented_sha256": presented_hash(protocol),
            "schedule_sha256": schedule_sha256,
            "simulated": self._is_simulated,
            "grades": self._grades.name,
            "device": protocol.device.backend,
            "rehearsal": self._is_rehearsal,
        }
        provenance: dict[str, _Fact] = {
            "protocol_sha256": protocol_hash(protocol),
            "clock": self._clock,
            "masrel_version": masrel.__version__,
        }
        header = self._state.header
        if not header:
            self._log.append("session", {**same, **provenance})
            return
        if header["format"] in _FORMATS:
            same["format"] = header["format"]
        for name, value in same.items():
            begun = header.get(name, False)  # there once were no rehearsals
            if begun != value:
                raise SessionLogError(
                    f"{self._log.path}: begun with {name} = {begun}: needed "
                    f"the same to go on, got {value}"
                )
        if not self._state.is_complete:
            self._log.append(
                "resumed", {**provenance, "n_graded": self._n_graded_before}
            )

    def run(self, progress: Callable[[Presentation], object] | None) -> SessionSummary:
        """Present and ask until every presentation has its grade or is skipped."""
        schedule = self._schedule
        for presentation in schedule.presentations:
            if presentation.code not in self._state.settled:
                self._rate(presentation)
            if progress is not None:
                progress(presentation)
        if not self._state.is_complete:
            n_presentations = len(schedule.presentations)
            self._log.append("complete", {"n_presentations": n_presentations})
        return SessionSummary(
            rater=schedule.rater,
            session=schedule.session,
            n_presentations=len(schedule.presentations),
            n_graded=len(replay(self._log.path, self._log.events).grades),
            n_graded_before=self._n_graded_before,
            n_again=self._presenter.n_again,
            n_faults=self._presenter.n_faults,
            simulated=self._is_simulated,
            rehearsal=self._is_rehearsal,
            log_file=self._log.path,
        )

    def _rate(self, presentation: Presentation) -> None:
        fields: dict[str, _Fact] = {
            "code": presentation.code,
            "position": presentation.position,
        }
        grade = self._presenter.rate(self._request(presentation))
        if isinstance(grade, Skip):
            reasons = stated(who=grade.who, why=grade.why)
            self._log.append("skipped", {**fields, **reasons})
            return
        self._log.append(
            "grade", {**fields, "grade": grade.grade, "stretch": grade.stretch}
        )

    def _request(self, presentation: Presentation) -> GradeRequest:
        return GradeRequest(
            rater=self._schedule.rater,
            session=self._schedule.session,
            presentation=presentation,
            n_presentations=len(self._schedule.presentations),
            attempt=1,
            rehearsal=self._is_rehearsal,
            rules=self._protocol.presentation,
            may_skip=True,
        )
