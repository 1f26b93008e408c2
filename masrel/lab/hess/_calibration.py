"""What a device is like, measured on it: noise, friction, inertia, delay, gain.

In: an open device whose arm is free, or bears weights that are known or that a torque
sensor reads. Out: numbers with 95 % intervals. Also, from recordings: how near the
torque that a device gives comes to the one that was asked for, and how late ticks are.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import stdtrit

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
from masrel.lab.recording import (
    _TORQUE_GAINS,
    ESTIMATED_TORQUE,
    MEASURED_TORQUE,
    Recording,
    _Floats,
)

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
    smooth: _Floats = np.linalg.qr(powers)[0]

    def left(column: _Floats) -> _Floats:
        values: _Floats = column[rows]
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
    if df < 1 or np.linalg.matrix_rank(design) < 3:
        raise DeviceError(
            "gain: needs weights of two masses or more, each way, got "
            f"{len(set(against.tolist()))} torques"
        )
    (slope, offset, _), (error, offset_error, _) = linear_fit(design, sent)
    share = _measured(slope, error, df)
    gain = Measured(1.0 / slope, 1.0 / share.high, 1.0 / share.low)
    least, most = _TORQUE_GAINS
    if not least <= gain.value <= most:
        raise DeviceError(
            f"gain: needs a torque of {least:g} to {most:g} times the one that "
            f"is sent, got {gain.value:.3f} times ({gain.low:.3f} to {gain.high:.3f}); "
            "correct the motor's torque constant, the gear or the direction"
        )
    return {
        "torque_gain": gain,
        "torque_offset_nm": _measured(offset, offset_error, df),
    }


# How near a torque comes to the one that is asked for

# Which torque is rendered, and which it is compared with. A sensor between motor and
# arm reads what the hand feels but for the arm; a board's own estimate is of its motor.
_COMPARED = {
    MEASURED_TORQUE: "model_torque_nm",
    ESTIMATED_TORQUE: "command_torque_nm",
}
_LATE_S = (-0.005, 0.05)


def rendered(recording: Recording) -> dict[str, float]:
    """Compare the torque of a stretch with the one that was asked for.

    Nothing is known of a device that neither measures nor estimates its torque.
    """
    channel = next((each for each in _COMPARED if each in recording.channels), None)
    if channel is None:
        return {}
    columns = {n: c[: recording.n_presented] for n, c in recording.columns.items()}
    time, felt = columns["time_s"], columns[channel.column]
    goal = columns[_COMPARED[channel]]
    difference = felt - goal
    velocity = np.radians(columns["velocity_deg_s"])
    friction = np.column_stack(
        [velocity, np.sign(velocity), np.gradient(velocity, time)]
    )
    rows = np.isfinite(felt)

    def square(delay: float) -> float:
        # What neither the torque sent so much earlier nor (7) explains
        sent = np.interp(time - delay, time, columns["command_torque_nm"])
        left = (felt - sent)[rows]
        moved = np.linalg.lstsq(friction[rows], left, rcond=None)[0]
        return float(np.sum((left - friction[rows] @ moved) ** 2))

    best = minimize_scalar(square, bounds=_LATE_S, method="bounded")
    return {
        "rmse_nm": math.sqrt(float(np.nanmean(difference**2))),
        "max_nm": float(np.nanmax(np.abs(difference))),
        "delay_ms": 1e3 * float(best.x),
        "peak_nm": float(np.abs(goal).max()),
    }


def compare_models(
    stretches: Sequence[Mapping[str, Any]],
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return what the stretches of each model say together, and that in lines."""
    models: dict[str, dict[str, Any]] = {}
    lines = []
    for model in dict.fromkeys(each["model"] for each in stretches):
        of = [each for each in stretches if each["model"] == model and len(each) > 2]
        if not of:
            return {}, ["torque: the device neither measures nor estimates it"]
        rmse, delay = (mean_of([e[key] for e in of]) for key in ("rmse_nm", "delay_ms"))
        largest = max(each["max_nm"] for each in of)
        percent = 100.0 * rmse.value / max(each["peak_nm"] for each in of)
        models[model] = {"rmse_nm": rmse, "max_nm": largest, "percent_of_peak": percent}
        models[model]["delay_ms"] = delay
        lines.append(
            f"{model}: RMSE {rmse.value:.3f} [{rmse.low:.3f}, {rmse.high:.3f}] N·m, "
            f"{percent:.1f} % of the peak; at most {largest:.2f} N·m; "
            f"{delay.value:.2f} [{delay.low:.2f}, {delay.high:.2f}] ms late"
        )
    return models, lines


def lateness_ms(recordings: Sequence[Recording], rate_hz: int) -> _Floats:
    """Return how late each tick was, beside the prompt ones of its recording, ms."""
    # A reading takes its time on the bus, the same for most ticks, and one that comes
    # in the next tick's time is still late: prompt ones are at most so little earlier.
    # It holds while fewer than one tick in a hundred is nearly a tick late.
    period_ns = 1e9 / rate_hz
    room_ns, late_ns = 0.05 * period_ns, []
    for each in recordings:
        since_due = np.mod(np.rint(1e9 * each.columns["time_s"]), period_ns)
        prompt = np.quantile(since_due, 0.01)
        late = np.mod(since_due - prompt + room_ns, period_ns) - room_ns
        late_ns.append(np.maximum(late, 0.0))
    return 1e-6 * np.concatenate(late_ns)
