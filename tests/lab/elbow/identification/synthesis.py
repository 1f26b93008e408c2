"""Recordings of an evaluator that never were: the law, a varying hand, its sensors.

Everything made here is simulated. The motion is integrated in steps of 0.25 ms and
events are interpolated between them, apart from `masrel.lab.elbow`, whose code this
does not use but for the parameters.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from masrel.lab.elbow.identification import Movement
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters

Floats = NDArray[np.float64]

HM2, HM3, HM4 = (STANDARD_MODELS[name] for name in ("HM2", "HM3", "HM4"))

# What is fitted of them, but for m
NAMES = (
    "damping",
    "stiffness",
    "catch_angle_constant",
    "catch_slope",
    "catch_torque_constant",
    "residual_ratio",
    "catch_travel",
    "post_catch_stiffness",
)

STEP = 2.5e-4  # s
ENCODER = math.radians(0.09)

# A hand's speed is a bell that is never twice the same: the size of its slow
# irregularities relative to it, and how much is lost after a catch, in 0.12 s
WOBBLE, YIELDING = 0.08, 0.3
REST = 0.2  # before and after a stretch, s


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """Trial-to-trial standard deviations of the joint itself; the paper has none."""

    catch_angle: float = 0.0  # rad
    catch_torque: float = 0.0  # relative
    catch_travel: float = 0.0  # rad


SCATTER = Scatter(
    catch_angle=math.radians(2.0), catch_torque=0.1, catch_travel=math.radians(2.0)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """What an arm and a sensor add to the law; the paper has nothing of it."""

    gravity: float = 0.0  # N·m, times the sine of the angle
    inertia: float = 0.0  # kg·m², in every phase
    drift: float = 0.0  # N·m/s
    own_drift: float = 0.0  # N·m/s more in every other trial, and less in the others
    lag: float = 0.0  # s, of a sensor of first order
    late: float = 0.0  # s, of the angle beside the torque
    rise: float = 0.0  # s, from the catch to its peak
    noise_time: float = 0.0  # s, over which noise is correlated; 0 is white


def recording(
    joint: ElbowParameters,
    *,
    start: float,
    end: float,
    mean_speed: float,
    rng: np.random.Generator,
    scatter: Scatter | None = None,
    noise: float = 0.1,
    rate: float = 1000.0,
    arm: Arm | None = None,
    name: str = "simulated",
) -> Movement:
    """One stretch with a rest before and after it."""
    scatter, arm = scatter or Scatter(), arm or Arm()
    joint = replace(joint, catch_rise=arm.rise)
    speed = _speed(end - start, mean_speed, rng)
    joint = replace(
        joint,
        catch_torque_constant=joint.catch_torque_constant
        * (1.0 + scatter.catch_torque * rng.standard_normal()),
        catch_travel=joint.catch_travel + scatter.catch_travel * rng.standard_normal(),
    )
    shift = scatter.catch_angle * rng.standard_normal()
    time = np.arange(speed.size) * STEP
    angle = start + _integral(speed)
    catch = _catch(joint, time, angle, speed, shift)
    free = np.gradient(speed, STEP)  # before the hand yields to a catch
    if catch is not None:
        speed = _yield(speed, time, catch)
        angle = start + _integral(speed)
    at = np.arange(round((time[-1] + 2 * REST) * rate)) / rate
    inside = np.clip(at - REST, 0.0, time[-1])
    late = np.clip(at - REST - arm.late, 0.0, time[-1])
    sampled = np.round(np.interp(late, time, angle) / ENCODER) * ENCODER
    motion = time, angle, speed
    torque = _torque(joint, *motion, catch, inside, free)
    if arm != Arm():
        fine = np.arange(at[0], at[-1] + STEP, STEP) - REST
        within = np.clip(fine, 0.0, time[-1])
        law = _torque(joint, *motion, catch, within, free)
        torque = np.interp(at - REST, fine, _sensed(arm, law, *motion, fine))
    felt = torque + noise * _noise(rng, at.size, arm.noise_time * rate)
    return Movement(name=name, time=at, angle=sampled, torque=felt, simulated=True)


def study(
    joint: ElbowParameters,
    *,
    seed: int,
    n_slow: int = 8,
    n_fast: int = 16,
    scatter: Scatter | None = None,
    noise: float = 0.1,
    fast: tuple[float, float] = (60.0, 120.0),
    arm: Arm | None = None,
    rate: float = 1000.0,
) -> list[Movement]:
    """Slow stretches of part of the range and fast ones of all of it."""
    rng = np.random.default_rng(seed)
    made, arm = [], arm or Arm()
    for place in range(n_slow + n_fast):
        is_slow = place < n_slow
        i = place if is_slow else place - n_slow
        start = math.radians(rng.uniform(*((25.0, 105.0) if is_slow else (27.0, 33.0))))
        drift = arm.drift + (-1) ** i * arm.own_drift
        made.append(
            recording(
                joint,
                start=start,
                end=start + math.radians(18.0) if is_slow else joint.range_end,
                mean_speed=math.radians(
                    rng.uniform(*((5.0, 8.5) if is_slow else fast))
                ),
                rng=rng,
                scatter=None if is_slow else scatter,
                noise=noise,
                rate=rate,
                name=f"{'slow' if is_slow else 'fast'} {i}",
                arm=replace(arm, drift=drift, own_drift=0.0),
            )
        )
    return made


def _sensed(
    arm: Arm, law: Floats, time: Floats, angle: Floats, speed: Floats, at: Floats
) -> Floats:
    # what a sensor reads of the law and the arm at fine times, from rest to rest
    within = np.clip(at, 0.0, time[-1])
    pushed = np.interp(at, time, np.gradient(speed, STEP), left=0.0, right=0.0)
    torque = law + arm.gravity * np.sin(np.interp(within, time, angle))
    torque = torque + arm.inertia * pushed + arm.drift * at
    if arm.lag:
        keep = math.exp(-STEP / arm.lag)
        torque = lfilter([1 - keep], [1, -keep], torque, zi=[keep * torque[0]])[0]
    return np.asarray(torque)


def _noise(rng: np.random.Generator, size: int, time: float) -> Floats:
    # of standard deviation 1; `time` in samples is that of its correlation
    white = rng.standard_normal(size)
    if not time:
        return white
    keep = math.exp(-1.0 / time)
    grown = math.sqrt(1.0 - keep**2) * white
    return np.asarray(lfilter([1.0], [1.0, -keep], grown, zi=[keep * white[0]])[0])


def _speed(travel: float, mean: float, rng: np.random.Generator) -> Floats:
    duration = travel / mean
    s = np.arange(0.0, duration + STEP, STEP) / duration
    s = s[s <= 1.0]
    bell = 30.0 * mean * (s * (1.0 - s)) ** 2
    ripple = np.ones_like(s)
    for cycles in (1.0, 2.0, 3.0):
        phase = rng.uniform(0.0, 2.0 * math.pi)
        ripple += (
            WOBBLE * rng.standard_normal() * np.sin(2.0 * math.pi * cycles * s + phase)
        )
    shaped = bell * np.maximum(ripple, 0.2)
    return np.asarray(shaped * (travel / _integral(shaped)[-1]))


def _integral(speed: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * STEP])


def _catch(
    joint: ElbowParameters, time: Floats, angle: Floats, speed: Floats, shift: float
) -> float | None:
    fast = np.flatnonzero(speed >= joint.speed_threshold)
    if fast.size == 0:
        return None
    onset = fast[0]
    later = slice(onset + 1, fast[-1])
    mean = (angle[later] - angle[onset]) / (time[later] - time[onset])
    at = joint.catch_angle_constant - joint.catch_slope * np.maximum(
        mean, joint.slowest_mean_speed
    )
    at = np.where(mean > joint.fastest_mean_speed, joint.smallest_catch_angle, at)
    beyond = angle[later] - at - shift
    if not (beyond > 0.0).any():
        return None
    first = int(np.argmax(beyond > 0.0))
    if first == 0:
        return float(time[later][0])
    part = beyond[first - 1] / (beyond[first - 1] - beyond[first])
    return float(time[later][first - 1] + part * STEP)


def _yield(speed: Floats, time: Floats, catch: float) -> Floats:
    since = np.maximum(time - catch, 0.0)
    return speed * (1.0 - YIELDING * (1.0 - np.exp(-since / 0.12)))


def _torque(
    joint: ElbowParameters,
    time: Floats,
    angle: Floats,
    speed: Floats,
    catch: float | None,
    at: Floats,
    free: Floats,
) -> Floats:
    # torque at the times `at`; a step is before or after a sample, never smeared
    rest = angle[0] if joint.rest_angle is None else joint.rest_angle
    law = joint.damping * speed + joint.stiffness * (angle - rest)
    law = law + joint.inertia * np.gradient(speed, STEP)
    pre = np.interp(at, time, law)
    if catch is None:
        return pre
    catch_angle = float(np.interp(catch, time, angle))
    catch_speed = float(np.interp(catch, time, speed))
    pre_end = joint.damping * catch_speed + joint.stiffness * (catch_angle - rest)
    pre_end += joint.inertia * float(np.interp(catch, time, free))
    released = catch_angle + joint.catch_travel
    catch_end = (
        float(np.interp(released, angle, time)) if released < angle[-1] else math.inf
    )
    rise = joint.catch_torque_constant * catch_speed
    in_peak = at < min(catch + joint.peak_duration, catch_end)
    share = 1.0
    if joint.catch_rise:
        x = np.clip((at - catch) / joint.catch_rise, 0.0, 1.0)
        share = x**2 * (3 - 2 * x)
    level = np.where(in_peak, share * rise, joint.residual_ratio * rise)
    climb = np.maximum(np.interp(at, time, angle) - released, 0.0)
    added = level + joint.post_catch_stiffness * climb
    pushed = joint.inertia * np.interp(at, time, np.gradient(speed, STEP))
    after = pre_end + added + np.where(at >= catch_end, pushed, 0.0)
    torque = np.where(at < catch, pre, after)
    if joint.post_catch == "additive":
        torque = np.where(at >= catch_end, pre + added, torque)
    slow = time[np.flatnonzero(speed >= joint.speed_threshold)[-1]]
    torque = np.where((at > slow) & (at > catch_end), pre, torque)
    return torque
