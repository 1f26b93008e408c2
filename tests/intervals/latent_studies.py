"""Made studies: ratings drawn from the latent-trait model, and the truth they hide."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def drawn(
    rng: np.random.Generator,
    n_items: int,
    n_raters: int,
    thresholds: list[float],
    *,
    share: float,
    fraction: float,
    spread: float,
) -> tuple[NDArray[np.int64], dict[str, Floats]]:
    """Draw items and raters, and let every rater grade every item, one by one.

    Returns the codes, and the unknowns that made them, each of one position.
    """
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
    return codes, {
        "severity": theta[None],
        "bias": bias[None],
        "noise": noise[None],
        "thresholds": np.array([thresholds]),
        "item_share": np.array([share]),
        "noise_spread": np.array([spread]),
        "bias_variance": np.array([rest * (1.0 - fraction)]),
        "noise_variance": np.array([rest * fraction]),
    }
