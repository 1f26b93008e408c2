"""The course of a motion: its phases, found piece by piece, without stepping.

In: a joint and a motion. Out: what happens when, in 50-digit decimals.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4), (6) and Fig. 7.
"""

import math
from decimal import Decimal
from itertools import pairwise

from masrel.elbow.catch import Onset, catch_share
from masrel.elbow.moments import Change, Course, Moment, Stretch
from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ONE, ZERO, exactly, value
from masrel.elbow.roots import cuts
from masrel.errors import ParameterError
from masrel.recording import Phase

__all__ = ["course", "end_time", "rest_angle"]


def course(parameters: ElbowParameters, motion: Motion) -> Course:
    """Find out what happens in a motion.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    Course
        Its phases and stretches; times to 40 digits or so.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.
    """
    _check_start(parameters, motion)
    with exactly():
        return _Walk(parameters).through(motion)


def end_time(parameters: ElbowParameters, motion: Motion) -> float:
    """Return when a motion ends, at its own end or at the end of range.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint, of which the end of range is used.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        Time from the start, s.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> from math import radians
    >>> stretch = ConstantSpeed(start=radians(46), end=radians(160), speed=radians(50))
    >>> round(end_time(STANDARD_MODELS["HM1"], stretch), 12)
    2.0
    """
    _check_start(parameters, motion)
    limit, time = Decimal(parameters.range_end), ZERO
    with exactly():
        for piece in motion.pieces():
            share = _share_in_range(piece, limit)
            time += share * piece.length
            if share < 1:
                break
        return float(time)


def _check_start(parameters: ElbowParameters, motion: Motion) -> None:
    if motion.start >= parameters.range_end:
        raise ParameterError(
            "start: needs less than the end of range, "
            f"{math.degrees(parameters.range_end):g} degrees, got "
            f"{math.degrees(motion.start):g} degrees"
        )


def rest_angle(parameters: ElbowParameters, motion: Motion) -> float:
    """Return θ_rest of (1).

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion.

    Returns
    -------
    float
        The joint's own, or the angle where the motion starts, rad.
    """
    return motion.start if parameters.rest_angle is None else parameters.rest_angle


class _Walk:
    """The state machine of Fig. 7, led from piece to piece instead of sampled."""

    def __init__(self, parameters: ElbowParameters) -> None:
        self._parameters = parameters
        self._threshold = Decimal(parameters.speed_threshold)
        self._travel = Decimal(parameters.catch_travel)
        self._limit = Decimal(parameters.range_end)
        self._phase: Phase = "pre-catch"
        self._is_armed = True
        self._onset: Onset | None = None  # of the movement going on in pre-catch
        self._changes: list[Change] = []
        self._stretches: list[Stretch] = []

    def through(self, motion: Motion) -> Course:
        time, last = ZERO, ONE
        for piece in motion.pieces():
            last = _share_in_range(piece, self._limit)
            if not self._changes:
                self._change("pre-catch", _moment(piece, time, ZERO))
            if last > 0:
                self._piece(piece, time, last)
            end = _moment(piece, time, last)
            if last < 1:
                break
            time = end.time
        return Course(
            changes=tuple(self._changes), stretches=tuple(self._stretches), end=end
        )

    def _piece(self, piece: Piece, time: Decimal, last: Decimal) -> None:
        velocity, threshold = piece.velocity, self._threshold
        limits = (
            (velocity[0] - threshold, *velocity[1:]),
            (velocity[0] + threshold, *velocity[1:]),
        )
        for low, high in pairwise(cuts(limits, ZERO, last)):
            speed = value(velocity, _middle(low, high))
            if abs(abs(speed) - threshold) <= _ROUNDING * threshold:
                speed = threshold.copy_sign(speed)
            if speed <= -threshold:
                self._flexed(_moment(piece, time, low))
            elif speed < threshold:
                self._slow(piece, time, low, high)
            else:
                self._fast(piece, time, low, high, may_catch=speed > threshold)

    def _flexed(self, moment: Moment) -> None:
        # the stretch is over, and the next may catch
        if self._phase == "catch":
            self._stretches[-1].catch_end = moment
        if self._phase == "post-catch":
            self._stretches[-1].post_catch_end = moment
        if self._phase != "pre-catch":
            self._change("pre-catch", moment)
        self._is_armed, self._onset = True, None

    def _slow(self, piece: Piece, time: Decimal, low: Decimal, high: Decimal) -> None:
        if self._phase == "catch":
            low = self._catch_until(piece, time, low, high)
        if self._phase == "post-catch":  # ends below ν_th, Fig. 7
            moment = _moment(piece, time, low)
            self._stretches[-1].post_catch_end = moment
            self._change("pre-catch", moment)
        self._onset = None

    def _fast(
        self,
        piece: Piece,
        time: Decimal,
        low: Decimal,
        high: Decimal,
        *,
        may_catch: bool,
    ) -> None:
        if self._phase == "pre-catch":
            if self._onset is None:
                moment = _moment(piece, time, low)
                self._onset = Onset(
                    piece=piece, share=low, time=moment.time, angle=moment.angle
                )
                self._stretches.append(Stretch(onset=moment))
            if not (may_catch and self._is_armed):
                return
            found = catch_share(self._parameters, self._onset, piece, time, (low, high))
            if found is None:
                return
            low, mean_speed = found
            self._catch(_moment(piece, time, low), mean_speed)
        if self._phase == "catch":
            self._catch_until(piece, time, low, high)

    def _catch(self, moment: Moment, mean_speed: Decimal) -> None:
        stretch = self._stretches[-1]
        stretch.catch, stretch.mean_speed = moment, mean_speed
        self._is_armed, self._onset = False, None
        self._change("catch", moment)

    def _catch_until(
        self, piece: Piece, time: Decimal, low: Decimal, high: Decimal
    ) -> Decimal:
        # (4): the catch ends when the angle travelled exceeds D
        stretch = self._stretches[-1]
        if stretch.catch is None:
            return low
        goal = stretch.catch.angle + self._travel
        beyond = (piece.angle[0] - goal, *piece.angle[1:])
        for left, right in pairwise(cuts((beyond,), low, high)):
            if value(beyond, _middle(left, right)) > 0:
                moment = _moment(piece, time, left)
                stretch.catch_end = stretch.post_catch = moment
                self._change("post-catch", moment)
                return left
        return low

    def _change(self, phase: Phase, moment: Moment) -> None:
        stretch = None if phase == "pre-catch" else self._stretches[-1]
        self._phase = phase
        self._changes.append(Change(phase=phase, moment=moment, stretch=stretch))


_HALF = Decimal("0.5")

_ROUNDING = Decimal("1e-40")
# Of ν_th, and rad of the end of range: what is as near as that is the same, but for
# rounding of 50 digits.


def _share_in_range(piece: Piece, limit: Decimal) -> Decimal:
    # the joint goes no further than the end of its range
    if sum(max(c, ZERO) for c in piece.angle) - limit <= _ROUNDING:
        return ONE
    beyond = (piece.angle[0] - limit, *piece.angle[1:])
    for low, high in pairwise(cuts((beyond,), ZERO, ONE)):
        if value(beyond, _middle(low, high)) > 0:
            return low
    return ONE


def _middle(low: Decimal, high: Decimal) -> Decimal:
    return low + _HALF * (high - low)


def _moment(piece: Piece, time: Decimal, share: Decimal) -> Moment:
    return Moment(
        time=time + share * piece.length,
        angle=value(piece.angle, share),
        velocity=value(piece.velocity, share),
        acceleration=value(piece.acceleration, share),
    )
