"""What a source of grades is; a script and simulated raters, who are two of them.

Nothing of a simulated rater models a person. ``docs/session_log.md`` states the rules
in words.
"""

import hashlib
import json
import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from masrel.errors import ParameterError, ProtocolError
from masrel.lab.protocol import (
    Model,
    PresentationRules,
    Protocol,
    Question,
    Questionnaire,
    scale_of,
)
from masrel.lab.protocol._values import Answer
from masrel.lab.run._state import Felt
from masrel.lab.schedule import Presentation

if TYPE_CHECKING:
    from masrel.lab.hess import PresentationStatus  # loads numpy

MAX_FAULTS = 3  # in a row of one presentation; after that nobody is asked any more

_MOST_STRETCHES = 3  # of a simulated rater who may stretch as often as wanted

Correct = Callable[..., None]
"""Corrects a grade of the session that goes on: `code`, `grade` (None for a missing
one), `who` corrects it and `why`; ParameterError or SessionLogError where it cannot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeRequest:
    """One request for a grade: to whom, and of which presentation.

    Attributes
    ----------
    rater, session : str
        Who grades, and in which session.
    presentation : Presentation
        What is presented. A person is told its position and code, never the model.
    n_presentations : int
        Presentations in the session.
    attempt : int
        From 1; above 1 when it is presented again.
    n_faults : int
        Faults in a row so far.
    rehearsal : bool
        Whether nothing of this enters the study's ratings.
    practice : bool
        Whether it is for practice; its grade is no rating.
    rules : PresentationRules
        How often the arm may be stretched, and with which cues.
    status : PresentationStatus or None
        Of the presentation that is about to begin: whoever lets a program answer calls
        its `done` when the rater is, from any thread. None once it is over.
    n_stretches : int
        Stretches that were made; 0 before.
    felt : {"felt", "below-threshold", "no-catch"} or None
        Whether what the model has could be felt: no stretch was fast enough, or none
        came to the catch that the model has at that speed. None before, and after a
        fault.
    grip_lost : bool or None
        Whether the arm came loose and the model let it go. None before.
    ended : str or None
        What ended the presentation, as in its recording: ``"time-limit"``, say. None
        before.
    may_skip: bool
        Whether the presentation can be left without a grade after a fault.
    correct : callable or None
        Corrects a grade of the session while it goes on: takes `code`, `grade` (None
        for a missing one), `who` and `why`; raises ParameterError or SessionLogError
        where it cannot. None where nothing can be corrected.
    last : tuple of str and str or None, or None
        Code and grade of what the session graded last, as it is corrected: what a
        rater may want to correct. None before there is one.
    samples : Path or None
        File that keeps every sample of the presentation while it goes on. None before
        and after.
    """

    rater: str
    session: str
    presentation: Presentation
    n_presentations: int
    attempt: int
    n_faults: int = 0
    rehearsal: bool = False
    practice: bool = False
    rules: PresentationRules = field(default_factory=PresentationRules)
    status: "PresentationStatus | None" = None
    n_stretches: int = 0
    felt: Felt | None = None
    grip_lost: bool | None = None
    ended: str | None = None
    may_skip: bool = False
    correct: Correct | None = None
    last: tuple[str, str | None] | None = None
    samples: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchGrade:
    """A grade, and the stretch it rests on.

    Attributes
    ----------
    grade : str
        A grade of the scale.
    stretch : int or None
        Number of the stretch, from 1; None where nobody says.
    """

    grade: str
    stretch: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Skip:
    """That a presentation is left without a grade after a fault.

    Attributes
    ----------
    who, why : str
        Who says so, and for what reason.
    """

    who: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionRequest:
    """One question to a rater.

    Attributes
    ----------
    rater, session : str
        Who is asked, and in which session.
    questionnaire : Questionnaire
        The questionnaire.
    question : Question
        The one of its questions; its `needed` says what an answer is.
    presentation : Presentation or None
        What it is about; None for the session or the study. A person is told its code,
        never the model.
    correct : callable or None
        As that of a `GradeRequest`.
    """

    rater: str
    session: str
    questionnaire: Questionnaire
    question: Question
    presentation: Presentation | None
    correct: Correct | None = None


def checked_grade(
    request: GradeRequest, grades: Sequence[str], grade: object, stretch: Any
) -> StretchGrade:
    """Return a grade of what was presented; ParameterError says what it cannot be."""
    code, n_stretches = request.presentation.code, request.n_stretches
    if not isinstance(grade, str) or grade not in grades:
        raise ParameterError(
            f"grade of {code}: needed one of {', '.join(grades)}, got {grade!r}"
        )
    is_number = type(stretch) is int and 1 <= stretch <= n_stretches  # true is none
    if stretch is not None and not is_number:
        raise ParameterError(
            f"stretch of {code}: needed one of {n_stretches}, from 1, got {stretch!r}"
        )
    return StretchGrade(grade=grade, stretch=stretch)


class GradeSource:
    """A source of grades: a person, a script, or simulated raters.

    What is here is of those that nobody has to wait for; `grade` is each one's own. One
    that is listened to while a model is presented has a method ``listening``, too: it
    takes the request and the emergency stop, which it may press, and returns what lasts
    as long as the presentation. For any other the terminal is listened to.

    Attributes
    ----------
    name : str
        Name of the source, kept in the log.
    simulated : bool
        Whether its grades are no person's.
    """

    name: ClassVar[str]
    simulated: ClassVar[bool] = True

    def make_ready(self, request: GradeRequest) -> None:
        """Return when the rater is ready for the presentation."""

    def grade(self, request: GradeRequest) -> str | StretchGrade | None:
        """Return the grade, or None to have it presented again first."""
        raise NotImplementedError

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:  # noqa: ARG002 - as all
        """Return whether to present it again after a fault, or that it is skipped."""
        return request.n_faults < MAX_FAULTS

    def instruct(self, request: GradeRequest, text: str) -> None:
        """Return when the rater has read the instructions; `request` comes next."""

    def take_break(self, request: GradeRequest, minutes: float) -> None:
        """Return when a break is over; `request` comes next."""

    def begins_anew(self, request: GradeRequest, days: int) -> bool:  # noqa: ARG002 - as all
        """Return whether a session begins anew that was left so many days ago."""
        return False

    def answer(self, request: QuestionRequest) -> Answer:  # noqa: ARG002 - as all
        """Return the answer, or None for none."""
        return None


class ScriptGrades(GradeSource):
    """Grades and answers fixed beforehand.

    Parameters
    ----------
    grades : mapping of str to str, or sequence of str
        Grade by code, or one grade a position.
    practice : mapping of str to str, or sequence of str, optional
        The same for practice.
    answers : mapping of str to str, int, float or None, optional
        Answer by ``questionnaire.question``, whatever it is about.
    """

    name: ClassVar[str] = "script"

    def __init__(
        self,
        grades: Mapping[str, str] | Sequence[str],
        *,
        practice: Mapping[str, str] | Sequence[str] = (),
        answers: Mapping[str, Answer] | None = None,
    ) -> None:
        self._grades = grades
        self._practice = practice
        self._answers = answers or {}

    def grade(self, request: GradeRequest) -> str | None:
        """Return the grade of the script.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        str
            The grade.

        Raises
        ------
        ParameterError
            If the script has none for it.
        """
        presentation = request.presentation
        grades = self._practice if request.practice else self._grades
        if isinstance(grades, Mapping):
            if presentation.code in grades:
                return grades[presentation.code]
        elif presentation.position <= len(grades):
            return grades[presentation.position - 1]
        raise ParameterError(
            f"script: needed a grade of position {presentation.position}, "
            f"code {presentation.code}"
        )

    def answer(self, request: QuestionRequest) -> Answer:
        """Return the answer of the script; None where it has none."""
        return self._answers.get(f"{request.questionnaire.id}.{request.question.id}")


_Key = tuple[str, str, str, int]
"""Rater, session, model and repeat."""


def key_of(request: GradeRequest) -> _Key:
    """Return what a simulated rater's numbers depend on, beside what they are for."""
    shown = request.presentation
    return request.rater, request.session, shown.model, shown.repeat


class SimulatedGrades(GradeSource):
    """Simulated raters as ``[simulated_raters]`` of a protocol describes them.

    A grade depends on seed, rater, session, model and repeat alone: not on the
    order of presentations, nor on what was graded before. The true grade of a model
    with an intended grade is that one; any other model has a severity (`severity`)
    between two grades, and its true grade is the upper one with a probability of
    the fraction. The rater gives the true grade with probability `accuracy`, else a
    neighbouring one. In a later session the rater gives the grade of the first one
    with probability `retest_agreement`, else grades anew.

    Parameters
    ----------
    protocol : Protocol
        The protocol.

    Raises
    ------
    ProtocolError
        If no model has an intended grade.
    """

    name: ClassVar[str] = "simulated"

    def __init__(self, protocol: Protocol) -> None:
        self._settings = protocol.simulated_raters
        self._grades = protocol.scale.grades
        self._severity = {
            model.id: severity(protocol, model) for model in protocol.models
        }
        self._first_session: dict[str, str] = {}
        for session in protocol.sessions:
            for rater in session.raters:
                self._first_session.setdefault(rater, session.id)

    def grade(self, request: GradeRequest) -> str | None:
        """Return the grade the simulated rater gives.

        Parameters
        ----------
        request : GradeRequest
            What was presented.

        Returns
        -------
        str
            A grade of the scale.

        Raises
        ------
        ParameterError
            If the protocol has no such model.
        """
        presentation = request.presentation
        if presentation.model not in self._severity:
            raise ParameterError(
                f"model: needed one of {', '.join(self._severity)}, "
                f"got {presentation.model!r}"
            )
        rater, session, model, repeat = key = key_of(request)
        first = self._first_session.get(rater, session)
        repeats = _uniform(self._settings.seed, "retest", key)
        if session != first and repeats < self._settings.retest_agreement:
            key = (rater, first, model, repeat)
        return self._fresh(key)

    def answer(self, request: QuestionRequest) -> Answer:
        """Return an answer that is drawn, each that is possible equally likely.

        Parameters
        ----------
        request : QuestionRequest
            The question.

        Returns
        -------
        str or int
            An answer; to a question for text, that it is simulated.
        """
        question, shown = request.question, request.presentation
        model, repeat = ("", 0) if shown is None else (shown.model, shown.repeat)
        name = f"answer {request.questionnaire.id}.{question.id}"
        key = (request.rater, request.session, model, repeat)
        share = _uniform(self._settings.seed, name, key)
        if question.choices:
            return question.choices[int(share * len(question.choices))]
        if question.range is None:
            return "simulated"
        low, high = question.range
        return low + int(share * (high - low + 1))

    def _fresh(self, key: _Key) -> str:
        seed, position = self._settings.seed, self._severity[key[2]]
        lower = math.floor(position)
        upper = _uniform(seed, "severity", key) < position - lower
        code = lower + 1 if upper else lower
        if _uniform(seed, "accuracy", key) >= self._settings.accuracy:
            last = len(self._grades) - 1
            neighbours = [c for c in (code - 1, code + 1) if 0 <= c <= last]
            share = _uniform(seed, "neighbour", key)
            code = neighbours[int(share * len(neighbours))]
        return self._grades[code]


def severity(protocol: Protocol, model: Model) -> float:
    """Return the rank of a model on the scale, from facts of the protocol alone."""
    scale = scale_of(protocol)
    if model.intended_grade is not None:
        return float(scale.code(model.intended_grade))
    height = model.catch_torque_nms_rad
    if height is None:
        raise ProtocolError(
            f"models: simulated raters need an intended_grade for a model of kind "
            f"{model.kind}, got none for {model.id}"
        )
    ranks: dict[float, list[int]] = {}
    for other in protocol.models:
        if other.intended_grade is not None and other.catch_torque_nms_rad is not None:
            of_height = ranks.setdefault(other.catch_torque_nms_rad, [])
            of_height.append(scale.code(other.intended_grade))
    if not ranks:
        raise ProtocolError(
            "models: simulated raters need a model with an intended_grade, got none"
        )
    heights = sorted(ranks)
    means = [statistics.fmean(ranks[each]) for each in heights]
    return float(np.interp(height, heights, means))


def intended_speeds(protocol: Protocol, key: _Key) -> list[float]:
    """Return the mean speed of each stretch that a simulated hand means to make."""
    rules = protocol.presentation
    if isinstance(rules.stretches, tuple):
        speeds = {"slow": rules.slow_speed_deg_s, "fast": rules.fast_speed_deg_s}
        return [speeds[cue] for cue in rules.stretches]
    if isinstance(rules.stretches, int):
        n_stretches = rules.stretches
    else:
        share = _uniform(protocol.simulated_raters.seed, "stretches", key)
        n_stretches = 1 + int(share * _MOST_STRETCHES)
    return [_speed(protocol, key, number) for number in range(1, n_stretches + 1)]


def _speed(protocol: Protocol, key: _Key, number: int) -> float:
    settings = protocol.simulated_raters
    mean, sd = settings.mean_speed_deg_s, settings.speed_sd_deg_s
    # the first is as it was when there was no other
    share = _uniform(settings.seed, "speed", key, *((number,) if number > 1 else ()))
    speed = mean + sd * statistics.NormalDist().inv_cdf(share)
    return min(max(speed, mean - 3 * sd, 0.2 * mean), mean + 3 * sd)


def sensor_seed(protocol: Protocol, key: _Key) -> int:
    """Return the seed of a simulated torque sensor's noise, another one each time."""
    return int(2**52 * _uniform(protocol.simulated_raters.seed, "sensor", key))


def hand_seed(protocol: Protocol, rater: str) -> int:
    """Return the seed of what a rater's hand is like, in every presentation."""
    seed = protocol.simulated_raters.seed
    return int(2**52 * _uniform(seed, "hand", (rater, "", "", 0)))


def _uniform(seed: int, purpose: str, key: _Key, *further: int) -> float:
    # In (0, 1), from SHA-256 so that it is the same on every machine and version.
    text = json.dumps([seed, purpose, *key, *further])
    word = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")
    return ((word >> 12) + 0.5) / 2**52
