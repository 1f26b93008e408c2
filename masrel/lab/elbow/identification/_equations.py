"""What one trial says of the parameters: residuals and their derivatives.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from masrel.lab.elbow.identification._catches import Arm, Catch, Trial
from masrel.lab.elbow.identification._clusters import Rows, partial_out, triangle
from masrel.lab.elbow.identification._stretches import Part
from masrel.lab.elbow.identification._travels import DetectionLimit, beyond
from masrel.lab.elbow.parameters import ElbowParameters

_Floats = NDArray[np.float64]
Row = tuple[float, dict[str, float]]  # a residual over its sd, and its derivatives

_LINEAR = ("damping", "stiffness", "inertia", "gravity", "arm_inertia", "drift", "peak")
_CURVED = ("lag", "catch_rise", "shift")  # differentiated numerically
_STEP = 1e-4  # of that, s


@dataclass(frozen=True, slots=True, kw_only=True)
class Spreads:
    """What a residual of each kind is divided by: N·m, N·m, N·m, rad, rad."""

    torque: float
    peak: float
    residual: float
    catch_angle: float
    travel: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What the equations of a trial do not change.

    `names` are the shared parameters in the order of their vector; `offset` the fixed
    constant torque above -k·θ_rest (None if each trial has its own); `drifts` says
    whether a trial's offset may drift; `on_line` whether its catch is on the line of
    (2); `limit` behind which its catch ends, if it does not end before.
    """

    names: tuple[str, ...]
    constants: ElbowParameters
    spreads: Spreads
    arm: Arm
    offset: float | None = None
    drifts: bool = False
    on_line: bool = False
    limit: DetectionLimit | None = None


@dataclass(frozen=True, slots=True)
class _Columns:
    # What multiplies each parameter, shape (n_samples,), and the climbing angle
    linear: dict[str, _Floats]
    held: _Floats  # 1 where the residual torque acts, through the sensor
    past: _Floats  # angle since the catch, -inf where nothing climbs
    over: NDArray[np.bool_] | None = field(default=None)  # after a fixed end


class Equations:
    """Residuals of one trial as a function of shared parameters and its own.

    Its own (`own`) are the constant torque and its drift, and of a catch the peak and
    residual torque above the end of pre-catch (N·m), the angle travelled (rad), and how
    much later than `catch.time` it was (s), as far as the trial has them.
    """

    def __init__(self, trial: Trial, known: Known) -> None:
        self.trial, self.known = trial, known
        pre = trial.pre_catch
        self.catch = trial.catch if trial.after is not None else None
        self.n_pre = pre.torque.size
        parts = [pre] if trial.after is None else [pre, trial.after]
        self.torque = np.concatenate([part.torque for part in parts])
        self.measured = np.concatenate([part.measured for part in parts])
        self.time = np.concatenate([part.time for part in parts])
        self._middle = float(self.time.mean()) if self.time.size else 0.0
        self._curved = known.arm.takes_time
        self.local = self._local_names()
        self._static = None if self._curved else self._columns({}, {})
        self._compact = self._compressed() if self._static else None

    def _local_names(self) -> tuple[str, ...]:
        names = ["offset"] if self.known.offset is None else []
        names += ["drift"] if self.known.drifts else []
        catch, after = self.catch, self.trial.after
        if catch is None or after is None:
            return tuple(names)
        in_peak = self._in_peak(after, catch)
        names += ["peak"] if in_peak.any() else []
        names += ["residual"] if not in_peak.all() else []
        moves = catch.end is not None and not self._fixed_end(catch)
        names += ["travel"] if moves and "catch_travel" in self.known.names else []
        names += ["shift"] if self._curved and in_peak.any() else []
        return tuple(names)

    def _fixed_end(self, catch: Catch) -> bool:
        additive = self.known.constants.post_catch == "additive"
        return catch.end is not None and (catch.within_peak or additive)

    def _peak_end(self, catch: Catch) -> float:
        end = (
            catch.end if catch.end is not None and self._fixed_end(catch) else math.inf
        )
        return min(catch.time + self.known.constants.peak_duration, end)

    def _in_peak(self, after: Part, catch: Catch) -> NDArray[np.bool_]:
        return np.asarray(after.time < self._peak_end(catch))

    def _columns(
        self, now: Mapping[str, float], local: Mapping[str, float]
    ) -> _Columns:
        arm = self.known.arm
        lag = now.get("lag", arm.lag)
        rise = now.get("catch_rise", arm.catch_rise)
        before = self._before(self.trial.pre_catch, lag)
        catch, after = self.catch, self.trial.after
        zero = np.zeros(self.n_pre)
        if catch is None or after is None:
            return _Columns(before | {"peak": zero}, zero, zero - math.inf)
        later, held, past = self._from_catch(
            after, catch, lag, rise, local.get("shift", 0.0)
        )
        linear = {name: np.concatenate([before[name], later[name]]) for name in before}
        linear["peak"] = np.concatenate([zero, later["peak"]])
        over = None
        if self._fixed_end(catch):
            over = np.concatenate([zero > 0.0, after.time >= (catch.end or math.inf)])
        return _Columns(
            linear,
            np.concatenate([zero, held]),
            np.concatenate([zero - math.inf, past]),
            over,
        )

    def _before(self, part: Part, lag: float) -> dict[str, _Floats]:
        # a sensor that lags by T reads x - T·x' + T²·x'' of what is smooth
        angle = part.angle - lag * (part.velocity - lag * part.acceleration)
        velocity = part.velocity - lag * (part.acceleration - lag * part.jerk)
        acceleration = part.acceleration - lag * part.jerk
        return {
            "damping": velocity,
            "stiffness": angle - self._rest(),
            "inertia": acceleration,
            "gravity": np.sin(angle - self.known.arm.gravity_angle),
            "arm_inertia": acceleration,
            "drift": part.time - self._middle,
        }

    def _rest(self) -> float:
        # without an offset of its own, the torque of a trial is 0 at its rest angle
        if self.known.offset is None:
            return 0.0
        rest = self.known.constants.rest_angle
        return self.trial.rest_angle if rest is None else rest

    def _from_catch(
        self, part: Part, catch: Catch, lag: float, rise: float, shift: float
    ) -> tuple[dict[str, _Floats], _Floats, _Floats]:
        since = part.time - (catch.time + shift)
        fading = np.exp(-np.maximum(since, 0.0) / lag) if lag > 0.0 else 0.0 * since
        speed = catch.speed + catch.acceleration * shift
        angle = catch.angle + catch.speed * shift
        # τ_pre_end of (3) is held; the sensor comes from what it was before
        held = {
            "damping": speed - lag * catch.acceleration * fading,
            "stiffness": angle - self._rest() - lag * speed * fading,
            "inertia": np.full(part.time.size, catch.acceleration),
        }
        seen = part.angle - lag * part.velocity
        if self.known.constants.post_catch == "additive" and catch.end is not None:
            law = self._before(part, lag)
            over = part.time >= catch.end
            held = {name: np.where(over, law[name], held[name]) for name in held}
        elif catch.end is not None:  # m·θ̈ of (5)
            held["inertia"] += np.where(part.time >= catch.end, part.acceleration, 0.0)
        last = self._peak_end(catch) - catch.time
        risen = _risen(since, rise)
        risen = _slow(risen, part.time, lag) if rise > 0.0 else _step(since, lag)
        fallen = _step(since - last, lag)
        held |= {
            "gravity": np.sin(seen - self.known.arm.gravity_angle),
            # the hand slows at once, and the sensor comes from what it was before
            "arm_inertia": _slow(part.acceleration, part.time, lag)
            + catch.acceleration * fading,
            "drift": part.time - self._middle,
            "peak": risen - fallen,
        }
        climbs = since >= last
        if self._fixed_end(catch):
            climbs = part.time >= (catch.end or math.inf)
        past = np.where(climbs, part.angle - angle, -math.inf)
        return held, fallen, past

    def _compressed(self) -> tuple[_Columns, _Floats]:
        # Where nothing climbs, everything is linear: QR leaves a row for each column.
        columns = self._static or self._columns({}, {})
        flat = columns.held == 0.0
        names = list(columns.linear)
        table = np.column_stack(
            [*columns.linear.values(), np.ones(self.torque.size), self.torque]
        )
        first = triangle(table[flat])
        whole = np.concatenate([first, table[~flat]])
        pad = np.zeros(first.shape[0])
        over = columns.over
        compact = _Columns(
            {name: whole[:, i] for i, name in enumerate([*names, "offset"])},
            np.concatenate([pad, columns.held[~flat]]),
            np.concatenate([pad - math.inf, columns.past[~flat]]),
            None if over is None else np.concatenate([pad > 0.0, over[~flat]]),
        )
        return compact, whole[:, -1]

    def start(self, shared: Mapping[str, float]) -> _Floats:
        """Return where to begin with the trial's own: (3), and what was seen."""
        catch = self.catch
        values = dict.fromkeys(self.local, 0.0)
        if catch is not None:
            peak = shared["catch_torque_constant"] * catch.speed
            residual = peak * shared["residual_ratio"]
            values |= {
                "peak": peak if math.isfinite(peak) else 0.0,
                "residual": residual if math.isfinite(residual) else 0.0,
                "travel": catch.travel,
            }
        return np.array([values[name] for name in self.local])

    def table(self, shared: _Floats, local: _Floats, *, whole: bool = False) -> _Floats:
        """Return the columns [own | shared | residuals], over their spreads.

        Of all samples if `whole`, else of what least squares see of them.
        """
        now = dict(zip(self.known.names, shared.tolist(), strict=True))
        mine = dict(zip(self.local, local.tolist(), strict=True))
        by_name, law, torque = self._torque_rows(now, mine, whole)
        rows = self.catch_rows(now, mine).values()
        zeros = np.zeros(law.size)
        sd = self.known.spreads.torque
        columns = [
            np.append(
                by_name.get(name, zeros) / sd,
                [slopes.get(name, 0.0) for _, slopes in rows],
            )
            for name in (*self.local, *self.known.names)
        ]
        left = np.append((law - torque) / sd, [value for value, _ in rows])
        return np.column_stack([*columns, left])

    def _torque_rows(
        self, now: Mapping[str, float], mine: Mapping[str, float], whole: bool
    ) -> tuple[dict[str, _Floats], _Floats, _Floats]:
        # derivatives of the torque by each parameter, the law, and what was measured
        torque, ones = self.torque, np.ones(self.torque.size)
        if self._compact is not None and not whole:
            columns, torque = self._compact
            ones = columns.linear["offset"]
        else:
            columns = self._static or self._columns(now, mine)
        by_name, law = self._evaluate(columns, ones, now, mine)
        for name in (n for n in _CURVED if n in now or n in mine):
            laws = []
            for step in (_STEP, -_STEP):
                near, local = {**now}, {**mine}
                (near if name in near else local)[name] += step
                laws.append(
                    self._evaluate(self._columns(near, local), ones, near, local)[1]
                )
            by_name[name] = (laws[0] - laws[1]) / (2.0 * _STEP)
        return by_name, law, torque

    def _evaluate(
        self,
        columns: _Columns,
        ones: _Floats,
        now: Mapping[str, float],
        mine: Mapping[str, float],
    ) -> tuple[dict[str, _Floats], _Floats]:
        arm = self.known.arm
        fixed = {
            name: getattr(arm, name) for name in ("gravity", "arm_inertia", "drift")
        }
        values = {**fixed, **now, **mine}
        by_name = {name: columns.linear[name] for name in _LINEAR} | {"offset": ones}
        offset = self.known.offset
        law = ones * (mine.get("offset", 0.0) if offset is None else offset)
        for name in _LINEAR:
            if values.get(name, 0.0) != 0.0:
                law = law + values[name] * by_name[name]
        if "residual" in mine:
            catch = self.catch
            k_post = now.get("post_catch_stiffness", 0.0)
            past = np.zeros_like(law)
            over = past > 0.0
            if catch is not None and catch.end is not None:
                past = columns.past - mine.get("travel", catch.travel)
                over = past > 0.0 if columns.over is None else columns.over
            climb, slope = np.where(over, past, 0.0), np.where(over, -k_post, 0.0)
            lag = now.get("lag", arm.lag)
            if lag > 0.0:
                later = slice(self.n_pre, None)
                climb[later] = _slow(climb[later], self.time[later], lag)
                slope[later] = _slow(slope[later], self.time[later], lag)
            by_name |= {"residual": columns.held, "post_catch_stiffness": climb}
            by_name["travel"] = slope
            law = law + mine["residual"] * columns.held + k_post * climb
        return by_name, law

    def catch_rows(
        self, now: Mapping[str, float], mine: Mapping[str, float]
    ) -> dict[str, Row]:
        """Return how far the trial's own values are from what they scatter about."""
        rows, used, size = {}, self.catch, self.known.spreads
        if self.known.on_line and self.trial.catch and "catch_slope" in now:
            rows["catch angle"] = _line(self.known, self.trial.catch, now)
        if used is None:
            return rows
        if "peak" in mine and "catch_torque_constant" in now:
            left = now["catch_torque_constant"] * used.speed - mine["peak"]  # (3)
            slopes = {"catch_torque_constant": used.speed, "peak": -1.0}
            rows["peak"] = _scaled(left, slopes, size.peak)
        if "residual" in mine and "peak" in mine and "residual_ratio" in now:
            ratio, peak = now["residual_ratio"], mine["peak"]
            left = ratio * peak - mine["residual"]  # (3)
            slopes = {"residual_ratio": peak, "peak": ratio, "residual": -1.0}
            rows["residual"] = _scaled(left, slopes, size.residual)
        if "catch_travel" in now and used.end is not None:
            left = now["catch_travel"] - mine.get("travel", used.travel)  # (4)
            slopes = {"catch_travel": 1.0, "travel": -1.0}
            rows["travel"] = _scaled(left, slopes, size.travel)
        elif "catch_travel" in now and self.known.limit is not None:
            left, slope, _ = beyond(now["catch_travel"], self.known.limit, size.travel)
            rows["limit"] = left, {"catch_travel": slope}
        return rows

    def rows(self, shared: _Floats, table: _Floats) -> Rows:
        """Return what a whole table says of the shared parameters, linearly."""
        names, limit = self.known.names, self.known.limit
        if limit is not None and "catch_travel" in names:
            place = names.index("catch_travel")
            scale = self.known.spreads.travel
            _, slope, root = beyond(float(shared[place]), limit, scale)
            # the last row: as steep as the likelihood is curved, and of equal score
            if slope != 0.0:
                table = table.copy()
                table[-1, -1] *= slope / -root
                table[-1, :-1] *= -root / slope
        rest = partial_out(table, len(self.local))
        return Rows(design=rest[:, :-1], target=-rest[:, -1])

    def law_at(self, now: Mapping[str, float], mine: Mapping[str, float]) -> _Floats:
        """Return the law at other values than those it was fitted with, N·m."""
        ones = np.ones(self.torque.size)
        return self._evaluate(self._columns(now, mine), ones, now, mine)[1]

    def law(self, shared: _Floats, local: _Floats) -> _Floats:
        """Return the torque of the law at the trial's samples, N·m."""
        now = dict(zip(self.known.names, shared.tolist(), strict=True))
        return self.law_at(now, dict(zip(self.local, local.tolist(), strict=True)))


def _risen(since: _Floats, rise: float) -> _Floats:
    # 3x² - 2x³ up to the rise, a step without one
    if rise <= 0.0:
        return np.where(since >= 0.0, 1.0, 0.0)
    x = np.clip(since / rise, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))


def _step(since: _Floats, lag: float) -> _Floats:
    # a step as a sensor of first order reads it
    if lag <= 0.0:
        return _risen(since, 0.0)
    return np.where(since > 0.0, -np.expm1(-np.maximum(since, 0.0) / lag), 0.0)


def _slow(values: _Floats, time: _Floats, lag: float) -> _Floats:
    # what is 0 at first as that sensor reads it
    if lag <= 0.0 or values.size < 2:
        return values
    keep = math.exp(-float(np.median(np.diff(time))) / lag)
    half = 0.5 * (1.0 - keep)
    return np.asarray(lfilter([half, half], [1.0, -keep], values))


def _scaled(left: float, slopes: dict[str, float], size: float) -> Row:
    return left / size, {name: value / size for name, value in slopes.items()}


def line_row(
    catch: Catch, line: float, slope: float, slowest: float
) -> tuple[float, float, float]:
    """Return how far from the line of (2) a catch is, and the derivatives by L and α.

    A catch that comes late in a motion that speeds up has a larger mean speed for that
    very reason, so that a plain regression on mean speed is biased. Here the motion is
    followed to the angle θ* at which it meets the line, θ* = L - α·v̄(θ*) with
    v̄(θ*) = v̄ + (θ* - θ)·dv̄/dθ, and θ* is compared with the catch.

    >>> from types import SimpleNamespace
    >>> catch = SimpleNamespace(angle=1.0, mean_speed=2.0, speed_gain=0.5)
    >>> round(line_row(catch, 2.2, 0.4, 1.0)[0], 12)  # 0.4/(1 + 0.4·0.5)
    0.333333333333
    """
    clamped = catch.mean_speed <= slowest  # first line of (6): θ_catch stands still
    speed = slowest if clamped else catch.mean_speed
    gain = 0.0 if clamped else catch.speed_gain
    scale = 1.0 + slope * gain
    left = (line - slope * speed - catch.angle) / scale
    return left, 1.0 / scale, -(speed + left * gain) / scale


def _line(known: Known, catch: Catch, now: Mapping[str, float]) -> Row:
    slowest, size = known.constants.slowest_mean_speed, known.spreads.catch_angle
    line, slope = now["catch_angle_constant"], now["catch_slope"]
    left, by_line, by_slope = line_row(catch, line, slope, slowest)  # (2)
    slopes = {"catch_angle_constant": by_line, "catch_slope": by_slope}
    return _scaled(left, slopes, size)
