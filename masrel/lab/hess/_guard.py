"""What every reading, every torque and every tick of the loop has to pass.

In: `DeviceLimits`, readings, torques, ticks that were missed. Out: nothing, or a
`LimitExceededError` that names the limit.
"""

import math
from collections import deque

from masrel.errors import LimitExceededError
from masrel.lab.hess._signals import CUTOFF_RAD_S
from masrel.lab.hess.controller import Friction
from masrel.lab.hess.limits import DeviceLimits

# An arm that was faster than this cannot stop within a tick without 20 N·m on its
# 0.06 kg·m²; slower ones may come to rest between two steps of the encoder.
_MOVING_SPEED = math.radians(20.0)
_MAX_STOP_TICKS = 1.5

# A drift is told from a start by two intervals of this: an arm that begins to move
# covers more in the second than in the first (simulated hands 1.33 times as much and
# more), an even speed as much, but for a step of the encoder (at most 1.17). Less than
# six steps in the first do not tell.
_START_S = 0.010
_EVEN = (0.75, 1.25)
_LEAST_START = math.radians(0.03)
_REST_S = 0.05  # without a change of angle: the arm has come to rest

# What is too slow for that is told by going so much further without ever being faster:
# at an even 4 deg/s the estimated speed is up to half a step's 0.8 deg/s above it.
_CREEP_SPEED = math.radians(4.5)
_CREEP_DRIFTS = 5.0  # in drift angles

# An arm that stands still after it was no faster than a creep was brought to rest, by
# friction and a hand that holds it: so long, in standing times, may that last.
HELD_TIMES = 20.0

# Where an arm bounces off the joint's end, the estimated speed is still that of the
# bounce. But so short a way in so long was no faster than a creep either, which covers
# 0.018 deg less a step of the encoder.
_SETTLED = math.radians(0.0125)
_SETTLED_S = 0.0035  # four ticks

# Of so many ticks `DeviceLimits.missed_replies_per_100` may be without a reading.
_WINDOW_TICKS = 100

# And of so many `DeviceLimits.missed_ticks` may be missed: at 1 kHz a stretch of 116
# deg at 60 deg/s, the slowest that the paper's models distinguish, takes 1.9 s.
_STRETCH_TICKS = 2000


# What a hand may be asked to take up from one stretch to the next, W: clonus that does
# not fade gives a third of that.
_FORGIVEN_W = 0.2

# As near to where the first stretch began an arm is back there.
_BACK = math.radians(3.0)


class Guard:
    """Check readings, torques and ticks against limits that look at more than one."""

    def __init__(
        self, limits: DeviceLimits, period_s: float, *, has_hand: bool = True
    ) -> None:
        # has_hand: whether a hand may hold the arm at rest
        self._limits = limits
        self._period = period_s
        self._held_time = limits.standing_time * (HELD_TIMES if has_hand else 1.0)
        self._time = -math.inf  # of the last reading, s
        self._angle = 0.0
        self._raw_speed = 0.0  # between the last two readings, rad/s
        self._moved_at = 0.0  # when the angle changed last, s
        self._speed = 0.0  # estimated when the angle changed last, rad/s
        # where it has stayed near since when, rad and s
        self._settled_from, self._settled_at = 0.0, 0.0
        self._slow_from: float | None = None  # where it was faster than a creep, rad
        self._creep_angle = _CREEP_DRIFTS * limits.drift_angle
        self._stopped_dead = False  # whether it moved fast one tick before that
        self._sent = 0.0  # the last torque, N·m
        self._sent_at = math.inf  # nothing yet: the device holds zero
        self._drift: Drift | None = None  # while the arm may be one that creeps
        # Ticks without a new reading: the first and the last of 100 are 99 periods
        # apart; half of one more is for a loop that comes late.
        self.n_without_reading = self._n_in_a_row = 0
        self._window_s = (_WINDOW_TICKS - 0.5) * period_s
        self._without: deque[float] = deque(maxlen=limits.missed_replies_per_100 + 1)
        # Ticks that were missed
        self.n_missed_ticks = 0
        self._missed: deque[int] = deque(maxlen=limits.missed_ticks + 1)
        # A spring over the last bit of the range at each of its ends
        self._slope = limits.soft_stop_torque / limits.soft_stop_width
        self._upper = limits.highest_angle - limits.soft_stop_width
        self._lower = limits.lowest_angle + limits.soft_stop_width

    def is_new(self, time_s: float) -> bool:
        """Return whether a reading is newer than the last one."""
        return time_s > self._time

    def reading(self, time_s: float, angle: float, age_s: float) -> None:
        """Check a new reading alone and against the one before."""
        limits = self._limits
        if not -self._period <= age_s <= limits.stale_time:
            raise LimitExceededError(
                f"stale: needs a reading at most {limits.stale_time * 1e3:g} ms old, "
                f"got one of {age_s * 1e3:.1f} ms",
                "stale",
            )
        if not limits.lowest_angle <= angle <= limits.highest_angle:
            raise LimitExceededError(
                f"range: needs {math.degrees(limits.lowest_angle):.1f} to "
                f"{math.degrees(limits.highest_angle):.1f} deg, the arm is at "
                f"{math.degrees(angle):.1f} deg",
                "range",
            )
        self._n_in_a_row = 0
        if self._time == -math.inf:
            self._moved_at = self._settled_at = time_s
            self._settled_from = angle
            self._drift = Drift(limits, angle)
        else:
            self._follows(time_s, angle)
        self._time = time_s
        self._angle = angle

    def _follows(self, time_s: float, angle: float) -> None:
        # The same encoder cannot read just any angle one tick later.
        limits = self._limits
        interval = time_s - self._time
        change = angle - self._angle
        if change == 0.0:
            self._raw_speed = 0.0
            self._still_for(time_s - self._moved_at)
            return
        deviation = change - self._raw_speed * interval
        ticks = interval / self._period if interval > self._period else 1.0
        if not -limits.jump_angle <= deviation / ticks <= limits.jump_angle:
            raise LimitExceededError(
                f"jump: needs an angle within {math.degrees(limits.jump_angle):g} deg "
                f"of the one that the speed predicts, got "
                f"{math.degrees(deviation / ticks):.2f} deg a tick from it",
                "jump",
            )
        if self._drift is not None and not self._drift.goes_on(
            time_s, angle, self._time
        ):
            self._drift = None
        self._raw_speed = speed = change / interval
        self._moved_at = time_s
        if not -_SETTLED <= angle - self._settled_from <= _SETTLED:
            self._settled_from, self._settled_at = angle, time_s
        # Over a longer gap it may well have come to rest, against an end stop say.
        self._stopped_dead = abs(speed) > _MOVING_SPEED and ticks < _MAX_STOP_TICKS

    def _still_for(self, duration_s: float) -> None:
        limits = self._limits
        if self._drift is None and duration_s > _REST_S:
            self._drift = Drift(limits, self._angle)
        if self._stopped_dead and duration_s > limits.frozen_time:
            raise LimitExceededError(
                f"frozen: needs a change of angle within "
                f"{limits.frozen_time * 1e3:g} ms while the arm moves, "
                f"got none for {duration_s * 1e3:.1f} ms",
                "frozen",
            )
        if duration_s > limits.standing_time and not (
            -limits.standing_torque <= self._sent <= limits.standing_torque
        ):
            self._not_held_for(duration_s)

    def _not_held_for(self, duration_s: float) -> None:
        limits = self._limits
        was_held = (
            -_CREEP_SPEED < self._speed < _CREEP_SPEED
            or self._moved_at - self._settled_at > _SETTLED_S
        )
        longest = self._held_time if was_held else limits.standing_time
        if duration_s > longest:
            raise LimitExceededError(
                f"standing torque: needs at most {limits.standing_torque:g} N·m on an "
                f"arm that has not moved for {longest * 1e3:g} ms, "
                f"got {self._sent:.3f} N·m",
                "standing-torque",
            )

    def speed(self, velocity: float) -> None:
        """Check the estimated speed."""
        limit = self._limits.speed
        if self._raw_speed != 0.0:
            self._speed = velocity
        if not -limit <= velocity <= limit:
            raise LimitExceededError(
                f"speed: needs at most {math.degrees(limit):.0f} deg/s, the arm "
                f"moves at {math.degrees(velocity):.0f} deg/s",
                "speed",
            )
        if self._slow_from is None or not -_CREEP_SPEED < velocity < _CREEP_SPEED:
            self._slow_from = self._angle
        elif abs(self._angle - self._slow_from) > self._creep_angle:
            raise LimitExceededError(
                f"drift: needs an arm that rests or is faster than "
                f"{math.degrees(_CREEP_SPEED):g} deg/s, got an encoder that crept "
                f"by {math.degrees(self._creep_angle):g} deg",
                "drift",
            )

    def torque(self, time_s: float, torque: float) -> None:
        """Check a torque before it is sent."""
        limits = self._limits
        if not -limits.torque <= torque <= limits.torque:
            raise LimitExceededError(
                f"torque: needs at most {limits.torque:g} N·m, got {torque:.3f} N·m",
                "torque",
            )
        before = self._sent
        if not (0.0 <= torque <= before or before <= torque <= 0.0):  # it builds up
            interval = time_s - self._sent_at
            if interval < self._period:
                interval = self._period
            if abs(torque - before) > limits.torque_rate * interval:
                raise LimitExceededError(
                    f"torque rate: needs at most {limits.torque_rate:g} N·m/s, "
                    f"got {before:.3f} and then {torque:.3f} N·m",
                    "torque-rate",
                )
        self._sent = torque
        self._sent_at = time_s

    def begins_with(self, torque: float) -> None:
        """Check what a model asks for before anything moves."""
        # A hand that has only just taken the arm does not expect more
        limit = self._limits.standing_torque
        if not -limit <= torque <= limit:
            raise LimitExceededError(
                f"start: needs at most {limit:g} N·m in the first tick, but at "
                f"{math.degrees(self._angle):.1f} deg the model asks for {torque:.3f} "
                "N·m; move the arm to the start of the stretch",
                "start",
            )

    def soft_stop(self, angle: float) -> float:
        """Return the torque of the springs at the ends of the range, N·m."""
        # positive near the highest angle, negative near the lowest, 0 between
        if angle > self._upper:
            return self._slope * (angle - self._upper)
        return self._slope * (angle - self._lower) if angle < self._lower else 0.0

    def no_reading(self, time_s: float, reason: str) -> None:
        """Count a tick without a new reading; many in a row or in 100 are a fault."""
        limits = self._limits
        self.n_without_reading += 1
        self._n_in_a_row += 1
        if self._n_in_a_row > limits.missed_replies:
            raise LimitExceededError(
                f"missed replies: needs at most {limits.missed_replies} ticks in a row "
                f"without a new reading, got {self._n_in_a_row} ({reason})",
                "missed-replies",
            )
        times = self._without
        times.append(time_s)
        if len(times) == times.maxlen and time_s - times[0] < self._window_s:
            raise LimitExceededError(
                f"missed replies: needs at most {limits.missed_replies_per_100} of "
                f"{_WINDOW_TICKS} ticks without a new reading, got {len(times)} "
                f"within {(time_s - times[0]) * 1e3:.1f} ms ({reason})",
                "missed-replies",
            )

    def missed(self, first: int, after: int, gap_s: float) -> None:
        """Count the ticks from one to before another, after so long a silence."""
        self.n_missed_ticks += after - first
        self.silence(gap_s)
        missed = self._missed
        missed.extend(range(first, after))
        if len(missed) == missed.maxlen and missed[-1] - missed[0] < _STRETCH_TICKS:
            raise LimitExceededError(
                f"missed ticks: needs at most {self._limits.missed_ticks} of any "
                f"{_STRETCH_TICKS}, the loop missed {len(missed)} of "
                f"{missed[-1] - missed[0] + 1}",
                "overrun",
            )

    def silence(self, gap_s: float) -> None:
        """Check how long no command has been sent."""
        limits = self._limits
        if gap_s >= limits.watchdog_time:
            raise LimitExceededError(
                f"silence: needs a command every {limits.watchdog_time * 1e3:g} ms, "
                f"the loop sent none for {gap_s * 1e3:.1f} ms",
                "overrun",
            )


# So long may the sensor read another torque than the one that is sent; the low-pass of
# the estimated speed is on the difference, too, so that a late sensor leaves little.
_ACTUATOR_S = 0.05
_SILENT_S = 0.01  # after which there is nothing to go on with


class ActuatorGuard:
    """Tell an actuator that does not do what it is told, by the torque sensor."""

    # The sensor between the arm and the device reads what the arm pulls at:
    #     τ_motor + B θ̇ + β sgn(θ̇) + I θ̈ with I, B, β of (7)
    # Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370.

    def __init__(
        self, limits: DeviceLimits, friction: Friction, rate_hz: int, delay: float
    ) -> None:
        self._limit, self._friction = limits.actuator_torque, friction
        # What is sent in a tick acts in the next one, or after so many
        n_ticks = max(1, round(delay * rate_hz))
        self._sent = deque([0.0] * n_ticks, maxlen=n_ticks)
        self._gain = -math.expm1(-CUTOFF_RAD_S / rate_hz)
        self._rate_hz = rate_hz
        self._residual = 0.0  # measured less expected, N·m, late
        self._speed = 0.0
        self._within_s = self._read_s = 0.0  # when within the limit, and read, last, s

    def check(
        self, time_s: float, velocity: float, sent: float, measured: float
    ) -> None:
        """Check what was measured against the torque that was held until then."""
        friction = self._friction
        self._sent.append(sent)
        acceleration = (velocity - self._speed) * self._rate_hz
        self._speed = velocity
        if math.isnan(measured):  # no fault of the actuator; a sensor may be slower
            return
        if time_s - self._read_s > _SILENT_S:
            self._within_s = time_s
        self._read_s = time_s
        moved = friction.inertia * acceleration + friction.viscous * velocity
        moved += math.copysign(friction.coulomb, velocity) if velocity else 0.0
        moved += self._sent[0]
        self._residual += self._gain * (measured - moved - self._residual)
        if abs(self._residual) <= self._limit:
            self._within_s = time_s
        elif time_s - self._within_s > _ACTUATOR_S:
            raise LimitExceededError(
                f"actuator: needs a torque within {self._limit:g} N·m of the one that "
                f"was sent, got a difference of {self._residual:+.2f} N·m for "
                f"{_ACTUATOR_S * 1e3:g} ms",
                "actuator",
            )


class Drift:
    """Tell whether an arm that leaves its rest starts, or its encoder drifts."""

    def __init__(self, limits: DeviceLimits, rest: float) -> None:
        self._limits = limits
        self._rest = rest  # rad
        self._left_at = math.inf  # when it was there last, s
        self._first = 0.0  # travel of the first interval, rad
        self._speed = 0.0  # of the second, rad/s; 0 before

    def goes_on(self, time_s: float, angle: float, before_s: float) -> bool:
        """Take a changed angle in -> whether it may still be a drift."""
        if self._left_at == math.inf:
            self._left_at = before_s
        moved, since = angle - self._rest, time_s - self._left_at
        if since < _START_S:
            return True
        if self._first == 0.0:
            self._first = moved
            return abs(moved) >= _LEAST_START
        if since < 2.0 * _START_S:
            return True
        if self._speed == 0.0:
            second = moved - self._first
            self._speed = abs(moved) / since
            return _EVEN[0] < second / self._first < _EVEN[1]
        return self._is_even(abs(moved), abs(moved) / since)

    def _is_even(self, moved: float, speed: float) -> bool:
        limits = self._limits
        if moved < limits.drift_angle:
            return 0.5 * self._speed < speed < 1.5 * self._speed
        if speed < limits.drift_speed:
            raise LimitExceededError(
                f"drift: needs an arm that starts from rest, got an encoder that "
                f"read {math.degrees(speed):.1f} deg/s at once and moved by "
                f"{math.degrees(moved):.1f} deg",
                "drift",
            )
        return False


class ActiveGuard:
    """Check torque, energy and speed of a model that is not passive."""

    # The device holds a torque τ until the next one, so that an arm that meanwhile goes
    # from θ to θ' takes -τ (θ' - θ) of energy: exactly, but for the motor's lag. It is
    # the model's torque that counts: what compensates friction is eaten by friction.
    # Hannaford, B., Ryu, J.-H. (2002). IEEE Trans. Robot. Autom. 18(1), 1-10 (passivity
    # observer): https://doi.org/10.1109/70.988969

    def __init__(self, limits: DeviceLimits) -> None:
        self._limits = limits
        self._first_angle = math.nan  # where the first stretch began, rad
        self._forgiven_at = 0.0  # when the last stretch from there began, s
        self._angle = self._held = 0.0  # of the last tick: rad, N·m
        self.energy_given = 0.0  # to the arm, less what was taken from it, J

    def begin_stretch(self, time_s: float, angle: float) -> None:
        """Let the model give back no more what it took in earlier stretches."""
        # Only where the first stretch began holds no spring what it took.
        if math.isnan(self._first_angle):
            self._first_angle, self._forgiven_at = angle, time_s
        elif angle <= self._first_angle + _BACK:
            forgiven = _FORGIVEN_W * (time_s - self._forgiven_at)
            self.energy_given = max(self.energy_given - forgiven, 0.0)
            self._forgiven_at = time_s

    def check(self, angle: float, velocity: float, torque: float) -> None:
        """Check what a model asks for before it is sent."""
        limits = self._limits
        self.energy_given -= self._held * (angle - self._angle)
        if self.energy_given > limits.active_energy:
            raise LimitExceededError(
                f"energy: needs a model that gives the arm at most "
                f"{limits.active_energy:g} J more than it takes, got "
                f"{self.energy_given:.3f} J",
                "energy",
            )
        if not -limits.active_torque <= torque <= limits.active_torque:
            raise LimitExceededError(
                f"active torque: needs at most {limits.active_torque:g} N·m from a "
                f"model that is not passive, got {torque:.3f} N·m",
                "active-torque",
            )
        if torque * velocity < 0.0 and abs(velocity) > limits.active_speed:
            raise LimitExceededError(
                f"slip: needs at most {math.degrees(limits.active_speed):.0f} deg/s in "
                "the direction in which a model that is not passive pushes, got "
                f"{math.degrees(velocity):.0f} deg/s",
                "slip",
            )
        self._angle = angle
        self._held = torque
