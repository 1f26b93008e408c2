"""Sums of features where raters are resampled, none paired with a copy of itself.

They are in whole units and not in `WHOLE` parts, which ratios of them do not notice.
"""

import numpy as np

from masrel.agreement._engine import (
    CrossedSums,
    Floats,
    Integers,
    RaterSums,
    bilinear,
    over,
)
from masrel.agreement._labels import Codes

_BLOCK = 1 << 14  # items whose categories are spread out at once


def resampled_pooled(codes: Codes, freq: Integers, v: Floats) -> RaterSums:
    """Return sums of features as a function of how often each rater is taken."""
    # Items that the same raters rated are summed once, pair of raters by pair: Σ_i v of
    # their categories is a quadratic form in how often each rater is taken.
    patterns, kind = np.unique(codes >= 0, axis=0, return_inverse=True)
    groups = [
        (rated.astype(np.float64), *_rater_pairs(codes[same], freq[same], v))
        for rated, same in zip(
            patterns, kind.ravel() == np.arange(len(patterns))[:, None], strict=True
        )
    ]

    def sums(taken: Floats) -> Floats:
        # (..., n_raters) -> (..., 2 + n_categories)
        total = np.zeros((*taken.shape[:-1], 2 + len(v)), dtype=taken.dtype)
        for rated, n_items, disagreement, chosen in groups:
            of = taken * rated
            n = of.sum(axis=-1)
            # Pairs of a rater with its own copies always agree: they are left out.
            pairs = n * n - (of * of).sum(axis=-1)
            total[..., 0] += over((of @ disagreement * of).sum(axis=-1), pairs)
            total[..., 1] += n_items * (pairs != 0)
            total[..., 2:] += over(of @ chosen, n[..., None])
        return total

    return sums


def crossed_pooled(codes: Codes, v: Floats) -> CrossedSums:
    """Return the same as a function of how often each row and each rater is taken."""
    each = (codes[:, :, None] == np.arange(len(v))).astype(np.float64)
    rated = (codes >= 0).astype(np.float64)  # (n_rows, n_raters)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (n, n_rows), (n, n_raters) -> (n, 2 + n_categories)
        counts = np.tensordot(raters, each, axes=(1, 1))  # (n, n_rows, n_categories)
        n = counts.sum(axis=-1)
        # Copies of a rater agree, and disagree in nothing: only their number goes.
        pairs = n * n - raters**2 @ rated.T
        features = np.empty((*n.shape, 2 + len(v)))
        features[..., 0] = over(bilinear(counts, v, counts), pairs)
        features[..., 1] = pairs != 0
        features[..., 2:] = over(counts, n[..., None])
        return np.asarray(np.einsum("np,npf->nf", rows, features))

    return sums


def _rater_pairs(codes: Codes, freq: Integers, v: Floats) -> tuple[int, Floats, Floats]:
    # how many items; Σ_i v of two raters' categories, (n_raters, n_raters); how often
    # each rater chose each category, (n_raters, n_categories)
    n_items, n_raters = codes.shape
    side = (n_raters, len(v))
    both = np.zeros(side * 2)
    chosen = np.zeros(side)
    for start in range(0, n_items, _BLOCK):
        block = slice(start, start + _BLOCK)
        each = (codes[block, :, None] == np.arange(len(v))).astype(np.float64)
        weighed = each * freq[block, None, None]
        flat = weighed.reshape(len(each), -1).T @ each.reshape(len(each), -1)
        both += flat.reshape(side * 2)
        chosen += weighed.sum(axis=0)
    return int(freq.sum()), np.einsum("rksl,kl->rs", both, v), chosen


def resampled_conger(codes: Codes, freq: Integers, v: Floats) -> RaterSums:
    """Return the same for Conger's kappa."""
    pooled, n_ratings, chosen = resampled_pooled(codes, freq, v), *_marginals(codes, v)

    def sums(taken: Floats) -> Floats:
        # (..., n_raters) -> (..., 2 + n_raters (1 + n_categories))
        of_raters = taken[..., None] * (freq @ chosen).reshape(n_ratings.shape[1], -1)
        n = np.broadcast_to(freq @ n_ratings, taken.shape)
        return _joined(pooled(taken), n, of_raters)

    return sums


def crossed_conger(codes: Codes, v: Floats) -> CrossedSums:
    """Return the same for Conger's kappa."""
    pooled, n_ratings, chosen = crossed_pooled(codes, v), *_marginals(codes, v)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (n, n_rows), (n, n_raters) -> (n, 2 + n_raters (1 + n_categories))
        of_raters = raters[..., None] * (rows @ chosen).reshape(*raters.shape, -1)
        return _joined(pooled(rows, raters), rows @ n_ratings, of_raters)

    return sums


def _marginals(codes: Codes, v: Floats) -> tuple[Floats, Floats]:
    # whether each rater rated, (n_rows, n_raters), and which category each chose,
    # (n_rows, n_raters n_categories)
    chosen = codes[:, :, None] == np.arange(len(v))
    rated = codes >= 0
    return rated.astype(np.float64), chosen.reshape(
        len(rated), rated.shape[1] * len(v)
    ).astype(np.float64)


def _joined(pooled: Floats, n_ratings: Floats, chosen: Floats) -> Floats:
    # pooled (..., 2 + n_categories), n_ratings (..., n_raters), and what each rater
    # chose, (..., n_raters, n_categories), to sums of Conger's features
    flat = chosen.reshape(*pooled.shape[:-1], -1)
    return np.concatenate((pooled[..., :2], n_ratings, flat), axis=-1)
