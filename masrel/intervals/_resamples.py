"""The values of resamples: of all there are, equal ones together, or of some drawn."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError, ParameterError
from masrel.intervals._endpoints import (
    AllResamples,
    Control,
    DrawnResamples,
    EndpointRule,
)
from masrel.intervals._lattice import (
    Integers,
    Lattice,
    box,
    grid_of,
    sums_of_scores,
    sums_of_steps,
)
from masrel.intervals._units import CrossedUnits, SamplingUnits

Statistic = Callable[[Floats], Floats]
"""How often each unit is drawn, (n_resamples, n_units), to values (n_resamples,)."""

Draws = tuple[Floats, Integers | None]
"""Values of resamples, ``nan`` where undefined, and their scores on the control."""

# All resamples
_MAX_ALL = 300_000  # resamples, or sums of them, that are taken rather than drawn
_MAX_COUNTED = 60_000  # the same where a statistic is none of sums alone
_MAX_INSISTED = 1_000_000  # resamples that are taken one by one if that is required
_FEW = 5_000  # resamples that are taken one by one before anything else is tried
_MAX_BOX = 3_000_000  # places of a table whose transform is taken
_BLOCK = 1 << 14  # numbers held at once while values are computed
# Drawn ones
_CHUNK = 1 << 17  # numbers held at once while resampling
_MIN_CONTROLLED = 30  # draws from which on a control is worth its time
_TABLE = 1 << 14  # sums of a few items that are looked up at once
_MAX_BITS = 62
_BINOMIAL = 20  # lookups that take as long as one binomial number
_FINE = 60.0  # integer scores in a standard deviation of one draw
_MAX_SPAN = 1 << 18  # integers that sums of scores span


def all_crossed_resamples(units: CrossedUnits, *, insist: bool) -> AllResamples | None:
    """Take every pair of a resample of items and one of raters, if there are few."""
    items, raters = units.items, units.raters
    n_distinct = math.comb(items.n + items.freq.size - 1, items.n)
    n_distinct *= math.comb(2 * raters.n - 1, raters.n)
    if n_distinct > (_MAX_INSISTED if insist else _MAX_ALL):
        if insist:
            raise ParameterError(
                f"exact: there are {_rounded(n_distinct)} distinct resamples of items "
                "and raters: too many; draw some of them instead"
            )
        return None
    of_items, item_weights = compositions(items.n, items.shares)
    of_raters, rater_weights = compositions(raters.n, raters.shares)
    values = np.empty(n_distinct)
    size = max(1, _CHUNK // units.width)
    for start in range(0, n_distinct, size):
        item, rater = np.divmod(
            np.arange(start, min(start + size, n_distinct)), len(of_raters)
        )
        values[start : start + size] = units.of_both(
            of_items[item].astype(np.float64), of_raters[rater].astype(np.float64)
        )
    return AllResamples.of(values, np.outer(item_weights, rater_weights).ravel())


def _crossed_sampler(units: CrossedUnits) -> "Sampler":
    def draw_chunk(size: int, generator: np.random.Generator) -> Draws:
        items, raters = (
            generator.multinomial(of.n, of.shares, size=size).astype(np.float64)
            for of in (units.items, units.raters)
        )
        return units.of_both(items, raters), None

    return Sampler(draw_chunk=draw_chunk, width=units.width)


def all_resamples(
    units: SamplingUnits | CrossedUnits, statistic: Statistic | None, *, insist: bool
) -> AllResamples | None:
    """Take every distinct resample once, with its probability.

    None if there are too many, and an error if that is not accepted. Without a
    statistic it is the coefficient, a function of sums of features.
    """
    if isinstance(units, CrossedUnits):
        return all_crossed_resamples(units, insist=insist)
    n_distinct = math.comb(units.n + units.freq.size - 1, units.n)
    if n_distinct > _FEW and statistic is None:
        merged = _merged(units, n_distinct)
        if merged is not None:
            return merged
    if statistic is None:
        most = _MAX_INSISTED if insist else _MAX_ALL
    else:
        most = _MAX_ALL if insist else _MAX_COUNTED
    if n_distinct <= most:
        counts, weights = compositions(units.n, units.shares)
        values = _in_blocks(statistic or units.of_counts, counts)
        return AllResamples.of(values, weights)
    if insist:
        raise ParameterError(
            f"exact: there are {_rounded(n_distinct)} distinct resamples, with more "
            f"than {_MAX_ALL} different sums of features: too many; draw some of them "
            "instead"
        )
    return None


def _rounded(count: int) -> str:
    if count < 10**9:
        return str(count)
    return f"{count:.2g}" if count < 10**300 else "more than 1e+300"


def _merged(units: SamplingUnits, n_distinct: int) -> AllResamples | None:
    """Take every sum of features once, if they lie on a lattice that is not large."""
    lattice = units.lattice
    if lattice is None:
        return None
    size = math.prod(box(lattice.steps, units.shares, units.n).tolist())
    if size > min(_MAX_BOX, 10 * n_distinct):
        return None
    steps, weights = sums_of_steps(lattice.steps, units.shares, units.n)
    if weights.size > _MAX_ALL:
        return None
    values = _in_blocks(lambda block: units.values(lattice.sums(block, units.n)), steps)
    return AllResamples.of(values, weights, "sums of resamples")


def compositions(n: int, shares: Floats) -> tuple[NDArray[np.int32], Floats]:
    """Return how often each unit is in every resample of n, and its probability."""
    # shares (n_units,) -> (n_resamples, n_units), (n_resamples,)
    # n! Π share^t / t! in logarithms, so that no n over- or underflows.
    steps = np.log(np.maximum(np.arange(n + 1), 1))
    factorials = np.cumsum(steps, dtype=np.longdouble).astype(np.float64)
    left = np.array([n], dtype=np.int32)  # draws that are left to the next units
    logs = np.array([factorials[n]])
    columns: list[NDArray[np.int32]] = []
    for share in shares[:-1]:
        n_choices = left + 1
        parent = np.repeat(np.arange(left.size), n_choices)
        first = np.cumsum(n_choices) - n_choices
        drawn = (np.arange(parent.size) - first[parent]).astype(np.int32)
        columns = [column[parent] for column in columns] + [drawn]
        left = left[parent] - drawn
        logs = logs[parent] + (drawn * math.log(share) - factorials[drawn])
    logs = logs + (left * math.log(shares[-1]) - factorials[left])
    return np.column_stack([*columns, left]), np.exp(logs)


def _in_blocks(statistic: Statistic, numbers: NDArray[np.integer[Any]]) -> Floats:
    """Return values of rows of integers, a block at a time."""
    values = np.empty(len(numbers))
    size = max(256, _BLOCK // max(numbers.shape[1], 1))
    for start in range(0, len(numbers), size):
        block = numbers[start : start + size]
        values[start : start + size] = statistic(block.astype(np.float64))
    return values


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawBudget:
    """How many resamples are drawn."""

    n_resamples: int  # at least
    tolerance: float | None = None  # the largest Monte Carlo error; None for any
    max_resamples: int

    def n_more(self, n_drawn: int, error: float) -> int:
        """Return how many more the tolerance takes, after some with an error."""
        if self.tolerance is None or error <= self.tolerance:
            return 0
        needed = n_drawn * (error / self.tolerance) ** 2
        n_more = min(math.ceil(1.05 * needed), self.max_resamples) - n_drawn
        if needed > self.max_resamples or n_more <= 0:
            raise ConvergenceError(
                f"tolerance: with {n_drawn} resamples an end has an error of "
                f"{error:.2g}; {self.tolerance:g} takes about {needed - n_drawn:.2g} "
                f"more, and max_resamples is {self.max_resamples}"
            )
        return n_more


def draw_resamples(
    units: SamplingUnits | CrossedUnits,
    statistic: Statistic | None,
    rule: EndpointRule,
    budget: DrawBudget,
    generator: np.random.Generator,
) -> DrawnResamples:
    """Draw resamples, more of them while an end is less certain than it should be."""
    if isinstance(units, CrossedUnits):
        sampler = _crossed_sampler(units)
    else:
        sampler = sampler_of(units, statistic)
    values, scores = sampler.draw(budget.n_resamples, generator)
    while True:
        resamples = _drawn(sampler, values, scores)
        n_more = budget.n_more(values.size, _error(resamples, rule))
        if not n_more:
            return resamples
        more, more_scores = sampler.draw(n_more, generator)
        values = np.concatenate([values, more])
        if scores is not None and more_scores is not None:
            scores = np.concatenate([scores, more_scores])


def _error(resamples: DrawnResamples, rule: EndpointRule) -> float:
    """Return that of the end that is less certain; 0 if there is no interval."""
    ends = rule.ends(resamples)
    return 0.0 if isinstance(ends, str) or ends.errors is None else max(ends.errors)


def _drawn(
    sampler: "Sampler", drawn: Floats, scores: Integers | None
) -> DrawnResamples:
    control, n = sampler.control, drawn.size
    undefined = np.isnan(drawn)
    if undefined.any():
        drawn = drawn[~undefined]
        control = scores = None  # its distribution is that of all resamples
    return DrawnResamples(
        drawn=drawn,
        values=np.sort(drawn),
        control=control,
        scores=scores,
        n_undefined=n - drawn.size,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampler:
    """How resamples of some units are drawn."""

    # What is drawn does not depend on how it is cut into chunks.
    draw_chunk: Callable[[int, np.random.Generator], Draws]
    control: Control | None = field(default=None, repr=False)
    width: int  # numbers a resample takes while it is drawn

    def draw(self, n_resamples: int, generator: np.random.Generator) -> Draws:
        """Draw resamples, a few at a time."""
        size = max(1, _CHUNK // self.width)
        chunks = [
            self.draw_chunk(min(size, n_resamples - start), generator)
            for start in range(0, n_resamples, size)
        ]
        values = np.concatenate([values for values, _ in chunks])
        scores = [scores for _, scores in chunks if scores is not None]
        return values, np.concatenate(scores) if scores else None


def sampler_of(units: SamplingUnits, statistic: Statistic | None) -> Sampler:
    """Choose how resamples are drawn: as packed sums of features, or in counts."""
    slopes = _slopes(units)
    n, n_units = units.n, units.freq.size
    at_once = max(1, int(math.log(_TABLE, max(n, 2)) + 1e-9))
    if statistic is None and n / at_once < _BINOMIAL * n_units:
        lattice = _packable(units)
        if lattice is not None:
            return _packed_sampler(units, lattice, slopes, at_once)
    return _counting_sampler(units, statistic or units.of_counts, slopes)


def _slopes(units: SamplingUnits) -> tuple[Floats, float] | None:
    """Return each unit's influence on the estimate, and its standard deviation."""
    if units.n < _MIN_CONTROLLED:
        return None
    (slopes,) = units.influence(units.freq[None].astype(np.float64))
    slopes = slopes - units.shares @ slopes
    sd = math.sqrt(float(units.shares @ slopes**2))
    if not math.isfinite(sd) or sd <= 1e-12 * float(np.abs(slopes).max()):
        return None
    return slopes, sd


def _counting_sampler(
    units: SamplingUnits, statistic: Statistic, slopes: tuple[Floats, float] | None
) -> Sampler:
    """Draw how often each unit is taken: one at a time, or by binomial numbers."""
    n, n_units, shares = units.n, units.freq.size, units.shares
    scores = control = None
    if slopes is not None:
        scores = integer_scores(*slopes, n)
        control = control_of(scores, shares, n)
    unit_of = np.repeat(np.arange(n_units), units.freq)
    one_by_one = n < _BINOMIAL // 2 * n_units

    def draw_chunk(size: int, generator: np.random.Generator) -> Draws:
        if one_by_one:
            drawn = unit_of[generator.integers(0, n, size=(size, n))]
            drawn += n_units * np.arange(size)[:, None]
            counts = np.bincount(drawn.ravel(), minlength=size * n_units)
            counts = counts.reshape(size, n_units)
        else:
            counts = generator.multinomial(n, shares, size=size)
        values = statistic(counts.astype(np.float64))
        return values, None if scores is None else counts @ scores

    width = 3 * n_units + (2 * n if one_by_one else 0)
    if units.rows is not None:
        width += 4 * units.rows.shape[1]
    return Sampler(draw_chunk=draw_chunk, control=control, width=width)


def _packable(units: SamplingUnits) -> Lattice | None:
    """Return steps whose sums fit into one integer: of the features, or shorter."""
    if units.rows is None:
        return None
    plain = grid_of(units.rows, units.n)
    if plain is None:
        return None
    if plain.bits(units.n).sum() <= _MAX_BITS:
        return plain
    short = units.lattice
    if short is None or short.bits(units.n).sum() > _MAX_BITS:
        return None
    return short


def _packed_sampler(
    units: SamplingUnits,
    lattice: Lattice,
    slopes: tuple[Floats, float] | None,
    at_once: int,
) -> Sampler:
    """Draw sums of features, several units by one lookup."""
    # The steps of a unit are bit fields of one integer, and so are those of a sum. A
    # table of the sums of any `at_once` units makes so many draws one lookup; the last
    # one may be of more than are left, and `surplus` is what it has too much.
    n = units.n
    bits = lattice.bits(n)
    places = np.cumsum(bits) - bits
    fields = list(zip(places.tolist(), ((1 << bits) - 1).tolist(), strict=True))
    keys = np.repeat((lattice.steps << places).sum(axis=1), units.freq)
    table = surplus = np.zeros(1, dtype=np.int64)
    n_lookups = -(-n // at_once)
    n_surplus = n_lookups * at_once - n
    for digit in range(at_once):
        table = np.add.outer(keys, table).ravel()
        extra = keys if digit >= at_once - n_surplus else 0 * keys
        surplus = np.add.outer(extra, surplus).ravel()
    scores = control = None
    if slopes is not None:
        scores = _scores_of_steps(lattice.steps, *slopes, n)
        control = control_of(lattice.steps @ scores, units.shares, n)

    def draw_chunk(size: int, generator: np.random.Generator) -> Draws:
        at = generator.integers(0, table.size, size=(size, n_lookups))
        packed = np.einsum("ij->i", table[at])  # sums short rows faster than sum
        packed -= surplus[at[:, -1]]
        steps = np.empty((size, bits.size), dtype=np.int64)
        for column, (place, mask) in enumerate(fields):
            np.bitwise_and(packed >> place, mask, out=steps[:, column])
        values = units.values(lattice.sums(steps, n))
        return values, None if scores is None else steps @ scores

    width = 3 * n_lookups + 4 * lattice.origin.size
    return Sampler(draw_chunk=draw_chunk, control=control, width=width)


def integer_scores(slopes: Floats, sd: float, n: int) -> Integers:
    """Round slopes to integers that are fine enough, and few enough."""
    # Fine enough is a part of the spread; the sums span 17 of their deviations.
    scale = min(_FINE, _MAX_SPAN / (17.0 * math.sqrt(n))) / sd
    return np.asarray(np.rint(slopes * scale), dtype=np.int64)


def _scores_of_steps(steps: Integers, slopes: Floats, sd: float, n: int) -> Integers:
    """Return the score of a step in each dimension, (n_dimensions,)."""
    design = np.column_stack([steps, np.ones(len(steps))])
    per_step, *_ = np.linalg.lstsq(design, slopes)
    return integer_scores(per_step[:-1].astype(np.float64), sd, n)


def control_of(scores: Integers, shares: Floats, n: int) -> Control:
    """Return the distribution of a sum of the scores of n draws."""
    # Takes scores (n_units,), shares (n_units,)
    lowest = int(scores.min())
    least, weights = sums_of_scores(scores - lowest, shares, n)
    return Control(least=least + n * lowest, cumulative=np.cumsum(weights))
