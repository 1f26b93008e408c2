"""How resamples are drawn: in counts, or as packed sums of a few items at once."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.control import Control, control_of, whole_scores
from masrel.intervals.resampling.lattice import Lattice, grid_of
from masrel.intervals.resampling.numerators import Integers
from masrel.intervals.resampling.pool import Pool
from masrel.intervals.resampling.slopes import influence

__all__ = ["Sampler", "sampler_of"]

_CHUNK = 1 << 17  # numbers held at once while resampling
_LEAST = 30  # draws from which on a control is worth its time
_TABLE = 1 << 14  # sums of a few items that are looked up at once
_MOST_BITS = 62
_BINOMIAL = 20  # lookups that take as long as one binomial number

Batch = tuple[Floats, Integers | None]
"""Values of resamples, ``nan`` where undefined, and their scores on the control."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampler:
    """How resamples of one pool are drawn."""

    # A number of resamples and a generator to a batch. What is drawn does not depend on
    # how it is cut into batches.
    draw: Callable[[int, np.random.Generator], Batch]
    # the distribution of the scores; None where there are none
    control: Control | None = field(default=None, repr=False)
    width: int  # numbers a resample takes while it is drawn

    def batches(self, n_resamples: int, generator: np.random.Generator) -> Batch:
        """Draw resamples, a few at a time."""
        step = max(1, _CHUNK // self.width)
        parts = [
            self.draw(min(step, n_resamples - start), generator)
            for start in range(0, n_resamples, step)
        ]
        values = np.concatenate([values for values, _ in parts])
        scores = [scores for _, scores in parts if scores is not None]
        return values, np.concatenate(scores) if scores else None


def sampler_of(pool: Pool, statistic: Callable[[Floats], Floats] | None) -> Sampler:
    """Choose how resamples of a pool are drawn."""
    slopes = _slopes(pool)
    n, n_members = pool.n, pool.times.size
    at_once = max(1, int(math.log(_TABLE, max(n, 2)) + 1e-9))
    if statistic is None and n / at_once < _BINOMIAL * n_members:
        lattice = _packable(pool)
        if lattice is not None:
            return _packed(pool, lattice, slopes, at_once)
    return _counted(pool, statistic or pool.of_counts, slopes)


def _slopes(pool: Pool) -> tuple[Floats, float] | None:
    # influence of each member on the estimate, and its standard deviation over a draw
    if pool.n < _LEAST:
        return None
    (slopes,) = influence(pool, pool.times[None].astype(np.float64))
    slopes = slopes - pool.shares @ slopes
    spread = math.sqrt(float(pool.shares @ slopes**2))
    if not math.isfinite(spread) or spread <= 1e-12 * float(np.abs(slopes).max()):
        return None
    return slopes, spread


def _counted(
    pool: Pool,
    statistic: Callable[[Floats], Floats],
    slopes: tuple[Floats, float] | None,
) -> Sampler:
    n, shares = pool.n, pool.shares
    scores = control = None
    if slopes is not None:
        scores = whole_scores(*slopes, n)
        control = control_of(scores, shares, n)

    member = np.repeat(np.arange(shares.size), pool.times)
    by_lookup = n < _BINOMIAL // 2 * shares.size

    def draw(size: int, generator: np.random.Generator) -> Batch:
        if by_lookup:
            drawn = member[generator.integers(0, n, size=(size, n))]
            drawn += shares.size * np.arange(size)[:, None]
            counts = np.bincount(drawn.ravel(), minlength=size * shares.size)
            counts = counts.reshape(size, shares.size)
        else:
            counts = generator.multinomial(n, shares, size=size)
        values = statistic(counts.astype(np.float64))
        return values, None if scores is None else counts @ scores

    width = 3 * shares.size + (2 * n if by_lookup else 0)
    if pool.rows is not None:
        width += 4 * pool.rows.shape[1]
    return Sampler(draw=draw, control=control, width=width)


def _packable(pool: Pool) -> Lattice | None:
    # the features themselves if their sums fit into one integer, else their lattice
    if pool.rows is None:
        return None
    plain = grid_of(pool.rows, pool.n)
    if plain is None:
        return None
    if _bits(plain, pool.n).sum() <= _MOST_BITS:
        return plain
    short = pool.lattice
    if short is None or _bits(short, pool.n).sum() > _MOST_BITS:
        return None
    return short


def _bits(lattice: Lattice, n: int) -> Integers:
    # (n_dimensions,): bits that hold each coordinate of a sum
    most = (n * lattice.steps.max(axis=0)).tolist()
    return np.array([number.bit_length() for number in most], dtype=np.int64)


def _packed(
    pool: Pool,
    lattice: Lattice,
    slopes: tuple[Floats, float] | None,
    at_once: int,
) -> Sampler:
    # The steps of an item are bit fields of one integer, and so are those of a sum.
    # A table of the sums of any `at_once` items makes so many draws one lookup.
    n = pool.n
    bits = _bits(lattice, n)
    places = np.cumsum(bits) - bits
    fields = list(zip(places.tolist(), ((1 << bits) - 1).tolist(), strict=True))
    keys = np.repeat((lattice.steps << places).sum(axis=1), pool.times)
    table = surplus = np.zeros(1, dtype=np.int64)
    n_lookups = -(-n // at_once)
    for digit in range(at_once):
        table = np.add.outer(keys, table).ravel()
        more = keys if digit >= at_once - (n_lookups * at_once - n) else 0 * keys
        surplus = np.add.outer(more, surplus).ravel()
    scores = control = None
    if slopes is not None:
        slope, *_ = np.linalg.lstsq(
            np.column_stack([lattice.steps, np.ones(len(lattice.steps))]), slopes[0]
        )
        scores = whole_scores(slope[:-1].astype(np.float64), slopes[1], n)
        control = control_of(lattice.steps @ scores, pool.shares, n)

    def draw(size: int, generator: np.random.Generator) -> Batch:
        at = generator.integers(0, table.size, size=(size, n_lookups))
        packed = np.einsum("ij->i", table[at])  # sums short rows faster than sum
        packed -= surplus[at[:, -1]]  # the last lookup may be of more than are left
        steps = np.empty((size, bits.size), dtype=np.int64)
        for column, (place, mask) in enumerate(fields):
            np.bitwise_and(packed >> place, mask, out=steps[:, column])
        values = pool.values(lattice.sums(steps, n))
        return values, None if scores is None else steps @ scores

    width = 3 * n_lookups + 4 * lattice.origin.size
    return Sampler(draw=draw, control=control, width=width)
