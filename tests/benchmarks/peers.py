"""The same coefficient by other packages, as each of them takes ratings."""

from collections.abc import Callable
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int64]


def statsmodels_fleiss(codes: Codes) -> float:
    """statsmodels: count the raters of each category, then kappa."""
    from statsmodels.stats.inter_rater import aggregate_raters, fleiss_kappa

    return float(fleiss_kappa(aggregate_raters(codes)[0]))


def krippendorff_alpha(codes: Codes) -> float:
    """The package krippendorff: nominal alpha, raters in rows."""
    import krippendorff

    return float(
        krippendorff.alpha(
            reliability_data=codes.T.astype(float), level_of_measurement="nominal"
        )
    )


def irrcac_fleiss(codes: Codes) -> float:
    """irrCAC: kappa with its standard error, rounded to five decimals."""
    import pandas as pd
    from irrCAC.raw import CAC

    found = CAC(pd.DataFrame(codes)).fleiss()
    return float(found["est"]["coefficient_value"])


def sklearn_cohen(codes: Codes) -> float:
    """scikit-learn: Cohen's kappa of two raters."""
    from sklearn.metrics import cohen_kappa_score

    return float(cohen_kappa_score(codes[:, 0], codes[:, 1]))


PEERS: dict[str, Callable[[Codes], float]] = {
    "statsmodels": statsmodels_fleiss,
    "krippendorff": krippendorff_alpha,
    "irrCAC": irrcac_fleiss,
}


def present(names: list[str]) -> dict[str, str]:
    """Return the versions of those packages that are installed."""
    found: dict[str, str] = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def made(rng: np.random.Generator, n_items: int, n_raters: int, q: int = 5) -> Any:
    """Draw ratings of some agreement: an item has a grade that 7 of 10 raters see."""
    truth = rng.integers(1, q + 1, (n_items, 1))
    seen = rng.random((n_items, n_raters)) < 0.7
    return np.where(seen, truth, rng.integers(1, q + 1, (n_items, n_raters)))
