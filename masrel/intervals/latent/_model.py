"""The ordinal latent-trait model: its coordinates, prior, likelihood, and slopes.

Rater r perceives item i at θ_i + b_r + σ_r ε, with ε ~ N(0, 1), and gives grade k if
that lies between the thresholds τ_(k-1) and τ_k: a cumulative probit model.

In its coordinates the posterior is nearly normal. Ratings determine where items and
thresholds lie relative to each other in units of c = √(1 - ρ), the standard deviation
of a rating around its item; about ρ they say nothing more. So thresholds are
T_k = (τ_k - α) / c from the one of them that halves the ratings, α. The coordinate of
an item that its ratings place is how far (θ_i - α) / c is from the thresholds between
its grades. An item that all raters gave the first or the last grade lies anywhere
beyond the threshold next to it: its coordinate y, which is
√(ρ) / c log(1 + e^y) + y / √n beyond it, turns the wall of n ratings into a slope. The
coordinate of an item that ratings hardly place is θ_i / √ρ, the unit of its prior.

Raters' biases and noises are in units of their scales, √(1 - f) and η, which ratings
tell only through them; η has a coordinate by which it falls to 0 by powers of e, since
0 is where raters' noises are alike.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, ndtr, ndtri

from masrel._input import refuse
from masrel.agreement._engine import Floats
from masrel.agreement._labels import Codes

_NOISE_UNIT = 0.2  # η of about which logarithms of the noises differ in studies
_FAR = 1e9  # where the first grade begins and the last ends: times 0 it is 0
_PLAIN = 5.0  # variance of items' means over its error, where ratings place items


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentPrior:
    """The prior of the ordinal latent-trait model.

    The variance of a rating on the latent scale is 1. It has three shares: of the
    items' severities ρ, of the raters' biases (1 - ρ)(1 - f), and of the raters'
    noise (1 - ρ) f.

    Attributes
    ----------
    item_share : tuple of float
        ρ ~ Beta(a, b). By default Beta(1, 1/3), under which the kappa of six grades is
        nearly uniform: its 5, 50 and 95 % are 0.03, 0.42 and 0.98. (Under a uniform ρ
        they are 0.01, 0.14 and 0.59: that would all but rule out good agreement.)
    noise_fraction : tuple of float
        f ~ Beta(a, b). By default Beta(2, 2): raters have both biases and noise.
    noise_spread : float
        Raters' noises are σ e^(η w) with w ~ N(0, 1) and η ~ half-normal of this
        scale. By default 0.5: most raters within a factor of two of each other.
    concentration : float
        The shares of the grades over the population of items and raters are
        Dirichlet(concentration, ...). Uniform by default.
    """

    item_share: tuple[float, float] = (1.0, 1.0 / 3.0)
    noise_fraction: tuple[float, float] = (2.0, 2.0)
    noise_spread: float = 0.5
    concentration: float = 1.0

    def __post_init__(self) -> None:
        parts = {
            "item_share": self.item_share,
            "noise_fraction": self.noise_fraction,
            "noise_spread": (self.noise_spread,),
            "concentration": (self.concentration,),
        }
        refuse(
            *(
                (
                    not all(0.0 < value < math.inf for value in values),
                    f"prior: {name} needs positive numbers, got {values}",
                )
                for name, values in parts.items()
            )
        )

    @classmethod
    def other(cls) -> "LatentPrior":
        """Return one that might as well have been chosen.

        Returns
        -------
        LatentPrior
            A uniform share of the items and split of bias and noise, Dirichlet(1/2,
            ...) for the grades, and noises that differ half as much.
        """
        return cls(
            item_share=(1.0, 1.0),
            noise_fraction=(1.0, 1.0),
            noise_spread=0.25,
            concentration=0.5,
        )

    @property
    def words(self) -> str:
        """The prior in one line."""
        a, b = self.item_share
        c, d = self.noise_fraction
        return (
            f"share of the items ~ Beta({a:.3g}, {b:.3g}), noise of the rest ~ "
            f"Beta({c:.3g}, {d:.3g}), spread of the noises ~ half-normal"
            f"({self.noise_spread:g}), grades ~ Dirichlet({self.concentration:g}, ...)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """The unknowns at n positions, on the scale where a rating has variance 1."""

    severity: Floats = field(compare=False, repr=False)  # (n, n_items): θ_i ~ N(0, ρ)
    # (n, n_raters): b_r ~ N(0, ω²), ω² = (1 - ρ)(1 - f)
    bias: Floats = field(compare=False, repr=False)
    # (n, n_raters): σ_r = σ e^(η w_r), σ² = (1 - ρ) f, w_r ~ N(0, 1)
    noise: Floats = field(compare=False, repr=False)
    # (n, n_categories - 1): τ_k, ascending
    thresholds: Floats = field(compare=False, repr=False)
    # item_share, noise_spread: (n,): ρ and η
    item_share: Floats = field(compare=False, repr=False)
    noise_spread: Floats = field(compare=False, repr=False)
    # bias_variance, noise_variance: (n,): ω² and σ²
    bias_variance: Floats = field(compare=False, repr=False)
    noise_variance: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnconstrainedPoint:
    """The unknowns at n positions in units of c, and the coordinates themselves."""

    item: Floats = field(compare=False, repr=False)  # (n, n_items): u_i = (θ_i - α) / c
    # bias, noise: (n, n_raters): b_r / c and σ_r / c
    bias: Floats = field(compare=False, repr=False)
    noise: Floats = field(compare=False, repr=False)
    # threshold, tau: (n, n_categories - 1): T_k = (τ_k - α) / c, and τ_k
    threshold: Floats = field(compare=False, repr=False)
    tau: Floats = field(compare=False, repr=False)
    severity: Floats = field(compare=False, repr=False)  # (n, n_items): θ_i
    # (n, n_items): the items' coordinates
    raw_item: Floats = field(compare=False, repr=False)
    # log(1 + e^y) √ρ/c and the slope of that by y, where y is the item's coordinate:
    # (n, n_items), and 0 where no grade is the only one
    reach: Floats = field(compare=False, repr=False)
    stretch: Floats = field(compare=False, repr=False)
    # b, w: (n, n_raters): b_r / ω and w_r
    b: Floats = field(compare=False, repr=False)
    w: Floats = field(compare=False, repr=False)
    # raw_share, raw_fraction, raw_noise_sd: (n, 1): the coordinates of ρ, f and η
    raw_share: Floats = field(compare=False, repr=False)
    raw_fraction: Floats = field(compare=False, repr=False)
    raw_noise_sd: Floats = field(compare=False, repr=False)
    # share, root, fraction, noise_sd, anchor: (n, 1): ρ, c, f, η and α
    share: Floats = field(compare=False, repr=False)
    root: Floats = field(compare=False, repr=False)
    fraction: Floats = field(compare=False, repr=False)
    noise_sd: Floats = field(compare=False, repr=False)
    anchor: Floats = field(compare=False, repr=False)
    # (n, n_categories - 2): distances of neighbouring T_k
    gap: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentDensity:
    """The posterior of the model on unbounded coordinates."""

    # A position holds, in this order: one coordinate an item; b_r / ω and w_r
    # (n_raters each); logit ρ, logit f, and y where η = 0.2 log(1 + e^y), which falls
    # to 0 as e^y and grows as y; α; and the logarithms of the distances between
    # neighbouring T_k, from the lowest pair up.

    prior: LatentPrior
    codes: Codes = field(
        compare=False, repr=False
    )  # (n_items, n_raters): -1 if missing
    n_categories: int
    middle: int  # the threshold that is α: the one that halves the ratings best
    # (n_items,): items whose coordinate tells u_i - Σ_k W_ik T_k; of the others it is
    # z_i = θ_i / √ρ
    placed: NDArray[np.bool_] = field(compare=False, repr=False)
    # (n_items,): -1 where all ratings are the first grade, 1 where they are the last,
    # if the item is placed; 0 elsewhere
    beyond: Floats = field(compare=False, repr=False)
    # (n_items,): slope of u_i by y on the wrong side of that threshold: the error there
    # of as many ratings; 1 where the item is not beyond one
    inside: Floats = field(compare=False, repr=False)
    # (n_items, n_categories - 1): W: weights of the thresholds between an item's
    # grades, or next to its only one
    threshold_weights: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Codes, n_categories: int, prior: LatentPrior) -> "LatentDensity":
        """Take codes of shape (n_items, n_raters), -1 where missing."""
        rated, last = codes >= 0, n_categories - 1
        at_most = (rated[:, :, None] & (codes[:, :, None] <= np.arange(last))).sum(1)
        n_each = rated.sum(axis=1)
        share = at_most / n_each.clip(1)[:, None]
        weight = share * (1.0 - share)  # 0 where all are on one side
        is_first = share[:, 0] == 1.0
        is_last = (n_each > 0) & (share[:, -1] == 0.0)
        weight[is_first, 0] = weight[is_last, -1] = 1.0
        total = weight.sum(axis=1)
        placed = (total > 0.0) & _tell_items_apart(codes)
        scale = np.where(placed, 1.0 / np.where(placed, total, 1.0), 0.0)
        beyond = placed * (is_last.astype(np.float64) - is_first)
        return cls(
            prior=prior,
            codes=codes,
            n_categories=n_categories,
            middle=int(np.abs(2 * at_most.sum(axis=0) - rated.sum()).argmin()),
            placed=placed,
            beyond=beyond,
            inside=np.where(beyond, 1.0 / np.sqrt(n_each.clip(1)), 1.0),
            threshold_weights=scale[:, None] * weight,
        )

    @property
    def share_start(self) -> int:
        """Where logit ρ, logit f and the coordinate of η begin."""
        n_items, n_raters = self.codes.shape
        return int(n_items + 2 * n_raters)

    @property
    def n_dimensions(self) -> int:
        """Length of a position."""
        return self.share_start + 3 + self.n_categories - 1

    def start(self) -> Floats:
        """Return a position, (n_dimensions,), where the density is near its peak."""
        position = np.zeros(self.n_dimensions)
        at = self.share_start
        position[at] = 1.0
        position[at + 2] = np.log(np.expm1(self.prior.noise_spread / _NOISE_UNIT))
        tau = ndtri(np.arange(1, self.n_categories) / self.n_categories)
        position[at + 3] = tau[self.middle]
        position[at + 4 :] = np.log(np.diff(tau) / np.sqrt(expit(-1.0)))
        return position

    def point(self, position: Floats) -> UnconstrainedPoint:
        """Return what positions (n, n_dimensions) hold."""
        at, (n_items, n_raters) = self.share_start, self.codes.shape
        parts = [n_items, n_items + n_raters, at, at + 1, at + 2, at + 3, at + 4]
        raw_item, b, w, rho, f, raw_eta, anchor, log_gap = np.split(
            position, parts, axis=1
        )
        share, fraction = expit(rho), expit(f)
        root = np.sqrt(expit(-rho))
        eta = _NOISE_UNIT * np.logaddexp(0.0, raw_eta)
        # T_k from their distances; that of α is 0
        gap = np.exp(log_gap)
        lower = -_from_right(gap[:, : self.middle])
        upper = gap[:, self.middle :].cumsum(axis=1)
        threshold = np.hstack([lower, np.zeros((len(gap), 1)), upper])
        across = np.where(self.beyond, np.exp(0.5 * rho), 0.0)  # √ρ / c
        reach = across * np.logaddexp(0.0, raw_item)
        moved = np.where(
            self.beyond, self.beyond * (reach + self.inside * raw_item), raw_item
        )
        by_ratings = moved + threshold @ self.threshold_weights.T
        by_prior = (np.sqrt(share) * raw_item - anchor) / root
        item = np.where(self.placed, by_ratings, by_prior)
        return UnconstrainedPoint(
            item=item,
            bias=np.sqrt(expit(-f)) * b,
            noise=np.sqrt(fraction) * np.exp(eta * w),
            threshold=threshold,
            tau=anchor + root * threshold,
            severity=anchor + root * item,
            raw_item=raw_item,
            reach=reach,
            stretch=across * expit(raw_item),
            b=b,
            w=w,
            raw_share=rho,
            raw_fraction=f,
            raw_noise_sd=raw_eta,
            share=share,
            root=root,
            fraction=fraction,
            noise_sd=eta,
            anchor=anchor,
            gap=gap,
        )

    def traits(self, position: Floats) -> Traits:
        """Turn positions (n, n_dimensions) into the unknowns."""
        point = self.point(position)
        rest = (point.root**2)[:, 0]
        return Traits(
            severity=point.severity,
            bias=point.root * point.bias,
            noise=point.root * point.noise,
            thresholds=point.tau,
            item_share=point.share[:, 0],
            noise_spread=point.noise_sd[:, 0],
            bias_variance=rest * expit(-point.raw_fraction[:, 0]),
            noise_variance=rest * point.fraction[:, 0],
        )

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions."""
        # position (n, n_dimensions) -> (n,)
        with np.errstate(all="ignore"):  # far out a cell has probability 0
            point = self.point(position)
            low, high, _ = self._cells(point)
            density = np.log(_normal_probability(low, high)).sum(axis=1)
            density += self._log_prior(point)
        return np.where(np.isfinite(density), density, -np.inf)

    def _log_prior(self, point: UnconstrainedPoint) -> Floats:
        # densities of θ_i or z_i, b_r / ω, w_r, τ; of ρ, f and η; and the Jacobian of
        # the coordinates, (n,)
        prior, placed = self.prior, self.placed
        a, b = prior.item_share
        c, d = prior.noise_fraction
        rho, f = point.raw_share, point.raw_fraction
        # N(0, ρ), where 1/√ρ = (1 + e^-ρ')^½ for ρ' = logit ρ
        of_items = np.where(
            placed,
            -0.5 * point.severity**2 / point.share + 0.5 * np.logaddexp(0.0, -rho),
            -0.5 * point.raw_item**2,
        )
        density = of_items.sum(axis=1)
        density -= 0.5 * (point.b**2 + point.w**2).sum(axis=1)
        # Beta density and Jacobian of the logit: ρ^a (1 - ρ)^b
        shares = a * np.logaddexp(0.0, -rho) + b * np.logaddexp(0.0, rho)
        shares += c * np.logaddexp(0.0, -f) + d * np.logaddexp(0.0, f)
        of_sd = -0.5 * (point.noise_sd / prior.noise_spread) ** 2
        of_sd -= np.logaddexp(0.0, -point.raw_noise_sd)
        # Dirichlet density of the shares Φ(τ_k) - Φ(τ_(k-1)), Jacobian Π φ(τ_k)
        tau = point.tau
        density += (of_sd - shares)[:, 0] - 0.5 * (tau**2).sum(axis=1)
        if prior.concentration != 1.0:
            grades = np.log(grade_shares(tau)).sum(axis=1)
            density += (prior.concentration - 1.0) * grades
        # log |∂(θ, τ) / ∂(their coordinates)|, without items' √ρ: z_i is a unit normal
        # by its prior, whose density needs no Jacobian
        stretched = np.log(point.gap).sum(axis=1) + np.log(
            self.inside + point.stretch
        ).sum(axis=1)
        density += self._n_scaled * np.log(point.root[:, 0]) + stretched
        return np.asarray(density)

    @property
    def _n_scaled(self) -> int:
        # unknowns in units of c
        return int(self.placed.sum()) + self.n_categories - 2

    def _cells(self, point: UnconstrainedPoint) -> tuple[Floats, Floats, Floats]:
        # of each rating both ends of its grade in its rater's noises, and one over
        # these: three of shape (n, n_ratings)
        item, rater = np.nonzero(self.codes >= 0)
        grade = self.codes[item, rater]
        sharp = (1.0 / point.noise)[:, rater]
        centre = point.item[:, item] + point.bias[:, rater]
        far = np.full((len(centre), 1), _FAR)
        ends = np.hstack([-far, point.threshold, far])
        low, high = ends[:, grade] - centre, ends[:, grade + 1] - centre
        return low * sharp, high * sharp, sharp

    def gradient(self, position: Floats) -> Floats:
        """Return the gradient of `log_density`; 0 where that is -inf."""
        # position (n, n_dimensions) -> (n, n_dimensions)
        with np.errstate(all="ignore"):
            point = self.point(position)
            slope = self._prior_slopes(point, *self._likelihood_slopes(point))
        return np.where(np.isfinite(slope).all(axis=1, keepdims=True), slope, 0.0)

    def _likelihood_slopes(
        self, point: UnconstrainedPoint
    ) -> tuple[Floats, Floats, Floats, Floats]:
        # of the log-likelihood by u_i, (n, n_items); by b_r and log σ_r, (n, n_raters);
        # and by T_k, (n, n_categories - 1)
        low, high, sharp = self._cells(point)
        probability = _normal_probability(low, high)
        at_low = _normal_density(low) / probability
        at_high = _normal_density(high) / probability
        by_place, by_noise = np.zeros((2, len(low), *self.codes.shape))
        by_noise[:, self.codes >= 0] = low * at_low - high * at_high
        at_low *= sharp
        at_high *= sharp
        by_place[:, self.codes >= 0] = at_low - at_high
        grade = self.codes[self.codes >= 0]
        is_grade = (grade[:, None] == np.arange(self.n_categories)) * 1.0
        # einsum and not a product of matrices, whose threads cost more than they save
        above = np.einsum("nr,rk->nk", at_high, is_grade)[:, :-1]
        below = np.einsum("nr,rk->nk", at_low, is_grade)[:, 1:]
        return (
            by_place.sum(axis=2),
            by_place.sum(axis=1),
            by_noise.sum(axis=1),
            above - below,
        )

    def _prior_slopes(
        self,
        point: UnconstrainedPoint,
        by_item: Floats,
        by_bias: Floats,
        by_noise: Floats,
        by_threshold: Floats,
    ) -> Floats:
        # turns slopes of the likelihood into those of the density by the coordinates
        placed, root, share = self.placed, point.root, point.share
        # of the prior by θ_i and by τ_k
        item = np.where(placed, -point.severity / share, 0.0)
        tau = -point.tau
        if more := self.prior.concentration - 1.0:
            over = 1.0 / grade_shares(point.tau)
            tau = more * _normal_density(point.tau) * (over[:, :-1] - over[:, 1:]) + tau
        # by u_i of placed items, by y_i, and through ρ'
        by_place = np.where(placed, by_item + root * item, 0.0)
        width = self.inside + point.stretch
        part = point.stretch / width
        by_coordinate = np.where(
            self.beyond,
            self.beyond * by_place * width + part * expit(-point.raw_item),
            by_place,
        )
        through = 0.5 * (self.beyond * by_place * point.reach + part)
        by_raw_item = np.where(
            placed, by_coordinate, by_item * np.sqrt(share) / root - point.raw_item
        )
        threshold = by_threshold + root * tau + by_place @ self.threshold_weights
        # a distance below the middle moves all thresholds below it down
        down = -threshold.cumsum(axis=1)[:, : self.middle]
        up = _from_right(threshold)[:, self.middle + 1 :]
        loose = np.where(placed, 0.0, by_item)  # moves against the thresholds with α
        anchor = item.sum(axis=1) + tau.sum(axis=1) - (loose / root).sum(axis=1)
        return np.hstack(
            [
                by_raw_item,
                np.sqrt(1.0 - point.fraction) * by_bias - point.b,
                point.noise_sd * by_noise - point.w,
                self._by_share(point, item, tau, loose)
                + through.sum(axis=1, keepdims=True),
                self._by_fraction(point, by_bias, by_noise),
                self._by_noise_sd(point, by_noise),
                anchor[:, None],
                1.0 + np.asarray(point.gap * np.hstack([down, up])),
            ]
        )

    def _by_share(
        self, point: UnconstrainedPoint, item: Floats, tau: Floats, loose: Floats
    ) -> Floats:
        # by logit ρ, (n, 1): through c, dc = -c ρ/2; through the densities and the
        # Jacobian; and through u_i = (√ρ z_i - α) / c
        share, anchor = point.share, point.anchor
        a, b = self.prior.item_share
        scaled = (item * (point.severity - anchor)).sum(axis=1, keepdims=True)
        scaled += (tau * (point.tau - anchor)).sum(axis=1, keepdims=True)
        slope = -0.5 * share * (scaled + self._n_scaled)
        slope = slope + a * (1.0 - share) - b * share
        through = np.where(self.placed, point.severity**2 / share - 1.0, 0.0)
        slope += 0.5 * (1.0 - share) * through.sum(axis=1, keepdims=True)
        moved = np.sqrt(share) * point.raw_item - share * anchor
        return np.asarray(
            slope + 0.5 * (loose * moved / point.root).sum(axis=1, keepdims=True)
        )

    def _by_fraction(
        self, point: UnconstrainedPoint, by_bias: Floats, by_noise: Floats
    ) -> Floats:
        # by logit f, (n, 1): √(1 - f) scales b, and √f all noises
        c, d = self.prior.noise_fraction
        f = point.fraction
        bias = (by_bias * point.bias).sum(axis=1, keepdims=True)
        noise = by_noise.sum(axis=1, keepdims=True)
        return np.asarray((1.0 - f) * (0.5 * noise + c) - f * (0.5 * bias + d))

    def _by_noise_sd(self, point: UnconstrainedPoint, by_noise: Floats) -> Floats:
        # by the coordinate of η, (n, 1), which scales w
        raw = point.raw_noise_sd
        by_eta = (by_noise * point.w).sum(axis=1, keepdims=True)
        by_eta -= point.noise_sd / self.prior.noise_spread**2
        return np.asarray(by_eta * _NOISE_UNIT * expit(raw) + expit(-raw))


def _tell_items_apart(codes: Codes) -> bool:
    # whether the variance of items' mean codes is plainly more than its error
    rated = codes >= 0
    n_each = rated.sum(axis=1)
    some = n_each > 0
    df = int((n_each[some] - 1).sum())
    if some.sum() < 2 or df < 1:
        return False
    mean = np.where(rated, codes, 0).sum(axis=1) / n_each.clip(1)
    within = (np.where(rated, codes - mean[:, None], 0.0) ** 2).sum() / df
    error = within * (1.0 / n_each[some]).mean()
    return bool(mean[some].var(ddof=1) > _PLAIN * error)


def _from_right(values: Floats) -> Floats:
    # (n, m) -> (n, m): sums of each entry and all to its right
    return values[:, ::-1].cumsum(axis=1)[:, ::-1]


def grade_shares(thresholds: Floats) -> Floats:
    """Return the shares of the grades over all items and raters."""
    # thresholds (n, n_categories - 1) -> (n, n_categories)
    far = np.full((len(thresholds), 1), np.inf)
    ends = np.hstack([-far, thresholds, far])
    return _normal_probability(ends[:, :-1], ends[:, 1:])


def _normal_probability(low: Floats, high: Floats) -> Floats:
    """Return Φ(high) - Φ(low), from the side where it keeps its digits."""
    flip = low > 0.0  # in the upper tail from the other side
    return np.asarray(
        ndtr(np.where(flip, -low, high)) - ndtr(np.where(flip, -high, low))
    )


def _normal_density(x: Floats) -> Floats:
    """Return the density of a unit normal."""
    return np.asarray(np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi))
