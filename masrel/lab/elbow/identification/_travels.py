"""How far catches travel of which some outlast their stretch.

A catch that goes on where its stretch ends has a travel that is larger than what was
seen of it. Leaving it out keeps the short travels and loses the long ones; here it is
an observation censored on the right, not where the stretch stops but at the last angle
at which an end would still be told from noise.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equation (4) and Fig. 5.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import erfcx, log_ndtr, stdtrit

from masrel.errors import ConvergenceError
from masrel.lab.elbow.identification._catches import Trial
from masrel.lab.elbow.identification._changes import MIN_GAIN, MIN_SIGNAL
from masrel.lab.elbow.parameters import ElbowParameters

_Floats = NDArray[np.float64]

_CANDIDATES = 200  # ends that are tried, whatever the number of samples


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionLimit:
    """The travel up to which the end of one catch would have been seen."""

    travel: float  # an end here would be seen as often as not, rad
    sd: float  # of where noise lets the search see one last, rad


def detection_limit(
    trial: Trial, stiffness: float, constants: ElbowParameters
) -> DetectionLimit | None:
    """Return how late the catch of a trial could end and be seen to.

    None without a catch, or if no end of it could be seen at all. `stiffness` is
    k_post: what an end makes the torque climb with, and nothing else. An end is seen if
    its climb takes `MIN_GAIN` residual variances off the sum of squares and adds up to
    `MIN_SIGNAL` standard deviations. The root of that gain is a t whose error has a
    standard deviation of 1, which over the slope of t against the angle of the end is
    the standard deviation of the limit.
    """
    if trial.catch is None or trial.after is None or not stiffness > 0.0:
        return None
    catch = trial.catch
    angle = trial.after.angle[trial.after.time >= catch.time + constants.peak_duration]
    if angle.size == 0:
        return None
    ends = np.unique(np.linspace(0, angle.size - 1, _CANDIDATES).astype(np.int64))
    climb = np.maximum(angle - angle[ends, None], 0.0)  # (n_ends, n_samples)
    about = climb - climb.mean(axis=1, keepdims=True)
    scatter = np.sqrt((about**2).sum(axis=1))
    seen = stiffness * scatter / max(catch.residual_sd, 1e-12)  # 0 of exact data
    rises = climb[:, -1] > 0.0  # but for the last sample
    needed = np.full(ends.size, math.sqrt(MIN_GAIN))
    least = MIN_SIGNAL * scatter[rises] / climb[rises, -1]
    needed[rises] = np.maximum(needed[rises], least)
    return _last(angle[ends] - catch.angle, seen - needed)


def _last(travel: _Floats, spare: _Floats) -> DetectionLimit | None:
    # where what is to spare runs out for good: an end at the last sample adds nothing
    enough = np.flatnonzero(spare[:-1] >= 0.0)
    if enough.size == 0:
        return None
    last = int(enough[-1])
    fall = float(spare[last] - spare[last + 1])
    slope = float(travel[last + 1] - travel[last]) / fall if fall > 0.0 else 0.0
    return DetectionLimit(
        travel=float(travel[last]) + slope * float(spare[last]), sd=slope
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CensoredTravels:
    """Travels that were seen, and limits behind which the others lie."""

    seen: _Floats = field(compare=False, repr=False)
    limit: _Floats = field(compare=False, repr=False)
    limit_sd: _Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, seen: Sequence[float], limits: Sequence[DetectionLimit]
    ) -> "CensoredTravels":
        """Put travels and limits into columns."""
        return cls(
            seen=np.array(seen, dtype=np.float64),
            limit=np.array([each.travel for each in limits]),
            limit_sd=np.array([each.sd for each in limits]),
        )

    def log_likelihood(self, mean: float, sd: float) -> float:
        """Evaluate the log-likelihood of normal travels, without its constant."""
        scaled = (self.seen - mean) / sd
        z, _ = self._beyond(mean, sd)
        density = -0.5 * float(scaled @ scaled) - self.seen.size * math.log(sd)
        return density + float(log_ndtr(z).sum())

    def score(self, mean: float, sd: float) -> tuple[float, float]:
        """Differentiate the log-likelihood."""
        scaled = (self.seen - mean) / sd
        z, size = self._beyond(mean, sd)
        ratio = mills(z)
        by_mean = float(scaled.sum()) / sd + float((ratio / size).sum())
        by_sd = (float(scaled @ scaled) - scaled.size) / sd
        return by_mean, by_sd - float((ratio * z * sd / size**2).sum())

    def information(self, mean: float, sd: float) -> _Floats:
        """Give minus the second derivatives of the log-likelihood."""
        scaled = (self.seen - mean) / sd
        z, size = self._beyond(mean, sd)
        ratio = mills(z)
        curve = ratio * (z + ratio)  # -d²/dz² ln Φ
        turn = -z * sd / size**2  # dz/dsd
        turn2 = z * (3.0 * sd**2 - size**2) / size**4  # d²z/dsd²
        by_mean = scaled.size / sd**2 + float((curve / size**2).sum())
        both = 2.0 * float(scaled.sum()) / sd**2
        both += float((curve * turn / size + ratio * sd / size**3).sum())
        by_sd = (3.0 * float(scaled @ scaled) - scaled.size) / sd**2
        by_sd += float((curve * turn**2 - ratio * turn2).sum())
        return np.array([[by_mean, both], [both, by_sd]])

    def _beyond(self, mean: float, sd: float) -> tuple[_Floats, _Floats]:
        # standardized distance of the mean beyond each detection_limit, and what it is
        # divided by: travels scatter, and so does what is seen of an end
        size = np.sqrt(sd**2 + self.limit_sd**2)
        return (mean - self.limit) / size, size


def mills(z: _Floats) -> _Floats:
    """Evaluate φ/Φ of the standard normal distribution."""
    return np.asarray(math.sqrt(2.0 / math.pi) / erfcx(-z / math.sqrt(2.0)))


_DOUBLINGS = 60  # of a step towards a change of sign


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelFit:
    """Mean and spread of travels of which some were not seen to end."""

    mean: float
    sd: float
    standard_error: float
    df: float
    low: float
    high: float


def beyond(mean: float, limit: DetectionLimit, sd: float) -> tuple[float, float, float]:
    """Residual whose square is -2 ln of the chance to lie beyond a limit."""
    size = math.hypot(sd, limit.sd)
    z = (mean - limit.travel) / size
    left = math.sqrt(-2.0 * float(log_ndtr(z)))
    ratio = float(mills(np.array(z)))
    if left == 0.0:  # so far beyond that a float64 knows of no chance to lie before
        return 0.0, 0.0, 0.0
    return left, -ratio / (size * left), math.sqrt(ratio * (z + ratio)) / size


def fit_censored(travels: CensoredTravels, *, level: float) -> TravelFit:
    """Return mean and standard deviation of travels, some not seen to end.

    Where the likelihood of normal travels is largest. The interval of the mean holds
    all values whose profile likelihood is no smaller than the one that, of as many
    values of which all are seen, the end of Student's interval has: of n values without
    censoring, twice the profile's fall from its maximum is n·ln(1 + t²/(n - 1)), so
    that this *is* Student's interval then. With censoring n is the number seen.
    Simulated, of 6 to 24 values of which 7 to 75 % are censored, such intervals of 95 %
    cover 94 to 98 %; with all values in n it would be 92 to 97 %, and with the quantile
    of χ² 88 to 96 %. (Cohen 1959, https://doi.org/10.1080/00401706.1959.10489859)

    >>> nothing = np.empty(0)
    >>> seen = np.array([1.0, 2.0, 6.0])
    >>> travels = CensoredTravels(seen=seen, limit=nothing, limit_sd=nothing)
    >>> fit = fit_censored(travels, level=0.95)
    >>> round(fit.mean, 9), round(fit.high - 3.0, 6)  # 4.302653·√(7/3)
    (3.0, 6.572411)
    """
    mean, sd = _largest(travels)
    number = travels.seen.size
    t = float(stdtrit(number - 1.0, 0.5 + 0.5 * level))
    fall = 0.5 * number * math.log1p(t**2 / (number - 1.0))
    top = travels.log_likelihood(mean, sd)

    def below(value: float) -> float:
        return travels.log_likelihood(value, _sd_at(travels, value)) - top + fall

    (a, b), (_, d) = travels.information(mean, sd)
    variance = d / (a * d - b * b)  # of the mean, the spread being unknown
    return TravelFit(
        mean=mean,
        sd=sd,
        standard_error=math.sqrt(variance * number / (number - 1.0)),
        df=number - 1.0,
        low=_root(below, mean, -sd),
        high=_root(below, mean, sd),
    )


def _largest(travels: CensoredTravels) -> tuple[float, float]:
    # At the mean of those seen, censored ones pull upwards; the likelihood is
    # log-concave (but for the limits' sd), so that its slope changes sign once.
    def slope(mean: float) -> float:
        return travels.score(mean, _sd_at(travels, mean))[0]

    mean = float(travels.seen.mean())
    if travels.limit.size and slope(mean) > 0.0:
        mean = _root(slope, mean, float(travels.seen.std()))
    return mean, _sd_at(travels, mean)


def _sd_at(travels: CensoredTravels, mean: float) -> float:
    # the most likely standard deviation for this mean
    first = math.sqrt(float(((travels.seen - mean) ** 2).mean()))
    if not travels.limit.size:
        return first

    def slope(log_sd: float) -> float:
        return travels.score(mean, math.exp(log_sd))[1]

    start = math.log(first)
    step = math.copysign(0.5, slope(start))
    return math.exp(_root(slope, start, step))


def _root(function: Callable[[float], float], start: float, step: float) -> float:
    # the first change of sign from `start` in the direction of `step`
    sign = function(start) >= 0.0
    last = start
    for _ in range(_DOUBLINGS):
        if (function(last + step) >= 0.0) != sign:
            return float(brentq(function, last, last + step, xtol=1e-14, rtol=1e-14))
        last, step = last + step, 2.0 * step
    raise ConvergenceError(
        "catch_travel: the likelihood of the travels of the catches has no end in sight"
    )
