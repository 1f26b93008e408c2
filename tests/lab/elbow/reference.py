"""The joint model once more, in 50 digits: by scanning and halving, not by polynomials.

Written from the equations alone; nothing of masrel's own search is used. Whether
something happens between two points of a grid is seen in floats, and in 50 digits where
those leave a doubt; where it happens is found in 50 digits.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from mpmath import mp, mpf

from masrel.lab.elbow import (
    ConstantSpeed,
    ElbowParameters,
    Hold,
    Joined,
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
)

N_GRID = 400

TIE = mpf("1e-13")  # of a time: what is nearer to its end is at its end

Number = Any  # mpf, float, or an array of floats
Law = Callable[[Number], Number]


@dataclass(frozen=True)
class Segment:
    """A time in which the angle is one formula of the time since its beginning."""

    length: Number
    angle: Law
    velocity: Law
    acceleration: Law


def segments(motion: Motion, number: Callable[[float], Number]) -> list[Segment]:
    """The formulas of a motion, with constants as `number` makes them."""
    makers: dict[type, Callable[..., Iterator[Segment]]] = {
        ConstantSpeed: _constant,
        MinimumJerk: _minimum_jerk,
        Trapezoid: _trapezoid,
        Hold: _hold,
        Reversed: _reversed,
        Part: _part,
        Joined: _joined,
        Recorded: _recorded,
    }
    return list(makers[type(motion)](motion, number))


def _line(start: Number, speed: Number, length: Number) -> Segment:
    return Segment(
        length, lambda u: start + speed * u, lambda u: speed + 0 * u, lambda u: 0 * u
    )


def _constant(motion, number):
    start, speed = number(motion.start), number(motion.speed)
    yield _line(start, speed, (number(motion.end) - start) / speed)


def _hold(motion, number):
    yield _line(number(motion.start), number(0.0), number(motion.duration))


def _minimum_jerk(motion, number):
    start = number(motion.start)
    way = number(motion.end) - start
    total = way / number(motion.mean_speed)
    yield Segment(
        total,
        lambda u: (
            start
            + way
            * (10 * (u / total) ** 3 - 15 * (u / total) ** 4 + 6 * (u / total) ** 5)
        ),
        lambda u: way / total * 30 * (u / total) ** 2 * (1 - u / total) ** 2,
        lambda u: (
            way
            / total**2
            * (60 * (u / total) - 180 * (u / total) ** 2 + 120 * (u / total) ** 3)
        ),
    )


def _trapezoid(motion, number):
    start, end, speed = (number(x) for x in (motion.start, motion.end, motion.speed))
    rate = number(motion.acceleration_rate)
    ramp = speed / rate
    level = (end - start) / speed - ramp
    yield Segment(
        ramp,
        lambda u: start + rate * u * u / 2,
        lambda u: rate * u,
        lambda u: rate + 0 * u,
    )
    if level > 0:
        yield _line(start + speed * ramp / 2, speed, level)
    yield Segment(
        ramp,
        lambda u: end - rate * (ramp - u) ** 2 / 2,
        lambda u: rate * (ramp - u),
        lambda u: -rate + 0 * u,
    )


def _backwards(one: Segment) -> Segment:
    return Segment(
        one.length,
        lambda u: one.angle(one.length - u),
        lambda u: -one.velocity(one.length - u),
        lambda u: one.acceleration(one.length - u),
    )


def _reversed(motion, number):
    yield from (_backwards(one) for one in reversed(segments(motion.motion, number)))


def _later(one: Segment, by: Number, length: Number) -> Segment:
    return Segment(
        length,
        lambda u: one.angle(u + by),
        lambda u: one.velocity(u + by),
        lambda u: one.acceleration(u + by),
    )


def _part(motion, number):
    begin, finish, since = number(motion.begin), number(motion.finish), number(0.0)
    to_the_end = motion.finish == motion.motion.duration
    for one in segments(motion.motion, number):
        low = max(begin - since, 0)
        high = one.length if to_the_end else min(finish - since, one.length)
        if high > low:
            yield _later(one, low, high - low)
        since += one.length


def _joined(motion, number):
    for one in motion.motions:
        yield from segments(one, number)


def _recorded(motion, number):
    # cubics of SciPy, or lines, whose coefficients are taken as they are
    for _, length, (first, *others), _, _ in motion.pieces():
        p = Polynomial([number(motion.start) + number(first), *map(number, others)])
        yield Segment(number(length), p, p.deriv(), p.deriv(2))


class Polynomial(tuple):
    """Coefficients of any kind of number, constant first."""

    def __call__(self, u: Number) -> Number:
        total = 0 * u
        for c in reversed(self):
            total = total * u + c
        return total

    def deriv(self, times: int = 1) -> "Polynomial":
        """The derivative, or one of it."""
        found = Polynomial([i * c for i, c in enumerate(self)][1:])
        return found if times == 1 else found.deriv(times - 1)


def first_above(exact: Law, rough: Law, low: mpf, high: mpf) -> mpf | None:
    """Where a function is first above 0 between two places, or None."""
    shares = np.linspace(0.0, 1.0, N_GRID + 1)
    shares[0] = 1e-25  # what holds from the beginning does so at once
    with np.errstate(all="ignore"):
        heights = np.asarray(rough(float(low) + float(high - low) * shares), float)
    heights = heights + 0.0 * shares
    scale = np.nanmax(np.abs(heights)) or 1.0
    doubtful = ~(np.abs(heights) > 1e-7 * scale)
    doubtful[[0, -1]] = True

    def place(k: int) -> mpf:
        return low + (high - low) * mpf(float(shares[k]))

    for k in np.flatnonzero(doubtful | (heights > 0)).tolist():
        if (exact(place(k)) if doubtful[k] else heights[k]) > 0:
            return low if k == 0 else _root(exact, place(k - 1), place(k))
    return None


def _root(f: Law, low: mpf, high: mpf) -> mpf:
    """Where f, not above 0 at `low`, is above 0: Illinois' rule, then halving."""
    f_low, f_high, side = f(low), f(high), 0
    for _ in range(60):
        if f_low == 0 or f_high == f_low:
            break
        x = high - f_high * (high - low) / (f_high - f_low)
        if not low < x < high:
            break
        height = f(x)
        if height > 0:
            high, f_high = x, height
            f_low = f_low / 2 if side == 1 else f_low
            side = 1
        else:
            low, f_low = x, height
            f_high = f_high / 2 if side == -1 else f_high
            side = -1
        if high - low < mpf("1e-40") * (1 + abs(high)):
            return high
    for _ in range(200):
        middle = (low + high) / 2
        if not low < middle < high:
            break
        low, high = (low, middle) if f(middle) > 0 else (middle, high)
    return high


@dataclass
class Caught:
    """What `masrel.lab.elbow.StretchEvents` holds, in 50 digits."""

    onset: mpf
    onset_angle: mpf
    catch: mpf | None = None
    catch_angle: mpf | None = None
    catch_speed: mpf | None = None
    mean_speed: mpf | None = None
    peak_end: mpf | None = None
    catch_end: mpf | None = None
    post_catch_end: mpf | None = None
    pre_end: mpf | None = None  # τ_pre_end
    post_angle: mpf | None = None  # θ_post


@dataclass
class Reference:
    """The state machine of Fig. 7 in 50 digits."""

    joint: ElbowParameters
    motion: Motion
    phase: str = "pre-catch"
    armed: bool = True
    moving: bool = False
    end: mpf = field(default_factory=lambda: mpf(0))
    stretches: list[Caught] = field(default_factory=list)
    changes: list[tuple[str, mpf, Caught | None]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.exact = segments(self.motion, mpf)
        self.rough = segments(self.motion, float)
        self.starts: list[mpf] = []
        self.changes.append(("pre-catch", mpf(0), None))
        limit = mpf(self.joint.range_end)
        for one, rough in zip(self.exact, self.rough, strict=True):
            self.starts.append(self.end)
            stop = first_above(
                lambda u, one=one: one.angle(u) - limit,
                lambda u, rough=rough: rough.angle(u) - float(limit),
                mpf(0),
                one.length,
            )
            if stop is not None and one.length - stop <= TIE * one.length:
                stop = None
            self.segment(one, rough, one.length if stop is None else stop)
            self.end += one.length if stop is None else stop
            if stop is not None:
                break
        for stretch in self.stretches:
            if stretch.catch is not None:
                last = self.end if stretch.catch_end is None else stretch.catch_end
                peak = stretch.catch + mpf(self.joint.peak_duration)
                stretch.peak_end = min(peak, last)

    def segment(self, one: Segment, rough: Segment, stop: mpf) -> None:
        threshold = mpf(self.joint.speed_threshold)
        marks = [mpf(0)]
        for limit in (threshold, -threshold):
            marks += self.crossings(one, rough, stop, limit)
        marks = [*sorted(marks), stop]
        for low, high in itertools.pairwise(marks):
            if high - low <= TIE * one.length:
                continue
            # not in the middle, where a symmetric speed may touch the threshold
            speed = one.velocity(low + mpf("0.4871") * (high - low))
            if speed <= -threshold:
                self.flexed(low)
            elif speed < threshold:
                self.slow(one, rough, low, high)
            else:
                self.fast(one, rough, low, high, speed > threshold)

    def crossings(
        self, one: Segment, rough: Segment, stop: mpf, limit: mpf
    ) -> list[mpf]:
        found, low = [], mpf(0)
        sign = 1
        if one.velocity(stop * mpf("1e-12")) > limit:
            sign = -1
        while True:
            place = first_above(
                lambda u, s=sign: s * (one.velocity(u) - limit),
                lambda u, s=sign: s * (rough.velocity(u) - float(limit)),
                low,
                stop,
            )
            if place is None or (found and place <= found[-1]):
                return found
            if place > 0:
                found.append(place)
            low, sign = place, -sign

    def flexed(self, at: mpf) -> None:
        if self.phase == "catch":
            self.stretches[-1].catch_end = self.end + at
        if self.phase == "post-catch":
            self.stretches[-1].post_catch_end = self.end + at
        self.change("pre-catch", at)
        self.armed, self.moving = True, False

    def slow(self, one: Segment, rough: Segment, low: mpf, high: mpf) -> None:
        if self.phase == "catch":
            low = self.leave_catch(one, rough, low, high)
        if self.phase == "post-catch":
            self.stretches[-1].post_catch_end = self.end + low
            self.change("pre-catch", low)
        self.moving = False

    def fast(
        self, one: Segment, rough: Segment, low: mpf, high: mpf, above: bool
    ) -> None:
        if self.phase == "pre-catch":
            if not self.moving:
                self.moving = True
                self.stretches.append(Caught(self.end + low, one.angle(low)))
            if not (above and self.armed):
                return
            found = self.find_catch(one, rough, low, high)
            if found is None:
                return
            self.begin_catch(one, found)
            low = found
        if self.phase == "catch":
            self.leave_catch(one, rough, low, high)

    def find_catch(
        self, one: Segment, rough: Segment, low: mpf, high: mpf
    ) -> mpf | None:
        joint, stretch = self.joint, self.stretches[-1]

        def excess(u, law, number):
            since = number(self.end - stretch.onset) + u
            way = law.angle(u) - number(stretch.onset_angle)
            with np.errstate(all="ignore"):
                mean = way / since
            top, slope = (
                number(x) for x in (joint.catch_angle_constant, joint.catch_slope)
            )
            least, slowest = (
                number(x)
                for x in (joint.smallest_catch_angle, joint.slowest_mean_speed)
            )
            if number is mpf:
                fast = mean > (top - least) / slope
                return law.angle(u) - (
                    least if fast else top - slope * max(mean, slowest)
                )
            fast = mean > (top - least) / slope
            held = np.where(fast, least, top - slope * np.maximum(mean, slowest))
            return law.angle(u) - held

        place = first_above(
            lambda u: excess(u, one, mpf), lambda u: excess(u, rough, float), low, high
        )
        is_late = place is not None and high - place <= TIE * (high - low)
        return None if is_late else place

    def begin_catch(self, one: Segment, at: mpf) -> None:
        joint, stretch = self.joint, self.stretches[-1]
        angle, speed = one.angle(at), one.velocity(at)
        time = self.end + at
        since = time - stretch.onset
        stretch.catch, stretch.catch_angle, stretch.catch_speed = time, angle, speed
        stretch.mean_speed = (
            (angle - stretch.onset_angle) / since if since > mpf("1e-35") else speed
        )
        stretch.pre_end = (
            mpf(joint.damping) * speed
            + mpf(joint.stiffness) * (angle - self.rest)
            + mpf(joint.inertia) * one.acceleration(at)
        )
        self.armed = self.moving = False
        self.change("catch", at)

    def leave_catch(self, one: Segment, rough: Segment, low: mpf, high: mpf) -> mpf:
        stretch = self.stretches[-1]
        goal = stretch.catch_angle + mpf(self.joint.catch_travel)
        # in floats, from the catch on: the travel may be tiny
        base = float(stretch.catch_angle)
        place = first_above(
            lambda u: one.angle(u) - goal,
            lambda u: (rough.angle(u) - base) - self.joint.catch_travel,
            low,
            high,
        )
        if place is None or high - place <= TIE * high:
            return low
        stretch.catch_end = self.end + place
        stretch.post_angle = one.angle(place)
        self.change("post-catch", place)
        return place

    def change(self, phase: str, at: mpf) -> None:
        if phase == self.phase:
            return
        self.phase = phase
        stretch = None if phase == "pre-catch" else self.stretches[-1]
        self.changes.append((phase, self.end + at, stretch))

    @property
    def rest(self) -> mpf:
        rest = self.joint.rest_angle
        return mpf(self.motion.start if rest is None else rest)

    def steepness(self, time: float) -> float:
        """How fast the torque grows in a smoothed onset, N·m/s: its steepest."""
        for stretch in self.stretches:
            if stretch.catch is not None and self.joint.catch_rise > 0.0:
                since = time - float(stretch.catch)
                if 0.0 <= since <= 1.01 * self.joint.catch_rise:
                    rise = self.joint.catch_torque_constant * float(stretch.catch_speed)
                    return 1.5 * rise / self.joint.catch_rise
        return 0.0

    def terms(self, time: mpf) -> list[mpf]:
        """The terms of the torque at a time; their sum is the torque."""
        joint = self.joint
        i = max(i for i, start in enumerate(self.starts) if start <= time)
        one, u = self.exact[i], time - self.starts[i]
        phase, stretch = next(
            (phase, stretch)
            for phase, start, stretch in reversed(self.changes)
            if start <= time
        )
        inertia = mpf(joint.inertia) * one.acceleration(u)
        pre = [
            mpf(joint.damping) * one.velocity(u),
            mpf(joint.stiffness) * (one.angle(u) - self.rest),
            inertia,
        ]
        if phase == "pre-catch":
            return pre
        rise = mpf(joint.catch_torque_constant) * stretch.catch_speed
        share = mpf(joint.residual_ratio)
        if joint.residual_reading == "decrease":
            share = 1 - share
        since = time - stretch.catch
        if phase == "catch":
            if since < joint.catch_rise:
                y = since / mpf(joint.catch_rise)
                return [stretch.pre_end, rise * y * y * (3 - 2 * y)]
            return [
                stretch.pre_end,
                rise * (1 if since < joint.peak_duration else share),
            ]
        climb = mpf(joint.post_catch_stiffness) * (one.angle(u) - stretch.post_angle)
        if joint.post_catch == "additive":
            return [*pre, share * rise, climb]
        return [stretch.pre_end, share * rise, climb, inertia]


def solved(joint: ElbowParameters, motion: Motion) -> Reference:
    """Solve a scene; call it and use what it gives within 50 digits."""
    assert mp.dps >= 50
    return Reference(replace(joint), motion)
