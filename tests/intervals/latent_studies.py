"""Made studies: ratings drawn from the latent-trait model, and the truth they hide."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.intervals.latent._model import Traits

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Codes with the unknowns they were drawn from, each of one position."""

    codes: NDArray[np.int64]
    truth: Traits


def drawn(
    rng: np.random.Generator,
    n_items: int,
    n_raters: int,
    thresholds: list[float],
    *,
    share: float,
    fraction: float,
    spread: float,
) -> Study:
    """Draw items and raters, and let every rater grade every item, one by one."""
    rest = 1.0 - share
    theta = rng.normal(scale=np.sqrt(share), size=n_items)
    bias = rng.normal(scale=np.sqrt(rest * (1.0 - fraction)), size=n_raters)
    noise = np.sqrt(rest * fraction) * np.exp(spread * rng.normal(size=n_raters))
    codes = np.array(
        [
            [
                sum(
                    theta[i] + bias[r] + noise[r] * rng.normal() > t for t in thresholds
                )
                for r in range(n_raters)
            ]
            for i in range(n_items)
        ]
    )
    return Study(
        codes=codes,
        truth=Traits(
            severity=theta[None],
            bias=bias[None],
            noise=noise[None],
            thresholds=np.array([thresholds]),
            item_share=np.array([share]),
            noise_spread=np.array([spread]),
            bias_variance=np.array([rest * (1.0 - fraction)]),
            noise_variance=np.array([rest * fraction]),
        ),
    )
