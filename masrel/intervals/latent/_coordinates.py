"""Coordinates in which the posterior of the latent-trait model is nearly normal.

Ratings determine where items and thresholds lie relative to each other in units of
c = √(1 - ρ), the standard deviation of a rating around its item; about ρ they say
nothing more. So thresholds are T_k = (τ_k - α) / c from the one of them that halves the
ratings, α. The coordinate of an item that its ratings place is how far (θ_i - α) / c is
from the thresholds between its grades. An item that all raters gave the first or the
last grade lies anywhere beyond the threshold next to it: its coordinate y, which is
√(ρ) / c log(1 + e^y) + y / √n beyond it, turns the wall of n ratings into a slope. The
coordinate of an item that ratings hardly place is θ_i / √ρ, the unit of its prior.

Raters' biases and noises have scales, √(1 - f) and η, that ratings tell only through
them. Their coordinates are units of what the scale and the ratings leave open, so that
they hardly change with it (`Information`); η itself has one that falls to 0 by powers
of e, since 0 is where raters' noises are alike.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, ndtr, ndtri

from masrel.agreement._engine import Floats
from masrel.agreement._labels import Codes

NOISE_UNIT = 0.2  # η of about which logarithms of the noises differ in studies
_PLAIN = 5.0  # variance of items' means over its error, where ratings place items


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
    # item_share, noise_fraction, noise_spread: (n,): ρ, f and η
    item_share: Floats = field(compare=False, repr=False)
    noise_fraction: Floats = field(compare=False, repr=False)
    noise_spread: Floats = field(compare=False, repr=False)
    # bias_variance, noise_variance: (n,): ω² and σ²
    bias_variance: Floats = field(compare=False, repr=False)
    noise_variance: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Information:
    """What ratings tell of numbers s z, z ~ N(0, 1): as if each was seen at m once."""

    # I, m: (n_raters,): the information, one over the variance, and the place
    amount: Floats = field(compare=False, repr=False)
    place: Floats = field(compare=False, repr=False)

    @classmethod
    def none(cls, n_raters: int) -> "Information":
        """Return that nothing is known."""
        return cls(amount=np.zeros(n_raters), place=np.zeros(n_raters))

    @classmethod
    def at_peak(cls, peak: Floats, curvature: Floats, scale: float) -> "Information":
        """Take z where the posterior has its peak, and the likelihood's curvature."""
        amount = curvature.clip(0.0) / scale**2
        known = scale * amount
        # the peak is at m s I / (1 + s² I)
        place = peak * (1.0 + scale * known) / np.where(known > 0.0, known, np.inf)
        return cls(amount=amount, place=place)

    def scaled(self, coordinate: Floats, scale: Floats) -> "Scaled":
        """Return z at coordinates (n, n_raters), where scales are s, (n, 1)."""
        # Given s, z is normal around m s I / (1 + s² I) with variance 1 / (1 + s² I).
        # In units of that its coordinate is a unit normal whatever s is, where z itself
        # makes a funnel of z and s.
        known = scale * self.amount
        precision = 1.0 + scale * known
        root = np.sqrt(precision)
        centre = known * self.place / precision
        away = coordinate / root
        slope = self.amount * self.place - (2.0 * centre + away) * known
        return Scaled(
            value=centre + away,
            by_coordinate=1.0 / root,
            by_scale=slope / precision,
            log_jacobian=-0.5 * np.log(precision).sum(axis=1),
            jacobian_by_scale=-(known / precision).sum(axis=1, keepdims=True),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaled:
    """Numbers z at n positions, with how they change."""

    # value, by_coordinate, by_scale: (n, n_raters): z and its slopes
    value: Floats = field(compare=False, repr=False)
    by_coordinate: Floats = field(compare=False, repr=False)
    by_scale: Floats = field(compare=False, repr=False)
    # (n,) and (n, 1): Σ log ∂z/∂(coordinate), and the slope of that by s
    log_jacobian: Floats = field(compare=False, repr=False)
    jacobian_by_scale: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class UnconstrainedPoint:
    """The unknowns at n positions in units of c, and the coordinates themselves."""

    item: Floats = field(compare=False, repr=False)  # (n, n_items): u_i = (θ_i - α) / c
    # bias, noise: (n, n_raters): b_r / c and σ_r / c
    bias: Floats = field(compare=False, repr=False)
    noise: Floats = field(compare=False, repr=False)
    # (n, n_categories - 1): t_k = (τ_k - α) / c
    threshold: Floats = field(compare=False, repr=False)
    # (n, n_items): the items' coordinates
    raw_item: Floats = field(compare=False, repr=False)
    # log(1 + e^y) √ρ/c and the slope of that by y, where y is the item's coordinate:
    # (n, n_items), and 0 where no grade is the only one
    reach: Floats = field(compare=False, repr=False)
    stretch: Floats = field(compare=False, repr=False)
    # b, w: (n, n_raters): b_r / ω and w_r
    b: "Scaled" = field(compare=False, repr=False)
    w: "Scaled" = field(compare=False, repr=False)
    # logit_share, logit_fraction: (n, 1): logit ρ and logit f
    logit_share: Floats = field(compare=False, repr=False)
    logit_fraction: Floats = field(compare=False, repr=False)
    # share, root, fraction, noise_sd: (n, 1): ρ, c, f and η
    share: Floats = field(compare=False, repr=False)
    root: Floats = field(compare=False, repr=False)
    fraction: Floats = field(compare=False, repr=False)
    noise_sd: Floats = field(compare=False, repr=False)
    # (n, 1): the coordinate of η
    raw_noise_sd: Floats = field(compare=False, repr=False)
    anchor: Floats = field(compare=False, repr=False)  # (n, 1): α
    # (n, n_categories - 2): distances of neighbouring T_k
    gap: Floats = field(compare=False, repr=False)

    @property
    def severity(self) -> Floats:
        """Severities θ_i, (n, n_items)."""
        return self.anchor + self.root * self.item

    @property
    def tau(self) -> Floats:
        """Thresholds τ_k, (n, n_categories - 1)."""
        return self.anchor + self.root * self.threshold

    @property
    def traits(self) -> Traits:
        """All on the scale where a rating has variance 1."""
        rest = (self.root**2)[:, 0]
        fraction = self.fraction[:, 0]
        return Traits(
            severity=self.severity,
            bias=self.root * self.bias,
            noise=self.root * self.noise,
            thresholds=self.tau,
            item_share=self.share[:, 0],
            noise_fraction=fraction,
            noise_spread=self.noise_sd[:, 0],
            bias_variance=rest * expit(-self.logit_fraction[:, 0]),
            noise_variance=rest * fraction,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinates:
    """What a position holds."""

    # In this order: one coordinate an item; those of b_r / ω and w_r (n_raters each);
    # logit ρ, logit f, and y where η = 0.2 log(1 + e^y), which falls to 0
    # as e^y and grows as y; α; and the logarithms of the distances between neighbouring
    # T_k, from the lowest pair up.

    # n_items, n_raters, n_categories: sizes
    n_items: int
    n_raters: int
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
    # what ratings tell of b_r / c = √(1 - f) b and of log(σ_r / σ) = η w
    of_bias: Information = field(compare=False, repr=False)
    of_noise: Information = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Codes, n_categories: int) -> "Coordinates":
        """Fit coordinates to codes of shape (n_items, n_raters), -1 where missing."""
        rated = codes >= 0
        grades = np.arange(n_categories - 1)
        at_most = (rated[:, :, None] & (codes[:, :, None] <= grades)).sum(axis=1)
        n_each = rated.sum(axis=1)
        share = at_most / n_each.clip(1)[:, None]
        weight = share * (1.0 - share)  # 0 where all are on one side
        first, last = share[:, 0] == 1.0, (n_each > 0) & (share[:, -1] == 0.0)
        weight[first, 0] = weight[last, -1] = 1.0
        total = weight.sum(axis=1)
        placed = (total > 0.0) & _tell_items_apart(codes)
        scale = np.where(placed, 1.0 / np.where(placed, total, 1.0), 0.0)
        beyond = placed * (last.astype(np.float64) - first)
        return cls(
            n_items=codes.shape[0],
            n_raters=codes.shape[1],
            n_categories=n_categories,
            middle=int(np.abs(2 * at_most.sum(axis=0) - rated.sum()).argmin()),
            placed=placed,
            beyond=beyond,
            inside=np.where(beyond, 1.0 / np.sqrt(n_each.clip(1)), 1.0),
            threshold_weights=scale[:, None] * weight,
            of_bias=Information.none(codes.shape[1]),
            of_noise=Information.none(codes.shape[1]),
        )

    @property
    def n_dimensions(self) -> int:
        """Length of a position."""
        return self.share_start + 3 + self.n_categories - 1

    @property
    def share_start(self) -> int:
        """Where logit ρ, logit f and log η begin."""
        return self.n_items + 2 * self.n_raters

    def start(self, noise_spread: float) -> Floats:
        """Return a position, (n_dimensions,), where the density is near its peak."""
        position = np.zeros(self.n_dimensions)
        at = self.share_start
        position[at] = 1.0
        position[at + 2] = np.log(np.expm1(noise_spread / NOISE_UNIT))
        tau = ndtri(np.arange(1, self.n_categories) / self.n_categories)
        position[at + 3] = tau[self.middle]
        position[at + 4 :] = np.log(np.diff(tau) / np.sqrt(expit(-1.0)))
        return position

    def point(self, position: Floats) -> UnconstrainedPoint:
        """Return what positions (n, n_dimensions) hold."""
        at, n = self.share_start, self.n_items
        raw_item, raw_b, raw_w = np.split(
            position[:, :at], [n, n + self.n_raters], axis=1
        )
        rho, f, raw_eta, anchor = np.split(position[:, at : at + 4], 4, axis=1)
        share, fraction = expit(rho), expit(f)
        root = np.sqrt(expit(-rho))
        bias_scale = np.sqrt(expit(-f))
        b = self.of_bias.scaled(raw_b, bias_scale)
        eta = NOISE_UNIT * np.logaddexp(0.0, raw_eta)
        w = self.of_noise.scaled(raw_w, eta)
        gap = np.exp(position[:, at + 4 :])
        threshold = self._thresholds(gap)
        across = np.where(self.beyond, np.exp(0.5 * rho), 0.0)  # √ρ / c
        reach = across * np.logaddexp(0.0, raw_item)
        moved = np.where(
            self.beyond, self.beyond * (reach + self.inside * raw_item), raw_item
        )
        by_ratings = moved + threshold @ self.threshold_weights.T
        by_prior = (np.sqrt(share) * raw_item - anchor) / root
        return UnconstrainedPoint(
            item=np.where(self.placed, by_ratings, by_prior),
            bias=bias_scale * b.value,
            noise=np.sqrt(fraction) * np.exp(eta * w.value),
            threshold=threshold,
            raw_item=raw_item,
            reach=reach,
            stretch=across * expit(raw_item),
            b=b,
            w=w,
            logit_share=rho,
            logit_fraction=f,
            share=share,
            root=root,
            fraction=fraction,
            noise_sd=eta,
            raw_noise_sd=raw_eta,
            anchor=anchor,
            gap=gap,
        )

    def _thresholds(self, gap: Floats) -> Floats:
        # T_k from their distances, (n, n_categories - 1); that of α is 0
        lower = -_from_right(gap[:, : self.middle])
        upper = gap[:, self.middle :].cumsum(axis=1)
        return np.hstack([lower, np.zeros((len(gap), 1)), upper])

    def log_jacobian(self, point: UnconstrainedPoint) -> Floats:
        """Return log |∂(θ, τ) / ∂(their coordinates)|, (n,), without items' √ρ."""
        # z_i is a unit normal by its prior, whose density needs no Jacobian.
        n_scaled = int(self.placed.sum()) + self.n_categories - 2
        stretched = np.log(point.gap).sum(axis=1) + np.log(
            self.inside + point.stretch
        ).sum(axis=1)
        return np.asarray(n_scaled * np.log(point.root[:, 0]) + stretched)

    def by_item(
        self, slope: Floats, point: UnconstrainedPoint
    ) -> tuple[Floats, Floats]:
        """Turn slopes by u_i of placed items into slopes by y_i, and through ρ'."""
        # slope (n, n_items), with those of log_jacobian -> (n, n_items), (n, 1)
        share = point.stretch / (self.inside + point.stretch)
        by_coordinate = np.where(
            self.beyond,
            self.beyond * slope * (self.inside + point.stretch)
            + share * expit(-point.raw_item),
            slope,
        )
        through = 0.5 * (self.beyond * slope * point.reach + share)
        return by_coordinate, through.sum(axis=1, keepdims=True)

    def by_threshold(self, slope: Floats, point: UnconstrainedPoint) -> Floats:
        """Turn slopes by T_k into slopes by the logarithms of their distances."""
        # slope (n, n_categories - 1) -> (n, n_categories - 2)
        # a distance below the middle moves all thresholds below it down
        down = -slope.cumsum(axis=1)[:, : self.middle]
        up = _from_right(slope)[:, self.middle + 1 :]
        return np.asarray(point.gap * np.hstack([down, up]))


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
    return normal_probability(ends[:, :-1], ends[:, 1:])


def normal_probability(low: Floats, high: Floats) -> Floats:
    """Return Φ(high) - Φ(low), from the side where it keeps its digits."""
    flip = low > 0.0  # in the upper tail from the other side
    return np.asarray(
        ndtr(np.where(flip, -low, high)) - ndtr(np.where(flip, -high, low))
    )


def normal_density(x: Floats) -> Floats:
    """Return the density of a unit normal."""
    return np.asarray(np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi))
