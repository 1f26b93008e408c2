"""The fits that the source made one after the other, each on its own.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6), Figs. 3 to 5.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares
from scipy.special import log_ndtr, stdtrit

from masrel.errors import ConvergenceError
from masrel.lab.elbow.identification._catches import (
    MIN_GAIN,
    MIN_SIGNAL,
    Catch,
    CatchLevels,
    Law,
    Part,
    Trial,
    catch_levels,
)
from masrel.lab.elbow.identification._clusters import (
    UNDETERMINED,
    FittedParameter,
    Rows,
    Step,
    fitted,
    solve,
)
from masrel.lab.elbow.identification._equations import (
    DetectionLimit,
    line_row,
    mills,
)
from masrel.lab.elbow.motions import Floats
from masrel.lab.elbow.parameters import ElbowParameters

# Mean speeds must span this, rad/s: less is one speed, which has no slope.
_MIN_SPAN = math.radians(5.0)

_CANDIDATES = 200  # ends that are tried, whatever the number of samples
_DOUBLINGS = 60  # of a step towards a change of sign


def fit_catches(
    trials: Sequence[Trial], law: Law, level: float
) -> tuple[list[Step], dict[str, bool], dict[str, DetectionLimit]]:
    """Fit what catches tell, with b, k and m as known.

    The steps; by trial, whether its catch is on the line of (2); and where an end of
    it would no longer have been seen, if that counts.
    """
    catches = [trial.catch for trial in trials if trial.catch is not None]
    lies = on_the_line(catches, law.constants)
    levels = {t.stretch.name: read for t in trials if (read := catch_levels(t, law))}
    reads = list(levels.values())
    climbs = [read.climb for read in reads if read.climb.design.any()]
    post = _step(
        "post-catch: k_post of (5)",
        "post_catch_stiffness",
        climbs,
        level,
        "no stretch continues after its catch",
    )
    limits = _limits(trials, levels, law, post.estimates[0].value)
    peaks = [(read.catch.speed, read.peak) for read in reads]
    residuals = [(read.peak, read.residual) for read in reads]
    steps = [
        fit_catch_line(catches, lies, law.constants, level=level),
        _step("catch torque: H of (3)", "catch_torque_constant", _rows(peaks), level),
        _step(
            "residual torque: Q of (3)",
            "residual_ratio",
            _rows(residuals),
            level,
            "no torque was recorded after a peak",
        ),
        _travel([read.catch for read in reads], list(limits.values()), level),
        post,
    ]
    on_line = dict(zip((t.stretch.name for t in trials), lies.tolist(), strict=True))
    return steps, on_line, limits


def _step(
    title: str, name: str, rows: list[Rows], level: float, reason: str = UNDETERMINED
) -> Step:
    # with nothing to fit, a value that no row determines
    fit = solve(rows or [Rows(np.zeros((1, 1)), np.zeros(1))])
    estimates = fitted((name,), fit, level, {name: reason})
    return Step(name=title, estimates=estimates, residual_sd=fit.residual_sd)


def _rows(pairs: Sequence[tuple[float, float]]) -> list[Rows]:
    known = [(x, y) for x, y in pairs if not math.isnan(x + y)]
    return [Rows(np.array([[x]]), np.array([y])) for x, y in known]


def _travel(
    catches: Sequence[Catch], limits: Sequence[DetectionLimit], level: float
) -> Step:
    # D, the angle travelled during the catch, ΔT_c·v̄_c: its mean if all catches end,
    # otherwise where the likelihood of all travels is largest, those behind a limit
    # censored there
    title = "catch travel: D of (4)"
    seen = [catch.travel for catch in catches if catch.end is not None]
    if limits:
        travels = Travels(np.array(seen), *np.array(limits).T)
        estimate, sd = fit_censored(travels, level=level)
        return Step(name=title, estimates=(estimate,), residual_sd=sd)
    reason = "no catch ends within its stretch"
    if catches:
        longest = max(catch.travel for catch in catches)
        reason += f"; D is more than {math.degrees(longest):.4g} deg"
    rows = _rows([(1.0, travel) for travel in seen])
    return _step(title, "catch_travel", rows, level, reason)


def on_the_line(
    catches: Sequence[Catch], constants: ElbowParameters
) -> NDArray[np.bool_]:
    """Return which catches are on the line of (2), not where θ_L of (6) holds."""
    speeds = np.array([catch.mean_speed for catch in catches])
    speeds = np.maximum(speeds, constants.slowest_mean_speed)
    angles = np.array([catch.angle for catch in catches])
    design = np.stack([np.ones_like(speeds), -speeds], axis=1)
    on = np.ones(speeds.size, dtype=np.bool_)
    for _ in range(speeds.size):
        line = np.linalg.lstsq(design[on], angles[on], rcond=None)[0]
        now = design @ line >= constants.smallest_catch_angle
        if (now == on).all() or not now.any():
            break
        on = now
    return on


def fit_catch_line(
    catches: Sequence[Catch],
    on_line: NDArray[np.bool_],
    constants: ElbowParameters,
    *,
    level: float,
) -> Step:
    """Fit L and α to catch angles: (2) within the clamps of (6)."""
    names = ("catch_angle_constant", "catch_slope")
    title, slowest = "catch angles: L, α of (2)", constants.slowest_mean_speed
    used = [catch for catch, on in zip(catches, on_line, strict=True) if on]
    speeds = np.maximum([catch.mean_speed for catch in used], slowest)
    if np.ptp(speeds) < _MIN_SPAN:
        reason = (
            f"needs catches at mean speeds that differ by {math.degrees(_MIN_SPAN):g} "
            f"deg/s or more above {math.degrees(slowest):g} deg/s"
        )
        estimates = tuple(
            FittedParameter(name=name, level=level, n_trials=len(used), reason=reason)
            for name in names
        )
        return Step(name=title, estimates=estimates, residual_sd=math.nan)

    def left(x: Floats) -> Floats:
        return np.array([line_row(c, x[0], x[1], slowest)[0] for c in used])

    def slopes(x: Floats) -> Floats:
        return np.array([line_row(c, x[0], x[1], slowest)[1:] for c in used])

    plain = np.polyfit(-speeds, [catch.angle for catch in used], 1)[::-1]
    line = least_squares(left, plain, jac=slopes, ftol=1e-14, gtol=1e-14).x
    pairs = zip(slopes(line), left(line), strict=True)
    fit = solve([Rows(by[None], -np.array([far])) for by, far in pairs])
    return Step(
        name=title,
        estimates=fitted(names, replace(fit, values=line), level),
        residual_sd=fit.residual_sd,
    )


# How far catches travel of which some outlast their stretch. A catch that goes on where
# its stretch ends has a travel that is larger than what was seen of it. Leaving it out
# keeps the short travels and loses the long ones; here it is an observation censored on
# the right, not where the stretch stops but at the last angle at which an end would
# still be told from noise.


def _limits(
    trials: Sequence[Trial],
    levels: Mapping[str, CatchLevels],
    law: Law,
    stiffness: float,
) -> dict[str, DetectionLimit]:
    # Of catches that do not end, if those that do tell how much travels differ. With
    # m, or where the pre-catch law goes on after a catch, the torque may climb or not
    # whatever k_post is: what could have been seen is not one angle.
    catches = [read.catch for read in levels.values()]
    seen = {catch.travel for catch in catches if catch.end is not None}
    climbs_alone = law.constants.post_catch == "continuous" and law.inertia == 0.0
    if not climbs_alone or len(seen) < 2 or not stiffness > 0.0:
        return {}
    limits = {
        trial.stretch.name: _limit(
            trial.after, levels[trial.stretch.name].catch, law, stiffness
        )
        for trial in trials
        if trial.stretch.name in levels
        and trial.after is not None
        and levels[trial.stretch.name].catch.end is None
    }
    return {name: limit for name, limit in limits.items() if limit is not None}


def _limit(
    after: Part, catch: Catch, law: Law, stiffness: float
) -> DetectionLimit | None:
    # How late a catch could end and be seen to; None if no end could be seen at all.
    # `stiffness` is k_post: what an end makes the torque climb with, and nothing else.
    # An end is seen if its climb takes `MIN_GAIN` residual variances off the sum of
    # squares and adds up to `MIN_SIGNAL` standard deviations. The root of that gain is
    # a t whose error has a standard deviation of 1, which over the slope of t against
    # the angle of the end is the standard deviation of the limit.
    angle = after.angle[after.time >= catch.time + law.constants.peak_duration]
    if angle.size == 0:
        return None
    ends = np.unique(np.linspace(0, angle.size - 1, _CANDIDATES).astype(np.int64))
    climb = np.maximum(angle - angle[ends, None], 0.0)  # (n_ends, n_samples)
    scatter = np.linalg.norm(climb - climb.mean(axis=1, keepdims=True), axis=1)
    seen = stiffness * scatter / max(catch.residual_sd, 1e-12)  # 0 of exact data
    # the last sample does not rise above itself
    rise = np.where(climb[:, -1] > 0.0, climb[:, -1], math.inf)
    needed = np.maximum(math.sqrt(MIN_GAIN), MIN_SIGNAL * scatter / rise)
    spare, travel = seen - needed, angle[ends] - catch.angle
    # where it runs out for good: an end at the last sample adds nothing
    enough = np.flatnonzero(spare[:-1] >= 0.0)
    if enough.size == 0:
        return None
    last = int(enough[-1])
    fall = float(spare[last] - spare[last + 1])
    slope = float(travel[last + 1] - travel[last]) / fall if fall > 0.0 else 0.0
    return DetectionLimit(float(travel[last]) + slope * float(spare[last]), slope)


class Travels(NamedTuple):
    """Travels that were seen, and limits behind which the others lie, (n,) each."""

    seen: Floats
    limit: Floats
    limit_sd: Floats

    def log_likelihood(self, mean: float, sd: float) -> float:
        """Evaluate the log-likelihood of normal travels, without its constant."""
        scaled = (self.seen - mean) / sd
        z = (mean - self.limit) / np.hypot(sd, self.limit_sd)
        density = -0.5 * float(scaled @ scaled) - self.seen.size * math.log(sd)
        return density + float(log_ndtr(z).sum())

    def score(self, mean: float, sd: float) -> Floats:
        """Differentiate the log-likelihood by mean and sd."""
        scaled = (self.seen - mean) / sd
        # travels scatter, and so does what is seen of an end
        size = np.hypot(sd, self.limit_sd)
        z = (mean - self.limit) / size
        ratio = mills(z) / size
        by_sd = (scaled @ scaled - scaled.size) / sd - (ratio * z * sd / size).sum()
        return np.array([scaled.sum() / sd + ratio.sum(), by_sd])

    def sd_at(self, mean: float) -> float:
        """Return the most likely standard deviation for this mean."""
        first = math.log(math.sqrt(float(((self.seen - mean) ** 2).mean())))

        def slope(log_sd: float) -> float:
            return float(self.score(mean, math.exp(log_sd))[1])

        return math.exp(_root(slope, first, math.copysign(0.5, slope(first))))


def fit_censored(travels: Travels, *, level: float) -> tuple[FittedParameter, float]:
    """Return the mean of travels, some not seen to end, and their standard deviation.

    The mean maximises the likelihood of normal travels. Its interval holds all values
    whose profile likelihood is at least as large as that of the end of Student's
    interval without censoring: for n values twice the profile's fall from its maximum
    is then n·ln(1 + t²/(n - 1)), so this *is* Student's interval. With censoring n is
    the number seen. In simulations with 6 to 24 values, 7 to 75 % of them censored,
    such 95 % intervals cover 94 to 98 %; with all values in n it would be 92 to 97 %,
    and with the quantile of χ² 88 to 96 %.
    (Cohen 1959, https://doi.org/10.1080/00401706.1959.10489859)

    >>> nothing = np.empty(0)
    >>> travels = Travels(np.array([1.0, 2.0, 6.0]), nothing, nothing)
    >>> mean, _ = fit_censored(travels, level=0.95)
    >>> round(mean.value, 9), round(mean.high - 3.0, 6)  # 4.302653·√(7/3)
    (3.0, 6.572411)
    """

    def slope(value: float) -> float:
        return float(travels.score(value, travels.sd_at(value))[0])

    # At the mean of those seen, censored ones pull upwards; the likelihood is
    # log-concave (but for the limits' sd), so that its slope changes sign once.
    mean = float(travels.seen.mean())
    if travels.limit.size and slope(mean) > 0.0:
        mean = _root(slope, mean, float(travels.seen.std()))
    sd, number = travels.sd_at(mean), travels.seen.size
    t = float(stdtrit(number - 1.0, 0.5 + 0.5 * level))
    fall = 0.5 * number * math.log1p(t**2 / (number - 1.0))
    least = travels.log_likelihood(mean, sd) - fall

    def spare(value: float) -> float:
        return travels.log_likelihood(value, travels.sd_at(value)) - least

    # minus the second derivatives of the log-likelihood, by differences of the first
    h = 1e-5 * sd
    a, b = (travels.score(mean - h, sd) - travels.score(mean + h, sd)) / (2.0 * h)
    _, d = (travels.score(mean, sd - h) - travels.score(mean, sd + h)) / (2.0 * h)
    variance = d / (a * d - b * b)  # of the mean, the spread being unknown
    estimate = FittedParameter(
        name="catch_travel",
        value=mean,
        standard_error=math.sqrt(variance * number / (number - 1.0)),
        df=number - 1.0,
        low=_root(spare, mean, -sd),
        high=_root(spare, mean, sd),
        level=level,
        n_trials=number + travels.limit.size,
    )
    return estimate, sd


def _root(function: Callable[[float], float], start: float, step: float) -> float:
    # the first change of sign from `start` in the direction of `step`
    sign, last = function(start) >= 0.0, start
    for _ in range(_DOUBLINGS):
        if (function(last + step) >= 0.0) != sign:
            return float(brentq(function, last, last + step, xtol=1e-14, rtol=1e-14))
        last, step = last + step, 2.0 * step
    raise ConvergenceError(
        "catch_travel: no end of the interval was found; the likelihood does not fall"
    )
