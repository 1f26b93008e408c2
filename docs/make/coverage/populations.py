"""Populations whose coefficients are known, to draw studies of other items from.

A population is kinds of items, how frequent each is, and how every rater grades it.
What is true of a coefficient is computed from the pairs of raters, not by the package.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri, roots_jacobi

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]
Shares = tuple[float, ...]
"""Shares of the grades, in their order."""

MISSING = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Population:
    """Kinds of items, (n_kinds,), and chances of grades, (n_kinds, n_raters, q)."""

    kinds: Floats = field(repr=False)
    chances: Floats = field(repr=False)
    p_missing: float = 0.0  # of every rating by itself
    n_drawn: int | None = None  # raters drawn of these, with replacement, in each study
    are_fixed: bool = False  # every study has all these items, once each

    def draw(self, n_items: int, rng: np.random.Generator) -> Codes:
        """Draw the ratings of a study, (n_items, n_raters)."""
        of_items = self.chances
        if not self.are_fixed:
            of_items = of_items[rng.choice(self.kinds.size, n_items, p=self.kinds)]
        if self.n_drawn is not None:
            of_items = of_items[:, rng.integers(of_items.shape[1], size=self.n_drawn)]
        up_to = of_items.cumsum(axis=-1)[..., :-1]
        uniform = rng.random((*of_items.shape[:2], 1))
        codes = (uniform >= up_to).sum(axis=-1).astype(np.int8)
        codes[rng.random(codes.shape) < self.p_missing] = MISSING
        return codes

    def truth(self, coefficient: str, weights: str = "identity") -> float:
        """Return the coefficient of all items and these raters, or all such raters."""
        # ratings are missing of every rater alike, and leave it as it is
        chances = self.chances
        if self.n_drawn is not None:
            # two raters drawn are independent, and each grades as raters do in the mean
            chances = chances.mean(axis=1, keepdims=True).repeat(2, axis=1)
        q = chances.shape[-1]
        apart = np.abs(np.subtract.outer(np.arange(q), np.arange(q))) / (q - 1)
        v = apart**2 if weights == "quadratic" else np.ceil(apart)
        by_rater = np.einsum("s,srk->rk", self.kinds, chances)
        is_pair = ~np.eye(len(by_rater), dtype=bool)
        together = np.einsum("s,sik,sjk->ij", self.kinds, chances @ v, chances)
        observed = together[is_pair].mean()
        of_pairs = (by_rater @ v @ by_rater.T)[is_pair].mean()
        shares = by_rater.mean(axis=0)
        chance = {
            "percent_agreement": 1.0,
            "brennan_prediger": v.mean(),
            "conger_kappa": of_pairs,
            "cohen_kappa": of_pairs,
            "gwet_ac": 1.0
            - (1.0 - v).sum() * (shares * (1.0 - shares)).sum() / (q * (q - 1)),
        }.get(coefficient, shares @ v @ shares)
        return float(1.0 - observed / chance)

    def with_items_fixed(self, n_items: int) -> "Population":
        """Return so many items, of each kind in proportion, the same in all studies."""
        places = (np.arange(n_items) + 0.5) / n_items
        of_items = self.chances[np.searchsorted(self.kinds.cumsum(), places)]
        kinds = np.full(n_items, 1.0 / n_items)
        return replace(self, kinds=kinds, chances=of_items, are_fixed=True)


def dirichlet_multinomial(shares: Shares, kappa: float, n_raters: int) -> Population:
    """Return raters alike: an item's chances of the grades are Dirichlet."""
    kinds, chances = np.ones(1), np.ones((1, 0))
    a = np.array(shares) * (1.0 / kappa - 1.0)
    # grade by grade, each a Beta share of what those before leave
    n_nodes = max(round(200 ** (1.0 / (len(shares) - 1))), 12)
    for k in range(len(shares) - 1):
        x, weight = roots_jacobi(n_nodes, a[k + 1 :].sum() - 1.0, a[k] - 1.0)
        share = np.tile(0.5 * (1.0 + x), kinds.size)
        left = np.repeat(1.0 - chances.sum(axis=1), n_nodes)
        kinds = np.outer(kinds, weight / weight.sum()).ravel()
        chances = np.column_stack([np.repeat(chances, n_nodes, axis=0), left * share])
    rest = 1.0 - chances.sum(axis=1)
    grades = np.column_stack([chances, np.maximum(rest, 0.0)])
    return Population(kinds=kinds, chances=np.repeat(grades[:, None], n_raters, axis=1))


def latent_trait(
    shares: Shares,
    kappa: float,
    n_raters: int,
    bias: float = 0.5,
    n_drawn: int | None = None,
) -> Population:
    """Return raters who see a severity, N(0, 1), with bias and noise, and cut it.

    Biases are evenly spaced quantiles with a standard deviation of `bias` that of the
    noise, which is such that Fleiss' kappa is `kappa`.
    """
    # the trapezoid rule under the normal density: 1e-9 off for noise of a step
    severity = np.arange(-7.0, 7.04, 0.08)
    kinds = np.exp(-0.5 * severity**2)
    kinds /= kinds.sum()
    biases = ndtri((np.arange(n_raters) + 0.5) / n_raters)
    biases *= bias / biases.std()
    up_to = ndtri(np.cumsum(shares)[:-1])

    def of(log_noise: float) -> Population:
        noise = np.exp(log_noise)
        cuts = up_to * np.hypot(1.0, noise * np.hypot(1.0, bias))
        seen = severity[:, None, None] + noise * biases[:, None]
        below = ndtr((cuts - seen) / noise)
        edge = np.zeros((*below.shape[:2], 1))
        chances = np.diff(np.concatenate([edge, below, edge + 1.0], axis=-1), axis=-1)
        return Population(kinds=kinds, chances=chances, n_drawn=n_drawn)

    noise = brentq(lambda x: of(x).truth("fleiss_kappa") - kappa, -4.0, 3.0)
    return of(noise)


CLASSES = {
    # hit rates of raters where there is nothing, and where there is something
    "alike": ((0.98, 0.85),),
    "one lax rater": ((0.85, 0.85), *((0.98, 0.85),) * 11),
    "two groups of raters": ((0.99, 0.7), (0.95, 0.95)),
}
"""Raters of a latent class, turn by turn."""


def latent_class(shares: Shares, raters: str, n_raters: int) -> Population:
    """Return items with a true grade, which a rater hits or takes for a neighbour."""
    kinds_of_raters = CLASSES[raters]
    near = np.eye(len(shares), k=1) + np.eye(len(shares), k=-1)
    near /= near.sum(axis=1, keepdims=True)
    chances = []
    for j in range(n_raters):
        nothing, something = kinds_of_raters[j % len(kinds_of_raters)]
        hit = np.array([nothing, *[something] * (len(shares) - 1)])
        chances.append(np.diag(hit) + (1.0 - hit)[:, None] * near)
    return Population(kinds=np.array(shares), chances=np.stack(chances, axis=1))


def some_careless(shares: Shares, n_drawn: int) -> Population:
    """Return raters of whom one in five grades at random, and items with a true grade.

    The others see it nine times in ten, and else grade at random, too.
    """
    at_random = np.tile(shares, (len(shares), 1))
    careful = 0.9 * np.eye(len(shares)) + 0.1 * at_random
    chances = np.stack([at_random, *[careful] * 4], axis=1)
    return Population(kinds=np.array(shares), chances=chances, n_drawn=n_drawn)
