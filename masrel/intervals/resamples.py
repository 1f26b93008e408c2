"""Resamples of a pool: every one with its probability, or some that are drawn."""

from dataclasses import dataclass, field

import numpy as np

from masrel.agreement.kernel import Floats
from masrel.estimates import Distribution
from masrel.intervals.compositions import compositions
from masrel.intervals.endpoints import Replicates
from masrel.intervals.pool import Pool

__all__ = ["Resamples", "draw_resamples", "enumerate_resamples"]

_CHUNK = 2_000_000  # numbers held at once while resampling


@dataclass(frozen=True, slots=True, kw_only=True)
class Resamples:
    """Values of a coefficient over resamples.

    Attributes
    ----------
    replicates : Replicates
        The defined values.
    n_resamples : int or None
        How many were drawn; None if these are all.
    n_undefined : int
        How many are undefined, of those drawn or of the distinct ones.
    words : str
        What they are.
    notes : tuple of str
        What the reader must know of them.
    """

    replicates: Replicates = field(compare=False, repr=False)
    n_resamples: int | None
    n_undefined: int
    words: str
    notes: tuple[str, ...] = ()

    @property
    def distribution(self) -> Distribution:
        """The defined values with their probabilities."""
        return Distribution(
            values=_frozen(self.replicates.values),
            weights=_frozen(self.replicates.weights),
            continuous=False,
            words=self.words,
        )

    def errors(self, low_at: float, high_at: float) -> tuple[float, float] | None:
        """Return the Monte Carlo errors of two quantiles; None if nothing was drawn."""
        if self.n_resamples is None:
            return None
        low, high = (_quantile_error(self.replicates, at) for at in (low_at, high_at))
        return low, high


def _frozen(values: Floats) -> Floats:
    values.flags.writeable = False
    return values


def enumerate_resamples(pool: Pool) -> Resamples:
    """Take every distinct resample once, with its probability.

    Parameters
    ----------
    pool : Pool
        What is resampled.

    Returns
    -------
    Resamples
        Nothing of it is random.
    """
    counts, weights = compositions(pool.n, pool.shares)
    values = pool.of_counts(counts)
    lost = np.isnan(values)
    n_lost, n = int(lost.sum()), values.size
    notes = []
    if n_lost:
        values, gone, weights = values[~lost], weights[lost].sum(), weights[~lost]
        notes.append(
            f"undefined, and left out: {n_lost} of {n} distinct resamples, of "
            f"probability {gone:.2g}"
        )
    return Resamples(
        replicates=Replicates.weighted(values, weights),
        n_resamples=None,
        n_undefined=n_lost,
        words=f"exact bootstrap distribution, {n} resamples",
        notes=tuple(notes),
    )


def draw_resamples(
    pool: Pool, n_resamples: int, generator: np.random.Generator
) -> Resamples:
    """Draw resamples.

    Parameters
    ----------
    pool : Pool
        What is resampled.
    n_resamples : int
        How many.
    generator : Generator
        Where randomness comes from.

    Returns
    -------
    Resamples
        As many values, less the undefined ones.
    """
    drawn = np.empty(n_resamples)
    shares = pool.shares
    step = max(1, _CHUNK // shares.size)
    for start in range(0, n_resamples, step):
        stop = min(start + step, n_resamples)
        counts = generator.multinomial(pool.n, shares, size=stop - start)
        drawn[start:stop] = pool.of_counts(counts)
    values = drawn[~np.isnan(drawn)]
    return Resamples(
        replicates=Replicates.drawn(values),
        n_resamples=n_resamples,
        n_undefined=n_resamples - values.size,
        words=f"bootstrap distribution, {values.size} resamples",
    )


def _quantile_error(replicates: Replicates, position: float) -> float:
    # half the distance between the quantiles one binomial error to either side
    n = replicates.values.size
    error = float(np.sqrt(position * (1.0 - position) / n))
    ends = (max(position - error, 0.0), min(position + error, 1.0))
    low, high = (replicates.quantile(end) for end in ends)
    return 0.5 * (high - low)
