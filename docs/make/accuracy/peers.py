"""The same coefficients by other packages, each asked as its documentation says."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.accuracy.cases import METRICS, OF_PAIRS, Case

_MOST_ROWS = 10**7  # items that are written out one by one
# irrCAC rounds its results, to 5 decimals unless told otherwise, and cannot be told
# not to; to so many it moves a float by one unit in the last place at most.
_DECIMALS = 100


@dataclass(frozen=True)
class Answer:
    """What a package says; a note where it says nothing."""

    value: float | None = None
    standard_error: float | None = None
    over_n: bool = False  # the squares over n items, and not over n - 1
    other_error: bool = False  # it estimates the standard error in another way
    note: str = ""


class NotOfferedError(Exception):
    """The package has no such coefficient, or not with these weights."""


class NoAnswerError(Exception):
    """The package cannot be given these ratings."""


def ask(package: str, case: Case, name: str, weights: str) -> Answer:
    """Ask a package, whatever becomes of it."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return PACKAGES[package](case, name, weights)
    except NotOfferedError:
        return Answer(note="not offered")
    except NoAnswerError as reason:
        return Answer(note=f"no answer: {reason}")
    except Exception as error:  # noqa: BLE001 - any failure of a peer is a finding
        return Answer(note=f"crash: {type(error).__name__}")


def offers_errors(package: str, name: str) -> bool:
    """Tell whether a package offers standard errors of a coefficient."""
    return package == "irrCAC" or (package, name) == ("statsmodels", "cohen_kappa")


def _statsmodels(case: Case, name: str, weights: str) -> Answer:
    from statsmodels.stats.inter_rater import cohens_kappa, fleiss_kappa

    if name == "cohen_kappa" and weights in ("identity", "linear", "quadratic"):
        how = {}
        if weights != "identity":
            how = {"wt": weights, "weights": np.array(case.scale)}
        result = cohens_kappa(_table(case), **how)
        return Answer(float(result.kappa), float(result.std_kappa), over_n=True)
    methods = {"fleiss_kappa": "fleiss", "brennan_prediger": "uniform"}
    if weights != "identity" or name not in methods:
        raise NotOfferedError
    return Answer(float(fleiss_kappa(_counts(case), methods[name])))


def _scikit_learn(case: Case, name: str, weights: str) -> Answer:
    from sklearn.metrics import cohen_kappa_score

    if name != "cohen_kappa" or weights not in ("identity", "linear", "quadratic"):
        raise NotOfferedError
    if weights != "identity" and case.values:  # it weighs by position alone
        raise NotOfferedError
    cells = _table(case)
    first, second = np.indices(cells.shape).reshape(2, -1)
    kappa = cohen_kappa_score(
        first,
        second,
        labels=list(range(len(case.scale))),
        weights=None if weights == "identity" else weights,
        sample_weight=cells.ravel(),
    )
    return Answer(float(kappa))


def _krippendorff(case: Case, name: str, weights: str) -> Answer:
    import krippendorff

    level = METRICS.get(weights, "nominal")
    if name != "krippendorff_alpha" or weights not in ("identity", *METRICS):
        raise NotOfferedError
    alpha = krippendorff.alpha(
        value_counts=_counts(case).astype(np.float64),  # its integers overflow
        value_domain=np.array(case.scale, dtype=np.float64),
        level_of_measurement=level,
    )
    return Answer(float(alpha))


_OF_RATINGS = {
    "fleiss_kappa": "fleiss",
    "brennan_prediger": "bp",
    "gwet_ac": "gwet",
    "krippendorff_alpha": "krippendorff",
    "conger_kappa": "conger",
}
_OF_TABLES = {
    "percent_agreement": "pa2",
    "brennan_prediger": "bp",
    "gwet_ac": "gwet",
    "krippendorff_alpha": "krippendorff",
    "cohen_kappa": "cohen",
    "scott_pi": "scott",
}


def _irrcac(case: Case, name: str, weights: str) -> Answer:
    if weights in METRICS:
        raise NotOfferedError
    # it weighs the categories of a table by position alone
    by_position = weights == "identity" or not case.values
    if name in OF_PAIRS or (case.table and name in _OF_TABLES and by_position):
        if not by_position:
            raise NotOfferedError
        return _irrcac_of_table(case, name, weights)
    import pandas as pd
    from irrCAC.raw import CAC

    if name not in _OF_RATINGS:
        raise NotOfferedError
    ratings = CAC(
        pd.DataFrame(_labels(case)),
        weights=weights,
        categories=list(case.scale),
        digits=_DECIMALS,
    )
    single = any(sum(item.counts.values()) == 1 for item in case.items)
    return _of_dict(getattr(ratings, _OF_RATINGS[name])(), name, single=single)


def _irrcac_of_table(case: Case, name: str, weights: str) -> Answer:
    import pandas as pd
    from irrCAC.table import CAC

    table = CAC(pd.DataFrame(_table(case)), weights=weights, digits=_DECIMALS)
    return _of_dict(getattr(table, _OF_TABLES[name])(), name, over_n=True)


def _of_dict(
    result: dict[str, Any], name: str, *, over_n: bool = False, single: bool = False
) -> Answer:
    value, error = (
        np.asarray(result["est"][key]).item() for key in ("coefficient_value", "se")
    )
    # of alpha it leaves out what the n - 1 ratings move; single ratings it counts as
    # items of no agreement
    other = name == "krippendorff_alpha" or single
    return Answer(value, error, over_n=over_n, other_error=other)


def _table(case: Case) -> NDArray[np.int64]:
    # items per pair of categories, of two raters
    if case.table:
        return np.array(case.table)
    cells = np.zeros((len(case.scale),) * 2, dtype=np.int64)
    for row, freq in case.rows:
        if None not in row:
            cells[row] += freq
    return cells


def _counts(case: Case) -> NDArray[np.int64]:
    # raters per item and category, a row for each item
    if case.counts:
        return np.array(case.counts)
    freq = [item.times for item in case.items]
    if sum(freq) > _MOST_ROWS:
        raise NoAnswerError("a row per item")
    rows = np.zeros((len(freq), len(case.scale)), dtype=np.int64)
    for at, item in enumerate(case.items):
        for code, n in item.counts.items():
            rows[at, code] = n
    return np.repeat(rows, freq, axis=0)


def _labels(case: Case) -> NDArray[Any]:
    # every item's labels, rater by rater
    if case.counts:
        raise NoAnswerError("a column per rater")
    if sum(item.times for item in case.items) > _MOST_ROWS:
        raise NoAnswerError("a row per item")
    if case.rows:
        return case.labels()
    pairs = np.array([item.raters for item in case.items], dtype=np.intp)
    freq = [item.times for item in case.items]
    return np.repeat(np.array(case.scale)[pairs], freq, axis=0)


PACKAGES: dict[str, Callable[[Case, str, str], Answer]] = {
    "statsmodels": _statsmodels,
    "irrCAC": _irrcac,
    "scikit-learn": _scikit_learn,
    "krippendorff": _krippendorff,
}
