"""Reference data sets: those of the project, and those named by the environment."""

import functools
import json
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import COEFFICIENTS, krippendorff_alpha
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate

Dataset = dict[str, Any]
Check = Callable[[Dataset, str], None]

FILE = Path(__file__).parents[1] / "oracles" / "agreement.json"
# Data sets that ship with R packages stay outside the project.
OUTSIDE = os.environ.get("MASREL_ORACLE_PACKAGES")


def datasets() -> list[Dataset]:
    """Read every data set there is."""
    found: list[Dataset] = json.loads(FILE.read_text(encoding="utf-8"))["datasets"]
    if OUTSIDE:
        found += json.loads(Path(OUTSIDE).read_text(encoding="utf-8"))["datasets"]
    return found


def by_dataset(*names: str, field: str) -> Callable[[Check], Callable[[str], None]]:
    """Check every expected field of these coefficients, one test a data set."""
    import pytest

    found: dict[str, list[tuple[Dataset, str]]] = {}
    for dataset in datasets():
        for key, expected in dataset["expected"].items():
            if key.partition("/")[0] in names and "@" not in key and field in expected:
                found.setdefault(dataset["name"], []).append((dataset, key))

    def as_test(check: Check) -> Callable[[str], None]:
        @pytest.mark.parametrize("name", found)
        @functools.wraps(check)
        def test(name: str) -> None:
            for dataset, key in found[name]:
                check(dataset, key)

        del test.__wrapped__  # whose parameters are no fixtures
        return test

    return as_test


def estimate(dataset: Dataset, key: str, **options: Any) -> Estimate:
    """Estimate what a key such as ``"fleiss_kappa/linear"`` names."""
    name, _, weights = key.partition("/")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        if name == "krippendorff_alpha_metric":
            labels = dataset.get("categories")
            if labels is None:
                return krippendorff_alpha(values(dataset), metric=weights)  # type: ignore[arg-type]
            # The reference takes the values of the categories, text ones by rank.
            return krippendorff_alpha(
                dataset["ratings"],
                categories=labels,
                metric=weights,  # type: ignore[arg-type]
            )
        return COEFFICIENTS[name].function(
            dataset["ratings"],
            categories=dataset.get("categories"),
            weights="identity" if weights == "unweighted" else weights,
            **options,
        )


def values(dataset: Dataset) -> NDArray[np.float64]:
    """Return ratings as the values of their categories, missing as nan."""
    labels, numbers = dataset.get("categories"), dataset.get("category_values")
    value = dict(zip(labels, numbers, strict=True)) if labels and numbers else None
    return np.array(
        [
            [np.nan if g is None else float(value[g] if value else g) for g in row]
            for row in dataset["ratings"]
        ]
    )
