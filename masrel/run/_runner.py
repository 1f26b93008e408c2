"""The runner of one session: present, ask for the grade, and log both at once."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import masrel
from masrel._event_log import SessionLog
from masrel.conduct._study_log import stated
from masrel.errors import (
    DeviceError,
    ParameterError,
    SessionLogError,
    SessionStoppedError,
)
from masrel.hess import Clock, EmergencyStop, RealClock, SimulatedClock
from masrel.protocol import Protocol, StudyPaths, presented_hash, protocol_hash
from masrel.recording import _Fact, _Facts
from masrel.run._grade_sources import GradeRequest, GradeSource, Skip, StretchGrade
from masrel.run._present import (
    Outcome,
    fault_fields,
    present,
    presentation_status,
    presented_fields,
    recover,
    spool_of,
)
from masrel.run._rehearsal import RehearsalPaths
from masrel.run._settings import moves_hardware
from masrel.run._state import SessionState, replay
from masrel.schedule import Presentation, Schedule

ClockName = Literal["real", "simulated"]

CLOCKS: dict[str, Callable[[], Clock]] = {
    "real": RealClock,
    "simulated": SimulatedClock,
}
"""The clocks a control loop can run on, by name."""

_FORMAT = 2
_FORMATS = (1, _FORMAT)  # a session begun with one of these is finished as it was begun

# Emergency stops by somebody who wants the process to end; Ctrl-C may be a rater's.
_TERMINATING = ("signal SIGTERM", "signal SIGHUP")


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
        self._n_again = 0
        self._n_faults = 0

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
            n_again=self._n_again,
            n_faults=self._n_faults,
            simulated=self._is_simulated,
            rehearsal=self._is_rehearsal,
            log_file=self._log.path,
        )

    def _rate(self, presentation: Presentation) -> None:
        fields: dict[str, _Fact] = {
            "code": presentation.code,
            "position": presentation.position,
        }
        try:
            grade = self._until_graded(presentation)
        except SessionStoppedError as error:
            self._log.append("stopped", {**fields, "why": str(error)})
            raise
        if isinstance(grade, Skip):
            reasons = stated(who=grade.who, why=grade.why)
            self._log.append("skipped", {**fields, **reasons})
            return
        self._log.append(
            "grade", {**fields, "grade": grade.grade, "stretch": grade.stretch}
        )

    def _until_graded(self, presentation: Presentation) -> StretchGrade | Skip:
        before = self._state.presented.get(presentation.code, [])
        for event in before:  # a process may have died between the log and this
            file = self._study.sessions / str(event.fields["recording"])
            spool_of(file).unlink(missing_ok=True)
        attempt = len(before)
        n_faults, grade = 0, None
        attempt += self._recovered(self._request(presentation, attempt + 1, 0))
        while grade is None:
            attempt += 1
            request = self._request(presentation, attempt, n_faults)
            status = presentation_status(self._protocol, request)
            request = dataclasses.replace(request, status=status)
            self._grades.make_ready(request)
            outcome = self._present(request)
            fault, made = outcome.fault, outcome.made
            n_faults = 0 if fault is None else n_faults + 1
            request = dataclasses.replace(
                request,
                status=None,
                n_faults=n_faults,
                n_stretches=len(made.stretches),
                felt=made.felt if fault is None else None,
            )
            if fault is None:
                grade = self._checked(request, self._grades.grade(request))
                continue
            answer = self._grades.present_again(request, fault.message)
            if isinstance(answer, Skip):
                return answer
            if not answer:
                raise DeviceError(
                    f"session {request.session} of {request.rater}: presentation "
                    f"{presentation.position}, code {presentation.code}, was stopped "
                    f"by a fault: {fault.message}"
                )
        return grade

    def _request(
        self, presentation: Presentation, attempt: int, n_faults: int
    ) -> GradeRequest:
        return GradeRequest(
            rater=self._schedule.rater,
            session=self._schedule.session,
            presentation=presentation,
            n_presentations=len(self._schedule.presentations),
            attempt=attempt,
            n_faults=n_faults,
            rehearsal=self._is_rehearsal,
            rules=self._protocol.presentation,
            may_skip=True,
        )

    def _file(self, request: GradeRequest) -> Path:
        code = request.presentation.code
        file = self._study.recording_file(request.rater, request.session, code)
        if request.attempt > 1:
            return file.with_name(f"{code}-{request.attempt}.npz")
        return file

    def _recovered(self, request: GradeRequest) -> bool:
        # Whether a process died while it presented this, and its data are now logged
        file = self._file(request)
        outcome = recover(self._protocol, request, file=file)
        if outcome is not None:
            self._log_presented(request, outcome, file)
        return outcome is not None

    def _present(self, request: GradeRequest) -> Outcome:
        file = self._file(request)
        # A new one each time, so that the simulated clock starts at zero.
        clock, stop = CLOCKS[self._clock](), EmergencyStop()
        outcome = present(self._protocol, request, clock=clock, file=file, stop=stop)
        self._n_again += request.attempt > 1
        self._log_presented(request, outcome, file)
        if stop.reason in _TERMINATING:
            raise SessionStoppedError(
                f"session {request.session} of {request.rater} was stopped by "
                f"{stop.reason} at presentation {request.presentation.position}; "
                "the same command goes on there"
            )
        return outcome

    def _log_presented(
        self, request: GradeRequest, outcome: Outcome, file: Path
    ) -> None:
        fault = outcome.fault
        self._n_faults += fault is not None
        fields: dict[str, _Facts] = {
            "code": request.presentation.code,
            "position": request.presentation.position,
            "attempt": request.attempt,
        }
        presented = presented_fields(outcome, file, self._study.sessions)
        self._log.append("presented", {**fields, **presented})
        if fault is not None:
            self._log.append("fault", {**fields, **fault_fields(fault, outcome)})
        spool_of(file).unlink(missing_ok=True)  # only now is it of no use

    def _checked(
        self, request: GradeRequest, grade: str | StretchGrade | None
    ) -> StretchGrade | None:
        if grade is None:
            return None
        if isinstance(grade, str):
            grade = StretchGrade(grade=grade)
        grades, code = self._protocol.scale.grades, request.presentation.code
        if grade.grade not in grades:
            raise ParameterError(
                f"grade of {code}: needed one of {', '.join(grades)}, "
                f"got {grade.grade!r}"
            )
        stretch, n_stretches = grade.stretch, request.n_stretches
        if stretch is not None and not 1 <= stretch <= n_stretches:
            raise ParameterError(
                f"stretch of {code}: needed one of {n_stretches}, from 1, got {stretch}"
            )
        return grade
