"""Train a rater: present models with known grades until the criterion is met.

Started again, a training resumes where its log ends, as a session does.
"""

import math
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from typing import ClassVar

from masrel._input import refuse
from masrel.errors import ParameterError, ProtocolError, SessionLogError
from masrel.lab._event_log import SessionLog, utc_now
from masrel.lab._study_files import Fact
from masrel.lab.conduct._study_log import check_rater
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash
from masrel.lab.run._grade_sources import GradeRequest, GradeSource, StretchGrade
from masrel.lab.run._presenter import ClockName, Presenter, check_same
from masrel.lab.run.session import _check_device
from masrel.lab.schedule._secret import Stream
from masrel.lab.schedule.presentation import Presentation
from masrel.lab.training._criterion import calibrate, training_criterion
from masrel.lab.training._lessons import (
    FORMAT,
    SETTINGS,
    Lesson,
    TrainingRecord,
    check_events,
    record_of,
)
from masrel.lab.training._trainees import BLOCK_SETS, confusion

_SESSION = "training"  # what recordings of a training have in place of a session

# Noise of perception in grades: at first, in the end, and in how many presentations
# it comes nearer to the latter by a factor of e.
_FIRST_NOISE, _LAST_NOISE, _PRESENTATIONS = 1.2, 0.2, 12.0

_N_WORDS = 2.0**64


def train_rater(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    *,
    grades: GradeSource,
    clock: ClockName,
    feedback: Callable[[Lesson], object] | None = None,
    now: Callable[[], datetime] = utc_now,
) -> TrainingRecord:
    """Train a rater until the criterion is met, or resume.

    Trainings never enter the ratings of the study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Id of one of its raters.
    grades : GradeSource
        Where grades come from.
    clock : {"real", "simulated"}
        The clock of the control loop; "simulated" needs a simulated hand.
    feedback : callable, optional
        Called with each lesson once its grade is in the log.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    TrainingRecord
        The training, passed or not. One that has ended is left as it is.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, the device or `clock` is unknown or they do
        not fit each other, or a grade is not of the scale.
    ProtocolError
        If fewer than two intended grades can be taught, the test needs more
        presentations than there may be, or a model asks for more torque than the
        device may send.
    SessionLogError
        If the log is damaged, was begun with other settings, models, source of grades
        or device, or is open elsewhere.
    DeviceError
        If the device cannot be used, or faults are not to be tried again.
    SessionStoppedError
        If the person stops; the same call goes on there.
    OSError
        If log or recording cannot be written.

    Warns
    -----
    OverrunWarning
        If the control loop missed ticks.
    """
    _check_device(clock, protocol)
    _check_models(study, protocol, rater)
    path = study.training_log_file(rater)
    if not path.exists() and any(path.with_suffix("").glob("*.npz")):
        raise SessionLogError(
            f"{path}: is gone, and there are recordings in {path.with_suffix('')}: put "
            "the log back from a copy, or move these recordings away to begin again"
        )
    with SessionLog.open(path, now=now) as log:
        check_events(path, log.events)
        trainer = _Trainer(study, protocol, rater, grades, clock, log)
        trainer.begin()
        with trainer.stop_logged():
            return trainer.run(feedback)


def _check_models(study: StudyPaths, protocol: Protocol, rater: str) -> None:
    check_rater(protocol, rater)
    criterion = training_criterion(protocol)
    refuse(
        (
            len(set(criterion.intended)) < 2,
            f"{study.protocol}: models: training needs two or more different intended "
            f"grades, got {len(set(criterion.intended))}",
        ),
        (
            criterion.window < criterion.n_models,
            f"{study.protocol}: training.window: needed at least one presentation of "
            f"each of the {criterion.n_models} models with an intended grade, got "
            f"{criterion.window}",
        ),
        error=ProtocolError,
    )


class _Trainer(Presenter):
    """One run of one training; what it does is on disk before it goes on."""

    def __init__(
        self,
        study: StudyPaths,
        protocol: Protocol,
        rater: str,
        grades: GradeSource,
        clock: ClockName,
        log: SessionLog,
    ) -> None:
        super().__init__(
            study,
            protocol,
            grades,
            clock,
            log,
            occasion=f"training of {rater}",
            named_by=("position",),
            has_schedule=False,
        )
        self._study, self._rater = study, rater
        self._intended = {
            model.id: model.intended_grade
            for model in protocol.models
            if model.intended_grade is not None
        }

    def begin(self) -> None:
        """Log which training this is; check that it is the same when it goes on."""
        rules, device = self._protocol.training, self._protocol.device
        same: dict[str, Fact] = {
            "format": FORMAT,
            "study": self._protocol.study.id,
            "rater": self._rater,
            "presented_sha256": presented_hash(self._protocol),
            **{name: getattr(rules, name) for name in SETTINGS},
            "simulated": self.is_simulated,
            "grades": self._grades.name,
            "device": device.backend,
        }
        events = self._log.events
        if not events:
            fields = {**same, **self._calibrated(), **self.provenance()}
            self._log.append("training", fields)
            return
        check_same(self._log.path, events[0].fields, same)
        if not any(event.kind == "complete" for event in events):
            n_graded = sum(event.kind == "grade" for event in events)
            self._log.append("resumed", {"n_graded": n_graded, **self.provenance()})

    def _calibrated(self) -> dict[str, Fact]:
        rules = self._protocol.training
        criterion = training_criterion(self._protocol)
        calibration = calibrate(criterion, false_pass=rules.false_pass, rng=rules.seed)
        if calibration.false_fail > rules.false_fail:
            raise ProtocolError(
                f"{self._study.protocol}: training.max_presentations: needed enough to "
                f"fail at most {100.0 * rules.false_fail:g} % of trainees with kappa "
                f"{rules.kappa_sufficient:g}, got {rules.max_presentations}, which "
                f"fail {100.0 * calibration.false_fail:.1f} %; allow more, with a "
                "longer window, or put the two kappas further apart"
            )
        # An order that anybody can draw again from the protocol teaches by heart.
        seed = rules.seed if self._grades.simulated else secrets.randbits(53)
        return {
            "boundary": calibration.boundary,
            "calibrated_false_fail": calibration.false_fail,
            "order_seed": seed,
            "is_weighted": True,
        }

    def run(self, feedback: Callable[[Lesson], object] | None) -> TrainingRecord:
        """Teach until the criterion is met or there were enough presentations."""
        record = record_of(self._log.path, self._log.events, self._protocol)
        while record.passed is None:
            # Looked at once a set is whole; a training that went on before could not
            # have ended.
            passed = bool((record.evidence() >= record.boundary).any())
            n_presentations = len(record.lessons)
            if passed or n_presentations >= record.criterion.max_presentations:
                facts = {"passed": passed, "n_presentations": n_presentations}
                self._log.append("complete", facts)
                return replace(record, passed=passed)
            lesson = self._teach(record)
            if feedback is not None:
                feedback(lesson)
            record = replace(record, lessons=(*record.lessons, lesson))
        return record

    def _teach(self, record: TrainingRecord) -> Lesson:
        model = next_model(
            self._intended,
            record.lessons,
            order=record.criterion.order,
            seed=record.order_seed,
            rater=self._rater,
        )
        position = len(record.lessons) + 1
        grade = self.rate(self._request(position, model))
        if not isinstance(grade, StretchGrade):  # no training can do without a grade
            raise ParameterError(f"grade of presentation {position}: needed one now")
        lesson = Lesson(
            position=position,
            model=model,
            intended=self._intended[model],
            grade=grade.grade,
        )
        self._log.append("grade", asdict(lesson))
        return lesson

    def _request(self, position: int, model: str) -> GradeRequest:
        return GradeRequest(
            rater=self._rater,
            session=_SESSION,
            presentation=Presentation(
                position=position, code=f"{position:03d}", model=model, repeat=position
            ),
            n_presentations=self._protocol.training.max_presentations,
            attempt=1,
            rules=self._protocol.presentation,
        )


def next_model(
    intended: Mapping[str, str],
    lessons: Sequence[Lesson],
    *,
    order: str,
    seed: int,
    rater: str,
) -> str:
    """Return the id of the next model."""
    # intended: grade by model. Each draw is of its number alone, or of that and the
    # grades before, so that a training goes on as if nothing had stopped it.
    models = list(intended)
    if order == "blocked":
        block, place = divmod(len(lessons), BLOCK_SETS * len(models))
        return _block(models, Stream(seed, "training", rater, str(block)))[place]
    last = {one.model: one.grade for one in lessons}
    wrong = [
        model for model in models if last.get(model, intended[model]) != intended[model]
    ]
    tickets = [*models, *wrong]  # what was misgraded the last time, twice
    stream = Stream(seed, "training", rater, str(len(lessons)))
    return tickets[stream.below(len(tickets))]


def _block(models: Sequence[str], stream: Stream) -> list[str]:
    # Only that each comes at all is certain: who counts knows next to nothing.
    while True:
        block = [
            models[stream.below(len(models))] for _ in range(BLOCK_SETS * len(models))
        ]
        if set(block) == set(models):
            return block


class SimulatedTrainee(GradeSource):
    """A trainee who confuses neighbouring grades less and less.

    The grade depends on the seed of ``[simulated_raters]``, the rater, the model and
    the number of the presentation alone. Nothing here models a person.

    Parameters
    ----------
    protocol : Protocol
        The protocol.
    """

    name: ClassVar[str] = "simulated"

    def __init__(self, protocol: Protocol) -> None:
        self._seed = protocol.simulated_raters.seed
        self._grades = protocol.scale.grades
        self._intended = {
            model.id: self._grades.index(model.intended_grade)
            for model in protocol.models
            if model.intended_grade is not None
        }

    def grade(self, request: GradeRequest) -> str | None:
        """Return the grade that the trainee gives.

        Parameters
        ----------
        request : GradeRequest
            What was presented; its model has an intended grade.

        Returns
        -------
        str
            A grade of the scale.
        """
        shown = request.presentation
        learnt = math.exp(-(shown.position - 1) / _PRESENTATIONS)
        noise = _LAST_NOISE + (_FIRST_NOISE - _LAST_NOISE) * learnt
        n_grades = len(self._grades)
        table = confusion("noise", noise, n_grades, tuple(self._intended.values()))
        purpose = "trainee", request.rater, str(shown.position)
        share = Stream(self._seed, *purpose).word() / _N_WORDS
        row = table[self._intended[shown.model]].cumsum()
        return self._grades[min(int((share >= row).sum()), n_grades - 1)]
