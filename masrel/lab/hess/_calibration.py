"""What a device is like, measured on it: noise, friction, inertia, delay, gain.

In: an open device whose arm is free, or bears weights that are known or that a torque
sensor reads. Out: numbers with intervals of 95 %.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import stdtrit

from masrel._input import refuse
from masrel.errors import DeviceError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._free_arm import (
    LIMITS,
    SPEEDS,
    Tick,
    TurningArm,
    fit_friction,
    linear_fit,
    mean_run,
)
from masrel.lab.hess._stop import EmergencyStop, Watching
from masrel.lab.hess.device import Device
from masrel.lab.recording import _TORQUE_GAINS

_REST_S = 2.0

# Square pulses on an arm that turns, so that friction has one sign
_PULSED_SPEED = math.radians(40.0)
_PULSE, _HALF_PERIOD_S = 0.5, 0.025  # N·m: they change the speed by some 12 deg/s
_N_PULSED = 4  # runs each way
_DELAYS_S = (-0.002, 0.02)  # less than half a period apart
_N_SMOOTH = 8  # terms of a polynomial of the time: what is slower than the pulses

# A weight is carried to and fro, slowly and not far
_CARRIED_SPEED = math.radians(10.0)
_CARRIED = math.radians(70.0), math.radians(85.0)
_CARRIED_SETTLING = math.radians(5.0)

N_STEPS = 2 * len(SPEEDS) + 2 * _N_PULSED
"""How often the free arm is turned."""


class Measured(NamedTuple):
    """A number and its interval of 95 %."""

    value: float
    low: float
    high: float

    def scaled(self, gain: "Measured") -> "Measured":
        """Return the product with an independent number, to first order."""
        value = self.value * gain.value
        half = math.hypot(
            0.5 * (self.high - self.low) * gain.value,
            0.5 * (gain.high - gain.low) * self.value,
        )
        return Measured(value, value - half, value + half)


def _measured(value: float, error: float, df: float) -> Measured:
    half = float(stdtrit(df, 0.975)) * error
    return Measured(value, value - half, value + half)


def measure_free_arm(
    device: Device,
    clock: Clock,
    *,
    watchdog: Watching | None = None,
    stop: EmergencyStop | None = None,
    progress: Callable[[], object] = lambda: None,
) -> dict[str, Measured]:
    """Measure noise of the encoder, delay, inertia and friction on a free arm.

    THE ARM MOVES BY ITSELF, as in `steady_runs`. Inertia and friction are in the torque
    that was sent: those of the arm, divided by the gain of torque.
    """
    arm = TurningArm(device, clock, watchdog, stop)
    rest = arm.hold(0.0, _REST_S)
    arm.check_direction()
    runs = arm.steady_runs(SPEEDS, progress)
    away = 1.0 if runs[-1].speed < 0.0 else -1.0
    pulsed = []
    for direction in (away, -away) * _N_PULSED:
        pulsed.append(arm.turn(direction * _PULSED_SPEED, pushes=_pulse))
        progress()
    arm.turn(away * SPEEDS[0], ends=_CARRIED)
    arm.let_go()
    viscous = fit_friction(runs).viscous
    fits = (_pulsed_fit(ticks, viscous) for ticks in pulsed)
    delays, inertias = zip(*fits, strict=True)
    inertia = mean_of(inertias)
    friction = fit_friction(runs, inertia=inertia.value)
    df = len(runs) - 3
    angles = [tick.angle for ticks in (rest, *pulsed) for tick in ticks]
    noise = encoder_noise([tick.angle for tick in rest], step=_step(angles))
    return {
        "encoder_noise_deg": Measured(*map(math.degrees, noise)),
        "delay_ms": Measured(*(1e3 * delay for delay in mean_of(delays))),
        "inertia_kg_m2": inertia,
        "viscous_nms_rad": _measured(friction.viscous, friction.viscous_error, df),
        "coulomb_nm": _measured(friction.coulomb, friction.coulomb_error, df),
    }


def mean_of(values: Sequence[float]) -> Measured:
    """Return the mean of runs that are independent of each other."""
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values))
    return _measured(float(np.mean(values)), error, len(values) - 1)


def _step(angles: Sequence[float]) -> float:
    # The least by which two readings differ, rad
    return float(np.min(np.diff(np.unique(angles)), initial=math.inf))


def encoder_noise(angles: Sequence[float], *, step: float) -> Measured:
    """Return the standard deviation of readings at rest beyond steps of the encoder."""
    deviation = float(np.std(angles))
    half = 1.96 * deviation / math.sqrt(2.0 * len(angles)) + 0.5 * step
    # Sheppard's correction, good for noise of a step and more. What rounding does below
    # depends on where the arm stands, but changes a deviation by at most half a step.
    value = math.sqrt(max(0.0, deviation**2 - step**2 / 12.0))
    return Measured(value, max(0.0, deviation - half), deviation + half)


def _pulse(time_s: float) -> float:
    return _PULSE if int(time_s / _HALF_PERIOD_S) % 2 else -_PULSE


def _pulsed_fit(ticks: list[Tick], viscous: float) -> tuple[float, float]:
    # -> the delay, s, and the inertia, kg·m², with which the torques that were sent
    # turn the arm as it turned: I θ̈ = τ(t - delay) - B θ̇ + what changes slowly. B is
    # known, because at one period a damper is as good as a delay.
    time, angle, _, _, sent, torque = np.array(ticks).T
    held = np.diff(sent, append=2.0 * sent[-1] - sent[-2])
    # speed and angle of an arm of 1 kg·m² when each torque was sent
    speed = np.cumsum(torque * held) - torque * held
    gone = (speed + 0.5 * torque * held) * held
    way = np.cumsum(gone) - gone
    rows = time > sent[0] + _DELAYS_S[1]
    powers = np.vander(time[rows] - time.mean(), _N_SMOOTH)
    smooth: NDArray[np.float64] = np.linalg.qr(powers)[0]

    def left(column: NDArray[np.float64]) -> NDArray[np.float64]:
        values: NDArray[np.float64] = column[rows]
        return values - smooth @ (smooth.T @ values)

    damped = viscous * np.cumsum(angle * np.gradient(time))
    target = left(angle)

    def fit(delay: float) -> tuple[float, float]:
        then = time - delay
        k = np.maximum(np.searchsorted(sent, then, side="right") - 1, 0)
        since = then - sent[k]
        driven = way[k] + (speed[k] + 0.5 * torque[k] * since) * since
        driven = left(driven - damped)
        share = float(driven @ target) / float(driven @ driven)  # 1/I
        return float(np.sum((target - share * driven) ** 2)), share

    best = minimize_scalar(
        lambda delay: fit(delay)[0],
        bounds=_DELAYS_S,
        method="bounded",
        options={"xatol": 1e-7},
    )
    return float(best.x), 1.0 / fit(float(best.x))[1]


class GainPoint(NamedTuple):
    """A torque that was sent, and what it was against, N·m; friction has a sign."""

    against: float
    sent: float
    direction: float


def carry(
    device: Device,
    clock: Clock,
    load: float,
    *,
    watchdog: Watching | None = None,
    stop: EmergencyStop | None = None,
) -> list[GainPoint]:
    """Carry a weight of a known torque to and fro; positive extends the arm."""
    most = LIMITS.torque + abs(load)
    limits = replace(LIMITS, torque=most, standing_torque=most)
    arm = TurningArm(device, clock, watchdog, stop, limits)
    arm.hold(0.0, 0.001)
    speeds = (-_CARRIED_SPEED, _CARRIED_SPEED, -_CARRIED_SPEED)
    turn = partial(arm.turn, ends=_CARRIED, settling=_CARRIED_SETTLING, holds=-load)
    runs = [(turn(speed), speed) for speed in speeds]
    arm.let_go()
    return [_gain_point(load, turn, speed) for turn, speed in runs[1:]]


def _gain_point(load: float, ticks: list[Tick], speed: float) -> GainPoint:
    # A sensor between motor and arm reads what the arm pulls at
    measured = float(np.mean([tick.measured for tick in ticks]))
    against = load if math.isnan(measured) else measured
    return GainPoint(against, -mean_run(ticks, speed).torque, math.copysign(1.0, speed))


def fit_gain(points: Sequence[GainPoint]) -> dict[str, Measured]:
    """Fit gain and offset of the torque by a line, or refuse a gain that is far off."""
    against, sent, direction = np.array(points).T
    design = np.column_stack([against, np.ones(len(points)), direction])
    df = len(points) - 3
    refuse(
        (
            df < 1 or np.linalg.matrix_rank(design) < 3,
            "gain: needs weights of two masses or more, each way, got "
            f"{len(set(against.tolist()))} torques",
        ),
        error=DeviceError,
    )
    (slope, offset, _), (error, offset_error, _) = linear_fit(design, sent)
    share = _measured(slope, error, df)
    gain = Measured(1.0 / slope, 1.0 / share.high, 1.0 / share.low)
    least, most = _TORQUE_GAINS
    refuse(
        (
            not least <= gain.value <= most,
            f"gain: needs a torque of {least:g} to {most:g} times the one that "
            f"is sent, got {gain.value:.3f} times ({gain.low:.3f} to {gain.high:.3f}); "
            "correct the motor's torque constant, the gear or the direction",
        ),
        error=DeviceError,
    )
    return {
        "torque_gain": gain,
        "torque_offset_nm": _measured(offset, offset_error, df),
    }
