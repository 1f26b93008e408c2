"""What is believed of raters' severities, biases and noises before the data."""

import math
from dataclasses import dataclass

from masrel.errors import ParameterError

__all__ = ["LatentPrior"]


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
        for name, values in (
            ("item_share", self.item_share),
            ("noise_fraction", self.noise_fraction),
            ("noise_spread", (self.noise_spread,)),
            ("concentration", (self.concentration,)),
        ):
            if not all(0.0 < value < math.inf for value in values):
                raise ParameterError(
                    f"prior: {name} needs positive numbers, got {values}"
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
