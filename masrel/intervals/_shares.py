"""Intervals of shares whose parts come in items: exact ones at an effective size."""

from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats, divide

# [1] Korn, E. L., Graubard, B. I. (1998). Confidence intervals for proportions with
# small expected number of positive counts estimated from survey data. Survey
# Methodology 24, 193-201.


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemShares:
    """Sums over items of parts a of wholes b; an array has one for each share."""

    parts: Floats = field(compare=False, repr=False)  # Σ a
    wholes: Floats = field(compare=False, repr=False)  # Σ b
    squares: Floats = field(compare=False, repr=False)  # Σ a²
    products: Floats = field(compare=False, repr=False)  # Σ ab
    whole_squares: Floats = field(compare=False, repr=False)  # Σ b²
    n_items: Floats = field(compare=False, repr=False)  # those with b > 0

    def interval(self, level: float) -> tuple[Floats, Floats]:
        """Return Clopper and Pearson's intervals at the effective size [1]."""
        from scipy.special import betaincinv, stdtrit

        share = divide(self.parts, self.wholes)
        # Σa/Σb = s varies by Σ (a - s b)² / (Σb)², that of m single ones by s(1 - s)/m
        variance = divide(
            self.squares
            - 2.0 * share * self.products
            + share * share * self.whole_squares,
            self.wholes**2,
        )
        varies = variance > 1e-12 * share * (1.0 - share)
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.where(varies, share * (1.0 - share) / variance, self.n_items)
            # the variance is known from the items: by t, not from as many single ones
            upper = 0.5 + 0.5 * level
            many = stdtrit(np.maximum(self.wholes - 1.0, 1.0), upper)
            few = stdtrit(np.maximum(self.n_items - 1.0, 1.0), upper)
            size = np.minimum(size * (many / few) ** 2, self.wholes)
            x = share * size
            low = betaincinv(np.maximum(x, 1e-300), size - x + 1.0, 1.0 - upper)
            high = betaincinv(x + 1.0, np.maximum(size - x, 1e-300), upper)
        low = np.where(share <= 0.0, 0.0, low)
        high = np.where(share >= 1.0, 1.0, high)
        none = np.isnan(share)
        return np.where(none, np.nan, low), np.where(none, np.nan, high)
