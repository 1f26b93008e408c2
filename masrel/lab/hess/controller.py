"""The controller of Fig. 7: the joint model, friction, and loss of grip.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B and Fig. 7.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

from masrel._input import refuse
from masrel.errors import LimitExceededError
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.elbow.tone import JointModel
from masrel.lab.hess._signals import CUTOFF_RAD_S, Flexion, raised_cosine
from masrel.lab.hess.limits import _check_not_negative, _check_positive
from masrel.lab.recording import PHASES

_PRE_CATCH = PHASES.index("pre-catch")
_INFINITE = math.inf
_SLIP_WINDOW_S = 0.010  # twice the delay of the estimated speed
_LOOSE_WINDOW_S = 0.005  # under 3 N·m a loose arm loses 18 times the speed's noise
# Share of the speed a loose arm would lose: an arm in people's hands loses at most two
# fifths, a loose one all but what the low-pass holds back.
_LOOSE_SHARE = 0.6
# Behind the guard a beat of clonus throws light hands back as well, and a hand may turn
# the arm by itself, at up to 30 rad/s²: more counts, of what 2.8 N·m take in 6 ms.
_GUARDED_SHARE = 0.78
_MOST_GIVEN_UP = 0.25  # of a guarded model's torque in one tick, N·m
_GUARDED_WINDOW_S = 0.006
_LEAST_LOSS = math.radians(16.0)
_RANGE_END_MARGIN = math.radians(3.0)  # what the loop takes for arrived, too


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Friction of motor and cable drive at the elbow, identified for (7).

    Attributes
    ----------
    inertia : float
        I of (7), kg·m²: motor and speed reduction, without the forearm.
    viscous : float
        B of (7), N·m·s/rad.
    coulomb : float
        β of (7), N·m.

    Raises
    ------
    ParameterError
        If one is negative or not finite, or the inertia is 0.
    """

    inertia: float = 0.0097
    viscous: float = 0.168
    coulomb: float = 0.189

    def __post_init__(self) -> None:
        _check_positive(inertia=self.inertia)
        _check_not_negative(viscous=self.viscous, coulomb=self.coulomb)


class FrictionCompensation:
    """The share of the friction that the motor takes off the rater's hand.

    The Coulomb part needs the sign of a speed that an encoder resolves in steps,
    so it is 0 in a dead zone around rest, grows in proportion to the speed above
    it, and is whole from `full_speed` on: a torque that never jumps. At rest a step of
    the encoder, 0.8 deg/s in the estimate, switches 0.06 N·m of it on for some
    milliseconds: less than the friction that holds the arm, so that nothing moves.

    Parameters
    ----------
    friction : Friction
        What is there.
    share : float
        How much of it is compensated, from 0 to 1. Above 1 the device would feed
        energy into the hand and creep by itself, so it is refused; at 1 a slightly
        overestimated B or β does the same.
    dead_zone : float, optional
        Speed below which the Coulomb part is 0, rad/s.
    full_speed : float, optional
        Speed above which it is whole, rad/s.

    Raises
    ------
    ParameterError
        If the share is outside [0, 1] or the speeds are not in order.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    At 1 rad/s, nine tenths of 0.168 and 0.189 N·m:

    >>> round(FrictionCompensation(Friction(), share=0.9).torque(1.0), 4)
    0.3213
    """

    def __init__(
        self,
        friction: Friction,
        *,
        share: float,
        dead_zone: float = math.radians(0.1),
        full_speed: float = math.radians(2.0),
    ) -> None:
        refuse(
            (not 0.0 <= share <= 1.0, f"share: needs [0, 1], got {share}"),
            (
                not 0.0 <= dead_zone < full_speed < math.inf,
                "dead_zone, full_speed: need 0 <= dead_zone < full_speed, "
                f"got {dead_zone} and {full_speed}",
            ),
        )
        self._viscous = share * friction.viscous
        self._coulomb = share * friction.coulomb
        self._dead_zone = dead_zone
        self._full_speed = full_speed
        self._slope = self._coulomb / (full_speed - dead_zone)

    def torque(self, velocity: float) -> float:
        """Return the torque that helps the motion.

        Parameters
        ----------
        velocity : float
            Estimated speed of the elbow, rad/s.

        Returns
        -------
        float
            Torque with the sign of `velocity`, N·m; subtracted from the model's.
        """
        speed = velocity if velocity >= 0.0 else -velocity
        if speed >= self._full_speed:
            coulomb = self._coulomb
        elif speed > self._dead_zone:
            coulomb = self._slope * (speed - self._dead_zone)
        else:
            coulomb = 0.0
        helping = self._viscous * speed + coulomb  # B and β of (7), scaled
        return helping if velocity >= 0.0 else -helping


class Controller:
    """Decide a torque from every sample of the motion.

    Grip is lost when, in catch or post-catch, the arm loses more than 0.6 of the speed
    within 5 ms that the torque would take off it if nobody held it. A hand that gives
    way still pushes, and its own mass goes on. The model is then released to pre-catch
    at once and stays there until the arm has been moved back, faster than ν_th. Within
    3 deg of the end of range no loss counts: there it is the joint that stops the arm.

    A second catch needs a flexion in between, faster than ν_th, by 5 deg or for 100 ms:
    a catch throws a soft hand back by less, within one push.

    Where a catch or post-catch ends otherwise, the torque goes from its value then to
    that of the law within `post_catch_ramp`, along a raised cosine. A grip that is lost
    meanwhile ends this at once. If a guarded model gives up more than 0.25 N·m in
    one tick, as clonus does, it goes as soon as no tick takes more than that.

    A model that is not passive is guarded: in every phase it is a fault when the arm
    gets within 6 ms more than 0.78 of the speed that the torque, if it is 2.8 N·m or
    more, would give it if nobody held it, or when its speed falls by more than
    `slip_speed_drop` within 10 ms while the model resists extension. The paper's own
    law has a trigger too, and is released as the paper has it instead.

    Parameters
    ----------
    model : JointModel
        The joint model. An inertial term is not commanded: the mannequin has it.
    start_angle : float
        Where the stretch starts, rad.
    friction : Friction or None, optional
        Friction of the device; None for that of the source.
    compensation : float, optional
        Share of the friction that is compensated, 0 to 1. The default leaves a
        tenth, so that B and β may be wrong by as much before friction is
        overcompensated.
    dead_zone, full_speed : float, optional
        Speeds below which Coulomb friction is not compensated, and above which it
        is, rad/s; see `FrictionCompensation`.
    slip_speed_drop : float, optional
        Fall of speed that means a lost grip on a guarded model, rad/s. The default,
        40 deg/s, lies between what a held arm does and a loose one: a minimum-jerk
        stretch at the highest mean speed of Table V, 131 deg/s, brakes by 8.5 deg/s in
        10 ms, and 10 N·m take 95 deg/s off an arm of 0.06 kg·m² in that time.
    loose_inertia : float, optional
        Inertia of device and arm that nobody holds, kg·m². Too large a number takes a
        soft hand for a lost grip, too small a one notices a lost grip late.
    post_catch_ramp : float, optional
        How long the end of a catch or post-catch takes, s, 0 to 1; 0 is the step of
        Fig. 7. A guarded model uses only whether there is a ramp.
    rate_hz : int, optional
        Steps a second.

    Attributes
    ----------
    model_torque : float
        What the joint model alone asked for in the last step, N·m.
    phase : int
        Its phase, a position in `masrel.lab.recording.PHASES`.
    grip_lost : bool
        Whether grip has been lost since the beginning.
    is_guarded : bool
        Whether the model runs behind `DeviceLimits.active_energy` and `active_torque`.
    is_easing : bool
        Whether the last torque was on its way from the end of a catch or post-catch.
    is_over : bool
        Whether nothing may catch any more; set by `run_presentation` where it ends.
    is_new : bool
        Whether it has never been stepped: one controller makes one presentation.
    rate_hz : int
        Steps a second.
    speed_margin : float
        What noise of the encoder may do to the estimated speed, rad/s: so much more a
        fall of speed must be to be a lost grip. 0 unless `run_presentation` sets it,
        from `DeviceLimits.encoder_noise`.
    speed_threshold : float
        Speed ν_th of the joint, rad/s.
    friction : Friction
        Friction of the device.

    Raises
    ------
    ParameterError
        If a value is outside its range.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       Fig. 7 and section III.B. https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    At rest where the stretch starts nothing is commanded:

    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> Controller(STANDARD_MODELS["HM2"], start_angle=0.5).step(0.0, 0.5, 0.0)
    0.0
    """

    def __init__(
        self,
        model: JointModel,
        *,
        start_angle: float,
        friction: Friction | None = None,
        compensation: float = 0.9,
        dead_zone: float = math.radians(0.1),
        full_speed: float = math.radians(2.0),
        slip_speed_drop: float = math.radians(40.0),
        loose_inertia: float = 0.06,
        post_catch_ramp: float = 0.1,
        rate_hz: int = 1000,
    ) -> None:
        _check_positive(slip_speed_drop=slip_speed_drop, loose_inertia=loose_inertia)
        refuse(
            (
                not 0.0 <= post_catch_ramp <= 1.0,
                f"post_catch_ramp: needs 0 to 1 s, got {post_catch_ramp}",
            ),
            (rate_hz < 1, f"rate_hz: needs 1 or more, got {rate_hz}"),
        )
        self._joint = model.stepper(start_angle)
        self.is_guarded = not (model.is_passive or isinstance(model, ElbowParameters))
        self.friction = friction or Friction()
        self._compensation = FrictionCompensation(
            self.friction,
            share=compensation,
            dead_zone=dead_zone,
            full_speed=full_speed,
        )
        self._slip_speed_drop = slip_speed_drop
        self._loose_inertia = loose_inertia
        self._gain = -math.expm1(-CUTOFF_RAD_S / rate_hz)
        self._late_torque = 0.0  # that was sent, as late as the speed is, N·m
        self._taken = 0.0  # speed that it takes off a loose arm since the catch, rad/s
        self._time = 0.0  # up to when that has been counted, s
        self._post_catch_ramp = raised_cosine(post_catch_ramp, rate_hz)
        self._easing: Iterator[float] = iter(())
        self._command = self._stood = 0.0  # the torque now, at the last such end, N·m
        self._steepest_fall = 0.0  # of a tick under that ramp, N·m
        self.is_easing = False
        self._free_end = model.range_end - _RANGE_END_MARGIN
        window_s = _SLIP_WINDOW_S if self.is_guarded else _LOOSE_WINDOW_S
        n_past = max(1, round(window_s * rate_hz))
        self._past = deque([0.0] * n_past, maxlen=n_past)  # speeds, rad/s
        n_past = max(1, round(_GUARDED_WINDOW_S * rate_hz))
        # Times, speeds, and what has been taken, behind the guard
        self._loose_past = deque([(0.0, 0.0, 0.0)] * n_past, maxlen=n_past)
        self.speed_margin = 0.0
        # From where a fall is counted that has to leave the noise
        self._max_restored = -_INFINITE
        self._held: tuple[float, float, float] | None = None
        self.speed_threshold = model.speed_threshold
        self._flexion, self._may_catch = Flexion(model.speed_threshold), True
        self.is_over = False
        self.grip_lost = False
        self.model_torque = 0.0
        self.phase = _PRE_CATCH
        self.rate_hz = rate_hz
        self.is_new = True

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Take one sample in and decide.

        Afterwards `model_torque`, `phase` and `grip_lost` belong to this sample.

        Parameters
        ----------
        time_s : float
            Time of the sample, s.
        angle : float
            Elbow angle, rad.
        velocity : float
            Estimated speed, rad/s.

        Returns
        -------
        float
            Torque to command, N·m; positive resists extension.

        Raises
        ------
        LimitExceededError
            If the grip on a guarded model is lost, or the model gives no number.
        """
        self.is_new = False
        joint = self._joint
        if self.is_guarded:
            self._check_slip(time_s, angle, velocity)
        elif self.phase != _PRE_CATCH or self.is_easing:
            restored = velocity + _LOOSE_SHARE * self._take(time_s)
            past = self._past
            before = past[0]
            if self.speed_margin:
                before = self._max_restored = max(self._max_restored, before)
            if angle >= self._free_end:
                self._max_restored = -_INFINITE
            elif restored < before - self.speed_margin:
                joint.release()
                self.grip_lost = True
                self.is_easing = False
                self.phase = _PRE_CATCH  # no end that takes its time
            past.append(restored)
        self.model_torque = torque = self._wanted_torque(time_s, angle, velocity)
        command = torque - self._compensation.torque(velocity)
        phase = joint.phase
        if self.phase != phase:
            self._enter(phase, time_s, command)
        if self.is_easing:
            command = self._eased(command)
        self._command = command
        return command

    def _wanted_torque(self, time_s: float, angle: float, velocity: float) -> float:
        # What the model asks for, with one catch within one push
        joint = self._joint
        torque = joint.step(time_s, angle, velocity)
        if self.is_over or not self._may_catch:
            self._may_catch = self._flexion.update(time_s, angle, velocity)
            is_vetoed = self.is_over or not self._may_catch
            if is_vetoed and self.phase == _PRE_CATCH != joint.phase:
                joint.release()
                torque = joint.step(time_s, angle, velocity)
        try:
            is_number = -_INFINITE < torque < _INFINITE
        except TypeError:
            is_number = False
        if not is_number:  # the recording keeps the last that was one
            raise LimitExceededError(
                f"model: needs a torque that is a finite number, got {torque!r}",
                "model",
            )
        return torque

    def _enter(self, phase: int, time_s: float, command: float) -> None:
        if self.phase == _PRE_CATCH and not self.is_guarded:
            self._may_catch = False
            self._late_torque, self._taken = self._command, 0.0
            self._time = time_s
            self._past.extend([-_INFINITE] * len(self._past))  # nothing to fall from
            self._max_restored = -_INFINITE
        ends = self.phase != _PRE_CATCH and phase == _PRE_CATCH
        if ends and (shares := self._shares_left(command)):
            self._easing = iter(shares)
            self._stood = self._command
            self._steepest_fall = 0.5 * math.pi * abs(self._stood) / len(shares)
            self.is_easing = True
        self.phase = phase

    def _shares_left(self, command: float) -> tuple[float, ...]:
        # Of the torque that stands, in each tick from now on
        ramp, stands = self._post_catch_ramp, self._command
        if not (self.is_guarded and ramp):
            return ramp
        if abs(stands - command) <= _MOST_GIVEN_UP:
            return ()
        # A ramp of 100 ms hides a lost grip, so this is the shortest
        n_ticks = 0.5 * math.pi * abs(stands) / _MOST_GIVEN_UP
        return raised_cosine(n_ticks / self.rate_hz, self.rate_hz)

    def _eased(self, command: float) -> float:
        # Between the torque that stood at the end and what the law asks for now
        share = next(self._easing, 0.0)
        eased = command + share * (self._stood - command)
        # Speed, and so friction compensation, may change at once; the torque may not.
        before, fall = self._command, self._steepest_fall
        if before > 0.0:
            eased = max(eased, before - fall)
        else:
            eased = min(eased, before + fall)
        self.is_easing = share > 0.0 or eased != command
        return eased

    def _take(self, time_s: float) -> float:
        # Counts what the torque takes off a loose arm -> all of it so far, rad/s
        late = self._late_torque
        self._late_torque = late = late + self._gain * (self._command - late)
        self._taken += late * (time_s - self._time) / self._loose_inertia
        self._time = time_s
        return self._taken

    def _check_slip(self, time_s: float, angle: float, velocity: float) -> None:
        past, loose_past, margin = self._past, self._loose_past, self.speed_margin
        drop = past[0] - velocity
        before = loose_past[0]
        taken = self._take(time_s)
        past.append(velocity)
        loose_past.append((time_s, velocity, taken))
        of_loose = taken - before[2]
        if angle >= self._free_end or abs(of_loose) <= _LEAST_LOSS:
            self._held = None
        else:
            self._held = held = self._fall_from(before, taken, of_loose)
            of_loose = taken - held[2]
            lost = math.copysign(1.0, of_loose) * (held[1] - velocity)
            if lost > _GUARDED_SHARE * abs(of_loose) + margin:
                self._release_at_once(
                    f"speed changes by at most {_GUARDED_SHARE:g} of a loose arm's "
                    f"{math.degrees(abs(of_loose)):.0f}",
                    time_s - held[0],
                    lost,
                )
        if angle >= self._free_end:
            return
        if drop > self._slip_speed_drop + margin and self.model_torque > 0.0:
            self._release_at_once(
                f"speed falls by at most {math.degrees(self._slip_speed_drop):g}",
                _SLIP_WINDOW_S,
                drop,
            )

    def _fall_from(
        self, before: tuple[float, float, float], taken: float, of_loose: float
    ) -> tuple[float, float, float]:
        # When the speed, with what it is allowed to lose, began to fall
        held = self._held
        if held is None or not self.speed_margin or (taken - held[2]) * of_loose <= 0.0:
            return before
        rise = before[1] - held[1] + _GUARDED_SHARE * (before[2] - held[2])
        return before if rise * of_loose > 0.0 else held

    def _release_at_once(self, needs: str, window_s: float, lost: float) -> NoReturn:
        self._joint.release()
        self.grip_lost = True
        raise LimitExceededError(
            f"slip: needs an arm whose {needs} deg/s in {window_s * 1e3:.0f} ms, "
            f"got {math.degrees(lost):.0f} deg/s",
            "slip",
        )
