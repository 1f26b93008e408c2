"""The runner of one session: present, ask for the grade, and log both at once."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import masrel
from masrel.errors import SessionLogError, SessionStoppedError
from masrel.lab._event_log import SessionLog
from masrel.lab.conduct._study_log import stated
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash, protocol_hash
from masrel.lab.recording import _Fact, _Facts
from masrel.lab.run._corrections import correct_in_session
from masrel.lab.run._days import days_since, interval_fields, last_time
from masrel.lab.run._grade_sources import (
    GradeCorrection,
    GradeRequest,
    GradeSource,
    Skip,
    with_occasions,
)
from masrel.lab.run._practice import practice_presentations
from masrel.lab.run._presenter import CLOCKS, ClockName, Presenter
from masrel.lab.run._questionnaires import ask_questions
from masrel.lab.run._rehearsal import RehearsalPaths
from masrel.lab.run._settings import moves_hardware
from masrel.lab.run._state import FORMAT, SessionState, may_go_on, replay
from masrel.lab.schedule import Presentation, Schedule


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
    n_set_aside : int
        Grades that count no more, as the session began anew.
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
    n_set_aside: int
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
        now: Callable[[], datetime],
    ) -> None:
        self._study = study
        self._protocol = protocol
        self._schedule = schedule
        self._grades = with_occasions(grades, protocol)
        self._clock = clock
        self._log = log
        self._now = now
        self._state: SessionState = replay(log.path, log.events)
        self._practice = practice_presentations(protocol)
        occasion = f"session {schedule.session} of {schedule.rater}"
        named_by = ("code", "position")
        self._presenter = Presenter(
            protocol, grades, clock, log, occasion=occasion, named_by=named_by
        )
        self._practice_presenter = Presenter(
            protocol,
            grades,
            clock,
            log,
            occasion=f"practice of {occasion}",
            named_by=named_by,
            known_by=("model",),  # it has no schedule that says so
            kind="practised",
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
        same: dict[str, _Facts] = {
            "format": FORMAT,
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
            interval = self._interval()  # before there is anything of the session
            self._log.append("session", {**same, **provenance})
            if interval is not None:
                self._log.append("interval", interval)
            return
        same["format"] = header["format"]  # it is finished as it was begun
        for name in ("grades", *same):  # which says most comes first
            value = same[name]
            begun = header.get(name, False)  # there once were no rehearsals
            if begun != value and not (name == "grades" and may_go_on(begun, value)):
                raise SessionLogError(
                    f"{self._log.path}: begun with {name} = {begun}: needed "
                    f"the same to go on, got {value}"
                )
        if not self._state.is_complete:
            kind = "restarted" if self._begins_anew() else "resumed"
            provenance["n_graded"] = len(self._state.grades)
            self._log.append(kind, {**provenance, "grades": self._grades.name})
            self._state = replay(self._log.path, self._log.events)

    def _interval(self) -> dict[str, _Fact] | None:
        if self._is_rehearsal:
            return None
        rater, session = self._schedule.rater, self._schedule.session
        return interval_fields(self._study, self._protocol, rater, session, self._now)

    def _begins_anew(self) -> bool:
        # by the protocol's policy, once a model was presented
        policy = self._protocol.occasions.resume
        if policy == "always" or self._is_rehearsal or not self._state.presented:
            return False
        last = last_time(self._log.events)
        days = days_since(last, self._now)
        if policy == "same-day" and days != 0:
            raise SessionLogError(
                f"{self._log.path}: was left on {last[:10]}: needed to go on on the "
                'same day, as the protocol has occasions.resume = "same-day"; with '
                '"always" it goes on, with "restart" it begins anew'
            )
        restart = policy == "restart"
        if policy == "ask":
            comes_next = next(
                (p for p in self._shown if p.code not in self._state.settled),
                self._shown[-1],
            )
            with self._stop_logged(comes_next):
                request = self._request(comes_next)
                restart = self._grades.begins_anew(request, days)
        self._log.append(
            "aged",
            {
                "last_event_utc": last,
                "days": days,
                "resume": policy,
                "restart": restart,
            },
        )
        return restart

    @property
    def _shown(self) -> tuple[Presentation, ...]:
        return self._schedule.presentations

    def run(self, progress: Callable[[Presentation], object] | None) -> SessionSummary:
        """Present and ask until every presentation has its grade or is skipped."""
        n_graded_before = len(self._state.grades)
        if not self._state.is_complete:
            self._prepare()
        for presentation in self._shown:
            if presentation.code not in self._state.settled:
                self._take_break(presentation)
                self._rate(presentation)
            elif not self._state.is_complete:
                self._ask(presentation)  # what a process died before
            if progress is not None:
                progress(presentation)
        if not self._state.is_complete:
            self._ask(None)
            self._log.append("complete", {"n_presentations": len(self._shown)})
        state = replay(self._log.path, self._log.events)
        presenters = (self._presenter, self._practice_presenter)
        return SessionSummary(
            rater=self._schedule.rater,
            session=self._schedule.session,
            n_presentations=len(self._shown),
            n_graded=len(state.grades),
            n_graded_before=n_graded_before,
            n_again=sum(presenter.n_again for presenter in presenters),
            n_faults=sum(presenter.n_faults for presenter in presenters),
            n_set_aside=state.n_set_aside,
            simulated=self._is_simulated,
            rehearsal=self._is_rehearsal,
            log_file=self._log.path,
        )

    def _prepare(self) -> None:
        # instructions and practice, once
        text = self._protocol.occasions.instructions
        if text and not (self._state.is_instructed or self._state.presented):
            first = (*self._practice, *self._shown)[0]
            with self._stop_logged(first):
                self._grades.instruct(self._request(first), text)
            self._log.append("instructed", {"text": text})
        for presentation in self._practice:
            if presentation.code not in self._state.practice.settled:
                self._rate_by(self._practice_presenter, presentation, "practice-")

    def _take_break(self, presentation: Presentation) -> None:
        occasions, after = self._protocol.occasions, presentation.position - 1
        every = occasions.break_after
        if every is None or not after or after % every or after in self._state.breaks:
            return
        clock = CLOCKS[self._clock]()
        begun = clock.now_ns()
        with self._stop_logged(presentation):
            request = self._request(presentation)
            self._grades.take_break(request, occasions.break_minutes)
        fields: dict[str, _Fact] = {
            "after": after,
            "minutes": occasions.break_minutes,
            "lasted_s": round((clock.now_ns() - begun) * 1e-9, 3),
        }
        self._log.append("break", fields)

    def _rate(self, presentation: Presentation) -> None:
        if self._rate_by(self._presenter, presentation, ""):
            self._ask(presentation)

    def _rate_by(
        self, presenter: Presenter, presentation: Presentation, prefix: str
    ) -> bool:
        # whether it was graded, not skipped
        fields: dict[str, _Fact] = {
            "code": presentation.code,
            "position": presentation.position,
        }
        grade = presenter.rate(self._request(presentation))
        if isinstance(grade, Skip):
            reasons = stated(who=grade.who, why=grade.why)
            self._log.append(f"{prefix}skipped", {**fields, **reasons})
            return False
        self._log.append(
            f"{prefix}grade",
            {**fields, "grade": grade.grade, "stretch": grade.stretch},
        )
        return True

    def _ask(self, presentation: Presentation | None) -> None:
        # the questions about a presentation that was graded here, or the session
        code = None if presentation is None else presentation.code
        if code in self._state.settled and code not in self._state.first_grades:
            return
        with self._stop_logged(presentation or self._shown[-1]):
            ask_questions(
                self._protocol,
                "session" if presentation is None else "presentation",
                self._grades,
                rater=self._schedule.rater,
                session=self._schedule.session,
                presentation=presentation,
                answered={key[:2] for key in self._state.answers if key[2] == code},
                correct=self.correct,
                log=lambda fields: self._log.append(
                    "answered", {**fields, "code": code}
                ),
            )

    @contextmanager
    def _stop_logged(self, presentation: Presentation) -> Iterator[None]:
        try:
            yield
        except SessionStoppedError as error:
            fields: dict[str, _Fact] = {
                "code": presentation.code,
                "position": presentation.position,
                "why": str(error),
            }
            self._log.append("stopped", fields)
            raise

    def _request(self, presentation: Presentation) -> GradeRequest:
        is_practice = presentation in self._practice
        return GradeRequest(
            rater=self._schedule.rater,
            session=self._schedule.session,
            presentation=presentation,
            n_presentations=len(
                self._practice if is_practice else self._schedule.presentations
            ),
            attempt=1,
            practice=is_practice,
            rehearsal=self._is_rehearsal,
            rules=self._protocol.presentation,
            may_skip=True,
            correct=self.correct,
            last=self._last_grade(),
        )

    def correct(self, correction: GradeCorrection) -> None:
        """Correct a grade of the session while it goes on."""
        correct_in_session(self._log, self._protocol, correction)

    def _last_grade(self) -> tuple[str, str | None] | None:
        state = replay(self._log.path, self._log.events)
        code = next(reversed(state.first_grades), None)
        return None if code is None else (code, state.grades.get(code))
