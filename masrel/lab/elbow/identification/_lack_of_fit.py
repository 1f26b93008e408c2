"""Whether the law is that of the recordings: what is left, and what it goes with.

Each test adds one structure to the law that a real arm or sensor may have, and asks
whether its size differs from 0 by more than trials differ (CR2 with Satterthwaite's
degrees of freedom, clustered by trial: noise may have any colour within a trial); one
more asks whether trials drift each in a way of its own. All tests together are held to
one level by Holm's method.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from masrel.lab.elbow.identification._catches import Trial
from masrel.lab.elbow.identification._clusters import Rows, partial_out, solve
from masrel.lab.elbow.identification._drifts import own_drifts
from masrel.lab.elbow.identification._equations import Equations

_Floats = NDArray[np.float64]

LEVEL = 0.02
"""Of all tests together: how often a fit of the right law is called a wrong one."""

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

STRUCTURES = {
    "gravity": ("the weight of the arm", "--gravity fitted"),
    "bent stiffness": ("a stiffness that changes with the angle", ""),
    "bent damping": ("a damping that changes with the speed", ""),
    "arm_inertia": ("the inertia of the arm", "--arm-inertia fitted"),
    "drift": ("a drift of the torque", "--drift fitted"),
    "lag": ("a lag of the sensor", "--lag fitted"),
    "catch_rise": ("a catch that takes time to rise", "--rise fitted"),
    "residual slope": ("a torque that changes within the catch", ""),
    "bent climb": ("a stiffness after the catch that changes", ""),
    "catch angle": ("catch angles that bend with the speed", ""),
    "peak": ("peaks that are not in proportion to the speed", ""),
    "residual": ("residual torques that are not in proportion to the peaks", ""),
    "travel": ("travels that change with the speed", ""),
    "own drifts": ("drifts that differ from trial to trial", "--drift fitted"),
}
"""What is added to the law: in words, and the option that fits it."""


Verdict = Literal["fits", "does not fit", "no evidence either way", "undecided"]
"""Whether the law is that of the recordings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StructureTest:
    """One structure that was added to the law.

    Attributes
    ----------
    name : str
        Which.
    t, df : float
        Its size over its standard error, and degrees of freedom; of drifts that differ,
        which have no one size, the root of F and the degrees of its denominator.
    p_value : float
        Two-sided, of this test alone.
    adjusted : float
        The same, held to all tests by Holm's method.
    """

    name: str
    t: float
    df: float
    p_value: float
    adjusted: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseResidual:
    """What is left of the torque in one phase of all trials.

    Attributes
    ----------
    phase : {"slow", "pre-catch", "peak", "catch", "post-catch"}
        Of slow trials, or of fast ones.
    n_samples : int
        Samples.
    sd : float
        Root mean square of measured less fitted torque, N·m.
    runs : float
        Runs of one sign over those that independent samples would have.
    autocorrelation : float
        Of neighbouring samples; 0 if they are independent.
    """

    phase: str
    n_samples: int
    sd: float
    runs: float
    autocorrelation: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LackOfFit:
    """Whether the law is that of the recordings.

    Attributes
    ----------
    verdict : {"fits", "does not fit", "no evidence either way", "undecided"}
        Not if a test says so, or from the catch on 1.5 times what is left before it.
        No evidence if no test says so, but in some phase what is left is neither near
        the noise at rest nor white. Undecided with so few trials that no test says
        anything.
    level : float
        Of all tests together: how often the right law is called wrong.
    tests : tuple of StructureTest
        The most telling first.
    explained : float
        Share of the torque's variation within trials that the law explains.
    phases : tuple of PhaseResidual
        What is left in each phase.
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
            return f"Fit undecided: too few trials to tell; {share}."
        if not self.tests or (
            self.verdict == "does not fit" and self.tests[0].adjusted >= self.level
        ):
            return (
                f"DOES NOT FIT: from the catch on {self.after_to_before:.2g} times "
                f"what is left before it; {share}."
            )
        first = self.tests[0]
        p = f"p {p_text(first.adjusted)}"
        nothing = (
            f"nothing left goes with any of {len(self.tests)} structures ({p} at least)"
        )
        if self.verdict == "fits":
            return f"Fits: {nothing}; {share}."
        if self.verdict == "no evidence either way":
            most = max(_not_noise(self.phases, self.rest_sd), key=lambda left: left.sd)
            return (
                f"No evidence either way: {nothing}, but what is left is not noise "
                f"({most.phase}: {most.sd:.2g} N·m, autocorrelation "
                f"{most.autocorrelation:.2f}; at rest {_rest_text(self.rest_sd)}); "
                f"{share}."
            )
        words, option = STRUCTURES[first.name]
        remedy = f"; try {option}" if option else ""
        return (
            f"DOES NOT FIT: what is left goes with {words} ({p}), so that intervals "
            f"need not hold the truth; {share}{remedy}."
        )


def lack_of_fit(
    equations: Sequence[Equations],
    shared: _Floats,
    local: Sequence[_Floats],
    tables: Sequence[_Floats],
    laws: Sequence[_Floats],
    rest_sd: float,
) -> LackOfFit:
    """Return what a fit leaves over, and whether that goes with anything.

    `tables` are the equations' whole ones, `laws` their torques.
    """
    added = [_added(e, shared, mine) for e, mine in zip(equations, local, strict=True)]
    # of catches that outlast their stretch, those that end are the short ones
    unended = any(e.catch is not None and e.catch.end is None for e in equations)
    names = [
        name
        for name in STRUCTURES
        if any(name in each for each in added)
        and not (unended and name in ("travel", "bent climb"))
    ]
    reduced = [
        _reduced(e, table, columns, names)
        for e, table, columns in zip(equations, tables, added, strict=True)
    ]
    in_common = [t for i, name in enumerate(names) if (t := _test(i, name, reduced))]
    tests = _holm([*in_common, *_own_drifts(equations)])
    phases = _phases(equations, laws)
    ratio = _after_to_before(phases)
    verdict: Verdict = "undecided"
    if ratio > _MAX_RATIO or (tests and tests[0].adjusted < LEVEL):
        verdict = "does not fit"
    elif tests:
        is_noise = not _not_noise(phases, rest_sd)
        verdict = "fits" if is_noise else "no evidence either way"
    return LackOfFit(
        verdict=verdict,
        level=LEVEL,
        tests=tests,
        explained=_explained(equations, laws),
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


def _rest_text(rest_sd: float) -> str:
    return "unknown" if math.isnan(rest_sd) else f"{rest_sd:.2g} N·m"


def _explained(equations: Sequence[Equations], laws: Sequence[_Floats]) -> float:
    left = sum(
        float(((e.measured - law) ** 2).sum())
        for e, law in zip(equations, laws, strict=True)
    )
    whole = sum(
        float(((e.measured - e.measured.mean()) ** 2).sum())
        for e in equations
        if e.measured.size
    )
    return 1.0 - left / whole if whole > 0.0 else math.nan


def _after_to_before(phases: Sequence[PhaseResidual]) -> float:
    before = [p for p in phases if p.phase in ("slow", "pre-catch")]
    after = [p for p in phases if p.phase not in ("slow", "pre-catch")]
    if not (after and before and _pooled(before) > 0.0):
        return math.nan
    return _pooled(after) / _pooled(before)


def _pooled(phases: Sequence[PhaseResidual]) -> float:
    squares = sum(p.n_samples * p.sd**2 for p in phases)
    return math.sqrt(squares / sum(p.n_samples for p in phases))


def _reduced(
    e: Equations, table: _Floats, columns: Mapping[str, _Floats], names: Sequence[str]
) -> tuple[_Floats, int]:
    # rows of [shared | residuals | added], and how many columns are not added
    zeros = np.zeros(table.shape[0])
    added = [columns.get(name, zeros) for name in names]
    rest = partial_out(np.column_stack([table, *added]), len(e.local))
    return rest, table.shape[1] - len(e.local)


def _test(
    place: int, name: str, reduced: Sequence[tuple[_Floats, int]]
) -> StructureTest | None:
    rows = []
    for whole, n in reduced:
        design = np.column_stack([whole[:, : n - 1], whole[:, n + place]])
        rows.append(Rows(design=design, target=-whole[:, n - 1]))
    fit = solve(rows)
    value, df = float(fit.values[-1]), float(fit.df[-1])
    error = math.sqrt(max(fit.covariance[-1, -1], 0.0))
    if not (error > 0.0 and df >= _MIN_DF and fit.n_trials[-1] >= _MIN_TRIALS):
        return None
    p = 2.0 * float(stdtr(df, -abs(value / error)))
    return StructureTest(name=name, t=value / error, df=df, p_value=p, adjusted=p)


def _own_drifts(equations: Sequence[Equations]) -> list[StructureTest]:
    known = equations[0].known
    slow = [e.trial.pre_catch for e in equations if e.trial.pace == "slow"]
    if known.drifts or len(equations) < _MIN_TRIALS:
        return []
    test = own_drifts(slow, known.arm.gravity_angle)
    if test is None:
        return []
    return [
        StructureTest(
            name="own drifts",
            t=math.sqrt(test.ratio),
            df=float(test.df),
            p_value=test.p_value,
            adjusted=test.p_value,
        )
    ]


def _holm(tests: Sequence[StructureTest]) -> tuple[StructureTest, ...]:
    ordered = sorted(tests, key=lambda test: test.p_value)
    adjusted, last = [], 0.0
    for i, test in enumerate(ordered):
        last = max(last, min(1.0, (len(ordered) - i) * test.p_value))
        adjusted.append(replace(test, adjusted=last))
    return tuple(adjusted)


def _added(e: Equations, shared: _Floats, local: _Floats) -> dict[str, _Floats]:
    # columns of what the law has not, over the rows of the whole table
    now = dict(zip(e.known.names, shared.tolist(), strict=True))
    mine = dict(zip(e.local, local.tolist(), strict=True))
    rows = list(e.catch_rows(now, mine))
    columns = {
        name: np.append(column / e.known.spreads.torque, np.zeros(len(rows)))
        for name, column in (_before(e) | _from_catch(e, now, mine)).items()
        if name not in now and name not in mine and column.any()
    }
    catch = e.trial.catch
    size = {"catch angle": 0.0, "peak": 1.0, "residual": 1.0, "travel": 0.0}
    if catch is not None:
        size |= {"catch angle": catch.mean_speed**2, "travel": catch.mean_catch_speed}
    for name, value in size.items():
        if name in rows:
            column = np.zeros(e.torque.size + len(rows))
            column[e.torque.size + rows.index(name)] = value
            columns[name] = column
    return columns


def _before(e: Equations) -> dict[str, _Floats]:
    # what acts in every phase, and what the law holds from the catch on
    parts = [e.trial.pre_catch]
    if e.catch is not None and e.trial.after is not None:
        parts.append(e.trial.after)
    angle = np.concatenate([part.angle for part in parts])
    speed = np.concatenate([part.velocity for part in parts])
    held_angle, held_speed = angle.copy(), speed.copy()
    if e.catch is not None:
        held = np.arange(angle.size) >= e.n_pre
        if e.known.constants.post_catch == "additive" and e.catch.end is not None:
            held &= e.time < e.catch.end
        held_angle[held], held_speed[held] = e.catch.angle, e.catch.speed
    return {
        "gravity": np.sin(angle - e.known.arm.gravity_angle),
        "arm_inertia": np.concatenate([part.acceleration for part in parts]),
        "drift": e.time - e.time.mean() if e.time.size else e.time,
        "bent stiffness": held_angle**2,
        "bent damping": held_speed**2,
    }


def _from_catch(
    e: Equations, now: Mapping[str, float], mine: Mapping[str, float]
) -> dict[str, _Floats]:
    catch, after = e.catch, e.trial.after
    if catch is None or after is None:
        return {}
    since = np.concatenate([np.zeros(e.n_pre), after.time - catch.time])
    peak_end = e.known.constants.peak_duration
    end = math.inf if catch.end is None else catch.end - catch.time
    slope = np.where(since < end, np.maximum(since - peak_end, 0.0), 0.0)
    travel = mine.get("travel", catch.travel)
    past = np.concatenate([np.zeros(e.n_pre), after.angle - catch.angle - travel])
    past = np.where(since >= end, np.maximum(past, 0.0), 0.0)
    if math.isfinite(end):
        slope[since >= end] = slope.max(initial=0.0)
    made = {"residual slope": slope, "bent climb": past**2}
    law = e.law_at(now, mine)
    if "lag" not in now:
        made["lag"] = e.law_at({**now, "lag": e.known.arm.lag + _LAG}, mine) - law
    if "catch_rise" not in now:
        rise = {**now, "catch_rise": e.known.arm.catch_rise + _RISE}
        made["catch_rise"] = e.law_at(rise, mine) - law
    return made


def _phases(
    equations: Sequence[Equations], laws: Sequence[_Floats]
) -> tuple[PhaseResidual, ...]:
    pieces: dict[str, list[_Floats]] = {}
    for e, law in zip(equations, laws, strict=True):
        left = e.measured - law
        for phase, which in _phase_masks(e.trial, e):
            if which.sum() > 2:
                pieces.setdefault(phase, []).append(left[which])
    order = ("slow", "pre-catch", "peak", "catch", "post-catch")
    return tuple(_phase(name, pieces[name]) for name in order if name in pieces)


def _phase_masks(trial: Trial, e: Equations) -> list[tuple[str, NDArray[np.bool_]]]:
    before = np.arange(e.time.size) < e.n_pre
    if trial.pace == "slow":
        return [("slow", before)]
    masks = [("pre-catch", before)]
    if e.catch is not None:
        end = math.inf if e.catch.end is None else e.catch.end
        peak = ~before & (
            e.time < min(e.catch.time + e.known.constants.peak_duration, end)
        )
        over = ~before & ~peak & (e.time >= end)
        masks += [
            ("peak", peak),
            ("catch", ~before & ~peak & ~over),
            ("post-catch", over),
        ]
    return masks


def _phase(phase: str, pieces: Sequence[_Floats]) -> PhaseResidual:
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
