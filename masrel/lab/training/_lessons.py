"""What the log of a training says: criterion, lessons, learning curve, and the end.

The log is a chain like that of a session (``docs/reference/formats/session_log.md``),
with events of its own: ``docs/howto/laboratory/training.md`` lists them.
"""

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from masrel.errors import (
    SessionLogError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate
from masrel.intervals import estimate
from masrel.lab._event_log import Event, check_kinds, read_log
from masrel.lab.protocol import Protocol, StudyPaths, Training, presented_hash
from masrel.lab.run._state import EVENTS as SESSION_EVENTS
from masrel.lab.run._state import LATER, of_another_type
from masrel.lab.training._criterion import Criterion, training_criterion
from masrel.lab.training._trainees import adaptive_weights

CURVE_SETS = 4
"""Sets of presentations in each point: fewer say little, more blur."""

STEP_SETS = 2
"""Sets from one point to the next."""

FORMAT = 1
"""Version of the log of a training."""

SETTINGS = (
    "weights",
    "kappa_insufficient",
    "kappa_sufficient",
    "false_pass",
    "false_fail",
    "window",
    "order",
    "max_presentations",
)
"""Keys of ``[training]`` that a training keeps to its end."""

_PROVENANCE = ("protocol_sha256", "clock", "masrel_version")

# As those of a session, without the codes that a training has not
EVENTS: dict[str, tuple[str, ...]] = {
    "training": (
        *("format", "study", "rater", "presented_sha256", *SETTINGS),
        *("boundary", "calibrated_false_fail", "order_seed", "is_weighted"),
        *("simulated", "grades", "device", *_PROVENANCE),
    ),
    "resumed": ("n_graded", *_PROVENANCE),
    **{
        kind: tuple(name for name in SESSION_EVENTS[kind] if name != "code")
        for kind in ("fault", "stopped", "recovered")
    },
    "presented": tuple(n for n in SESSION_EVENTS["practised"] if n != "code"),
    "grade": ("position", "model", "intended", "grade"),
    "complete": ("passed", "n_presentations"),
}
"""Every kind of event with the fields it has."""

_LATER = {"training": ({"is_weighted"},), "presented": LATER["presented"]}


@dataclass(frozen=True, slots=True, kw_only=True)
class Lesson:
    """One presentation of a model whose grade is known, with the rater's grade.

    Attributes
    ----------
    position : int
        Place in the training, from 1.
    model : str
        Id of the haptic model.
    intended, grade : str
        The intended grade and the rater's.
    """

    position: int
    model: str
    intended: str
    grade: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingRecord:
    """A training, as far as it has come.

    Attributes
    ----------
    rater : str
        Whose training.
    criterion : Criterion
        What the rater must show.
    boundary : float
        The evidence that passes.
    false_pass, false_fail : float
        The largest chances of both errors, the latter as calibrated.
    order_seed : int
        What the order was drawn from.
    is_weighted : bool
        Whether presentations in adaptive order count by how likely they were; in a
        training begun before they did, they count alike to its end.
    lessons : tuple of Lesson
        In order.
    passed : bool or None
        None while the training goes on.
    simulated : bool
        Whether grades or device are simulated.
    """

    rater: str
    criterion: Criterion
    boundary: float
    false_pass: float
    false_fail: float
    order_seed: int
    is_weighted: bool
    lessons: tuple[Lesson, ...]
    passed: bool | None
    simulated: bool

    def evidence(self) -> NDArray[np.float64]:
        """Return the evidence after each set of lessons.

        Returns
        -------
        ndarray of float, shape (n_sets,)
            As `Criterion.evidence` has it.
        """
        code = {grade: at for at, grade in enumerate(self.criterion.grades)}
        pairs = [(code[one.intended], code[one.grade]) for one in self.lessons]
        codes = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        weights = None
        if self.is_weighted and self.criterion.order == "adaptive":
            models = {one.model: None for one in self.lessons}
            number = {model: at for at, model in enumerate(models)}
            weights = adaptive_weights(
                np.array([number[one.model] for one in self.lessons], dtype=np.int64),
                codes[:, 0] != codes[:, 1],
                self.criterion.n_models,
            )
        return self.criterion.evidence(codes[:, 0], codes[:, 1], weights)


def read_training(study: StudyPaths, protocol: Protocol, rater: str) -> TrainingRecord:
    """Read the log of a rater's training.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Id of the rater.

    Returns
    -------
    TrainingRecord
        The training as far as it has come.

    Raises
    ------
    SessionLogError
        If there is no such log, it is damaged, or it is of models that have changed.
    """
    path = study.training_log_file(rater)
    if not path.is_file():
        raise SessionLogError(
            f"{path}: no such log; masrel train STUDY --rater {rater} begins a training"
        )
    events = read_log(path)
    check_events(path, events)
    if not events:
        raise SessionLogError(f"{path}: needed a training that has begun, got none")
    return record_of(path, events, protocol)


def check_events(path: Path, events: Sequence[Event]) -> None:
    """Refuse events that no training leaves in this order."""
    check_kinds(path, events, EVENTS, head="training", newest=FORMAT, later=_LATER)
    graded, presented = 0, Counter[object]()
    for event in events:
        fields, problem = event.fields, of_another_type(event)
        if problem is not None:
            pass
        elif (event.kind == "training") != (event is events[0]):
            problem = "needed the event training once, before all others"
        elif event.kind == "presented" and fields["fault"] is None:
            presented[fields["position"]] += 1
        elif event.kind == "grade":
            graded += 1
            if fields["position"] != graded or not presented[graded]:
                problem = f"needed the grade of presentation {graded}, after it"
        if problem is not None:
            raise SessionLogError(f"{path}: line {event.line}: {event.kind}: {problem}")


def record_of(
    path: Path, events: Sequence[Event], protocol: Protocol
) -> TrainingRecord:
    """Return the record of events that were checked, the first of them there."""
    header = events[0].fields
    if header["presented_sha256"] != presented_hash(protocol):
        raise SessionLogError(
            f"{path}: needed the training of the models that the protocol has now, "
            "got one from before a change in its study id, scale, elbow, models, "
            "schedule, stretch, presentation, occasions or device"
        )
    rules = msgspec.convert({name: header[name] for name in SETTINGS}, Training)
    ended = [event.fields for event in events if event.kind == "complete"]
    return TrainingRecord(
        rater=str(header["rater"]),
        criterion=training_criterion(msgspec.structs.replace(protocol, training=rules)),
        boundary=float(str(header["boundary"])),
        false_pass=rules.false_pass,
        false_fail=float(str(header["calibrated_false_fail"])),
        order_seed=int(str(header["order_seed"])),
        is_weighted=bool(header.get("is_weighted", False)),
        lessons=tuple(
            msgspec.convert(dict(e.fields), Lesson) for e in events if e.kind == "grade"
        ),
        passed=bool(ended[-1]["passed"]) if ended else None,
        simulated=bool(header["simulated"]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """Kappa with the intended grades of the last presentations.

    Attributes
    ----------
    position : int
        Number of the last presentation.
    n_presentations : int
        Number of presentations in kappa.
    n_right : int
        Of these, those with the intended grade.
    kappa : Estimate
        With an interval of other presentations of the same models.
    evidence : float
        Of the training, at this time.
    """

    position: int
    n_presentations: int
    n_right: int
    kappa: Estimate = field(repr=False)
    evidence: float


def learning_curve(
    record: TrainingRecord, *, level: float = 0.95
) -> tuple[CurvePoint, ...]:
    """Return the learning curve of a training.

    Parameters
    ----------
    record : TrainingRecord
        The training.
    level : float, optional
        Nominal level of the intervals.

    Returns
    -------
    tuple of CurvePoint
        One every two sets of as many presentations as there are models, and one where
        the training ended; each of the last four sets, or of those there are.

    Raises
    ------
    ParameterError
        If the level is not between 0 and 1.

    Notes
    -----
    The intervals hold at each point, not at all points together, and not for the point
    at which a training is passed: it stops where kappa happens to be high.
    """
    criterion, evidence = record.criterion, record.evidence()
    n_sets = evidence.size
    ends = {*range(STEP_SETS, n_sets + 1, STEP_SETS), n_sets} - {0}
    points = []
    for end in sorted(ends):
        first, last = max(0, end - CURVE_SETS), end
        n_models = criterion.n_models
        lessons = record.lessons[first * n_models : last * n_models]
        pairs = [(lesson.intended, lesson.grade) for lesson in lessons]
        # a point says itself on how much it rests
        with (
            warnings.catch_warnings(action="ignore", category=SmallSampleWarning),
            warnings.catch_warnings(
                action="ignore", category=UndefinedStatisticWarning
            ),
        ):
            kappa = estimate(
                "cohen_kappa",
                pairs,
                target="items",
                categories=criterion.grades,
                weights=criterion.weights,
                level=level,
            )
        points.append(
            CurvePoint(
                position=lessons[-1].position,
                n_presentations=len(lessons),
                n_right=sum(a == b for a, b in pairs),
                kappa=kappa,
                evidence=float(evidence[end - 1]),
            )
        )
    return tuple(points)
