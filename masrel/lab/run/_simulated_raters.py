"""Simulated raters: grades and speeds of a stated accuracy, for trying a study out.

Nothing here models a person. ``docs/reference/formats/session_log.md`` states the rules
in words.
"""

import hashlib
import json
import math
import statistics
from typing import ClassVar

import numpy as np

from masrel.errors import ParameterError, ProtocolError
from masrel.lab.protocol import Model, Protocol, scale_of
from masrel.lab.protocol._values import Answer
from masrel.lab.run._grade_sources import GradeRequest, GradeSource, QuestionRequest

_MOST_STRETCHES = 3  # of a simulated rater who may stretch as often as wanted


_Key = tuple[str, str, str, int]  # rater, session, model and repeat


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
    with probability `retest_agreement`, else a new grade.

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
        # by rater; backwards, so that of several sessions the first one stays
        self._first_session = dict(reversed(protocol.rater_sessions))

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
