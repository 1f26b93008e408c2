"""Kappa of thousands of studies at once, with all that intervals are made of."""

from dataclasses import dataclass, field

import numpy as np

from docs.make.coverage.studies import Codes, Floats, Studies

_FIELDS = ("value", "error", "without_item", "without_rater", "of_cells")


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Fleiss' kappa of studies and how far it changes when something is left out.

    `value`, the delta method's `error` and `of_cells` have shape (n_studies,);
    `without_item` (n_studies, n_items) and `without_rater` (n_studies, n_raters) are
    kappa with one left out. ``nan`` where undefined.
    """

    value: Floats
    error: Floats
    without_item: Floats = field(repr=False)
    without_rater: Floats = field(repr=False)
    of_cells: Floats
    """The part of a rater's rating of an item that both jackknives hold."""

    @property
    def n_items(self) -> int:
        """Items of a study."""
        return int(self.without_item.shape[1])

    @property
    def n_raters(self) -> int:
        """Raters of a study."""
        return int(self.without_rater.shape[1])

    @property
    def of_items(self) -> Floats:
        """Jackknife variance over items."""
        return (self.n_items - 1) * np.asarray(self.without_item.var(axis=1))

    @property
    def of_raters(self) -> Floats:
        """Jackknife variance over raters."""
        return (self.n_raters - 1) * np.asarray(self.without_rater.var(axis=1))


def spread_of(studies: Studies) -> Spread:
    """Compute it in slices that fit into the cache of a processor."""
    weight = studies.codes.size * studies.n_categories
    parts = np.array_split(studies.codes, -(-weight // 1_000_000))
    computed = [_spread(part, studies.n_categories) for part in parts]
    joined = {
        f: np.concatenate([getattr(part, f) for part in computed]) for f in _FIELDS
    }
    return Spread(**joined)


def _spread(codes: Codes, n_categories: int) -> Spread:
    # s studies, n items, r raters, k categories
    n, r = codes.shape[1:]
    chosen = (codes[..., None] == np.arange(n_categories)).astype(np.float64)
    counts = chosen.sum(axis=2)  # (s, n, k)
    totals = counts.sum(axis=1)  # (s, k)
    of_rater = chosen.sum(axis=1)  # (s, r, k)
    pairs = (counts**2).sum(axis=-1) - r  # agreeing ordered pairs of an item, (s, n)
    partners = (chosen * (counts[:, :, None] - 1.0)).sum(axis=-1)  # (s, n, r)
    agreeing = pairs.sum(axis=1)
    value = _kappa(agreeing, totals, n, r)
    items = _kappa(agreeing[:, None] - pairs, totals[:, None] - counts, n - 1, r)
    left = agreeing[:, None] - 2.0 * partners.sum(axis=1)  # (s, r)
    raters = _kappa(left, totals[:, None] - of_rater, n, r - 1)
    both = left[:, None] - pairs[:, :, None] + 2.0 * partners
    rest = (totals[:, None] - counts)[:, :, None] - of_rater[:, None] + chosen
    of_cell = _kappa(both, rest, n - 1, r - 1) - items[:, :, None] - raters[:, None]
    of_cell = of_cell + value[:, None, None]
    return Spread(
        value=value,
        error=_delta(value, pairs, counts),
        without_item=items,
        without_rater=raters,
        of_cells=(n - 1) * (r - 1) / (n * r) * (of_cell**2).sum(axis=(1, 2)),
    )


def _kappa(pairs: Floats, totals: Floats, n: int, r: int) -> Floats:
    # agreeing ordered pairs (...), totals of categories (..., k)
    if r < 2:
        return np.full(pairs.shape, np.nan)
    chance = (n * r) ** 2 - (totals**2).sum(axis=-1)  # differing, by chance
    differing = n * r * (r - 1) - pairs
    with np.errstate(divide="ignore", invalid="ignore"):
        kappa = 1.0 - differing * (n * r) / (chance * (r - 1))
    return np.where(chance > 0.0, kappa, np.nan)


def _delta(value: Floats, pairs: Floats, counts: Floats) -> Floats:
    # Gwet (2014): an item's own agreement, and what it adds to chance agreement
    n, r = pairs.shape[1], counts[0, 0].sum()
    shares = counts.mean(axis=1) / r  # (s, k)
    chance = (shares**2).sum(axis=-1)[:, None]
    towards = np.einsum("sik,sk->si", counts, shares) / r
    with np.errstate(divide="ignore", invalid="ignore"):
        influence = (pairs / (r * (r - 1)) - chance) / (1.0 - chance)
        influence -= 2.0 * (1.0 - value[:, None]) * (towards - chance) / (1.0 - chance)
    return np.asarray(influence.std(axis=1, ddof=1) / np.sqrt(n))
