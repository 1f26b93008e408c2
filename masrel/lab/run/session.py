"""Run one session, from its schedule to the last grade.

Started again, a session resumes where its log ends: what has a grade keeps it, and
what was presented but not graded is presented again and logged as another attempt.
"""

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from masrel._files import check_inside
from masrel.errors import (
    ParameterError,
    ProtocolError,
    SessionLogError,
)
from masrel.lab._event_log import Event, SessionLog, utc_now
from masrel.lab._study_files import Facts, sha256_of
from masrel.lab.conduct._statements import refuse_withdrawn
from masrel.lab.conduct._study_log import (
    append_event,
    check_choice,
    recover_conduct,
    stated,
    study_answers,
)
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash
from masrel.lab.protocol._values import questions_of
from masrel.lab.protocol.content import _refuse_unknown_coefficients
from masrel.lab.run._corrections import correct_in_session
from masrel.lab.run._days import (
    completed_on,
    days_since,
    interval_fields,
    last_time,
)
from masrel.lab.run._grade_sources import (
    GradeRequest,
    GradeSource,
    OnSheet,
    Skip,
    ask_questions,
)
from masrel.lab.run._present import spool_of
from masrel.lab.run._presenter import CLOCKS, ClockName, Presenter, check_same
from masrel.lab.run._rehearsal import (
    RehearsalPaths,
    begin_rehearsal,
    practice_presentations,
)
from masrel.lab.run._settings import (
    check_backend,
    has_simulated_hand,
    torque_problems,
)
from masrel.lab.run._state import (
    FORMAT,
    FROM_PAPER,
    CodesState,
    SessionState,
    replay,
)
from masrel.lab.schedule.presentation import Presentation, Schedule
from masrel.lab.schedule.sheets import _drawn_schedule

__all__ = ["SessionSummary", "run_session"]


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
    simulated : bool
        Whether grades or device are simulated.
    n_set_aside : int
        Grades that no longer count, because the session was started again.
    rehearsal : bool
        Whether it was a rehearsal, whose grades are not ratings of the study.
    log_file : Path
        Its log.
    """

    rater: str
    session: str
    n_presentations: int
    n_graded: int
    n_set_aside: int
    simulated: bool
    rehearsal: bool
    log_file: Path


def run_session(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    grades: GradeSource,
    clock: ClockName,
    rehearsal: bool = False,
    progress: Callable[[Presentation], object] | None = None,
    now: Callable[[], datetime] = utc_now,
) -> SessionSummary:
    """Run one rater's session to its end, or resume it.

    A rehearsal has an order and codes of its own, and leaves its log and recordings in
    ``rehearsals/``: nothing of it enters the study's ratings. When it is complete, the
    next one is another.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; its schedules are drawn.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session.
    grades : GradeSource
        Where grades come from.
    clock : {"real", "simulated"}
        The clock of the control loop; "simulated" needs a simulated hand.
    rehearsal : bool, optional
        Whether to rehearse; no schedule need be drawn.
    progress : callable, optional
        Called with each presentation once it has its grade; at once for those
        that have it already.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    SessionSummary
        What came of it. A complete session is left as it is.

    Raises
    ------
    ScheduleError
        If the schedule is missing, damaged, foreign, or stale.
    SessionLogError
        If the log is damaged, of another schedule or protocol, was begun with
        another device or source of grades (console and browser resume one another's),
        was left on another day and may not be resumed, or is open elsewhere, or if
        there are recordings of the session that it does not name.
    ProtocolError
        If a model asks for more torque than the device may send, or a line of the plan
        names no coefficient.
    ParameterError
        If the device or `clock` is unknown or they do not fit each other, the rater
        was withdrawn, the session may not begin yet or any more, or the source is
        none, or gives a grade or an answer that cannot be.
    DeviceError
        If the device cannot be used, or faults are not to be tried again.
    SessionStoppedError
        If the person stops. As after all of these but the first two, the same
        call resumes where this one ended.
    OSError
        If log or recording cannot be written.

    Warns
    -----
    OverrunWarning
        If the control loop missed ticks.
    MasrelWarning
        If the session begins out of order, and the protocol lets it.
    """
    if not isinstance(grades, GradeSource):
        raise ParameterError(
            f"grades: needed a GradeSource, got {type(grades).__name__}"
        )
    _refuse_unknown_coefficients(protocol, study.protocol)
    _check_device(clock, protocol)
    recover_conduct(study)
    refuse_withdrawn(study, rater)
    if rehearsal:
        begun = begin_rehearsal(study, protocol, rater, session)
        study, schedule, checksum = begun
    else:
        schedule = _drawn_schedule(study, protocol, rater, session)
        file = study.schedule_file(rater, session)
        checksum = sha256_of(file.read_bytes())
    log_file = study.log_file(rater, session)
    check_inside(log_file.parent, study.root)
    both = (*schedule.presentations, *practice_presentations(protocol))
    codes = {presentation.code for presentation in both}
    if not log_file.exists():
        _check_recordings(codes, log_file, ())  # before an empty log is made
    with SessionLog.open(log_file, now=now) as log:
        _check_recordings(codes, log_file, log.events)
        runner = _Runner(study, protocol, schedule, grades, clock, log, now)
        with runner.stop_logged():
            runner.begin(checksum)
            summary = runner.run(progress)
        if not rehearsal:
            runner.ask_about_study()
        return summary


def _check_recordings(
    codes: Container[str], log_file: Path, events: Sequence[Event]
) -> None:
    # What the log does not name was graded, perhaps, in a log that is lost.
    named = {Path(str(event.fields.get("recording"))).name for event in events}
    folder = log_file.with_suffix("")
    unnamed = sorted(
        file.name
        for file in folder.glob("*.npz")
        if file.stem.partition("-")[0] in codes and file.name not in named
    )
    begun = any(event.kind == "session" for event in events)
    if begun:  # the one whose process died before it could log it is recovered
        unnamed = [name for name in unnamed if not spool_of(folder / name).exists()]
    if unnamed:
        what = "does not name" if begun else "is gone or empty, and there are"
        more = f" and {len(unnamed) - 1} more" if len(unnamed) > 1 else ""
        raise SessionLogError(
            f"{log_file}: {what} recordings in {folder} ({unnamed[0]}{more}): put the "
            "whole log back from a copy, or move these recordings away to present "
            "their models again"
        )


def _check_device(clock: str, protocol: Protocol) -> None:
    check_choice("clock", clock, CLOCKS)
    check_backend(protocol)
    device = protocol.device
    if clock == "simulated" and not has_simulated_hand(device):
        raise ParameterError(
            f"clock: needed the real one for device {device.backend!r}, got 'simulated'"
        )
    if problems := tuple(torque_problems(protocol)):
        raise ProtocolError(*problems)


class _Runner(Presenter):
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
        occasion = f"session {schedule.session} of {schedule.rater}"
        named_by = ("code", "position")
        super().__init__(
            study, protocol, grades, clock, log, occasion=occasion, named_by=named_by
        )
        self._study, self._schedule, self._now = study, schedule, now
        self._scheduled = schedule.presentations
        self._is_rehearsal = isinstance(study, RehearsalPaths)
        self._state: SessionState = replay(log.path, log.events)
        self._practice = practice_presentations(protocol)
        self._correct = partial(correct_in_session, log, protocol)

    def begin(self, schedule_sha256: str) -> None:
        """Log which session this is; check that it is the same when it is resumed."""
        protocol, schedule = self._protocol, self._schedule
        same: dict[str, Facts] = {
            "format": FORMAT,
            "study": protocol.study.id,
            "rater": schedule.rater,
            "session": schedule.session,
            "presented_sha256": presented_hash(protocol),
            "schedule_sha256": schedule_sha256,
            "simulated": self.is_simulated,
            "grades": self._grades.name,
            "device": protocol.device.backend,
            "rehearsal": self._is_rehearsal,
        }
        header = self._state.header
        if not header:
            # before there is anything of the session
            where = (self._study, protocol, schedule.rater, schedule.session)
            interval = (
                None if self._is_rehearsal else interval_fields(*where, self._now)
            )
            self._log.append("session", {**same, **self.provenance()})
            if interval is not None:
                self._log.append("interval", interval)
            return
        same["format"] = header["format"]  # it is finished as it was begun
        check_same(self._log.path, header, same)
        if not self._state.is_complete:
            kind = "restarted" if self._begins_anew() else "resumed"
            fields = self.provenance() | {"n_graded": len(self._state.grades)}
            self._log.append(kind, {**fields, "grades": self._grades.name})
            self._state = replay(self._log.path, self._log.events)

    def _begins_anew(self) -> bool:
        # by the protocol's policy, once a model was presented
        policy = self._protocol.occasions.resume
        if policy == "always" or self._is_rehearsal or not self._state.presented:
            return False
        last = last_time(self._log.events)
        days = days_since(last, self._now)
        if policy == "same-day" and days != 0:
            raise SessionLogError(
                f"{self._log.path}: was left on {last[:10]}: must be resumed on the "
                'same day, because the protocol has occasions.resume = "same-day"; '
                '"always" resumes it later, "restart" begins it again'
            )
        restart = policy == "restart"
        if policy == "ask":
            comes_next = next(
                (p for p in self._scheduled if p.code not in self._state.settled),
                self._scheduled[-1],
            )
            restart = self._grades.begins_anew(self._request(comes_next), days)
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

    def run(self, progress: Callable[[Presentation], object] | None) -> SessionSummary:
        """Present and ask until every presentation has its grade or is skipped."""
        if not self._state.is_complete:
            self._prepare()
        is_asked = self._grades.name != FROM_PAPER and not self._state.is_complete
        for presentation in self._scheduled:
            if not self._is_over(presentation, self._state):
                self._take_break(presentation)
                self._rate(presentation)
            elif is_asked:
                self._ask(presentation)  # what a process died before
            if progress is not None:
                progress(presentation)
        if is_asked:
            self._ask(None)
            self._log.append("complete", {"n_presentations": len(self._scheduled)})
        state = replay(self._log.path, self._log.events)
        return SessionSummary(
            rater=self._schedule.rater,
            session=self._schedule.session,
            n_presentations=len(self._scheduled),
            n_graded=len(state.grades),
            n_set_aside=state.n_set_aside,
            simulated=self.is_simulated,
            rehearsal=self._is_rehearsal,
            log_file=self._log.path,
        )

    def _is_over(self, presentation: Presentation, state: CodesState) -> bool:
        # on paper it is once it was presented: when it is graded nobody says here
        before = state.presented.get(presentation.code, [])
        is_presented = bool(before) and before[-1].fields["fault"] is None
        is_on_sheet = self._grades.name == FROM_PAPER and is_presented
        return presentation.code in state.settled or is_on_sheet

    def _prepare(self) -> None:
        # instructions and practice, once
        text = self._protocol.occasions.instructions
        if text and not (self._state.is_instructed or self._state.presented):
            first = (*self._practice, *self._scheduled)[0]
            self._grades.instruct(self._request(first), text)
            self._log.append("instructed", {"text": text})
        for presentation in self._practice:
            if not self._is_over(presentation, self._state.practice):
                self._rate(presentation)

    def _take_break(self, presentation: Presentation) -> None:
        occasions, after = self._protocol.occasions, presentation.position - 1
        every = occasions.break_after
        if every is None or not after or after % every or after in self._state.breaks:
            return
        clock = CLOCKS[self._clock]()
        begun = clock.now_ns()
        self._grades.take_break(self._request(presentation), occasions.break_minutes)
        self._log.append(
            "break",
            {
                "after": after,
                "minutes": occasions.break_minutes,
                "lasted_s": round((clock.now_ns() - begun) * 1e-9, 3),
            },
        )

    def _rate(self, presentation: Presentation) -> None:
        is_practice = presentation in self._practice
        prefix = "practice-" if is_practice else ""
        grade = self.rate(self._request(presentation))
        if isinstance(grade, OnSheet):
            return
        if isinstance(grade, Skip):
            reasons = stated(who=grade.who, why=grade.why)
            self._log.append(f"{prefix}skipped", {**self._named(), **reasons})
            return
        fields = {**self._named(), "grade": grade.grade, "stretch": grade.stretch}
        self._log.append(f"{prefix}grade", fields)
        if not is_practice:
            self._ask(presentation)

    def _ask(self, presentation: Presentation | None) -> None:
        # the questions about a presentation that was graded here, or the session
        code = None if presentation is None else presentation.code
        if code in self._state.settled and code not in self._state.first_grades:
            return
        self._shown = presentation or self._scheduled[-1]
        ask_questions(
            self._protocol,
            "session" if presentation is None else "presentation",
            self._grades,
            rater=self._schedule.rater,
            session=self._schedule.session,
            presentation=presentation,
            answered={key[:2] for key in self._state.answers if key[2] == code},
            correct=self._correct,
            log=lambda fields: self._log.append("answered", {**fields, "code": code}),
        )

    def ask_about_study(self) -> None:
        """Ask once a rater has completed every session; the answers are the study's."""
        study, protocol, rater = self._study, self._protocol, self._schedule.rater
        sessions = [each.id for each in protocol.sessions if rater in each.raters]
        if not questions_of(protocol, "study"):
            return
        if all(completed_on(study, rater, each) for each in sessions):
            ask_questions(
                protocol,
                "study",
                self._grades,
                rater=rater,
                session=self._schedule.session,
                answered=study_answers(study).get(rater, {}),
                correct=self._correct,
                log=lambda fields: append_event(
                    study,
                    protocol,
                    "answered",
                    {"rater": rater, **fields},
                    now=self._now,
                ),
            )

    def _request(self, presentation: Presentation) -> GradeRequest:
        is_practice, self._shown = presentation in self._practice, presentation
        return GradeRequest(
            rater=self._schedule.rater,
            session=self._schedule.session,
            presentation=presentation,
            n_presentations=len(
                self._practice if is_practice else self._schedule.presentations
            ),
            attempt=1,
            practice=is_practice,
            sealed=self._schedule.sealed and not is_practice,
            rehearsal=self._is_rehearsal,
            rules=self._protocol.presentation,
            may_skip=True,
            correct=self._correct,
            last=self._last_grade(),
        )

    def _last_grade(self) -> tuple[str, str | None] | None:
        state = replay(self._log.path, self._log.events)
        code = next(reversed(state.first_grades), None)
        return None if code is None else (code, state.grades.get(code))
