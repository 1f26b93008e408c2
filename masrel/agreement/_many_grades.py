"""Items of grades so many that counts of each would mostly be zeros.

In: coded ratings. Out: the sums that `_counts.DistinctItems` gives of counted items,
from the codes themselves: whole numbers without weights, floats with them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._counts import (
    CountedRatings,
    DistinctItems,
    Integers,
    ItemArrays,
    SizeGroup,
    SufficientStatistics,
    item_counts,
)
from masrel.agreement._data import CodedRatings, refuse_measurements
from masrel.agreement._distances import Codes, Differing, Floats
from masrel.agreement._weights import ManyWeights, Weights
from masrel.errors import ParameterError

_MEASURED = 1 << 12  # ratings from which on none may be alike
_BY_VALUE = ("linear", "quadratic", "ratio", "circular", "interval")
_MAX_PLACES = 1 << 27  # of a table of counts: more would not fit beside others


@dataclass(frozen=True, slots=True, eq=False)
class SparseCounts:
    """Counts of the categories of items, as the codes of their ratings."""

    codes: Codes  # (n_items, n_raters)

    def dot(self, vector: NDArray[Any]) -> NDArray[Any]:
        """Return Σ_k n_ik x_k, (n_items,)."""
        padded = np.append(vector, 0.0)  # missing, -1, is the last
        return np.asarray(padded[self.codes].sum(axis=1))

    def __getitem__(self, chosen: NDArray[np.bool_]) -> "SparseCounts":
        return SparseCounts(self.codes[chosen])


class ItemsOfManyGrades:
    """Items of many grades; those without ratings go."""

    def __init__(self, coded: CodedRatings) -> None:
        self.n_categories = len(coded.categories)
        self._coded = coded
        size = (coded.codes >= 0).sum(axis=1)
        self._codes, self._size = coded.codes, size
        if not size.all():
            self._codes, self._size = coded.codes[size > 0], size[size > 0]
        # of the weights that were last used: several sums are made of them
        self._last: tuple[Weights, Floats | Integers] | None = None
        self._counted: DistinctItems | None = None

    def sums(self, v: Weights) -> SufficientStatistics:
        """Add the items up."""
        if v.has_matrix:
            return self.counted.sums(v)
        if v.is_exact:
            refuse_measurements(self._coded)
        between, is_exact = self._disagreement(v), v.numerators is None
        groups, observed, n_usable = [], 0.0, 0
        shares = np.zeros(self.n_categories)
        for size in np.unique(self._size).tolist():
            same = self._size == size
            of_size = self._codes if same.all() else self._codes[same]
            rated = of_size[of_size >= 0]
            totals = np.bincount(rated, minlength=self.n_categories)
            disagreement = between[same].sum().item()
            shares += totals / size
            if size > 1:
                n_usable += len(of_size)
                observed += disagreement / (size * (size - 1))
            counted: Any = totals.tolist() if is_exact else totals.astype(np.float64)
            groups.append(SizeGroup(size, len(of_size), counted, disagreement))
        if is_exact:
            return DistinctItems([], [], self.n_categories, groups).sums(v)
        marginals: Any = shares
        n_rated = len(self._codes)
        return SufficientStatistics(
            groups, n_rated, n_usable, observed, n_usable, marginals, n_rated
        )

    def totals_of_pairs(self) -> Integers:
        """Count the ratings of each category in items with two or more."""
        codes = self._codes[self._size > 1]
        return np.bincount(codes[codes >= 0], minlength=self.n_categories)

    def arrays(self, v: Weights, _exact: bool) -> ItemArrays:
        """Return the items as floats."""
        if v.has_matrix:
            return self.counted.arrays(v, False)
        size: Any = self._size.astype(np.float64)
        if len(size) and (size == size[0]).all():
            size = float(size[0])
        counts: Any = SparseCounts(self._codes)
        disagreement = self._disagreement(v).astype(np.float64)
        return ItemArrays(counts, np.ones(len(self._codes)), size, disagreement)

    @property
    def counted(self) -> DistinctItems:
        """The same items as a table of counts."""
        if self._counted is None:
            n_places = len(self._codes) * self.n_categories
            if n_places > _MAX_PLACES:
                raise ParameterError(
                    f"ratings: {len(self._codes)} items of {self.n_categories} "
                    "different grades are too many for a table of counts, which this "
                    "statistic needs"
                )
            self._counted = DistinctItems.of_arrays(item_counts(self._coded))
        return self._counted

    @property
    def rows(self) -> Any:
        """Distinct rows of counts, (n_distinct, n_categories)."""
        return self.counted.rows

    @property
    def freq(self) -> Any:
        """How often each occurs, (n_distinct,)."""
        return self.counted.freq

    def _disagreement(self, v: Weights) -> Any:
        # Σ_kl v_kl n_ik n_il of each item
        if self._last is None or self._last[0] is not v:
            of_items: Floats | Integers
            if isinstance(v, ManyWeights):
                of_items = v.distances.of_items(self._codes)
            else:
                differing = Differing(self.n_categories).of_items(self._codes)
                of_items = differing.astype(np.int64)
            self._last = v, of_items
        return self._last[1]


def measurements(
    ratings: object, categories: object, weights: object
) -> CountedRatings | None:
    """Return an array of numbers no two of which are alike, as they are.

    None where they have to be sorted: there are others, or weights of their order.
    """
    if categories is not None or not isinstance(ratings, np.ndarray):
        return None
    if weights not in _BY_VALUE or ratings.dtype.kind != "f" or ratings.ndim != 2:
        return None
    first = ratings.ravel()[:_MEASURED]
    if ratings.size < _MEASURED or len(np.unique(first)) < _MEASURED // 2:
        return None
    rated = ~np.isnan(ratings)
    values = ratings[rated].astype(np.float64, copy=False)
    if not np.isfinite(values).all():
        return None
    ordered = np.sort(values)
    if (ordered[1:] == ordered[:-1]).any():
        return None
    codes = np.full(ratings.shape, -1, dtype=np.int32)
    codes[rated] = np.arange(values.size, dtype=np.int32)
    scale: Any = values
    coded = CodedRatings(codes=codes, categories=scale, declared=False)
    return CountedRatings(
        categories=scale,
        declared=False,
        items=ItemsOfManyGrades(coded),
        n_raters=coded.n_raters,
        source=coded,
    )
