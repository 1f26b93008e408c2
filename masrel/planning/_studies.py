"""What studies of one design show, exactly or by whole studies drawn in arrays.

In: a `Design`. Out: its numbers, means over studies, each with its Monte Carlo error.
Studies of an intraclass correlation are mean squares of normal ratings, the others how
often each distinct row of ratings occurs, or the ratings themselves.
"""

import itertools
import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.special import fdtr, fdtri, gammaln, ndtri, stdtrit

from masrel._input import refuse
from masrel.agreement import CodedRatings
from masrel.agreement._engine import Floats, Integers
from masrel.agreement._profile import profile_ends
from masrel.errors import MasrelWarning
from masrel.intervals import estimate
from masrel.planning._study_plan import Progress, limits_of
from masrel.planning._truth import AGREEMENT, MAX_TABLES, MODELS, ONE_WAY, Design

# numbers, their Monte Carlo errors, and how many studies were drawn
Shown = tuple[dict[str, float], dict[str, float], int]

EVENTS = ("assurance", "power", "coverage")
NUMBERS = (
    *("expected_half_width", "expected_low", "expected_high"),
    *EVENTS,
    "p_undefined",
)
# whether they are means over defined studies; an undefined one reaches nothing
_OF_DEFINED = np.array([True, True, True, False, False, True, False])

_PLACES = 1 << 20  # numbers held at once
_TINY = 1e-12
_NEVER = math.log(1e-18)  # so improbable that all such studies together do not count
_LEAST = 1e-13  # of a half-width: what rounding may leave above the aim
_TASK = 10_000  # studies that are drawn before their Monte Carlo error is looked at
_CHOSEN_TASK, _RESAMPLED_TASK = 250, 50  # with intervals study by study; resamples
_MAX_TASKS = 100
# Monte Carlo errors that are small enough, of a half-width and of a chance; twice as
# much where intervals are chosen study by study
_RELATIVE, _SMALL = 0.003, {"assurance": 0.0045, "power": 0.0045}
_NODES = 4001  # of the sum over log F; smooth, so that it converges at once
_HALVES = 60  # of the distance of two nodes


def shown(design: Design, progress: Progress | None = None) -> Shown:
    """Return what studies of a design show."""
    if not design.is_exact:
        return _drawn(design, progress)
    if design.is_icc and design.study.coefficient != AGREEMENT:
        return _exact_icc(design), {}, 0
    refuse(
        (
            design.n_tables > 20 * MAX_TABLES,
            'method: "exact" sums over all different studies, and there are '
            f'{design.n_tables:g}; "simulation" draws some of them',
        )
    )
    total = np.zeros((3, len(NUMBERS)))
    for freq, p in all_studies(design.n_items, design.p):
        total += _moments(design, outcomes_of(design, design.rows, freq), p)
    return numbers_of(total)[0], {}, 0


def _drawn(design: Design, progress: Progress | None) -> Shown:
    # until the Monte Carlo errors are small, or as many as were asked for
    n_studies, interval = design.study.n_studies, design.study.interval
    of_chosen = _RESAMPLED_TASK if interval == "bootstrap" else _CHOSEN_TASK
    size, factor = (of_chosen, 2.0) if design.is_chosen else (_TASK, 1.0)
    size = min(size, n_studies or size)
    total, task, n_tasks = np.zeros((3, len(NUMBERS))), 0, 1
    while task < n_tasks:  # each has its own seed
        total += simulated(
            design, np.random.default_rng([design.study.seed, task]), size
        )
        task += 1
        numbers, errors = numbers_of(total)
        half = numbers.get("expected_half_width", 0.0) or math.inf
        small = {"expected_half_width": _RELATIVE * half, **_SMALL}
        ratio = max(errors.get(name, 0.0) / small[name] for name in small) / factor
        needed = min(max(task, math.ceil(ratio**2 * task)), _MAX_TASKS)
        n_tasks = needed if n_studies is None else -(-n_studies // size)
        if progress is not None:
            progress(task * size, n_tasks * size)
    return numbers, errors, task * size


def simulated(design: Design, rng: np.random.Generator, n_studies: int) -> Floats:
    """Return moments of studies that are drawn, in blocks of about one size."""
    if design.is_icc:
        drawn = _drawn_agreement(design, rng, n_studies)
        return _moments(design, drawn, np.ones(n_studies))
    total, has_rows = np.zeros((3, len(NUMBERS))), design.has_rows
    size = design.n_rows if has_rows else design.n_items * design.n_raters
    block = max(1, 2 * _PLACES // size)
    for start in range(0, n_studies, block):
        n = min(block, n_studies - start)
        if has_rows:
            freq = rng.multinomial(design.n_items, design.p, size=n)
            outcomes = outcomes_of(design, design.rows, freq)
        else:
            outcomes = outcomes_of(design, draw(design, rng, n))
        total += _moments(design, outcomes, np.ones(n))
    return total


def draw(design: Design, rng: np.random.Generator, n: int) -> Integers:
    """Draw the ratings of n studies, (n, n_items, n_columns)."""
    size = (n, design.n_items, design.n_raters)
    if design.entry.shape == "pairs":
        # a rater's two gradings are those of two raters who never differ in bias
        size = (n, design.n_items * design.n_raters, 2)
    _, drawn = MODELS[design.model.name]
    codes = drawn(design.model, rng, size)
    if design.model.p_missing > 0.0:
        codes[rng.random(size) < design.model.p_missing] = -1
    return codes.reshape(n, design.n_items, -1)


def outcomes_of(
    design: Design, codes: Integers, freq: Integers | None = None
) -> Floats:
    """Return half-width, low and high of studies, (n_studies, 3)."""
    # ratings of each (n_studies, n_items, n_columns), or how often each distinct row
    # (n_rows, n_columns) occurs in it (n_studies, n_rows)
    if design.is_chosen:
        studies = codes if freq is None else [codes.repeat(row, axis=0) for row in freq]
        return np.array([_chosen(design, of) for of in studies]).reshape(-1, 3)
    weight = np.ones(codes.shape[:2]) if freq is None else freq.astype(np.float64)
    interval = _raters_left_out if design.leaves_raters_out else _wald
    return interval(design, weight, codes)


@np.errstate(invalid="ignore")  # 0/0 where a study has no coefficient
def _wald(design: Design, weight: Floats, codes: Integers) -> Floats:
    # weight (n_studies, n_rows); rows that all studies have, or each its own
    features, rows = design.features(codes), "rf" if codes.ndim == 2 else "srf"
    sums = np.einsum(f"sr,{rows}->sf", weight, features, optimize=True)
    u = np.einsum(
        f"sf,{rows}->sr", design.problem.slopes(sums), features, optimize=True
    )
    is_rated = features.any(axis=-1)
    # a pair of ratings of an item; in a retest of one rater
    is_pair = design.entry.shape == "pairs"
    is_paired = is_rated if is_pair else (codes >= 0).sum(axis=-1) >= 2
    n, n_paired = (
        np.einsum(f"sr,{rows[:-1]}->s", weight, which)
        for which in (is_rated, is_paired)
    )
    n = np.where(n > 1, n, np.nan)
    # √[Σ (n u_i)² / (n (n - 1))] about the mean, as of every estimate
    u = is_rated * (u - np.einsum("sr,sr,s->s", weight, u, 1.0 / n)[:, None])
    error = np.sqrt(np.einsum("sr,sr,sr->s", weight, u, u) * n / (n - 1.0))
    upper = 0.5 + 0.5 * design.level
    is_normal = design.study.interval == "normal"
    t = stdtrit(np.maximum(n_paired - 1.0, 1.0), upper)
    half = error * (ndtri(upper) if is_normal else t)
    if design.study.interval == "analytic":  # there is none without spread
        half = np.where((error > 0.0) & (n_paired > 1), half, np.nan)
    return _around(design, design.problem.values(sums), half)


def _around(design: Design, value: Floats, half: Floats) -> Floats:
    # intervals as an analysis gives them are cut at the ends of the scale
    low, high = value - half, value + half
    if design.study.interval in ("t", "normal"):
        return np.column_stack([np.where(np.isnan(low), np.nan, half), low, high])
    low = np.maximum(low, np.minimum(design.entry.lowest, value))
    high = np.minimum(high, 1.0)
    return np.column_stack([0.5 * (high - low), low, high])


@np.errstate(invalid="ignore")
def _raters_left_out(design: Design, weight: Floats, codes: Integers) -> Floats:
    # The rater jackknife of `intervals` for all studies at once; what that leaves
    # undefined or without spread is left to the choice of `intervals`, one by one.
    # weight and codes as `_wald` takes them
    r, rows = design.n_raters, "rf" if codes.ndim == 2 else "srf"
    every = [codes, *(np.delete(codes, rater, axis=-1) for rater in range(r))]
    value, *without = (
        design.problem.values(np.einsum(f"sr,{rows}->sf", weight, design.features(of)))
        for of in every
    )
    variance = (r - 1) ** 2 / r * np.var(without, axis=0, ddof=1)
    half = stdtrit(r - 1, 0.5 + 0.5 * design.level) * np.sqrt(variance)
    outcomes = _around(design, value, half)
    if design.study.interval != "t":
        for study in np.flatnonzero(~(variance > 1e-3 / (design.n_items * r))):
            ratings = codes if codes.ndim == 2 else codes[study]
            outcomes[study] = _chosen(
                design, ratings.repeat(weight[study].astype(np.int64), axis=0)
            )
    return outcomes


def _chosen(design: Design, codes: Integers) -> tuple[float, float, float]:
    # the interval that an analysis would compute of one study
    ratings: Any = CodedRatings(codes=codes, categories=design.model.scale)
    if design.entry.shape == "pairs":  # rater by rater
        labels = np.array([*design.model.scale, None], dtype=object)[codes]
        ratings = labels.reshape(len(codes), -1, 2).transpose(1, 0, 2).tolist()
    method = design.study.interval
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        interval = estimate(
            design.entry.name,
            ratings,
            target=design.study.target,
            method="auto" if method == "t" or method == "normal" else method,
            categories=design.model.scale,
            weights=design.study.weights,
            level=design.level,
            rng=0,
        ).interval
    low, high = (math.nan,) * 2 if interval is None else (interval.low, interval.high)
    return 0.5 * (high - low), low, high


def _events(design: Design, outcomes: Floats) -> Floats:
    # whether a study reaches each aim, and holds the truth, (n_studies, 3)
    study, (half, low, high) = design.study, outcomes.T
    events = dict.fromkeys(EVENTS, np.full(len(half), math.nan))
    if study.lower is not None or study.upper is not None:
        lower, upper = limits_of(study)
        is_power = study.power is not None and study.null is None
        events["power" if is_power else "assurance"] = (low >= lower) & (high <= upper)
    if study.half_width is not None:
        events["assurance"] = half <= study.half_width * (1.0 + _LEAST)
    is_lower = study.lower is not None or study.upper is None
    if study.null is not None:  # the end on the side of the null lies beyond it
        is_lower = design.value >= study.null
        events["power"] = low > study.null if is_lower else high < study.null
    from_below, from_above = low <= design.value + _TINY, high >= design.value - _TINY
    events["coverage"] = from_below & from_above
    if study.sides == 1:  # one end is the bound: that on the side of what is asked
        events["coverage"] = from_below if is_lower else from_above
    return np.column_stack(list(events.values()))


def _moments(design: Design, outcomes: Floats, weight: Floats) -> Floats:
    """Return sums of weights, of every number and of its square, (3, n_numbers)."""
    is_defined = ~np.isnan(outcomes[:, :1])
    x = np.column_stack([outcomes, _events(design, outcomes), ~is_defined])
    counts = is_defined | ~_OF_DEFINED
    w, x = weight[:, None] * counts, np.where(counts, x, 0.0)
    return np.array([w.sum(axis=0), (w * x).sum(axis=0), (w * x**2).sum(axis=0)])


def numbers_of(moments: Floats) -> tuple[dict[str, float], dict[str, float]]:
    """Return the means over studies, and their Monte Carlo errors."""
    n, sums, squares = moments
    with np.errstate(invalid="ignore"):
        mean = sums / n
        error = np.sqrt(np.maximum(squares / n - mean**2, 0.0) / n)
    return _named(NUMBERS, mean), _named(NUMBERS, error)


def _named(names: Sequence[str], numbers: Floats) -> dict[str, float]:
    return {
        name: number
        for name, number in zip(names, numbers.tolist(), strict=True)
        if not math.isnan(number)
    }


def all_studies(n: int, p: Floats) -> Iterator[tuple[Integers, Floats]]:
    """Yield how often each row occurs in every study, and how probable that is."""
    # n items fall between bars among as many places; some studies at a time, without
    # those that are never met
    log_p, n_places = np.log(np.maximum(p, 1e-300)), n + len(p) - 1
    bars = itertools.combinations(range(n_places), len(p) - 1)
    while some := list(itertools.islice(bars, _PLACES // len(p))):
        ends = np.pad(np.array(some), ((0, 0), (1, 1)), constant_values=(-1, n_places))
        freq = np.diff(ends, axis=1) - 1
        logs = gammaln(n + 1) - gammaln(freq + 1.0).sum(axis=1) + freq @ log_p
        yield freq[logs > _NEVER], np.exp(logs[logs > _NEVER])


# -- intraclass correlations: mean squares of normal ratings --------------------------


def icc_ratio(r: float, k: int) -> float:
    """Return θ = (1 + (k - 1) ρ)/(1 - ρ), the ratio of expected mean squares."""
    return (1 + (k - 1) * r) / (1 - r)


def _exact_icc(design: Design) -> dict[str, float]:
    # ICC(1) and ICC(C,1), from the F distribution of the ratio of mean squares
    from scipy.stats import f as f_distribution  # slow to load

    degrees, theta = _degrees(design), icc_ratio(design.value, design.n_raters)
    # log of F/θ on a grid that holds all but 1e-15 of it, by the trapezoid rule
    low, high = np.log(fdtri(*degrees, [1e-15, 1 - 1e-15])).tolist()
    ratio = np.exp(np.linspace(low, high, _NODES))
    weight = ratio * f_distribution.pdf(ratio, *degrees)
    outcomes = _of_ratios(design, theta * ratio)
    numbers, _ = numbers_of(_moments(design, outcomes, weight / weight.sum()))
    return {
        **numbers,
        **_named(EVENTS, _probabilities_of_events(design, theta * ratio)),
    }


def _degrees(design: Design) -> tuple[float, float]:
    """Return the degrees of freedom of the two mean squares."""
    n, k = design.n_items, design.n_raters
    is_one_way = design.study.coefficient == ONE_WAY
    return float(n - 1), float(n * (k - 1) if is_one_way else (n - 1) * (k - 1))


def _of_ratios(design: Design, f: Floats) -> Floats:
    """Return half-width, low and high of studies by their F, (n_studies, 3)."""
    # McGraw and Wong (1996), table 7, for single ratings
    first, second = _degrees(design)
    upper, k = 0.5 + 0.5 * design.level, design.n_raters
    up, down = fdtri(first, second, upper), fdtri(second, first, upper)
    low, high = ((ratio - 1) / (ratio + k - 1) for ratio in (f / up, f * down))
    return np.column_stack([0.5 * (high - low), low, high])


def _probabilities_of_events(design: Design, f: Floats) -> Floats:
    """Return how probable events are; each begins and ends between nodes of F."""
    occurs = _events(design, _of_ratios(design, f))
    place, event = np.nonzero(np.diff(np.nan_to_num(occurs), axis=0))
    before, low, high = occurs[place, event], f[place], f[place + 1]
    for _ in range(_HALVES):
        middle = 0.5 * (low + high)
        there = _events(design, _of_ratios(design, middle))
        is_before = there[np.arange(len(place)), event] == before
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    theta = icc_ratio(design.value, design.n_raters)
    step = (2.0 * before - 1.0) * fdtr(*_degrees(design), low / theta)
    return np.asarray(occurs[-1] + np.bincount(event, step, occurs.shape[1]))


def _drawn_agreement(
    design: Design, rng: np.random.Generator, n_studies: int
) -> Floats:
    """Return outcomes of studies of ICC(A,1) whose mean squares are drawn."""
    n, k, r = design.n_items, design.n_raters, design.value
    # variance of items 1; raters and residual share (1 - ρ)/ρ
    error = (1.0 - r) / r
    of_raters = design.study.rater_share * error
    residual = error - of_raters
    rows = (k + residual) * rng.chisquare(n - 1, n_studies) / (n - 1)
    columns = (n * of_raters + residual) * rng.chisquare(k - 1, n_studies) / (k - 1)
    df = (n - 1) * (k - 1)
    rest = residual * rng.chisquare(df, n_studies) / df
    low, high = profile_ends(n, k, (rows, columns, rest), design.level)
    return np.column_stack([0.5 * (high - low), low, high])
