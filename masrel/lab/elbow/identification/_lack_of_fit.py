"""Whether the law fits the recordings: the residual torque, and patterns in it.

Each test adds one structure to the law that a real arm or sensor may have, and asks
whether its size differs from 0 by more than trials differ (CR2 with Satterthwaite's
degrees of freedom, clustered by trial: noise may have any colour within a trial); one
more asks whether each trial has a drift of its own. Holm's method keeps all tests
together at one level.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import fdtrc, stdtr

from masrel.lab.elbow.identification._catches import Part
from masrel.lab.elbow.identification._clusters import Rows, partial_out, solve
from masrel.lab.elbow.identification._equations import LINEAR, Equations, JointFit
from masrel.lab.elbow.motions import Floats

# Of all tests together: how often a fit of the right law is called a wrong one.
LEVEL = 0.02

# What is tried for lag and rise, s: of the size that a sensor and a muscle have.
_LAG, _RISE = 0.005, 0.04

# Of the right law, what is left from the catch on is what is left before it.
_MAX_RATIO = 1.5

# And it is noise: in every phase 1.5 times that at rest at most, or white, that is, a
# quarter of it at most goes on from sample to sample. Beside the noise stands what
# smoothing the angle leaves of a law without any, N·m, at 60 to 120 deg/s.
_MAX_AUTOCORRELATION = 0.25
_SMOOTHING_SD = 0.01

_MIN_DF, _MIN_TRIALS = 1.0, 5  # a test with fewer says nothing

# Of drifts that differ: means over so many seconds, of a trial so many at least, and
# relative to columns of length 1 what a column adds to the others.
_DRIFT_BLOCK, _MIN_BLOCKS, _RANK_TOLERANCE = 0.25, 4, 1e-8

_PHASES = ("slow", "pre-catch", "peak", "catch", "post-catch")

# What is added to the law: in words, and the option that fits it.
STRUCTURES = {
    "gravity": ("the weight of the arm", "--gravity fitted"),
    "bent stiffness": ("a stiffness that changes with the angle", ""),
    "bent damping": ("a damping that changes with the speed", ""),
    "arm_inertia": ("the inertia of the arm", "--arm-inertia fitted"),
    "drift": ("a drift in the torque", "--drift fitted"),
    "lag": ("a lag in the sensor", "--lag fitted"),
    "late angle": ("an angle that is recorded later than the torque", "--lag fitted"),
    "catch_rise": ("a catch that takes time to rise", "--rise fitted"),
    "residual slope": ("a torque that changes within the catch", ""),
    "bent climb": ("a stiffness after the catch that is not constant", ""),
    "catch angle": ("catch angles that are not linear in the speed", ""),
    "peak": ("peaks that are not proportional to the speed", ""),
    "residual": ("residual torques that are not proportional to the peaks", ""),
    "travel": ("travels that change with the speed", ""),
    "own drifts": ("drifts that differ from trial to trial", "--drift fitted"),
}


# Whether the law is that of the recordings.
Verdict = Literal["fits", "does not fit", "no evidence either way", "undecided"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StructureTest:
    """One structure that was added to the law.

    Attributes
    ----------
    name : str
        The structure.
    t, df : float
        Its size over its standard error, and the degrees of freedom; for drifts that
        differ, which have no single size, the root of F and the degrees of freedom of
        its denominator.
    p_value : float
        Two-sided p-value of this test alone.
    adjusted : float
        The p-value adjusted for all tests by Holm's method.
    """

    name: str
    t: float
    df: float
    p_value: float
    adjusted: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseResidual:
    """The residual torque in one phase of all trials.

    Attributes
    ----------
    phase : {"slow", "pre-catch", "peak", "catch", "post-catch"}
        The slow trials, or a phase of the fast ones.
    n_samples : int
        Number of samples.
    sd : float
        Root mean square of measured minus fitted torque, N·m.
    runs : float
        Number of runs of one sign, divided by the number expected for independent
        samples.
    autocorrelation : float
        Autocorrelation of neighbouring samples; 0 if they are independent.
    """

    phase: str
    n_samples: int
    sd: float
    runs: float
    autocorrelation: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LackOfFit:
    """Whether the law fits the recordings.

    Attributes
    ----------
    verdict : {"fits", "does not fit", "no evidence either way", "undecided"}
        "does not fit" if a test rejects the law, or if the residual after the onset of
        the catch is more than 1.5 times that before it. "no evidence either way" if
        no test rejects it, but the residual in some phase is neither near the noise at
        rest nor white. "undecided" if there are too few trials for any test.
    level : float
        Level of all tests together: how often a right law is rejected.
    tests : tuple of StructureTest
        The smallest p-value first.
    explained : float
        Share of the torque's variation within trials that the law explains.
    phases : tuple of PhaseResidual
        The residual in each phase.
    after_to_before : float
        Root mean square residual after the catch over that before it; ``nan`` without
        a catch.
    rest_sd : float
        Noise of the torque at rest, N·m; ``nan`` if no recording rests.
    """

    verdict: Verdict
    level: float
    tests: tuple[StructureTest, ...]
    explained: float
    phases: tuple[PhaseResidual, ...]
    after_to_before: float
    rest_sd: float

    @property
    def sentence(self) -> str:
        """Return the verdict as one sentence."""
        share = f"the law explains {100.0 * self.explained:.1f} % of the torque"
        if self.verdict == "undecided":
            return f"Undecided: there are too few trials to test the fit; {share}."
        if not self.tests or (
            self.verdict == "does not fit" and self.tests[0].adjusted >= self.level
        ):
            return (
                f"DOES NOT FIT: the residual after the onset of the catch is "
                f"{self.after_to_before:.2g} times that before it; {share}."
            )
        first = self.tests[0]
        p = f"p {p_text(first.adjusted)}"
        nothing = (
            "no pattern was found in the residual "
            f"({len(self.tests)} kinds checked, smallest {p})"
        )
        if self.verdict == "fits":
            return f"Fits: {nothing}; {share}."
        if self.verdict == "no evidence either way":
            most = max(_not_noise(self.phases, self.rest_sd), key=lambda left: left.sd)
            is_known = not math.isnan(self.rest_sd)
            at_rest = f"{self.rest_sd:.2g} N·m" if is_known else "unknown"
            return (
                f"No evidence either way: {nothing}, but the residual is not noise "
                f"({most.phase}: {most.sd:.2g} N·m, autocorrelation "
                f"{most.autocorrelation:.2f}; at rest {at_rest}); "
                f"{share}."
            )
        words, option = STRUCTURES[first.name]
        remedy = f"; try {option}" if option else ""
        return (
            f"DOES NOT FIT: the residual shows signs of {words} ({p}), so the "
            f"intervals may not contain the true values; {share}{remedy}."
        )


def lack_of_fit(joint: JointFit, rest_sd: float) -> LackOfFit:
    """Return the residual torque of a fit, and the tests for patterns in it."""
    equations, left = joint.equations, joint.residuals
    added = list(map(_added, equations, joint.values, joint.laws))
    # of catches that outlast their stretch, those that end are the short ones
    unended = any(e.catch is not None and e.catch.end is None for e in equations)
    names = [
        name
        for name in STRUCTURES
        if any(name in each for each in added)
        and not (unended and name in ("travel", "bent climb"))
    ]
    # rows of [shared | residuals | added] of each trial
    rest = []
    for e, table, columns in zip(equations, joint.tables, added, strict=True):
        more = [columns.get(name, np.zeros(table.shape[0])) for name in names]
        rest.append(partial_out(np.column_stack([table, *more]), len(e.local)))
    n = len(joint.shared)
    tests = [_test(name, n, n + 1 + i, rest) for i, name in enumerate(names)]
    first = equations[0].held
    if "drift" not in first.fitted and len(equations) >= _MIN_TRIALS:
        slow = [e.trial.pre_catch for e in equations if e.trial.stretch.pace == "slow"]
        tests.append(own_drifts(slow, first.gravity_angle))
    adjusted = _holm([test for test in tests if test is not None])
    phases = _phases(equations, left)
    before, after = (
        [p for p in phases if (p.phase in ("slow", "pre-catch")) is early]
        for early in (True, False)
    )
    ratio = math.nan
    if before and after and _pooled(before) > 0.0:
        ratio = _pooled(after) / _pooled(before)
    verdict: Verdict = "undecided"
    if ratio > _MAX_RATIO or (adjusted and adjusted[0].adjusted < LEVEL):
        verdict = "does not fit"
    elif adjusted:
        is_noise = not _not_noise(phases, rest_sd)
        verdict = "fits" if is_noise else "no evidence either way"
    measured = [e.part.measured for e in equations if e.part.measured.size]
    whole = sum(float(((m - m.mean()) ** 2).sum()) for m in measured)
    far = sum(float((each**2).sum()) for each in left)
    return LackOfFit(
        verdict=verdict,
        level=LEVEL,
        tests=adjusted,
        explained=1.0 - far / whole if whole > 0.0 else math.nan,
        phases=phases,
        after_to_before=ratio,
        rest_sd=rest_sd,
    )


def p_text(p_value: float) -> str:
    """Return a p-value with its sign of relation.

    >>> p_text(0.0123), p_text(1e-9)
    ('= 0.012', '< 0.0001')
    """
    return "< 0.0001" if p_value < 1e-4 else f"= {p_value:.2g}"


def _not_noise(phases: Sequence[PhaseResidual], rest_sd: float) -> list[PhaseResidual]:
    # the phases in which what is left is neither near the noise at rest nor white
    at_rest = 0.0 if math.isnan(rest_sd) else rest_sd
    most = _MAX_RATIO * math.hypot(at_rest, _SMOOTHING_SD)
    return [
        left
        for left in phases
        if left.sd > most and left.autocorrelation > _MAX_AUTOCORRELATION
    ]


def _pooled(phases: Sequence[PhaseResidual]) -> float:
    squares = sum(p.n_samples * p.sd**2 for p in phases)
    return math.sqrt(squares / sum(p.n_samples for p in phases))


def _test(
    name: str, n_shared: int, place: int, rest: Sequence[Floats]
) -> StructureTest | None:
    # of the column at this place beside the shared ones; residuals are after these
    columns = [*range(n_shared), place]
    fit = solve([Rows(r[:, columns], -r[:, n_shared]) for r in rest])
    value, df = float(fit.values[-1]), float(fit.df[-1])
    error = math.sqrt(max(fit.covariance[-1, -1], 0.0))
    if not (error > 0.0 and df >= _MIN_DF and fit.n_trials[-1] >= _MIN_TRIALS):
        return None
    p = 2.0 * float(stdtr(df, -abs(value / error)))
    return StructureTest(name=name, t=value / error, df=df, p_value=p, adjusted=p)


def _holm(tests: Sequence[StructureTest]) -> tuple[StructureTest, ...]:
    ordered = sorted(tests, key=lambda test: test.p_value)
    n = len(ordered)
    least = [min(1.0, (n - i) * test.p_value) for i, test in enumerate(ordered)]
    running = np.maximum.accumulate(least).tolist()
    pairs = zip(ordered, running, strict=True)
    return tuple(replace(test, adjusted=p) for test, p in pairs)


def _added(e: Equations, values: Mapping[str, float], law: Floats) -> dict[str, Floats]:
    # columns of what the law has not, over the rows of the whole table
    n, catch, after = e.part.time.size, e.catch, e.trial.after
    matrix = dict(zip(LINEAR, e.design(values).matrix.T, strict=True))
    columns = {name: matrix[name] for name in ("gravity", "arm_inertia", "drift")}
    angle, speed = e.part.angle, e.part.velocity
    if catch is not None and after is not None:
        # what the law holds from the catch on
        held = np.arange(n) >= e.n_pre
        if e.held.constants.post_catch == "additive":
            held &= e.part.time < e.end
        angle, speed = (
            np.where(held, catch.angle, angle),
            np.where(held, catch.speed, speed),
        )
        since, end = e.part.time - catch.time, e.end - catch.time
        peak_end = e.held.constants.peak_duration
        slope = np.clip(np.minimum(since, end) - peak_end, 0.0, None)
        slope[: e.n_pre] = 0.0
        past = e.part.angle - catch.angle - values.get("travel", catch.travel)
        past = np.where(since >= end, np.maximum(past, 0.0), 0.0)
        columns |= {"residual slope": slope, "bent climb": past**2}
        for name, more in (("lag", _LAG), ("catch_rise", _RISE)):
            timed = {**values, name: getattr(e.held, name) + more}
            columns[name] = e.law(timed) - law
    columns |= {"bent stiffness": angle**2, "bent damping": speed**2}
    rows = [name for name, _, _ in e.catch_rows(values)]
    sd, fitted = e.spreads["torque"], {*e.names, *e.local}
    columns = {
        name: np.append(column / sd, np.zeros(len(rows)))
        for name, column in columns.items()
        if name not in fitted and column.any()
    }
    size = {"peak": 1.0, "residual": 1.0}
    if catch := e.trial.catch:
        size |= {"catch angle": catch.mean_speed**2, "travel": catch.mean_catch_speed}
    columns["late angle"] = e.by_late_angle(values)
    for place, name in enumerate(rows):
        if name in size:
            columns[name] = np.zeros(n + len(rows))
            columns[name][n + place] = size[name]
    return columns


def own_drifts(slow: Sequence[Part], gravity_angle: float) -> StructureTest | None:
    """Test whether each slow trial has a drift of its own; None if there are too few.

    Those are drifts beyond what trials have in common: one drift, b, k, weight,
    inertia, and a stiffness and a damping that are not constant. Drifts whose signs
    differ cancel in a mean over trials. So each slow trial is given its own, and F
    compares what these explain with the residual, in means over 0.25 s, which are
    nearly independent if a sensor's noise is correlated over less.
    """
    trials = []
    for part in slow:
        if part.time.size:
            n_blocks = max(int((part.time[-1] - part.time[0]) / _DRIFT_BLOCK), 1)
            columns = (
                part.time - part.time.mean(),
                part.velocity,
                part.angle,
                part.acceleration,
                np.sin(part.angle - gravity_angle),
                part.angle**2,
                part.velocity**2,
                part.measured,
            )
            blocks = np.array_split(np.column_stack(columns), n_blocks)
            trials.append(np.array([block.mean(axis=0) for block in blocks]))
    trials = [means for means in trials if len(means) >= _MIN_BLOCKS]
    if len(trials) < 2:
        return None
    which = np.repeat(np.arange(len(trials)), [len(means) for means in trials])
    offsets = np.eye(len(trials))[which]  # (n_blocks, n_trials)
    table = np.concatenate(trials)
    in_common = np.column_stack([offsets, table[:, :-1]])
    torque = table[:, -1]
    before, n_before = _left(in_common, torque)
    left, n_columns = _left(
        np.column_stack([in_common, offsets * table[:, :1]]), torque
    )
    n_more, df = n_columns - n_before, which.size - n_columns
    if n_more < 1 or df < 1:
        return None
    left = max(left, 1e-20 * float(torque @ torque))  # of torque without noise
    ratio = max((before - left) / n_more / (left / df), 0.0)
    p = float(fdtrc(n_more, df, ratio))
    return StructureTest(
        name="own drifts", t=math.sqrt(ratio), df=float(df), p_value=p, adjusted=p
    )


def _left(design: Floats, target: Floats) -> tuple[float, int]:
    # sum of squares of what least squares leave, and the rank of the design
    size = np.linalg.norm(design, axis=0)
    scaled = design / np.where(size > 0.0, size, 1.0)
    values, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=_RANK_TOLERANCE)
    return float(((target - scaled @ values) ** 2).sum()), int(rank)


def _phases(
    equations: Sequence[Equations], left: Sequence[Floats]
) -> tuple[PhaseResidual, ...]:
    pieces: dict[str, list[Floats]] = {name: [] for name in _PHASES}
    for e, torque in zip(equations, left, strict=True):
        time, place = e.part.time, np.zeros(e.part.time.size, dtype=np.int64)
        if e.trial.stretch.pace == "fast":
            place[:] = 1
        if e.catch is not None:
            peak_end = min(e.catch.time + e.held.constants.peak_duration, e.end)
            later = 2 + np.where(time < peak_end, 0, np.where(time < e.end, 1, 2))
            place[e.n_pre :] = later[e.n_pre :]
        for i, name in enumerate(_PHASES):
            piece = torque[place == i]
            pieces[name] += [piece] if piece.size > 2 else []
    return tuple(_phase(name, each) for name, each in pieces.items() if each)


def _phase(phase: str, pieces: Sequence[Floats]) -> PhaseResidual:
    runs = expected = products = squares = raw = 0.0
    for left in pieces:
        positive = left > 0.0
        n, n_up = left.size, int(positive.sum())
        runs += 1.0 + float((positive[1:] != positive[:-1]).sum())
        expected += 1.0 + 2.0 * n_up * (n - n_up) / n
        about = left - left.mean()
        products += float((about[1:] * about[:-1]).sum())
        squares += float((about**2).sum())
        raw += float((left**2).sum())
    count = sum(left.size for left in pieces)
    return PhaseResidual(
        phase=phase,
        n_samples=count,
        sd=math.sqrt(raw / count),
        runs=runs / expected,
        autocorrelation=products / squares if squares > 0.0 else 0.0,
    )
