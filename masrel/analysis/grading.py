"""What grades follow: ordered regression on a model's parameters and the speed.

The source left this as future work: "whether the parameters can be used as
quantitative measures indicating the degree of spasticity" (section V).
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from masrel.analysis.ordinal import (
    OrdinalData,
    OrdinalFit,
    fit_ordinal,
    is_separated,
    odds_ratio,
)
from masrel.analysis.predictors import PREDICTORS, independent, ratings_with
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.protocol import Protocol
from masrel.ratings import Ratings

__all__ = ["Effect", "GradeRegression", "grade_regression"]

SEPARATED = (
    "these predictors separate some grades from others without a miss, so that the "
    "likelihood has no maximum; fewer predictors, or more raters, may help"
)
"""Why a regression has no values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """What one predictor does to the grade, the others held."""

    predictor: str  # its name, of `PREDICTORS`
    # one standard deviation of it among the ratings, in its unit: the step that the
    # odds ratio is for
    per: float
    # by how much that step multiplies the odds of a higher grade; ``nan`` when
    # undefined
    odds_ratio: float
    # coefficient, standard_error: its logarithm, with an error clustered by rater
    coefficient: float
    standard_error: float
    # low, high: confidence interval of the odds ratio, from t with raters - 1 degrees
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeRegression:
    """An ordered logistic regression of grades."""

    effects: tuple[Effect, ...]  # one a predictor that is in the regression
    # predictors that are not, each with the reason
    dropped: tuple[tuple[str, str], ...]
    # where one grade turns into the next, on the scale of the coefficients
    thresholds: tuple[float, ...]
    grades: tuple[str, ...]  # the grades that were given, in order
    # n_ratings, n_raters, n_models, n_missing: ratings used, of how many raters and
    # models; ratings without a grade or speed, left out
    n_ratings: int
    n_raters: int
    n_models: int
    n_missing: int
    # log_likelihood, log_likelihood_alone: of the regression, and of the thresholds
    # without any predictor
    log_likelihood: float
    log_likelihood_alone: float
    level: float  # level of the intervals
    simulated: bool  # whether any rating is simulated
    reason: str | None = None  # why there are no values, or None


def grade_regression(
    protocol: Protocol,
    ratings: Ratings,
    *,
    predictors: Sequence[str] = tuple(PREDICTORS),
    models: Literal["standard", "dummy", "all"] = "all",
    session: str | None = None,
    level: float = 0.95,
) -> GradeRegression:
    """Regress grades on L, H, Q, D and the stretching speed."""
    # P(grade ≤ g) = 1/(1 + exp(x·β - τ_g)), by maximum likelihood (statsmodels,
    # `OrderedModel`). Whether a maximum exists is settled first, by a linear program:
    # it does not if some direction of β and τ makes no rating less likely [1]_. Models
    # on straight lines between others, as dummies are, do not help to tell L, H, Q and
    # D apart: they lie in the space of those at the ends.
    # [1] Albert, A., Anderson, J. A. (1984). On the existence of maximum likelihood
    # estimates in logistic regression models. Biometrika, 71(1), 1-10.
    # https://doi.org/10.1093/biomet/71.1.1
    _check_options(predictors, level)
    table, n_missing = ratings_with(protocol, ratings, predictors, models, session)
    grades = tuple(g for g in ratings.scale.grades if (table["grade"] == g).any())
    data, dropped, scale = _standardized(table, grades, predictors)
    reason = None
    if is_separated(data):
        reason = SEPARATED
        warnings.warn(reason, UndefinedStatisticWarning, stacklevel=2)
    found = _nothing(data) if reason else fit_ordinal(data)
    counts = np.bincount(data.codes)
    return GradeRegression(
        effects=_effects(found, scale, int(data.raters.max()) + 1, level),
        dropped=dropped,
        thresholds=tuple(found.thresholds.tolist()),
        grades=grades,
        n_ratings=len(table),
        n_raters=table["rater"].nunique(),
        n_models=table["model"].nunique(),
        n_missing=n_missing,
        log_likelihood=found.log_likelihood,
        log_likelihood_alone=float((counts * np.log(counts / counts.sum())).sum()),
        level=level,
        simulated=ratings.simulated,
        reason=reason,
    )


def _check_options(predictors: Sequence[str], level: float) -> None:
    unknown = [name for name in predictors if name not in PREDICTORS]
    if unknown or not predictors or len(set(predictors)) < len(predictors):
        raise ParameterError(
            f"predictors: need some of {', '.join(PREDICTORS)}, each once, got "
            f"{', '.join(predictors) or 'none'}"
        )
    if not 0.5 < level < 1.0:
        raise ParameterError(f"level: needs more than 0.5 and less than 1, got {level}")


def _standardized(
    table: pd.DataFrame, grades: tuple[str, ...], predictors: Sequence[str]
) -> tuple[OrdinalData, tuple[tuple[str, str], ...], dict[str, float]]:
    # what is regressed, what is dropped and why, and the standard deviations
    n_raters = table["rater"].nunique()
    if len(grades) < 2 or n_raters < 2:
        raise RatingsError(
            "a regression of grades needs two grades and two raters or more, got "
            f"{len(grades)} and {n_raters} in {len(table)} ratings with every predictor"
        )
    kept, dropped = independent(table, predictors)
    values = table[kept].to_numpy(dtype=np.float64)
    scale = values.std(axis=0, ddof=1)
    data = OrdinalData(
        values=(values - values.mean(axis=0)) / scale,
        codes=np.array([grades.index(g) for g in table["grade"]]),
        raters=pd.factorize(table["rater"])[0].astype(np.int64),
    )
    return data, tuple(dropped), dict(zip(kept, scale.tolist(), strict=True))


def _nothing(data: OrdinalData) -> OrdinalFit:
    n_predictors = data.values.shape[1]
    return OrdinalFit(
        coefficients=np.full(n_predictors, math.nan),
        covariance=np.full((n_predictors, n_predictors), math.nan),
        thresholds=np.full(int(data.codes.max()), math.nan),
        log_likelihood=math.nan,
    )


def _effects(
    found: OrdinalFit, scale: Mapping[str, float], n_raters: int, level: float
) -> tuple[Effect, ...]:
    quantile = float(stdtrit(n_raters - 1, 0.5 + 0.5 * level))
    errors = np.sqrt(np.diag(found.covariance)).tolist()
    return tuple(
        Effect(
            predictor=name,
            per=per,
            odds_ratio=odds_ratio(value),
            coefficient=value,
            standard_error=error,
            low=odds_ratio(value - quantile * error),
            high=odds_ratio(value + quantile * error),
        )
        for (name, per), value, error in zip(
            scale.items(), found.coefficients.tolist(), errors, strict=True
        )
    )
