"""A position of the latent-trait model's posterior, taken apart."""

from dataclasses import dataclass, field

from scipy.special import expit

from masrel.agreement._kernel import Floats
from masrel.intervals.latent.traits import Traits

__all__ = ["Place"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Positions taken apart, in units of c."""

    item: Floats = field(compare=False, repr=False)  # (n, n_items): u_i = (θ_i - α) / c
    # bias, noise: (n, n_raters): b_r / c and σ_r / c
    bias: Floats = field(compare=False, repr=False)
    noise: Floats = field(compare=False, repr=False)
    # (n, n_categories - 1): t_k = (τ_k - α) / c
    threshold: Floats = field(compare=False, repr=False)
    # (n, n_items): the items' coordinates
    own: Floats = field(compare=False, repr=False)
    # b, w: (n, n_raters): b_r / ω and w_r
    b: Floats = field(compare=False, repr=False)
    w: Floats = field(compare=False, repr=False)
    # logit_share, logit_fraction, log_spread: (n, 1): logit ρ, logit f, log η
    logit_share: Floats = field(compare=False, repr=False)
    logit_fraction: Floats = field(compare=False, repr=False)
    log_spread: Floats = field(compare=False, repr=False)
    # share, root, fraction, spread: (n, 1): ρ, c, f and η
    share: Floats = field(compare=False, repr=False)
    root: Floats = field(compare=False, repr=False)
    fraction: Floats = field(compare=False, repr=False)
    spread: Floats = field(compare=False, repr=False)
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
            noise_spread=self.spread[:, 0],
            bias_variance=rest * expit(-self.logit_fraction[:, 0]),
            noise_variance=rest * fraction,
        )
