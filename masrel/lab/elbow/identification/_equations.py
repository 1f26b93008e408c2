"""The last fit: every parameter from every trial together, nonlinear least squares.

Trials differ: each has a constant torque of its own, -k·θ_rest, and each catch a peak,
a residual and a travel of its own. What the joint has in common is what the torque of
all trials shares (b, k, m, k_post), and what their catches scatter about: the line of
catch angles (L, α), peaks in proportion to speed (H), residuals in proportion to peaks
(Q), and travels (D).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.special import erfcx, log_ndtr

from masrel.lab.elbow.identification._catches import Catch, Law, Part, Trial
from masrel.lab.elbow.identification._clusters import (
    ClusteredFit,
    Rows,
    left_out_steps,
    partial_out,
    solve,
    triangle,
)
from masrel.lab.elbow.parameters import ElbowParameters

_Floats = NDArray[np.float64]
_Bools = NDArray[np.bool_]

# What a trial's torque is linear in, in the order of the design matrix's columns, and
# what it is differentiated by numerically, in steps of so many seconds.
LINEAR = (
    "damping",
    "stiffness",
    "inertia",
    "gravity",
    "arm_inertia",
    "drift",
    "offset",
    "peak",
    "residual",
)
_CURVED, _STEP = ("lag", "catch_rise", "shift"), 1e-4

_SCATTERED = (
    "catch_angle_constant",
    "catch_slope",
    "catch_torque_constant",
    "residual_ratio",
    "catch_travel",
    "peak",
    "residual",
)

_EVALUATIONS = 60
# Relative fall of the sum of squares that ends the search; with derivatives that are
# differences, or of more rounds to come, less is enough. And relative size of a step:
# where a climb begins at a sample, nothing is more precise.
_PRECISE, _TIMED, _KINK = 1e-10, 1e-7, 1e-7


class DetectionLimit(NamedTuple):
    """The travel up to which the end of one catch would have been seen."""

    travel: float  # an end here would be seen as often as not, rad
    sd: float  # of where noise lets the search see one last, rad


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What the equations of a trial do not change.

    `names` are the shared parameters in the order of their vector; `spreads` what a
    residual is divided by ("torque", "peak", "residual", N·m; "catch angle", "travel",
    rad); `offset` the fixed constant torque above -k·θ_rest (None if each trial has its
    own); `drifts` says whether a trial's offset may drift; `on_line` whether its catch
    is on the line of (2); `limit` behind which its catch ends, if it does not end
    before.
    """

    names: tuple[str, ...]
    constants: ElbowParameters
    spreads: Mapping[str, float]
    law: Law
    offset: float | None = None
    drifts: bool = False
    on_line: bool = False
    limit: DetectionLimit | None = None


# A residual over its spread that is not of a sample: name, size, and derivatives.
Row = tuple[str, float, Mapping[str, float]]


class _Design(NamedTuple):
    # the matrix (n_samples, n_linear), the angle since the catch, and where torque may
    # climb with it
    matrix: _Floats
    past: _Floats
    climbs: _Bools


class Equations:
    """Residuals of one trial as a function of shared parameters and its own.

    Its own (`local`) are the constant torque and its drift, and of a catch the peak and
    residual torque above the end of pre-catch (N·m), the angle travelled (rad), and how
    much later than `catch.time` it was (s), as far as the trial has them.
    """

    def __init__(self, trial: Trial, known: Known) -> None:
        self.trial, self.known, self.part = trial, known, trial.pre_catch
        self.n_pre, later = self.part.time.size, self.part.time[:0]
        self.catch: Catch | None = None
        self.end, self.peak_end, self.fixed_end = math.inf, math.inf, False
        if trial.catch is not None and trial.after is not None:
            self.catch, later = trial.catch, trial.after.time
            self.part = self.part.then(trial.after)
            if self.catch.end is not None:
                self.end = self.catch.end
                # an end whose torque steps stays where it was found; others move with D
                additive = known.constants.post_catch == "additive"
                self.fixed_end = additive or self.catch.within_peak
            stop = self.end if self.fixed_end else math.inf
            self.peak_end = min(self.catch.time + known.constants.peak_duration, stop)
        self._period = float(np.median(np.diff(later))) if later.size > 1 else 0.0
        n_peak, timed = int((later < self.peak_end).sum()), known.law.takes_time
        moves = math.isfinite(self.end) and not self.fixed_end
        has = {
            "offset": known.offset is None,
            "drift": known.drifts,
            "peak": n_peak > 0,
            "residual": n_peak < later.size,
            "travel": moves and "catch_travel" in known.names,
            "shift": timed and n_peak > 0,
        }
        self.local = tuple(name for name, is_there in has.items() if is_there)
        self._first = self._design(known.law.lag, known.law.catch_rise, 0.0)

    def values(self, shared: _Floats, local: _Floats) -> dict[str, float]:
        """Return all parameters by name, those of the arm that are held among them."""
        law, offset = self.known.law, self.known.offset
        held = {
            name: getattr(law, name) for name in ("gravity", "arm_inertia", "drift")
        }
        held |= {"lag": law.lag, "catch_rise": law.catch_rise, "offset": offset or 0.0}
        now = zip(self.known.names, shared.tolist(), strict=True)
        return {
            **held,
            **dict(now),
            **dict(zip(self.local, local.tolist(), strict=True)),
        }

    def _design(self, lag: float, rise: float, shift: float) -> _Design:
        part, n = self.part, self.part.time.size
        columns = self._smooth(self.trial.pre_catch, lag)
        past, climbs = np.zeros(n), np.zeros(n, dtype=np.bool_)
        catch, after = self.catch, self.trial.after
        steps = np.zeros((n, 2))
        if catch is not None and after is not None:
            later, up, down = self._from_catch(after, catch, (lag, rise, shift))
            columns = np.concatenate([columns, later])
            steps[self.n_pre :] = np.column_stack([up - down, down])
            past = part.angle - (catch.angle + catch.speed * shift)
            if math.isfinite(self.end):
                begin = self.end if self.fixed_end else self.peak_end + shift
                climbs = part.time >= begin
                climbs[: self.n_pre] = False
        # a drift is that of the trial's own constant, in its middle, or of a known one
        middle = float(part.time.mean()) if n and self.known.offset is None else 0.0
        of_trial = np.column_stack([part.time - middle, np.ones(n), steps])
        return _Design(np.column_stack([columns, of_trial]), past, climbs)

    def _smooth(self, part: Part, lag: float) -> _Floats:
        # a sensor that lags by T reads x - T·x' + T²·x'' of what is smooth
        angle = part.angle - lag * (part.velocity - lag * part.acceleration)
        velocity = part.velocity - lag * (part.acceleration - lag * part.jerk)
        acceleration = part.acceleration - lag * part.jerk
        weight = np.sin(angle - self.known.law.gravity_angle)
        stretched = angle - self._rest()
        return np.column_stack(
            [velocity, stretched, acceleration, weight, acceleration]
        )

    def _rest(self) -> float:
        # without an offset of its own, the torque of a trial is 0 at its rest angle
        if self.known.offset is None:
            return 0.0
        rest = self.known.constants.rest_angle
        return self.trial.rest_angle if rest is None else rest

    def _from_catch(
        self, part: Part, catch: Catch, timed: tuple[float, float, float]
    ) -> tuple[_Floats, _Floats, _Floats]:
        # what _smooth returns, of samples from the catch on, and the two steps of (3)
        lag, rise, shift = timed
        since = part.time - (catch.time + shift)
        fading = np.exp(-np.maximum(since, 0.0) / lag) if lag > 0.0 else 0.0 * since
        speed = catch.speed + catch.acceleration * shift
        angle = catch.angle + catch.speed * shift
        # τ_pre_end of (3) is held; the sensor comes from what it was before
        held = np.column_stack(
            [
                speed - lag * catch.acceleration * fading,
                angle - self._rest() - lag * speed * fading,
                np.full(part.time.size, catch.acceleration),
            ]
        )
        over = (part.time >= self.end)[:, None]
        if self.known.constants.post_catch == "additive":
            held = np.where(over, self._smooth(part, lag)[:, :3], held)
        else:  # m·θ̈ of (5)
            held[:, 2:] += np.where(over, part.acceleration[:, None], 0.0)
        weight = np.sin(part.angle - lag * part.velocity - self.known.law.gravity_angle)
        # the hand slows at once, and the sensor comes from what it was before
        pushed = (
            _slow(part.acceleration, self._period, lag) + catch.acceleration * fading
        )
        up = _step(since, lag)
        if rise > 0.0:  # 3x² - 2x³
            x = np.clip(since / rise, 0.0, 1.0)
            up = _slow(x * x * (3.0 - 2.0 * x), self._period, lag)
        down = _step(since - (self.peak_end - catch.time), lag)
        return np.column_stack([held, weight, pushed]), up, down

    def start(self, shared: Mapping[str, float]) -> _Floats:
        """Return where to begin with the trial's own: (3), and what was seen."""
        values = dict.fromkeys(self.local, 0.0)
        if self.catch is not None:
            peak = shared["catch_torque_constant"] * self.catch.speed
            residual = peak * shared["residual_ratio"]
            own = {"peak": peak, "residual": residual, "travel": self.catch.travel}
            values |= {name: x if math.isfinite(x) else 0.0 for name, x in own.items()}
        return np.array([values[name] for name in self.local])

    def table(self, shared: _Floats, local: _Floats) -> _Floats:
        """Return the columns [own | shared | residuals], over their spreads."""
        values, names = self.values(shared, local), (*self.local, *self.known.names)
        design = self.design(values)
        law, climb, slope = self._evaluate(design, values)
        by_name = dict(zip(LINEAR, design.matrix.T, strict=True))
        by_name |= {"post_catch_stiffness": climb, "travel": slope}
        for name in set(_CURVED) & set(names):
            more, less = (
                self.law({**values, name: values[name] + step})
                for step in (_STEP, -_STEP)
            )
            by_name[name] = (more - less) / (2.0 * _STEP)
        rows, sd, n = self.catch_rows(values), self.known.spreads["torque"], law.size
        table = np.zeros((n + len(rows), len(names) + 1))
        for place, name in enumerate(names):
            table[:n, place] = by_name.get(name, 0.0)
            table[n:, place] = [slopes.get(name, 0.0) for _, _, slopes in rows]
        table[:n, -1] = law - self.part.torque
        table[:n] /= sd
        table[n:, -1] = [left for _, left, _ in rows]
        return table

    def law(self, values: Mapping[str, float]) -> _Floats:
        """Return the torque of the law at the trial's samples, N·m."""
        return self._evaluate(self.design(values), values)[0]

    def design(self, values: Mapping[str, float]) -> _Design:
        timed = values["lag"], values["catch_rise"], values.get("shift", 0.0)
        if timed == (self.known.law.lag, self.known.law.catch_rise, 0.0):
            return self._first
        return self._design(*timed)

    def _evaluate(
        self, design: _Design, values: Mapping[str, float]
    ) -> tuple[_Floats, _Floats, _Floats]:
        # the law, what k_post multiplies in it, and its derivative by the travel
        stiffness = values.get("post_catch_stiffness", 0.0)
        climb = slope = np.zeros(design.past.size)
        if self.catch is not None:
            past = design.past - values.get("travel", self.catch.travel)
            over = design.climbs & (self.fixed_end | (past > 0.0))
            climb, slope = np.where(over, past, 0.0), np.where(over, -stiffness, 0.0)
            if (lag := values["lag"]) > 0.0:
                later = slice(self.n_pre, None)
                climb[later] = _slow(climb[later], self._period, lag)
                slope[later] = _slow(slope[later], self._period, lag)
        linear = np.array([values.get(name, 0.0) for name in LINEAR])
        return design.matrix @ linear + stiffness * climb, climb, slope

    def catch_rows(self, values: Mapping[str, float]) -> list[Row]:
        """Return how far the trial's own values are from what they scatter about."""
        rows: list[Row] = []
        used, size = self.catch, self.known.spreads
        line, slope, height, ratio, mean, peak, residual = (
            values.get(name, math.nan) for name in _SCATTERED
        )
        if self.known.on_line and self.trial.catch is not None:
            slowest = self.known.constants.slowest_mean_speed
            left, by_line, by_slope = line_row(self.trial.catch, line, slope, slowest)
            slopes = {"catch_angle_constant": by_line, "catch_slope": by_slope}
            rows.append(("catch angle", left, slopes))  # (2)
        if used is not None:
            slopes = {"catch_torque_constant": used.speed, "peak": -1.0}
            rows.append(("peak", height * used.speed - peak, slopes))  # (3)
            slopes = {"residual_ratio": peak, "peak": ratio, "residual": -1.0}
            rows.append(("residual", ratio * peak - residual, slopes))  # (3)
            if used.end is not None:
                left = mean - values.get("travel", used.travel)  # (4)
                rows.append(("travel", left, {"catch_travel": 1.0, "travel": -1.0}))
        # what is not fitted is nan, and says nothing
        rows = [
            (name, left / size[name], {n: x / size[name] for n, x in slopes.items()})
            for name, left, slopes in rows
            if not math.isnan(left)
        ]
        limit = self.known.limit
        if used is not None and limit is not None and not math.isnan(mean):
            left, by_mean, _ = beyond(mean, limit, size["travel"])
            rows.append(("limit", left, {"catch_travel": by_mean}))
        return rows

    def rows(self, shared: _Floats, table: _Floats) -> Rows:
        """Return what a whole table says of the shared parameters, linearly."""
        names, limit = self.known.names, self.known.limit
        if self.catch is not None and limit is not None and "catch_travel" in names:
            place = names.index("catch_travel")
            scale = self.known.spreads["travel"]
            _, slope, root = beyond(float(shared[place]), limit, scale)
            # the last row: as steep as the likelihood is curved, and of equal score
            if slope != 0.0:
                table = table.copy()
                table[-1, -1] *= slope / -root
                table[-1, :-1] *= -root / slope
        rest = partial_out(table, len(self.local))
        return Rows(rest[:, :-1], -rest[:, -1])


def _step(since: _Floats, lag: float) -> _Floats:
    # a step as a sensor of first order reads it
    if lag <= 0.0:
        return np.where(since >= 0.0, 1.0, 0.0)
    return np.where(since > 0.0, -np.expm1(-np.maximum(since, 0.0) / lag), 0.0)


def _slow(values: _Floats, period: float, lag: float) -> _Floats:
    # what is 0 at first as that sensor reads it
    if lag <= 0.0 or values.size < 2:
        return values
    keep = math.exp(-period / lag)
    half = 0.5 * (1.0 - keep)
    return np.asarray(lfilter([half, half], [1.0, -keep], values))


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


def beyond(mean: float, limit: DetectionLimit, sd: float) -> tuple[float, float, float]:
    """Residual whose square is -2 ln of the chance to lie beyond a limit."""
    size = math.hypot(sd, limit.sd)
    z = (mean - limit.travel) / size
    left = math.sqrt(-2.0 * float(log_ndtr(z)))
    ratio = float(mills(np.array(z)))
    if left == 0.0:  # so far beyond that a float64 knows of no chance to lie before
        return 0.0, 0.0, 0.0
    return left, -ratio / (size * left), math.sqrt(ratio * (z + ratio)) / size


def mills(z: _Floats) -> _Floats:
    """Evaluate φ/Φ of the standard normal distribution."""
    return np.asarray(math.sqrt(2.0 / math.pi) / erfcx(-z / math.sqrt(2.0)))


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the sum of squares is smallest: shared parameters, and each trial's own."""

    equations: Sequence[Equations]
    shared: _Floats
    local: list[_Floats]
    values: list[dict[str, float]]  # each trial's parameters by name
    laws: tuple[_Floats, ...]  # and torque, N·m

    @property
    def typical(self) -> float:
        """Return the median over catches of the mean square that is left, (N·m)²."""
        left = [
            float(((e.part.measured - law) ** 2).mean())
            for e, law in zip(self.equations, self.laws, strict=True)
            if e.catch is not None
        ]
        return float(np.median(left)) if left else math.nan


def fit_together(
    equations: Sequence[Equations],
    start: Mapping[str, float],
    floors: Mapping[str, float],
) -> Solution:
    """Fit every parameter to every trial at once.

    Instants of catches stay where the change points are, unless the torque takes time:
    the law is not differentiable in them. Everything else is. No parameter falls
    below its floor.
    """
    names = equations[0].known.names
    n = len(names)
    lowest = np.array([floors.get(name, -math.inf) for name in names])
    first = np.maximum([start[name] for name in names], lowest)
    begin = np.concatenate([first, *(e.start(start) for e in equations)])
    cuts = np.cumsum([n, *(len(e.local) for e in equations)])
    jacobian = np.zeros((0, begin.size))

    def residuals(x: _Floats) -> _Floats:
        # Of each trial, R of the QR of [Jacobian | residuals]: the same sum of squares
        # and gradient in as many rows as columns.
        nonlocal jacobian
        local = np.split(x[n:], cuts[:-1] - n)[1:]
        tables = [
            triangle(e.table(x[:n], own))
            for e, own in zip(equations, local, strict=True)
        ]
        jacobian = np.zeros((sum(t.shape[0] for t in tables), x.size))
        row = 0
        for table, stop in zip(tables, cuts[1:].tolist(), strict=True):
            rows, n_own = slice(row, row + table.shape[0]), table.shape[1] - 1 - n
            jacobian[rows, stop - n_own : stop] = table[:, :n_own]
            jacobian[rows, :n] = table[:, n_own:-1]
            row = rows.stop
        return np.concatenate([t[:, -1] for t in tables])

    def derivatives(_: _Floats) -> _Floats:
        return jacobian  # of the last residuals, which are those of this point

    solution = least_squares(
        residuals,
        begin,
        jac=derivatives,
        bounds=(np.append(lowest, np.full(begin.size - n, -math.inf)), math.inf),
        x_scale="jac",
        ftol=_TIMED if equations[0].known.law.takes_time else _PRECISE,
        xtol=_KINK,
        gtol=None,
        max_nfev=_EVALUATIONS,
    )
    shared, local = solution.x[:n], np.split(solution.x[n:], cuts[:-1] - n)[1:]
    values = [e.values(shared, own) for e, own in zip(equations, local, strict=True)]
    laws = tuple(e.law(at) for e, at in zip(equations, values, strict=True))
    return Solution(equations, shared, local, values, laws)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFit:
    """What a solution says of the shared parameters, and leaves over of each trial."""

    fit: ClusteredFit
    tables: list[_Floats] = field(repr=False)  # of all samples, at the solution
    torque_sd: float
    cross_validation: _Floats = field(repr=False)


def joint_fit(solution: Solution) -> JointFit:
    """Return values of all parameters with their covariance, clustered by trial."""
    shared, equations = solution.shared, solution.equations
    pairs = zip(equations, solution.local, strict=True)
    tables = [e.table(shared, local) for e, local in pairs]
    rows = [e.rows(shared, t) for e, t in zip(equations, tables, strict=True)]
    pairs_of_torque = zip(equations, solution.laws, strict=True)
    left = np.concatenate([e.part.measured - law for e, law in pairs_of_torque])
    spare = left.size - sum(local.size for local in solution.local) - shared.size
    step = solve(rows)
    # what no trial determines is nan in the step and stays so
    values = np.where(np.isnan(step.values), np.nan, shared)
    return JointFit(
        fit=replace(step, values=values),
        tables=tables,
        torque_sd=math.sqrt(float(left @ left) / max(spare, 1)),
        cross_validation=_left_out(solution, rows, tables),
    )


def _left_out(
    solution: Solution, rows: Sequence[Rows], tables: Sequence[_Floats]
) -> _Floats:
    # Per trial the mean square of its torque less what the others' parameters give, as
    # linear as they are at the fit. Constant, peak, residual and travel are its own;
    # its drift is the others' mean, or a drift would better every fit.
    drifts = np.array([values["drift"] for values in solution.values])
    made = []
    pairs = zip(solution.equations, left_out_steps(rows), strict=True)
    for i, (e, step) in enumerate(pairs):
        table, law, n = tables[i], solution.laws[i], len(e.local)
        r = triangle(table)
        local = np.zeros(n)
        if "drift" in e.local and drifts.size > 1:
            others = (drifts.sum() - drifts[i]) / (drifts.size - 1)
            local[e.local.index("drift")] = others - drifts[i]
        left = r[:, -1] + r[:, n:-1] @ np.nan_to_num(step) + r[:, :n] @ local
        free = [j for j, name in enumerate(e.local) if name != "drift"]
        local[free] = np.linalg.lstsq(r[:, free], -left, rcond=1e-12)[0]
        columns = table[: law.size, :-1] * np.concatenate([local, step])
        error = e.part.measured - law - e.known.spreads["torque"] * columns.sum(axis=1)
        made.append(float((error**2).mean()) if error.size else math.nan)
    return np.array(made)
