"""Would the model have made such ratings? The posterior predictive check."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.agreement._labels import Codes
from masrel.intervals.latent.traits import Traits

__all__ = ["PredictiveCheck", "predictive_checks", "replicate"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictiveCheck:
    """One property of the ratings beside what the model would have made of it."""

    name: str  # what it is
    observed: float  # in the ratings
    # low, high: central 95 % of ratings made anew by the same raters on the same items
    low: float
    high: float
    # share of those that are larger, with half of those that are equal. Near 0 or 1 the
    # model does not make ratings such as these.
    p_value: float


def predictive_checks(
    codes: Codes,
    traits: Traits,
    categories: Sequence[object],
    generator: np.random.Generator,
) -> tuple[PredictiveCheck, ...]:
    """Compare ratings with ratings made anew from the posterior."""
    # Takes codes (n_items, n_raters)
    made = np.where(codes >= 0, replicate(traits, generator), -1)
    n = len(categories)
    names = [
        "agreeing pairs",
        *(f"ratings of {category}" for category in categories),
        "spread of raters' mean grades",
        "spread of items' mean grades",
        "widest spread of the grades of an item",
        "widest distance of a rater from items' means",
    ]
    observed, anew = _properties(codes[None], n)[0], _properties(made, n)
    return tuple(
        PredictiveCheck(
            name=name,
            observed=float(value),
            low=float(np.quantile(drawn, 0.025)),
            high=float(np.quantile(drawn, 0.975)),
            p_value=float((drawn > value).mean() + 0.5 * (drawn == value).mean()),
        )
        for name, value, drawn in zip(names, observed, anew.T, strict=True)
    )


def replicate(traits: Traits, generator: np.random.Generator) -> NDArray[np.int64]:
    """Let the same raters rate the same items anew."""
    # -> (n, n_items, n_raters)
    perceived = traits.severity[:, :, None] + traits.bias[:, None, :]
    noise = generator.standard_normal(perceived.shape)
    perceived = perceived + traits.noise[:, None, :] * noise
    above = perceived[..., None] > traits.thresholds[:, None, None, :]
    return np.asarray(above.sum(axis=-1))


def _properties(codes: Codes, n_categories: int) -> Floats:
    # (n, n_items, n_raters) -> (n, n_categories + 5)
    given = codes >= 0
    counts = (codes[..., None] == np.arange(n_categories)).sum(axis=2)  # (n, items, q)
    rated = counts.sum(axis=2)
    pairs = (rated * (rated - 1)).sum(axis=1)
    grades = np.where(given, codes, 0)
    by_rater = grades.sum(axis=1) / given.sum(axis=1)  # each has a rating
    by_item = grades.sum(axis=2) / given.sum(axis=2)
    away = np.where(given, codes - by_item[:, :, None], 0.0) ** 2
    return np.column_stack(
        [
            (counts * (counts - 1)).sum(axis=(1, 2)) / pairs,
            counts.sum(axis=1),
            by_rater.std(axis=1),
            by_item.std(axis=1),
            np.sqrt(away.sum(axis=2) / given.sum(axis=2)).max(axis=1),
            np.sqrt(away.sum(axis=1) / given.sum(axis=1)).max(axis=1),
        ]
    )
