"""The alternative annotator test: whether a judge can replace a human.

In: grades of humans and of a judge, by item. Out: how often the judge is at least as
close to the other humans as each of them is, tests of that, and intervals.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import stdtr

from masrel._input import check_option, listed, refuse, shown
from masrel.agreement import (
    Label,
    Weights,
    WeightsLike,
    benjamini_yekutieli,
    declared_weights,
    holm,
)
from masrel.agreement._engine import (
    NO_SPREAD,
    Floats,
    Integers,
    check_level,
    divide,
    logit_ends,
    student_t,
    undefined,
)
from masrel.agreement._labels import check_categories, label_codes
from masrel.agreement.benchmarks import _yekutieli_bounds
from masrel.errors import RatingsError
from masrel.estimates import Estimate, Interval, Target, Unit
from masrel.intervals._question import warn_small
from masrel.intervals.jackknife import _variance_of
from masrel.judges._paired import (
    NO_CHANGE,
    PairedTest,
    ScoreTest,
    check_count,
    check_share,
    p_less,
    p_less_of_clusters,
    score_test,
)

EPSILONS: Mapping[str, float] = {"expert": 0.2, "skilled": 0.15, "crowd": 0.1}
"""How much better a human may be, by kind of human (Calderon et al. 2025)."""


class Grades(Protocol):
    """Grades by item: a dict, a pandas Series, or another thing that has `items`."""

    def items(self) -> Iterable[tuple[Any, Any]]:
        """Return pairs of item and grade."""
        ...


ScoreName = Literal["accuracy", "neg_rmse"]
"""Closeness of a grade to those of others: how many are equal, or -√(mean square)."""

Score = ScoreName | tuple[WeightsLike, Sequence[Label]]
"""A name, or weights of agreement with the declared categories."""

_Bools = NDArray[np.bool_]

_EXACT_UP_TO = 2500  # items, of which an exact p-value takes some 50 ms
_FEW_CLUSTERS = 20
_ROUNDING = 1e-12  # share of a sum of weights, or an error, that is none
_NO_CLUSTERS = "0/0: there is only one cluster, or no difference in any"
_NO_ITEM = "a human has no item when one of the units is left out"
_AT_THE_END = (
    "it is at the end of its scale, so there is no information about its uncertainty"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class HumanBesideJudge:
    """One human and the judge, both compared with the other humans.

    Attributes
    ----------
    name : str
        The human.
    n_items : int
        Items that the human graded, of those that count.
    b, c : int
        Items where the human is nearer to the others than the judge is, and items
        where the judge is nearer.
    judge_share, human_share : float
        How often the judge is at least as near as the human, 1 - b/n, and the human at
        least as near as the judge, 1 - c/n.
    test : {"exact", "score", "t", "clusters"}
        How it was tested.
    p_value : float
        Of the hypothesis that the human's share exceeds the judge's by at least
        epsilon; ``nan`` when undefined, which does not reject it.
    p_adjusted : float
        The same by Benjamini and Yekutieli's method for all humans.
    is_rejected : bool
        Whether it is rejected: the judge is not worse than the human by epsilon.
    reason : str or None
        Why the p-value is undefined, or None.
    """

    name: str
    n_items: int
    b: int
    c: int
    judge_share: float
    human_share: float
    test: Literal["exact", "score", "t", "clusters"]
    p_value: float
    p_adjusted: float
    is_rejected: bool
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AlternativeAnnotatorTest:
    """Whether a judge can replace one of the humans.

    Attributes
    ----------
    winning_rate : float
        Share of the humans whose hypothesis is rejected, ω.
    advantage : float
        Mean of the judge's shares, ρ: how often it is at least as near to the other
        humans as a human is. `advantage` has its interval.
    is_passed : bool
        Whether the winning rate is at least one half.
    humans : tuple of HumanBesideJudge
        Each human that was tested, in the order of the data.
    left_out : tuple of (str, int)
        Humans with fewer items than `min_items`, and how many; the others are held
        against them, too.
    n_items : int
        Items that count: with grades of at least two humans, and of the judge.
    n_clusters : int or None
        Clusters of these; None without.
    epsilon : float
        By how much a human's share may exceed the judge's.
    score : str
        How grades were compared: the name of the score, or of the weights.
    test : {"auto", "exact", "score", "t"}
        What was asked for.
    level : float
        Bound of the expected share of false rejections.
    thresholds : tuple of float
        Thresholds of the smallest p-value, the next, and so on.
    min_items : int
        Items from which on a human is tested.
    """

    winning_rate: float
    advantage: float
    is_passed: bool
    humans: tuple[HumanBesideJudge, ...]
    left_out: tuple[tuple[str, int], ...]
    n_items: int
    n_clusters: int | None
    epsilon: float
    score: str
    test: str
    level: float
    thresholds: tuple[float, ...]
    min_items: int


def alternative_annotator_test(
    humans: Mapping[str, Grades],
    judge: Grades,
    *,
    epsilon: float,
    score: Score = "accuracy",
    test: PairedTest | Literal["auto"] = "auto",
    min_items: int = 30,
    level: float = 0.05,
    clusters: Grades | None = None,
) -> AlternativeAnnotatorTest:
    """Test whether a judge can replace a human: the alternative annotator test.

    Parameters
    ----------
    humans : mapping of mappings, or DataFrame
        The grades of each human by item, as ``{human: {item: grade}}`` or a column
        each; None and ``nan`` are missing.
    judge : mapping or Series
        The grade of the judge by item.
    epsilon : float
        By how much a human may be better and the judge still pass, within [0, 1];
        `EPSILONS` has what the authors advise.
    score : {"accuracy", "neg_rmse"} or tuple, optional
        How near a grade is to the others' grades: how many of them are equal, or minus
        the root of the mean square difference. Or weights of agreement, a name or a
        matrix, with the declared categories: ``("linear", ["low", "mid", "high"])``.
    test : {"auto", "exact", "score", "t"}, optional
        Exact and unconditional, Tango's score test, or Student's t as in the paper;
        by default exact up to 2500 items of a human, and by the score above.
    min_items : int, optional
        Items that a human needs to be tested. The exact test keeps its level however
        few there are, but then it has little power.
    level : float, optional
        Expected share of false rejections, by Benjamini and Yekutieli's method.
    clusters : mapping or Series, optional
        The cluster of every item, such as the document it is from. The test is then
        Tango's with a design effect, and is for `test` "auto" alone.

    Returns
    -------
    AlternativeAnnotatorTest
        The winning rate, the advantage, and each human's line.

    Raises
    ------
    ParameterError
        If an option is unknown or outside its range, or no human has enough items.
    RatingsError
        If grades do not fit the score, or an item is there twice or has no cluster.

    Warns
    -----
    SmallSampleWarning
        Below 20 clusters.
    UndefinedStatisticWarning
        If the p-value of a human is 0/0.

    Notes
    -----
    Items count that at least two humans and the judge have graded. Ties are exact:
    scores are compared as whole numbers, grades with a point as the decimals they are
    written as; sums of weights that differ by rounding alone are equal.

    The paper's t-test rejects too often where human and judge seldom differ, 11.5 % at
    a nominal 5 % in a case of 30 items, and has p = 0 where they never do. The exact
    p-value is the largest that any share of ties allows, outcomes in the order of
    Tango's statistic. With clusters the counts are divided by their design effect,
    which is drawn towards that of items wholly alike in a cluster, as if two more
    items had differed and said so; Student's t with as many degrees of freedom as
    clusters less 1 takes the place of the normal.

    References
    ----------
    .. [1] Calderon, N., Reichart, R., Dror, R. (2025). The alternative annotator test
       for LLM-as-a-judge: how to statistically justify replacing human annotators with
       LLMs. ACL 2025, 16051-16081. https://arxiv.org/abs/2501.10970
    .. [2] Hsueh, H.-M., Liu, J.-P., Chen, J. J. (2001). Unconditional exact tests for
       equivalence or noninferiority for paired binary endpoints. Biometrics, 57(2),
       478-483. https://doi.org/10.1111/j.0006-341X.2001.00478.x
    .. [3] Benjamini, Y., Yekutieli, D. (2001). The control of the false discovery rate
       in multiple testing under dependency. Annals of Statistics, 29(4), 1165-1188.
       https://doi.org/10.1214/aos/1013699998
    .. [4] Rao, J. N. K., Scott, A. J. (1992). A simple method for the analysis of
       clustered binary data. Biometrics, 48(2), 577-585.
       https://doi.org/10.2307/2532311

    Examples
    --------
    >>> grades = ["a", "b", "b", "a", "b"] * 20
    >>> humans = {
    ...     "Ann": dict(enumerate(grades)),
    ...     "Ben": dict(enumerate(["b"] + grades[1:])),
    ...     "Cem": dict(enumerate(grades[:-1] + ["a"])),
    ... }
    >>> result = alternative_annotator_test(
    ...     humans, dict(enumerate(grades)), epsilon=0.1
    ... )
    >>> result.winning_rate, result.advantage
    (1.0, 1.0)
    >>> result.humans[1].c, round(result.humans[1].p_value, 6)
    (1, 0.00025)
    """
    check_share("epsilon", epsilon)
    check_option("test", test, ("auto", *get_args(PairedTest)))
    check_level(level)
    refuse(
        (
            clusters is not None and test != "auto",
            f'test: with clusters it needs "auto", got {shown(test)}',
        )
    )
    graded = _graded(humans, {"judge": judge}, score, min_items)
    units = None if clusters is None else graded.cluster_codes(clusters)
    nearer, n_items = graded.nearer()[0], graded.rated.sum(axis=0).tolist()
    rows = [
        _human(graded, nearer, int(j), epsilon, test, units)
        for j in np.flatnonzero(graded.is_tested)
    ]
    m = len(rows)
    # what is undefined rejects nothing, and is of one of the humans all the same
    known = [1.0 if row["reason"] else row["p_value"] for row in rows]
    lines = tuple(
        HumanBesideJudge(**row, p_adjusted=p, is_rejected=p <= level)
        for row, p in zip(rows, benjamini_yekutieli(known), strict=True)
    )
    n_clusters = None if units is None else int(units.max()) + 1
    warn_small(n_clusters or _FEW_CLUSTERS, _FEW_CLUSTERS, "clusters")
    winning_rate = sum(line.is_rejected for line in lines) / m
    return AlternativeAnnotatorTest(
        winning_rate=winning_rate,
        advantage=sum(line.judge_share for line in lines) / m,
        is_passed=winning_rate >= 0.5,
        humans=lines,
        left_out=tuple(
            (graded.names[j], n_items[j]) for j in np.flatnonzero(~graded.is_tested)
        ),
        n_items=len(graded.items),
        n_clusters=n_clusters,
        epsilon=float(epsilon),
        score=graded.score,
        test=test,
        level=level,
        thresholds=tuple((level * _yekutieli_bounds(m)).tolist()),
        min_items=min_items,
    )


def _human(
    graded: "_Graded",
    nearer: Integers,
    j: int,
    epsilon: float,
    test: str,
    units: Integers | None,
) -> dict[str, Any]:
    """Return the line of one human, before the others are regarded."""
    # nearer (n_items, n_humans): 1 where the human is, -1 where the judge is
    name, rated = graded.names[j], graded.rated[:, j]
    d = nearer[rated, j]
    n, b, c = len(d), int((d == 1).sum()), int((d == -1).sum())
    way: Any = test
    if test == "auto":
        way = "exact" if n <= _EXACT_UP_TO else "score"
    if units is None:
        p = p_less(b, c, n, epsilon, way)
    else:
        way, p = "clusters", p_less_of_clusters(d, units[rated], epsilon)
    why = NO_CHANGE if units is None else _NO_CLUSTERS
    return {
        "name": name,
        "n_items": n,
        "b": b,
        "c": c,
        "judge_share": 1.0 - b / n,
        "human_share": 1.0 - c / n,
        "test": way,
        "p_value": p,
        "reason": undefined(f"the p-value of {name}", why) if math.isnan(p) else None,
    }


# -- who is nearer to the others -------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Graded:
    """Grades of the items that count, as values whose nearness is a number."""

    names: list[str]  # of the humans
    items: list[Hashable]
    humans: NDArray[Any]  # (n_items, n_humans)
    rated: _Bools  # whether there is such a grade, (n_items, n_humans)
    judges: NDArray[Any]  # (n_items, n_judges)
    nearness: Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]
    is_tested: _Bools  # whether a human has enough items, (n_humans,)
    n_categories: int
    score: str

    def nearer(self) -> Integers:
        """Return 1 where a human is nearer to the others, -1 where a judge is."""
        # -> (n_judges, n_items, n_humans); whole numbers are exact, of any size
        every = range(len(self.names))
        of_humans: Any = sum(  # nobody is compared with himself
            self._to(k, self.humans) * (np.array(every) != k) for k in every
        )
        by_human = np.stack([self._to(k, self.judges) for k in every], axis=-1)
        of_judge = by_human.sum(axis=-1, keepdims=True) - by_human
        gap = np.moveaxis(of_humans[:, None, :] - of_judge, 1, 0)
        rounding = _ROUNDING * np.abs(of_judge).max() if gap.dtype.kind == "f" else 0
        signs = (gap > rounding).astype(np.int8) - (gap < -rounding).astype(np.int8)
        return np.asarray(signs * self.rated)

    def _to(self, k: int, grades: NDArray[Any]) -> NDArray[Any]:
        """Return how near grades are to those of a human; 0 if those are missing."""
        return self.nearness(grades, self.humans[:, k, None]) * self.rated[:, k, None]

    def cluster_codes(self, clusters: Grades | None) -> Integers:
        """Return the cluster of every item as numbers from 0; without any, the item."""
        # -> (n_items,)
        if clusters is None:
            return np.arange(len(self.items))
        of = _by_item(clusters, "clusters")
        codes, _ = label_codes([list(map(of.get, self.items))], None)
        item = self.items[int(codes[0].argmin())]
        refuse(
            (
                (codes < 0).any(),
                f"clusters: item {item!r} needs a cluster, got nothing",
            ),
            error=RatingsError,
        )
        return np.asarray(codes[0], dtype=np.int64)


def _graded(
    humans: Mapping[str, Grades],
    judges: Mapping[str, Grades],
    score: Score,
    min_items: int,
) -> _Graded:
    """Check grades; code those of items with two humans' and all judges' grades."""
    check_count("min_items", min_items)
    title, declared, weights = _checked_score(score)
    of_humans = {str(name): of for name, of in _by_item(humans, "humans").items()}
    n, graders = len(of_humans), {f"humans: {who}": of for who, of in of_humans.items()}
    items, codes, categories = _coded({**graders, **judges}, list(judges), declared)
    is_there = codes >= 0
    does_count = is_there[:, n:].all(axis=1) & (is_there[:, :n].sum(axis=1) >= 2)
    refuse(
        (
            not does_count.any(),
            f"{listed(judges)}: needs items that two humans have graded, too; found "
            f"none among {len(items)}, such as {shown(next(iter(items), None))}",
        ),
        error=RatingsError,
    )
    rated = is_there[does_count, :n]
    n_items = rated.sum(axis=0)
    each = zip(of_humans, n_items.tolist(), strict=True)
    refuse(
        (
            not (n_items >= min_items).any(),
            f"min_items: needs a human with at least {min_items} items that another "
            "human and the judge have graded, got "
            + listed(f"{name} with {n}" for name, n in each),
        )
    )
    values, nearness = _values(title, codes[does_count], categories, weights)
    return _Graded(
        names=list(of_humans),
        items=[items[row] for row in np.flatnonzero(does_count)],
        humans=values[:, :n],
        rated=rated,
        judges=values[:, n:],
        nearness=nearness,
        is_tested=n_items >= min_items,
        n_categories=len(categories),
        score=title,
    )


def _coded(
    graders: Mapping[str, Grades],
    needed: Sequence[str],
    declared: tuple[Label, ...] | None = None,
) -> tuple[list[Hashable], Integers, tuple[Label, ...]]:
    """Return the items of those who are needed, codes of all, and the categories."""
    # graders: by their places for messages -> codes (n_items, n_graders)
    grades = {place: _by_item(of, place) for place, of in graders.items()}
    items = [x for x in grades[needed[0]] if all(x in grades[of] for of in needed)]
    codes, categories = label_codes(
        [list(map(of.get, items)) or [None] for of in grades.values()],
        declared,
        lambda row, column: f"{list(grades)[row]}: item {items[column]!r}",
    )
    return items, np.ascontiguousarray(codes.T), categories


def _by_item(grades: Any, place: str) -> dict[Any, Any]:
    """Return what there is by item, once each."""
    if not hasattr(grades, "items"):
        raise RatingsError(
            f"{place}: needs a dict, a Series or a DataFrame, got {shown(grades)}"
        )
    once: dict[Any, Any] = {}
    for name, of in grades.items():
        if name in once:
            raise RatingsError(f"{place}: needs each name once, got {name!r} twice")
        once[name] = of
    return once


def _checked_score(
    score: Score,
) -> tuple[str, tuple[Label, ...] | None, Weights | None]:
    """Return the name of a score, and the categories and weights that it declares."""
    if isinstance(score, tuple) and len(score) == 2:
        weights, categories = score
        declared = check_categories(categories)
        made = declared_weights(weights, declared)
        refuse((made.reason is not None, f"score: {made.reason}"))
        return made.name, declared, made
    check_option("score", score, get_args(ScoreName))
    return str(score), None, None


def _values(
    score: str, codes: Integers, categories: Sequence[Label], weights: Weights | None
) -> tuple[NDArray[Any], Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]]:
    """Return values of grades, and how near two of them are."""
    if weights is not None:
        return codes, lambda a, b: -weights.v[a, b]
    if score == "accuracy":
        return codes, lambda a, b: np.equal(a, b).astype(np.int64)
    # of equally many others a larger mean square is a larger sum of squares. Grades are
    # made whole numbers, in the proportions of the decimals they are.
    others = [x for x in categories if not isinstance(x, int)]
    refuse(
        (
            not all(isinstance(x, float) and math.isfinite(x) for x in others),
            "score: neg_rmse needs grades that are finite numbers, got "
            + listed(map(repr, categories)),
        ),
        error=RatingsError,
    )
    exact = [Fraction(x if isinstance(x, int) else str(x)) for x in categories]
    scale = math.lcm(*(x.denominator for x in exact))
    whole = [int((x - min(exact)) * scale) for x in exact]
    kind = np.int64 if max(whole) ** 2 * codes.shape[1] < 2**62 else object
    return np.array(whole, dtype=kind)[codes], lambda a, b: -((a - b) ** 2)


# -- how sure the advantage is ---------------------------------------------------------


def advantage(
    humans: Mapping[str, Grades],
    judge: Grades,
    *,
    target: Target,
    score: Score = "accuracy",
    min_items: int = 30,
    level: float = 0.95,
    clusters: Grades | None = None,
) -> Estimate:
    """Estimate how often a judge is at least as close to the humans as one of them.

    Parameters
    ----------
    humans : mapping of mappings, or DataFrame
        The grades of each human by item; see `alternative_annotator_test`.
    judge : mapping or Series
        The grade of the judge by item.
    target : {"items", "raters", "both"}
        Population that the interval is about: other items, other humans, or both.
    score : {"accuracy", "neg_rmse"} or tuple, optional
        How near grades are; see `alternative_annotator_test`.
    min_items : int, optional
        Items that a human needs to be one of the mean.
    level : float, optional
        Nominal level of the interval.
    clusters : mapping or Series, optional
        The cluster of every item, which leaves as a whole.

    Returns
    -------
    Estimate
        The mean over humans of the judge's shares, ρ, with its interval: by the
        jackknife and Student's t, on the logit scale so that it stays inside [0, 1];
        exact where all items are alike.

    Raises
    ------
    ParameterError
        If an option is outside its range, or other humans are the target and there
        are fewer than 3.
    RatingsError
        If grades do not fit; see `alternative_annotator_test`.

    Warns
    -----
    SmallSampleWarning
        Below 10 items or clusters, or 5 humans, of those that are left out.
    UndefinedStatisticWarning
        If leaving one out never changes the estimate or leaves a human without items,
        or other humans are a target and the judge is never farther than a human, or
        always.

    Notes
    -----
    A human who is left out is not compared with the judge, nor others with this human.
    For "both" the variances are added; the degrees of freedom are the fewest of those
    of items, of the human who has the fewest, and of humans.

    References
    ----------
    .. [1] Calderon, N., Reichart, R., Dror, R. (2025); see
       `alternative_annotator_test`.
    .. [2] Efron, B., Stein, C. (1981). The jackknife estimate of variance. Annals of
       Statistics, 9(3), 586-596. https://doi.org/10.1214/aos/1176345462

    Examples
    --------
    >>> grades = ["a", "b", "b", "a", "b"] * 12
    >>> humans = {
    ...     "Ann": dict(enumerate(grades)),
    ...     "Ben": dict(enumerate(["b"] + grades[1:])),
    ...     "Cem": dict(enumerate(grades[:-1] + ["a"])),
    ... }
    >>> judge = dict(enumerate(["b", "a", "a"] + grades[3:]))
    >>> estimate = advantage(humans, judge, target="items")
    >>> round(estimate.value, 3), round(estimate.interval.low, 3)
    (0.967, 0.872)
    """
    rest = _leave_out(
        humans, {"judge": judge}, target, score, min_items, level, clusters
    )
    graded, value, interval = rest.graded, float(rest.values[0]), rest.interval
    error = low = high = math.nan
    method, reason = interval.method, None
    if 0.0 < value < 1.0:
        error, reason = rest.error(np.ones(1))
        low, high = logit_ends(value, student_t(level, rest.df) * error)
        method = f"{interval.method} on the logit"
    elif target == "items":
        # of n units none was otherwise: Clopper and Pearson's interval
        share = (0.5 - 0.5 * level) ** (1.0 / (rest.df + 1.0))
        low, high = (share, 1.0) if value else (0.0, 1.0 - share)
        method = f"exact, because all {interval.unit} are the same"
    else:
        reason = undefined("the interval of the advantage", _AT_THE_END)
    return Estimate(
        coefficient="advantage",
        weights=graded.score,
        value=value,
        standard_error=error,
        interval=replace(interval, low=low, high=high, method=method, reason=reason),
        observed=value,
        chance=math.nan,
        n_items=len(graded.items),
        n_items_paired=len(graded.items),
        n_raters=int(graded.is_tested.sum()),
        n_categories=graded.n_categories,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgeDifference:
    """How much the advantage of one judge exceeds that of another on the same items.

    Attributes
    ----------
    first, second : str
        The judges.
    value : float
        Advantage of the first minus that of the second.
    standard_error : float
        By the jackknife; ``nan`` when undefined.
    interval : Interval
        Interval of this difference alone.
    p_value, p_holm : float
        Two-sided, that there is no difference; and adjusted for all pairs.
    n_items : int
        Items that two humans and all judges have graded.
    """

    first: str
    second: str
    value: float
    standard_error: float
    interval: Interval
    p_value: float
    p_holm: float
    n_items: int


def advantage_differences(
    humans: Mapping[str, Grades],
    judges: Mapping[str, Grades],
    *,
    target: Target,
    score: Score = "accuracy",
    min_items: int = 30,
    level: float = 0.95,
    clusters: Grades | None = None,
) -> tuple[JudgeDifference, ...]:
    """Compare the advantages of several judges on the items that all have graded.

    Parameters
    ----------
    humans : mapping of mappings, or DataFrame
        The grades of each human by item; see `alternative_annotator_test`.
    judges : mapping of mappings, or DataFrame
        The grades of each judge by item; two judges or more.
    target : {"items", "raters", "both"}
        Population that the interval is about: other items, other humans, or both.
    score : {"accuracy", "neg_rmse"} or tuple, optional
        How near grades are; see `alternative_annotator_test`.
    min_items : int, optional
        Items that a human needs to be one of the mean.
    level : float, optional
        Nominal level of each interval.
    clusters : mapping or Series, optional
        The cluster of every item, which leaves as a whole.

    Returns
    -------
    tuple of JudgeDifference
        Every two judges, in the order given.

    Raises
    ------
    ParameterError
        If an option is outside its range, there are fewer than two judges, or other
        humans are the target and there are fewer than 3.
    RatingsError
        If grades do not fit; see `alternative_annotator_test`.

    Warns
    -----
    SmallSampleWarning
        Below 10 items or clusters, or 5 humans, of those that are left out.
    UndefinedStatisticWarning
        If leaving one out never changes a difference.

    Notes
    -----
    Each item leaves for all judges at once, which keeps what they have in common;
    Student's t has the degrees of freedom of `advantage`.

    References
    ----------
    .. [1] Calderon, N., Reichart, R., Dror, R. (2025); see
       `alternative_annotator_test`.
    .. [2] Holm, S. (1979); see `masrel.agreement.holm`.

    Examples
    --------
    >>> grades = ["a", "b", "b", "a", "b"] * 12
    >>> humans = {
    ...     "Ann": dict(enumerate(grades)),
    ...     "Ben": dict(enumerate(["b"] + grades[1:])),
    ...     "Cem": dict(enumerate(grades[:-1] + ["a"])),
    ... }
    >>> judges = {
    ...     "one": dict(enumerate(grades)),
    ...     "other": dict(enumerate(["b", "a", "a", "b", "a"] + grades[5:])),
    ... }
    >>> (pair,) = advantage_differences(humans, judges, target="items")
    >>> round(pair.value, 3), round(pair.interval.low, 3)
    (0.067, 0.002)
    """
    by_name = {str(name): grades for name, grades in _by_item(judges, "judges").items()}
    refuse((len(by_name) < 2, f"judges: needs at least two, got {len(by_name)}"))
    rest = _leave_out(humans, by_name, target, score, min_items, level, clusters)
    names, contrasts = list(by_name), np.eye(len(by_name))
    pairs = list(combinations(range(len(names)), 2))
    rows = [_difference(rest, contrasts[i] - contrasts[j]) for i, j in pairs]
    adjusted = holm([row["p_value"] for row in rows])
    return tuple(
        JudgeDifference(first=names[i], second=names[j], **row, p_holm=p)
        for (i, j), row, p in zip(pairs, rows, adjusted, strict=True)
    )


def _difference(rest: "_LeftOut", contrast: Floats) -> dict[str, Any]:
    """Return what is to be said of two judges, before other pairs are regarded."""
    value, (error, reason) = float(contrast @ rest.values), rest.error(contrast)
    half = student_t(rest.interval.level, rest.df) * error
    low, high = max(value - half, -1.0), min(value + half, 1.0)
    if reason is not None:
        low = high = math.nan
    return {
        "value": value,
        "standard_error": error,
        "interval": replace(rest.interval, low=low, high=high, reason=reason),
        "p_value": 2.0 * float(stdtr(rest.df, -abs(value / error))),
        "n_items": len(rest.graded.items),
    }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _LeftOut:
    """Advantages of judges, and how they move together when units are left out."""

    graded: _Graded
    values: Floats  # (n_judges,)
    moved: list[Floats]  # without each unit of a kind, (n_judges, n_units)
    df: float
    interval: Interval  # without ends

    def error(self, contrast: Floats) -> tuple[float, str | None]:
        """Return the standard error of a contrast of judges, or why it is undefined."""
        variance = sum(_variance_of(contrast @ of, of.shape[1]) for of in self.moved)
        if variance > 0.0:
            return math.sqrt(variance), None
        reason = _NO_ITEM if math.isnan(variance) else NO_SPREAD
        return math.nan, undefined("the interval of the advantage", reason)


def _leave_out(
    humans: Mapping[str, Grades],
    judges: Mapping[str, Grades],
    target: Target,
    score: Score,
    min_items: int,
    level: float,
    clusters: Grades | None,
) -> _LeftOut:
    """Check a question about advantages, and leave out what it asks of."""
    check_option("target", target, get_args(Target))
    check_level(level)
    graded = _graded(humans, judges, score, min_items)
    unit: Unit = "items" if clusters is None else "clusters"
    lost, moved, fewest = graded.nearer() == 1, [], []
    notes: tuple[str, ...] = ()
    if target != "raters":
        without, n = _without_units(lost, graded, graded.cluster_codes(clusters))
        moved, fewest, notes = [without], [n], warn_small(n, 10, unit)
    if target != "items":
        moved.append(_without_humans(graded, target))
        fewest.append(moved[-1].shape[1])
        notes += warn_small(fewest[-1], 5, "humans")
    words = {"items": unit, "raters": "humans", "both": f"{unit} and humans"}
    interval = Interval(
        low=math.nan,
        high=math.nan,
        level=level,
        kind="confidence",
        method=f"jackknife of {words[target]}, t",
        target=target,
        unit=unit if target == "items" else target,
        units_are="left out",
        notes=notes,
    )
    return _LeftOut(
        graded=graded,
        values=_advantages(lost, graded),
        moved=moved,
        df=min(fewest) - 1.0,
        interval=interval,
    )


def _advantages(lost: _Bools, graded: _Graded) -> Floats:
    """Return the mean over humans of 1 - b/n, (n_judges,)."""
    n_items = graded.rated.sum(axis=0)
    counts = graded.is_tested & (n_items > 0)
    return np.asarray(
        (1.0 - lost.sum(axis=1)[:, counts] / n_items[counts]).mean(axis=1)
    )


def _without_units(
    lost: _Bools, graded: _Graded, units: Integers
) -> tuple[Floats, int]:
    """Return advantages without each unit, and the units of the human with fewest."""
    # -> (n_judges, n_units)
    one_hot = sparse.csr_array((np.ones(len(units)), (units, np.arange(len(units)))))
    n_items = one_hot @ graded.rated[:, graded.is_tested]
    b = np.stack([one_hot @ of for of in lost[:, :, graded.is_tested]])
    is_unit = n_items.any(axis=1)
    b, n_items = b[:, is_unit], n_items[is_unit]
    left = n_items.sum(axis=0) - n_items
    shares = 1.0 - divide(b.sum(axis=1, keepdims=True) - b, left)
    return shares.mean(axis=2), int((n_items > 0).sum(axis=0).min())


def _without_humans(graded: _Graded, target: Target) -> Floats:
    """Return advantages without each human who was tested, (n_judges, n_humans)."""
    tested = np.flatnonzero(graded.is_tested)
    refuse(
        (
            len(tested) < 3,
            f'target: "{target}" needs at least 3 humans, because one is left out; got '
            f"{len(tested)}",
        )
    )
    rest = []
    for j in tested:  # whom nobody is compared with then
        rated = graded.rated & (np.arange(len(graded.names)) != j)
        rated &= rated.sum(axis=1, keepdims=True) >= 2
        rest.append(replace(graded, rated=rated))
    return np.stack([_advantages(of.nearer() == 1, of) for of in rest], axis=1)


# -- one human, and a reference --------------------------------------------------------


def reference_difference(
    human: Grades,
    judge: Grades,
    reference: Grades,
    *,
    epsilon: float = 0.0,
    level: float = 0.95,
) -> ScoreTest:
    """Compare how often a judge and one human give the grade of a reference.

    Parameters
    ----------
    human, judge, reference : mapping or Series
        Grades by item; items with all three count.
    epsilon : float, optional
        By how much the human may be better: the hypothesis is that the judge is right
        less often by at least as much, and `p_greater` is that of its being better.
    level : float, optional
        Nominal level of the interval.

    Returns
    -------
    ScoreTest
        Items where the judge alone is right, b, and where the human alone is, c, and
        the difference of their shares b/n - c/n with Tango's interval.

    Raises
    ------
    ParameterError
        If an option is outside its range.
    RatingsError
        If no item has all three grades, or they are of different kinds.

    Warns
    -----
    UndefinedStatisticWarning
        If `epsilon` is 0 and both are right and wrong on the same items.

    Notes
    -----
    Without a reference there is nothing to compare: how often a judge and one human
    agree is `masrel.agreement.percent_agreement`.

    References
    ----------
    .. [1] Tango, T. (1998); see `score_test`.

    Examples
    --------
    >>> truth = dict(enumerate("abab" * 10))
    >>> human = truth | {0: "b", 1: "a"}
    >>> judge = truth | {4: "b"}
    >>> result = reference_difference(human, judge, truth)
    >>> result.b, result.c, round(result.low, 3), round(result.high, 3)
    (2, 1, -0.087, 0.145)
    """
    check_share("epsilon", epsilon)
    places = {"human": human, "judge": judge, "reference": reference}
    _, codes, _ = _coded(places, list(places))
    codes = codes[(codes >= 0).all(axis=1)]
    refuse(
        (
            not len(codes),
            "reference: needs items that the human and the judge graded, too",
        ),
        error=RatingsError,
    )
    of_human, of_judge = codes[:, 0] == codes[:, 2], codes[:, 1] == codes[:, 2]
    b, c = int((of_judge & ~of_human).sum()), int((of_human & ~of_judge).sum())
    return score_test(b, c, len(codes), delta=-float(epsilon), level=level)
