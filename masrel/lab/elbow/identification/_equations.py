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
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.special import erfcx, log_ndtr

from masrel.lab.elbow.identification._catches import Bools, Catch, Law, Part, Trial
from masrel.lab.elbow.identification._clusters import (
    ClusteredFit,
    FittedParameter,
    Rows,
    Step,
    left_out_steps,
    partial_out,
    solve,
    triangle,
)
from masrel.lab.elbow.motions import Floats

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
_HELD = ("gravity", "arm_inertia", "drift", "offset", "lag", "catch_rise")
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


# A residual over its spread that is not of a sample: name, size, and derivatives.
Row = tuple[str, float, Mapping[str, float]]


class _Design(NamedTuple):
    # the matrix (n_samples, n_linear), the angle since the catch, and where torque may
    # climb with it
    matrix: Floats
    past: Floats
    climbs: Bools


class Equations:
    """Residuals of one trial as a function of shared parameters and its own.

    Its own (`local`) are the constant torque and its drift, and of a catch the peak and
    residual torque above the end of pre-catch (N·m), the angle travelled (rad), and how
    much later than `catch.time` it was (s), as far as the trial has them.

    `names` are the shared parameters in the order of their vector; `spreads` what a
    residual is divided by ("torque", "peak", "residual", N·m; "catch angle", "travel",
    rad); `held` is known before; `on_line` says whether the catch is on the line of
    (2); `limit` behind which it ends, if it does not end before.
    """

    def __init__(
        self,
        trial: Trial,
        names: tuple[str, ...],
        spreads: Mapping[str, float],
        held: Law,
        *,
        on_line: bool = False,
        limit: DetectionLimit | None = None,
    ) -> None:
        self.trial, self.names, self.spreads, self.held = trial, names, spreads, held
        self.on_line, self.limit, self.part = on_line, limit, trial.pre_catch
        self.n_pre, later = self.part.time.size, self.part.time[:0]
        self.catch: Catch | None = None
        self.end, self.peak_end, self.fixed_end = math.inf, math.inf, False
        if trial.catch is not None and trial.after is not None:
            self.catch, later = trial.catch, trial.after.time
            self.part = self.part.then(trial.after)
            if self.catch.end is not None:
                self.end = self.catch.end
                # an end whose torque steps stays where it was found; others move with D
                additive = held.constants.post_catch == "additive"
                self.fixed_end = additive or self.catch.within_peak
            stop = self.end if self.fixed_end else math.inf
            self.peak_end = min(self.catch.time + held.constants.peak_duration, stop)
        self._period = float(np.median(np.diff(later))) if later.size > 1 else 0.0
        n_peak = int((later < self.peak_end).sum())
        moves = math.isfinite(self.end) and not self.fixed_end
        has = {
            "offset": "offset" in held.fitted,
            "drift": "drift" in held.fitted,
            "peak": n_peak > 0,
            "residual": n_peak < later.size,
            "travel": moves and "catch_travel" in names,
            "shift": held.takes_time and n_peak > 0,
        }
        self.local = tuple(name for name, is_there in has.items() if is_there)
        self._first = self._design(held.lag, held.catch_rise, 0.0)

    def values(self, shared: Floats, local: Floats) -> dict[str, float]:
        """Return all parameters by name, those of the arm that are held among them."""
        names = (*self.names, *self.local)
        numbers = (*shared.tolist(), *local.tolist())
        held = {name: getattr(self.held, name) for name in _HELD}
        return held | dict(zip(names, numbers, strict=True))

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
        middle = float(part.time.mean()) if n and "offset" in self.local else 0.0
        of_trial = np.column_stack([part.time - middle, np.ones(n), steps])
        return _Design(np.column_stack([columns, of_trial]), past, climbs)

    def _smooth(self, part: Part, lag: float) -> Floats:
        # a sensor that lags by T reads x - T·x' + T²·x'' of what is smooth
        angle = part.angle - lag * (part.velocity - lag * part.acceleration)
        velocity = part.velocity - lag * (part.acceleration - lag * part.jerk)
        acceleration = part.acceleration - lag * part.jerk
        weight = np.sin(angle - self.held.gravity_angle)
        stretched = angle - self._rest()
        return np.column_stack(
            [velocity, stretched, acceleration, weight, acceleration]
        )

    def _rest(self) -> float:
        # without an offset of its own, the torque of a trial is 0 at its rest angle
        if "offset" in self.local:
            return 0.0
        rest = self.held.constants.rest_angle
        return self.trial.stretch.rest_angle if rest is None else rest

    def _from_catch(
        self, part: Part, catch: Catch, timed: tuple[float, float, float]
    ) -> tuple[Floats, Floats, Floats]:
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
        if self.held.constants.post_catch == "additive":
            held = np.where(over, self._smooth(part, lag)[:, :3], held)
        else:  # m·θ̈ of (5)
            held[:, 2:] += np.where(over, part.acceleration[:, None], 0.0)
        weight = np.sin(part.angle - lag * part.velocity - self.held.gravity_angle)
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

    def start(self, shared: Mapping[str, float]) -> Floats:
        """Return where to begin with the trial's own: (3), and what was seen."""
        values = dict.fromkeys(self.local, 0.0)
        if self.catch is not None:
            peak = shared["catch_torque_constant"] * self.catch.speed
            residual = peak * shared["residual_ratio"]
            own = {"peak": peak, "residual": residual, "travel": self.catch.travel}
            values |= {name: x if math.isfinite(x) else 0.0 for name, x in own.items()}
        return np.array([values[name] for name in self.local])

    def table(self, shared: Floats, local: Floats) -> Floats:
        """Return the columns [own | shared | residuals], over their spreads."""
        values, names = self.values(shared, local), (*self.local, *self.names)
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
        rows, sd, n = self.catch_rows(values), self.spreads["torque"], law.size
        table = np.zeros((n + len(rows), len(names) + 1))
        for place, name in enumerate(names):
            table[:n, place] = by_name.get(name, 0.0)
            table[n:, place] = [slopes.get(name, 0.0) for _, _, slopes in rows]
        table[:n, -1] = law - self.part.torque
        table[:n] /= sd
        table[n:, -1] = [left for _, left, _ in rows]
        return table

    def by_late_angle(self, values: Mapping[str, float]) -> Floats:
        """Return the residuals' derivatives by how much earlier the angle is, 1/s."""
        shared, local = (
            np.array([values[name] for name in names])
            for names in (self.names, self.local)
        )
        early, late = (
            Equations(
                self.trial.ahead(by),
                self.names,
                self.spreads,
                self.held,
                on_line=self.on_line,
                limit=self.limit,
            ).table(shared, local)[:, -1]
            for by in (-_STEP, _STEP)
        )
        return np.asarray((early - late) / (2.0 * _STEP))

    def law(self, values: Mapping[str, float]) -> Floats:
        """Return the torque of the law at the trial's samples, N·m."""
        return self._evaluate(self.design(values), values)[0]

    def design(self, values: Mapping[str, float]) -> _Design:
        timed = values["lag"], values["catch_rise"], values.get("shift", 0.0)
        if timed == (self.held.lag, self.held.catch_rise, 0.0):
            return self._first
        return self._design(*timed)

    def _evaluate(
        self, design: _Design, values: Mapping[str, float]
    ) -> tuple[Floats, Floats, Floats]:
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
        used, size = self.catch, self.spreads
        line, slope, height, ratio, mean, peak, residual = (
            values.get(name, math.nan) for name in _SCATTERED
        )
        if self.on_line and self.trial.catch is not None:
            slowest = self.held.constants.slowest_mean_speed
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
        limit = self.limit
        if used is not None and limit is not None and not math.isnan(mean):
            left, by_mean, _ = beyond(mean, limit, size["travel"])
            rows.append(("limit", left, {"catch_travel": by_mean}))
        return rows

    def rows(self, shared: Mapping[str, float], table: Floats) -> Rows:
        """Return what a whole table says of the shared parameters, linearly."""
        limit = self.limit
        if self.catch is not None and limit is not None and "catch_travel" in shared:
            scale = self.spreads["travel"]
            _, slope, root = beyond(shared["catch_travel"], limit, scale)
            # the last row: as steep as the likelihood is curved, and of equal score
            if slope != 0.0:
                table = table.copy()
                table[-1, -1] *= slope / -root
                table[-1, :-1] *= -root / slope
        rest = partial_out(table, len(self.local))
        return Rows(rest[:, :-1], -rest[:, -1])


def _step(since: Floats, lag: float) -> Floats:
    # a step as a sensor of first order reads it
    if lag <= 0.0:
        return np.where(since >= 0.0, 1.0, 0.0)
    return np.where(since > 0.0, -np.expm1(-np.maximum(since, 0.0) / lag), 0.0)


def _slow(values: Floats, period: float, lag: float) -> Floats:
    # what is 0 at first as that sensor reads it
    if lag <= 0.0 or values.size < 2:
        return values
    keep = math.exp(-period / lag)
    half = 0.5 * (1.0 - keep)
    return np.asarray(lfilter([half, half], [1.0, -keep], values))


def line_row(
    catch: Catch, line: float, slope: float, slowest: float
) -> tuple[float, float, float]:
    """Return the distance of a catch from the line of (2), and its slopes in L and α.

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


def mills(z: Floats) -> Floats:
    """Evaluate φ/Φ of the standard normal distribution."""
    return np.asarray(math.sqrt(2.0 / math.pi) / erfcx(-z / math.sqrt(2.0)))


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFit:
    """Where the sum of squares is smallest: shared parameters, and each trial's own."""

    equations: Sequence[Equations]
    shared: dict[str, float]
    values: list[dict[str, float]]  # each trial's parameters by name
    tables: list[Floats]  # each trial's equations there
    laws: tuple[Floats, ...]  # and torque, N·m
    steps: tuple[Step, ...] = ()  # the fits before
    fast: tuple[Trial, ...] = ()  # those without a catch among them

    @property
    def trials(self) -> list[Trial]:
        """Return the trials that are used: slow and fast ones."""
        return [e.trial for e in self.equations]

    @property
    def alone(self) -> dict[str, FittedParameter]:
        """Return what the steps say, by name."""
        return {e.name: e for step in self.steps for e in step.estimates}

    @property
    def residuals(self) -> list[Floats]:
        """Return each trial's torque, measured less fitted, N·m."""
        pairs = zip(self.equations, self.laws, strict=True)
        return [e.part.measured - law for e, law in pairs]

    @property
    def typical(self) -> float:
        """Return the median over catches of the mean square that is left, (N·m)²."""
        pairs = zip(self.equations, self.residuals, strict=True)
        squares = [float((x**2).mean()) for e, x in pairs if e.catch is not None]
        return float(np.median(squares)) if squares else math.nan

    @property
    def torque_sd(self) -> float:
        """Return the standard deviation of torque about the law in all trials, N·m."""
        left = np.concatenate(self.residuals)
        spare = left.size - sum(len(e.local) for e in self.equations) - len(self.shared)
        return math.sqrt(float(left @ left) / max(spare, 1))

    def rows(self) -> list[Rows]:
        """Return what each trial says of the shared parameters."""
        pairs = zip(self.equations, self.tables, strict=True)
        return [e.rows(self.shared, table) for e, table in pairs]

    def clustered(self) -> ClusteredFit:
        """Return the shared parameters with their covariance, clustered by trial."""
        step, shared = solve(self.rows()), list(self.shared.values())
        # what no trial determines is nan in the step and stays so
        return replace(step, values=np.where(np.isnan(step.values), np.nan, shared))


def fit_together(
    equations: Sequence[Equations],
    start: Mapping[str, float],
    floors: Mapping[str, float],
) -> JointFit:
    """Fit every parameter to every trial at once.

    Instants of catches stay where the change points are, unless the torque takes time:
    the law is not differentiable in them. Everything else is. No parameter falls
    below its floor.
    """
    names = equations[0].names
    n = len(names)
    lowest = np.array([floors.get(name, -math.inf) for name in names])
    first = np.maximum([start[name] for name in names], lowest)
    begin = np.concatenate([first, *(e.start(start) for e in equations)])
    cuts = np.cumsum([len(e.local) for e in equations])[:-1]
    jacobian = np.zeros((0, begin.size))

    def own_of(x: Floats) -> list[tuple[Equations, Floats]]:
        return list(zip(equations, np.split(x[n:], cuts), strict=True))

    def residuals(x: Floats) -> Floats:
        # Of each trial, R of the QR of [Jacobian | residuals]: the same sum of squares
        # and gradient in as many rows as columns.
        nonlocal jacobian
        tables = [triangle(e.table(x[:n], own)) for e, own in own_of(x)]
        whole = np.concatenate([table[:, -n - 1 :] for table in tables])
        of_trials = block_diag(*(table[:, : -n - 1] for table in tables))
        jacobian = np.column_stack([whole[:, :-1], of_trials])
        return np.asarray(whole[:, -1])

    def derivatives(_: Floats) -> Floats:
        return jacobian  # of the last residuals, which are those of this point

    solution = least_squares(
        residuals,
        begin,
        jac=derivatives,
        bounds=(np.append(lowest, np.full(begin.size - n, -math.inf)), math.inf),
        x_scale="jac",
        ftol=_TIMED if equations[0].held.takes_time else _PRECISE,
        xtol=_KINK,
        gtol=None,
        max_nfev=_EVALUATIONS,
    )
    shared, pairs = solution.x[:n], own_of(solution.x)
    values = [e.values(shared, own) for e, own in pairs]
    return JointFit(
        equations=equations,
        shared=dict(zip(names, shared.tolist(), strict=True)),
        values=values,
        tables=[e.table(shared, own) for e, own in pairs],
        laws=tuple(e.law(x) for e, x in zip(equations, values, strict=True)),
    )


def with_late_angle(joint: JointFit, lag: float) -> tuple[JointFit, float]:
    """Return a fit with one more parameter, and by how much that is off, s.

    It is the lag of the torque, below 0, by which the recordings were put right.
    """
    columns = map(Equations.by_late_angle, joint.equations, joint.values)
    tables = [
        np.insert(table, -1, column, axis=1)
        for table, column in zip(joint.tables, columns, strict=True)
    ]
    whole = replace(joint, tables=tables, shared={**joint.shared, "lag": lag})
    return whole, float(solve(whole.rows()).values[-1])


def left_out_errors(joint: JointFit) -> Floats:
    """Return each trial's mean square distance from what the others say of it."""
    # What the others say is reckoned as linear as it is at the fit. Constant, peak,
    # residual and travel are its own; its drift is the others' mean, or a drift would
    # better every fit.
    drifts = np.array([values["drift"] for values in joint.values])
    squares = []
    steps, residuals = left_out_steps(joint.rows()), joint.residuals
    for i, (e, table) in enumerate(zip(joint.equations, joint.tables, strict=True)):
        n, r = len(e.local), triangle(table)
        local = np.zeros(n)
        if "drift" in e.local and drifts.size > 1:
            others = (drifts.sum() - drifts[i]) / (drifts.size - 1)
            local[e.local.index("drift")] = others - drifts[i]
        left = r[:, -1] + r[:, n:-1] @ np.nan_to_num(steps[i]) + r[:, :n] @ local
        free = [j for j, name in enumerate(e.local) if name != "drift"]
        local[free] = np.linalg.lstsq(r[:, free], -left, rcond=1e-12)[0]
        moved = table[: residuals[i].size, :-1] * np.concatenate([local, steps[i]])
        error = residuals[i] - e.spreads["torque"] * moved.sum(axis=1)
        squares.append(float((error**2).mean()) if error.size else math.nan)
    return np.array(squares)
