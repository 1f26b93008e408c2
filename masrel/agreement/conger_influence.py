"""How much each item moves Conger's kappa, through every rater's own margins."""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._counts import distinct_rows, item_counts
from masrel.agreement._data import CodedRatings
from masrel.agreement._kernel import Floats, weighted_disagreement
from masrel.agreement.float_sums import cancelled
from masrel.agreement.tally import Observed
from masrel.agreement.weights import Weights

__all__ = ["Margins", "influence_squares"]

Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Margins:
    """Chance disagreement, Σ_{g≠h} Σ_kl v_kl p_gk p_hl / (r (r - 1)), in integers."""

    raters: list[int]  # columns that have ratings, g
    n_ratings: list[int]  # how many each, n_g
    multiple: int  # A multiple of every n_g
    shares: list[list[int]]  # (r, n_categories): p_gk times `multiple`
    # (r, n_categories): h_gk = Σ_l v_kl Σ_{h≠g} p_hl, times `multiple` and the weights'
    # denominator
    products: list[list[int]]
    # numerator, denominator: D_e
    numerator: int
    denominator: int

    @classmethod
    def of(cls, coded: CodedRatings, v: Weights) -> "Margins":
        """Sum the ratings of each rater."""
        q = coded.n_categories
        counts = [
            np.bincount(column[column >= 0], minlength=q).tolist()
            for column in coded.codes.T
        ]
        raters = [g for g, row in enumerate(counts) if any(row)]
        n_ratings = [sum(counts[g]) for g in raters]
        multiple = math.lcm(*n_ratings)
        shares = [
            [n * (multiple // n_g) for n in counts[g]]
            for g, n_g in zip(raters, n_ratings, strict=True)
        ]
        total = [sum(column) for column in zip(*shares, strict=True)] or [0] * q
        products = [
            v.products([t - p for t, p in zip(total, row, strict=True)])
            for row in shares
        ]
        r = len(raters)
        return cls(
            raters=raters,
            n_ratings=n_ratings,
            multiple=multiple,
            shares=shares,
            products=products,
            numerator=sum(
                sum([p * vp for p, vp in zip(row, of_row, strict=True)])
                for row, of_row in zip(shares, products, strict=True)
            ),
            denominator=max(r * (r - 1), 1) * multiple**2 * v.denominator,
        )

    def moves(self, n: int) -> list[list[Fraction]]:
        """Return what a rating of k by rater g moves D_e by, times n items."""
        # -> (r, n_categories)
        # (n/n_g) 2 (h_gk - Σ_l h_gl p_gl) / (r (r - 1)).
        found = []
        for n_g, shares, h in zip(
            self.n_ratings, self.shares, self.products, strict=True
        ):
            mean = sum([p * x for p, x in zip(shares, h, strict=True)])
            over = n_g * self.denominator
            found.append(
                [Fraction(2 * n * (x * self.multiple - mean), over) for x in h]
            )
        return found


def influence_squares(
    coded: CodedRatings,
    v: Weights,
    observed: Observed,
    margins: Margins,
    as_irrcac: bool,
) -> float:
    """Return Σ_i u_i² of Conger's kappa, u_i being n times what item i moves it by."""
    # With d_i an item's disagreement and s_i = 1 if it has a pair, D_e u_i = (D_o/D_e)
    # Σ_g moves_g - (n/n') (d_i - D_o s_i). In fractions where floats would cancel.
    rows, times = distinct_rows(coded.codes, coded.n_categories)
    rated = (rows >= 0).any(axis=1)
    rows, times, n = rows[rated], times[rated], coded.n_items
    d_o = Fraction(observed.numerator, observed.denominator)
    d_e = Fraction(margins.numerator, margins.denominator)
    moves = margins.moves(n)
    rate = Fraction(n, observed.n_usable)
    terms = _Terms(
        by_rating=[[d_o / d_e**2 * x for x in of_g] for of_g in moves],
        by_apart=-rate / d_e,
        of_pair=rate * d_o / d_e + (rate * (1 - d_o / d_e) if as_irrcac else 0),
        always=(d_o / d_e - 1) if as_irrcac else Fraction(0),
    )
    value, size = terms.in_floats(rows, v)
    if not cancelled(value, size, times):
        return float((times * value * value).sum())
    exact = zip(times.tolist(), terms.exact(rows, v), strict=True)
    return float(sum((often * u * u for often, u in exact), Fraction(0)))


@dataclass(frozen=True, slots=True)
class _Terms:
    # u_i = Σ_g by_rating[g][k_ig] + by_apart d_i + of_pair s_i + always
    by_rating: list[list[Fraction]]
    by_apart: Fraction
    of_pair: Fraction
    always: Fraction

    def in_floats(self, rows: Integers, v: Weights) -> tuple[Floats, Floats]:
        # (m, n_raters) -> u_i, and the sum of the absolute values of its terms, (m,)
        coded = CodedRatings(codes=rows, categories=tuple(range(v.n_categories)))
        counts = item_counts(coded).astype(np.float64)
        size = counts.sum(axis=1)
        usable = (size > 1).astype(np.float64)
        pairs = np.where(size > 1, size * (size - 1), 1.0)
        apart = usable * weighted_disagreement(counts, v.as_floats()) / pairs
        parts = [
            np.array([*map(float, of_g), 0.0])[column]  # missing, -1, is the last
            for column, of_g in zip(rows.T, self.by_rating, strict=True)
        ]
        parts += [float(self.by_apart) * apart, float(self.of_pair) * usable]
        parts.append(np.full(len(rows), float(self.always)))
        return np.sum(parts, axis=0), np.sum(np.abs(parts), axis=0)

    def exact(self, rows: Integers, v: Weights) -> list[Fraction]:
        found = []
        for row in rows.tolist():
            given = [(g, k) for g, k in enumerate(row) if k >= 0]
            u = self.always + sum((self.by_rating[g][k] for g, k in given), Fraction(0))
            n = len(given)
            if n > 1:
                counts = [0] * v.n_categories
                for _, k in given:
                    counts[k] += 1
                over = n * (n - 1) * v.denominator
                apart = Fraction(v.disagreement(counts, n), over)
                u += self.by_apart * apart + self.of_pair
            found.append(u)
        return found
