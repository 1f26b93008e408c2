"""Travels of catches of which some outlast their stretch: their likelihood.

A catch that goes on where its stretch ends has a travel that is larger than what was
seen of it. Leaving it out keeps the short travels and loses the long ones; here it is
an observation censored on the right.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, log_ndtr

from masrel.elbow.identification.horizon import Horizon

__all__ = ["CensoredTravels", "mills"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CensoredTravels:
    """Travels that were seen, and horizons behind which the others lie.

    Attributes
    ----------
    seen : ndarray, shape (n_seen,)
        Travels of catches that end, rad.
    limit, softness : ndarray, shape (n_beyond,)
        Horizons of the others, rad.
    """

    seen: Floats = field(compare=False, repr=False)
    limit: Floats = field(compare=False, repr=False)
    softness: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, seen: Sequence[float], horizons: Sequence[Horizon]
    ) -> "CensoredTravels":
        """Put travels and horizons into columns.

        Parameters
        ----------
        seen : sequence of float
            Travels of catches that end, rad.
        horizons : sequence of Horizon
            Those of the catches that do not.

        Returns
        -------
        CensoredTravels
            Both.
        """
        return cls(
            seen=np.array(seen, dtype=np.float64),
            limit=np.array([horizon.travel for horizon in horizons]),
            softness=np.array([horizon.softness for horizon in horizons]),
        )

    def log_likelihood(self, mean: float, sd: float) -> float:
        """Evaluate the log-likelihood of normal travels, without its constant.

        Parameters
        ----------
        mean, sd : float
            Of the travels, rad.

        Returns
        -------
        float
            Densities of those seen, and chances of the others to lie beyond.
        """
        spread = (self.seen - mean) / sd
        z, _ = self._beyond(mean, sd)
        density = -0.5 * float(spread @ spread) - self.seen.size * math.log(sd)
        return density + float(log_ndtr(z).sum())

    def score(self, mean: float, sd: float) -> tuple[float, float]:
        """Differentiate the log-likelihood.

        Parameters
        ----------
        mean, sd : float
            Of the travels, rad.

        Returns
        -------
        tuple of two float
            By the mean and by the standard deviation, 1/rad.
        """
        spread = (self.seen - mean) / sd
        z, size = self._beyond(mean, sd)
        ratio = mills(z)
        by_mean = float(spread.sum()) / sd + float((ratio / size).sum())
        by_sd = (float(spread @ spread) - spread.size) / sd
        return by_mean, by_sd - float((ratio * z * sd / size**2).sum())

    def information(self, mean: float, sd: float) -> Floats:
        """Give minus the second derivatives of the log-likelihood.

        Parameters
        ----------
        mean, sd : float
            Of the travels, rad.

        Returns
        -------
        ndarray, shape (2, 2)
            By mean and standard deviation, 1/rad².
        """
        spread = (self.seen - mean) / sd
        z, size = self._beyond(mean, sd)
        ratio = mills(z)
        curve = ratio * (z + ratio)  # -d²/dz² ln Φ
        turn = -z * sd / size**2  # dz/dsd
        turn2 = z * (3.0 * sd**2 - size**2) / size**4  # d²z/dsd²
        by_mean = spread.size / sd**2 + float((curve / size**2).sum())
        both = 2.0 * float(spread.sum()) / sd**2
        both += float((curve * turn / size + ratio * sd / size**3).sum())
        by_sd = (3.0 * float(spread @ spread) - spread.size) / sd**2
        by_sd += float((curve * turn**2 - ratio * turn2).sum())
        return np.array([[by_mean, both], [both, by_sd]])

    def _beyond(self, mean: float, sd: float) -> tuple[Floats, Floats]:
        # standardized distance of the mean beyond each horizon, and what it is
        # divided by: travels scatter, and so does what is seen of an end
        size = np.sqrt(sd**2 + self.softness**2)
        return (mean - self.limit) / size, size


def mills(z: Floats) -> Floats:
    """Evaluate φ/Φ of the standard normal distribution.

    Parameters
    ----------
    z : ndarray
        Where.

    Returns
    -------
    ndarray, shape of z
        Without cancellation, however far below 0.

    Examples
    --------
    >>> round(float(mills(np.zeros(1))[0]), 12)  # √(2/π)
    0.797884560803
    """
    return np.asarray(math.sqrt(2.0 / math.pi) / erfcx(-z / math.sqrt(2.0)))
