"""Present one model until it is graded or skipped, and log each time at once.

Sessions and trainings do; their logs name what is presented by other fields.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import masrel
from masrel.errors import (
    DeviceError,
    SessionLogError,
    SessionStoppedError,
)
from masrel.lab._event_log import SessionLog
from masrel.lab._study_files import Fact, Facts
from masrel.lab.conduct._calibrations import last_calibration
from masrel.lab.hess import Clock, EmergencyStop, RealClock, SimulatedClock
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash
from masrel.lab.run._grade_sources import (
    GradeRequest,
    GradeSource,
    OnSheet,
    Skip,
    StretchGrade,
    checked_grade,
)
from masrel.lab.run._present import (
    Outcome,
    present,
    presentation_status,
    recover,
    spool_of,
)
from masrel.lab.run._settings import moves_hardware
from masrel.lab.run._state import may_go_on
from masrel.lab.run.console import _at_terminal
from masrel.lab.schedule.presentation import Presentation

ClockName = Literal["real", "simulated"]

CLOCKS: dict[str, Callable[[], Clock]] = {
    "real": RealClock,
    "simulated": SimulatedClock,
}
"""The clocks a control loop can run on, by name."""

# Emergency stops by somebody who wants the process to end; Ctrl-C may be a rater's.
_TERMINATING = ("signal SIGTERM", "signal SIGHUP")


class Presenter:
    """Puts models on the device; what it does is in the log before it goes on."""

    def __init__(
        self,
        study: StudyPaths,
        protocol: Protocol,
        grades: GradeSource,
        clock: ClockName,
        log: SessionLog,
        *,
        occasion: str,
        named_by: tuple[str, ...],
        has_schedule: bool = True,
    ) -> None:
        self._protocol = protocol
        self._grades = grades
        self._clock = clock
        self._log = log
        self._occasion = occasion  # what it is for, in messages
        self._named_by = named_by  # fields of a presentation in each of its events
        self._has_schedule = has_schedule  # that says which model it was
        self._calibration = last_calibration(
            study, protocol, simulated=not moves_hardware(protocol.device)
        )
        self._shown: Presentation | None = None  # what is asked about

    @property
    def is_simulated(self) -> bool:
        """Whether grades or device are simulated."""
        return self._grades.simulated or not moves_hardware(self._protocol.device)

    def provenance(self) -> dict[str, Fact]:
        """Return what a log says each time that it is begun or resumed."""
        return {
            "protocol_sha256": protocol_hash(self._protocol),
            "clock": self._clock,
            "masrel_version": masrel.__version__,
        }

    @contextmanager
    def stop_logged(self) -> Iterator[None]:
        """Log where a stop came: at what was asked about last."""
        try:
            yield
        except SessionStoppedError as error:
            self._log.append("stopped", {**self._named(), "why": str(error)})
            raise

    def rate(self, first: GradeRequest) -> StretchGrade | Skip | OnSheet:
        """Present until the grade comes, or nobody wants it any more.

        `first` is the request for the first attempt.
        """
        self._shown = first.presentation
        attempt, n_faults = self._attempts_before(first), 0
        attempt += self._recovered(dataclasses.replace(first, attempt=attempt + 1))
        while True:
            attempt += 1
            request = dataclasses.replace(first, attempt=attempt, n_faults=n_faults)
            status = presentation_status(self._protocol, request)
            request = dataclasses.replace(request, status=status)
            self._grades.make_ready(request)
            outcome = self._present(request)
            n_faults = n_faults + 1 if outcome.fault else 0
            known = ("n_stretches", "ended", "felt", "grip_lost")
            made: dict[str, Any] = {name: outcome.logged[name] for name in known}
            request = dataclasses.replace(
                request, status=None, n_faults=n_faults, **made
            )
            answer: StretchGrade | Skip | OnSheet | None
            if outcome.fault:
                answer = self._after_fault(request, str(outcome.fault["words"]))
            else:
                answer = self._checked(request, self._grades.grade(request))
            if answer is not None:
                return answer

    def _attempts_before(self, request: GradeRequest) -> int:
        # how often it was presented before this process
        kind, named = _kind_of(request), self._named().items()
        before = [
            event
            for event in self._log.events
            if event.kind == kind and named <= event.fields.items()
        ]
        for event in before:  # a process may have died between the log and this
            file = self._log.path.parent / str(event.fields["recording"])
            spool_of(file).unlink(missing_ok=True)
        return len(before)

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
        outcome = present(
            self._protocol,
            request,
            clock=clock,
            file=file,
            stop=stop,
            listening=getattr(self._grades, "listening", _at_terminal),
            calibration=self._calibration,
        )
        self._log_presented(request, outcome, file)
        if stop.reason in _TERMINATING:
            raise SessionStoppedError(
                f"{self._place(request)} was stopped by {stop.reason} at presentation "
                f"{request.presentation.position}; the same command resumes it there"
            )
        return outcome

    def _file(self, request: GradeRequest) -> Path:
        again = f"-{request.attempt}" if request.attempt > 1 else ""
        folder = self._log.path.with_suffix("")
        return folder / f"{request.presentation.code}{again}.npz"

    def _log_presented(
        self, request: GradeRequest, outcome: Outcome, file: Path
    ) -> None:
        fields = self._named() | {"attempt": request.attempt}
        shown = {"model": request.presentation.model}
        if self._has_schedule and not request.practice:
            shown.clear()
        self._log.append(_kind_of(request), {**fields, **shown, **outcome.logged})
        if outcome.fault:
            self._log.append("fault", {**fields, **outcome.fault})
        spool_of(file).unlink(missing_ok=True)  # only now is it of no use

    def _named(self) -> dict[str, Facts]:
        return {name: getattr(self._shown, name) for name in self._named_by}

    def _place(self, request: GradeRequest) -> str:
        return f"practice of {self._occasion}" if request.practice else self._occasion

    def _after_fault(self, request: GradeRequest, fault: str) -> Skip | None:
        answer = self._grades.present_again(request, fault)
        if isinstance(answer, Skip):
            return answer
        if not answer:
            raise DeviceError(
                f"{self._place(request)}: presentation "
                f"{request.presentation.position}, code {request.presentation.code}, "
                f"was stopped by a fault: {fault}"
            )
        return None

    def _checked(
        self, request: GradeRequest, answer: str | StretchGrade | OnSheet | None
    ) -> StretchGrade | OnSheet | None:
        if answer is None or isinstance(answer, OnSheet):
            return answer
        if isinstance(answer, str):
            answer = StretchGrade(grade=answer)
        grades = self._protocol.scale.grades
        return checked_grade(request, grades, answer.grade, answer.stretch)


def _kind_of(request: GradeRequest) -> Literal["presented", "practised"]:
    # of the event that says what was presented
    return "practised" if request.practice else "presented"


def check_same(
    path: Path, begun: Mapping[str, Facts], same: Mapping[str, Facts]
) -> None:
    """Refuse to resume a log that was begun with anything else."""
    for name in ("grades", *same):  # which says most comes first
        value, was = same[name], begun.get(name, False)  # there once were no rehearsals
        if was != value and not (name == "grades" and may_go_on(was, value)):
            raise SessionLogError(
                f"{path}: begun with {name} = {was}: needed the same to resume, got "
                f"{value}"
            )
