"""What grades follow: ordered regression on a model's parameters and the speed.

The source left this as future work: "whether the parameters can be used as
quantitative measures indicating the degree of spasticity" (section V).
"""

import math
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from masrel._input import refuse
from masrel.errors import RatingsError, UndefinedStatisticWarning
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.protocol import Protocol, joint_model
from masrel.lab.ratings import Ratings

if TYPE_CHECKING:
    from pandas import DataFrame

PREDICTORS: dict[str, tuple[str, str]] = {
    "L": ("catch_angle_constant_deg", "deg"),
    "H": ("catch_torque_nms_rad", "N·m·s/rad"),
    "Q": ("residual_ratio", "1"),
    "D": ("catch_travel_deg", "deg"),
    "speed": ("mean_speed_deg_s", "deg/s"),
}
"""Predictor to its key of a model, or column of the ratings, and its unit."""

_SEPARATED = (
    "these predictors separate some grades perfectly, so the likelihood has no "
    "maximum; fewer predictors, or more raters, may help"
)

_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """What one predictor does to the grade, the others held.

    Attributes
    ----------
    predictor : str
        L, H, Q, D or speed.
    per : float
        One standard deviation of it among the ratings, in its unit: the step that
        the odds ratio is for.
    odds_ratio : float
        By how much that step multiplies the odds of a higher grade; ``nan`` when
        undefined.
    coefficient, standard_error : float
        Its logarithm, with an error clustered by rater.
    low, high : float
        Confidence interval of the odds ratio, from t with raters - 1 degrees.
    """

    predictor: str
    per: float
    odds_ratio: float
    coefficient: float
    standard_error: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeRegression:
    """An ordered logistic regression of grades.

    Attributes
    ----------
    effects : tuple of Effect
        One a predictor that is in the regression.
    dropped : tuple of tuple of str
        Predictors that are not, each with the reason.
    thresholds : tuple of float
        Where one grade turns into the next, on the scale of the coefficients.
    grades : tuple of str
        The grades that were given, in order.
    n_ratings, n_raters, n_models, n_missing : int
        Ratings used, of how many raters and models; ratings without a grade or
        speed, left out.
    log_likelihood, log_likelihood_alone : float
        Of the regression, and of the thresholds without any predictor.
    level : float
        Level of the intervals.
    simulated : bool
        Whether any rating is simulated.
    reason : str or None
        Why there are no values, or None.
    """

    effects: tuple[Effect, ...]
    dropped: tuple[tuple[str, str], ...]
    thresholds: tuple[float, ...]
    grades: tuple[str, ...]
    n_ratings: int
    n_raters: int
    n_models: int
    n_missing: int
    log_likelihood: float
    log_likelihood_alone: float
    level: float
    simulated: bool
    reason: str | None = None


def grade_regression(
    protocol: Protocol,
    ratings: Ratings,
    *,
    predictors: Sequence[str] = tuple(PREDICTORS),
    models: Literal["standard", "dummy", "all"] = "all",
    session: str | None = None,
    level: float = 0.95,
    excluded: Sequence[str] = (),
) -> GradeRegression:
    """Regress grades on L, H, Q, D and the stretching speed.

    Parameters
    ----------
    protocol : Protocol
        The study, which has the models' parameters.
    ratings : Ratings
        Its ratings with their speeds.
    predictors : sequence of str, optional
        Some of L, H, Q, D and speed, in the order of
        their claim: one that is a combination of those before it, over these
        ratings, is dropped and named.
    models : {"standard", "dummy", "all"}, optional
        Which models.
    session : str, optional
        Which session; all unless given.
    level : float, optional
        Level of the intervals.
    excluded : sequence of str, optional
        Raters who are left out.

    Returns
    -------
    GradeRegression
        Odds ratios per standard deviation, errors clustered by rater.

    Raises
    ------
    ParameterError
        If there is no such predictor, session or level.
    RatingsError
        If fewer than two grades, or ratings of two raters, are left.

    Warns
    -----
    UndefinedStatisticWarning
        If the predictors separate grades without a miss: the likelihood then has no
        maximum, and no coefficient is a finite number.

    Notes
    -----
    P(grade ≤ g) = 1/(1 + exp(x·β - τ_g)), by maximum likelihood: the maximum that
    statsmodels' `OrderedModel` finds, to the last digits by Newton's steps. Errors are
    a sandwich of exact derivatives. A linear program first settles whether a maximum
    exists: not if some direction of β and τ makes no rating less likely [1]_. Models
    on straight lines between others, as dummies are, do not help to tell L, H, Q and
    D apart: they lie in the space of those at the ends.

    References
    ----------
    .. [1] Albert, A., Anderson, J. A. (1984). On the existence of maximum likelihood
       estimates in logistic regression models. Biometrika, 71(1), 1-10.
       https://doi.org/10.1093/biomet/71.1.1
    """
    # Imported here, as below: no other analysis needs them.
    from pandas import factorize
    from scipy.special import stdtrit

    _check_options(protocol, predictors, session, level)
    ratings = ratings.without(excluded)
    table, n_missing = _predictor_table(protocol, ratings, predictors, models, session)
    grades = tuple(g for g in ratings.scale.grades if (table["grade"] == g).any())
    raters, names = factorize(table["rater"])
    if len(grades) < 2 or len(names) < 2:
        raise RatingsError(
            "a regression of grades needs two grades and two raters or more, got "
            f"{len(grades)} and {len(names)} in {len(table)} ratings with every "
            "predictor"
        )
    used, dropped = _independent(table, predictors)
    values = table[used].to_numpy(dtype=np.float64)
    scale = values.std(axis=0, ddof=1)
    values = (values - values.mean(axis=0)) / scale  # (n_ratings, n_predictors)
    codes = np.array([grades.index(grade) for grade in table["grade"]])
    reason = _SEPARATED if _is_separated(values, codes) else None
    if reason is not None:
        warnings.warn(reason, UndefinedStatisticWarning, stacklevel=2)
        n_values = len(used), len(used), len(grades) - 1
        fit, log_likelihood = [np.full(n, math.nan) for n in n_values], math.nan
    else:
        fit, log_likelihood = _fit(values, codes, raters.astype(np.int64))
    quantile = float(stdtrit(len(names) - 1, 0.5 + 0.5 * level))
    counts = np.bincount(codes)
    return GradeRegression(
        effects=_effects(used, scale, fit, quantile),
        dropped=tuple(dropped),
        thresholds=tuple(fit[2].tolist()),
        grades=grades,
        n_ratings=len(table),
        n_raters=len(names),
        n_models=table["model"].nunique(),
        n_missing=n_missing,
        log_likelihood=log_likelihood,
        log_likelihood_alone=float((counts * np.log(counts / counts.sum())).sum()),
        level=level,
        simulated=ratings.simulated,
        reason=reason,
    )


def _check_options(
    protocol: Protocol, predictors: Sequence[str], session: str | None, level: float
) -> None:
    known = {*PREDICTORS} >= {*predictors}
    sessions = [declared.id for declared in protocol.sessions]
    refuse(
        (
            not (known and predictors) or len({*predictors}) < len(predictors),
            f"predictors: need some of {', '.join(PREDICTORS)}, each once, got "
            f"{', '.join(predictors) or 'none'}",
        ),
        (
            not 0.5 < level < 1.0,
            f"level: needs more than 0.5 and less than 1, got {level}",
        ),
        (
            session is not None and session not in sessions,
            f"session: needs one of {', '.join(sessions)}, got {session!r}",
        ),
    )


def _predictor_table(
    protocol: Protocol,
    ratings: Ratings,
    predictors: Sequence[str],
    models: str,
    session: str | None,
) -> "tuple[DataFrame, int]":
    # every grade with its predictors beside it, and how many ratings lack some
    selected = {m.id: m for m in protocol.models if models in ("all", m.role)}
    table = ratings.table[ratings.table["model"].isin(selected)].copy()
    if session is not None:
        table = table[table["session"] == session].copy()
    for name in predictors:
        key = PREDICTORS[name][0]
        if name == "speed":
            table[name] = table[key]
            continue
        of_model = {m: getattr(selected[m], key) for m in selected}
        if name == "Q":  # one meaning, whichever way a model reads its Q
            joints = {m: joint_model(protocol, m) for m in selected}
            of_model = {
                m: joint.residual_share if isinstance(joint, ElbowParameters) else None
                for m, joint in joints.items()
            }
        # none of them is any of a model of another kind than the spastic elbow
        values = [of_model[model] for model in table["model"]]
        table[name] = np.array(values, dtype=np.float64)
    complete = table.dropna(subset=["grade", *predictors])
    return complete, len(table) - len(complete)


def _independent(
    table: "DataFrame", predictors: Sequence[str]
) -> tuple[list[str], list[tuple[str, str]]]:
    # the predictors that are no combination of earlier ones, and why others are out
    names: list[str] = []
    dropped: list[tuple[str, str]] = []
    basis = np.ones((len(table), 1))  # (n_ratings, n_names + 1)
    for name in predictors:
        column = table[name].to_numpy(dtype=np.float64)
        centred = column - column.mean()
        known = basis @ np.linalg.lstsq(basis, column, rcond=None)[0]
        size = float(np.linalg.norm(column))
        if np.linalg.norm(centred) <= 1e-9 * size:
            dropped.append((name, "it is the same in all ratings"))
        elif np.linalg.norm(column - known) <= 1e-9 * size:
            others = ", ".join(names)
            dropped.append((name, f"it is a combination of {others} in these ratings"))
        else:
            names.append(name)
            basis = np.column_stack([basis, centred / np.linalg.norm(centred)])
    if not names:
        raise RatingsError(f"predictors: {'; '.join(': '.join(d) for d in dropped)}")
    return names, dropped


def _effects(
    names: Sequence[str], scale: _Floats, fit: Sequence[_Floats], quantile: float
) -> tuple[Effect, ...]:
    # scale: standard deviation of each predictor; fit: β and its errors
    columns = (of.tolist() for of in (scale, *fit[:2]))
    return tuple(
        Effect(
            predictor=name,
            per=per,
            odds_ratio=_odds_ratio(value),
            coefficient=value,
            standard_error=error,
            low=_odds_ratio(value - quantile * error),
            high=_odds_ratio(value + quantile * error),
        )
        for name, per, value, error in zip(names, *columns, strict=True)
    )


def _is_separated(values: _Floats, codes: NDArray[np.int64]) -> bool:
    """Say whether the likelihood has no maximum, by a linear program."""
    # standardized predictors; grades, 0 for the least that was given
    # [1] Albert, A., Anderson, J. A. (1984). On the existence of maximum likelihood
    # estimates in logistic regression models. Biometrika, 71(1), 1-10.
    # https://doi.org/10.1093/biomet/71.1.1
    from scipy.optimize import linprog

    # A direction (β, τ) in which no rating's interval τ_(g-1) < x·β < τ_g shrinks at
    # either end, and some end moves away: then the likelihood grows without limit.
    n, p = values.shape
    n_thresholds = int(codes.max())
    upper, lower = codes < n_thresholds, codes > 0
    rows = np.zeros((int(upper.sum() + lower.sum()), p + n_thresholds))
    ends = int(upper.sum())
    rows[:ends, :p] = values[upper]
    rows[np.arange(ends), p + codes[upper]] = -1.0  # x·β ≤ τ_g
    rows[ends:, :p] = -values[lower]
    rows[np.arange(ends, rows.shape[0]), p + codes[lower] - 1] = 1.0
    optimum = linprog(
        rows.sum(axis=0),  # the smaller, the further the ends move away
        A_ub=rows,
        b_ub=np.zeros(rows.shape[0]),
        bounds=(-1.0, 1.0),
        method="highs",
    )
    return bool(optimum.fun < -1e-7 * n)


def _fit(
    values: _Floats, codes: NDArray[np.int64], raters: NDArray[np.int64]
) -> tuple[list[_Floats], float]:
    """Fit the regression by maximum likelihood."""
    # -> β and its standard errors, clustered by rater, and τ; the log-likelihood there
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    model = OrderedModel(codes, values, distr="logit")
    result = model.fit(method="bfgs", disp=False, gtol=1e-8, maxiter=1000)
    p, n_raters = values.shape[1], int(raters.max()) + 1
    thresholds = model.transform_threshold_params(result.params)[1:-1]
    estimate = np.concatenate([result.params[:p], thresholds])
    # The optimizer's derivatives are differences, which are right to some 8 digits and
    # depend on the processor. From there on Newton's steps by the exact ones double
    # the digits.
    for _ in range(3):
        scores, information = _derivatives(estimate, values, codes)
        estimate += np.linalg.solve(information, scores.sum(axis=0))
    scores, information = _derivatives(estimate, values, codes)
    sums = np.zeros((n_raters, estimate.size))
    np.add.at(sums, raters, scores)
    influences = np.linalg.solve(information, sums.T)  # (n_parameters, n_raters)
    errors = np.sqrt((influences**2).sum(axis=1) * n_raters / (n_raters - 1))
    return [estimate[:p], errors[:p], estimate[p:]], float(result.llf)


def _derivatives(
    estimate: _Floats, values: _Floats, codes: NDArray[np.int64]
) -> tuple[_Floats, _Floats]:
    """Return each rating's score and the observed information, in β and τ."""
    from scipy.special import expit

    # log P(grade) = log F(u) + log F(-l) + log(1 - exp(l - u)), with the ends
    # u = τ_g - x·β and l = τ_(g-1) - x·β, of which the outermost are infinite
    n, p = values.shape
    rows = np.arange(n)
    slopes = np.zeros((2, n, estimate.size + 2))  # of u and l; τ from -inf to inf
    slopes[:, :, :p] = -values
    slopes[0, rows, p + 1 + codes] = slopes[1, rows, p + codes] = 1.0
    slopes = np.delete(slopes, [p, -1], axis=2)
    ends = np.concatenate([[-np.inf], estimate[p:], [np.inf]]) - (
        values @ estimate[:p, None]
    )
    u, low = ends[rows, codes + 1], ends[rows, codes]
    with np.errstate(over="ignore"):  # a grade as wide as that has only its ends
        between = 1.0 / np.expm1(u - low)
        joint = 0.25 / np.sinh(0.5 * (u - low)) ** 2
    scores = np.einsum(
        "tn,tni->ni", [expit(-u) + between, -expit(low) - between], slopes
    )
    weights = [expit(u) * expit(-u), expit(low) * expit(-low), joint]
    terms = np.concatenate([slopes, slopes[:1] - slopes[1:]])
    return scores, np.einsum("tn,tni,tnj->ij", weights, terms, terms, optimize=True)


def _odds_ratio(coefficient: float) -> float:
    """Turn a coefficient into what it multiplies the odds by."""
    if coefficient > math.log(sys.float_info.max):
        return math.inf
    return math.exp(coefficient)
