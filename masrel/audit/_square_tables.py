"""All tables of two raters that give printed numbers, counted without making them.

A table is taken apart in three, and each part is enumerated only where the one before
allows it:

1. How many items differ by 0, 1, 2, ... categories. This alone fixes the sum S of
   disagreement, for agreement and for kappa; a percentage leaves few of them, and
   kappa then says in which range the chance sum C must lie.
2. The symmetric part: the diagonal d, and for every two categories how many items y
   are between them, whoever gave the higher. It fixes s = r + c, the margins of both
   raters together.
3. The asymmetric part: how the y of every two categories fall to either side. It fixes
   δ = r - c. Since 4 C = s'Vs - δ'Vδ for symmetric weights V, all that matters of it is
   one number g = -δ'Vδ; how many ways lead to each g is counted once for a y.

For the three weights g is a sum of squares, between 0 and a bound that y has: diagonals
whose 4 C cannot be reached are dropped before (3) is looked at. All is in integers.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import comb

import numpy as np

from masrel.audit._printed import Rule
from masrel.audit._windows import (
    AuditWeights,
    Integers,
    Question,
    Window,
    by_distance,
    matrix_of,
    union,
)

MAX_VISITED = 100_000_000
"""Partial tables that are visited before a search is given up."""

MAX_COUNTED = 10_000
"""Tables that are counted; of more it is said that there are at least as many."""

_BLOCK = 1000  # rows that are made at once
_STEP_COST = 1000  # what a step costs at the least, in partial tables
_ROW_COST = 50  # what it costs to see in which range kappa lets the chance sum lie
_MERGED = 512  # states from which equal ones are put together
_MADE = 100_000  # tables that are made at once


class WorkLimitError(Exception):
    """The bound on work is met."""


@dataclass(slots=True)
class Work:
    """Partial tables that were visited."""

    n_visited: int = 0
    limit: int = MAX_VISITED

    def charge(self, n: int) -> None:
        """Count work before it is done."""
        if self.n_visited + n > self.limit:
            raise WorkLimitError
        self.n_visited += n


def compositions(parts: Sequence[tuple[int, int]]) -> Iterator[Integers]:
    """Yield blocks of rows: every way to share each total among its cells."""
    # parts: (total, cells); rows have the cells of all parts, side by side
    sizes = [comb(total + cells - 1, cells - 1) for total, cells in parts]
    if np.prod(sizes, dtype=object) <= _BLOCK:
        yield _product([_shares(total, cells) for total, cells in parts])
        return
    (total, cells), *rest = parts
    firsts = range(total + 1) if cells > 1 else (total,)
    for first in firsts:
        left = [(total - first, cells - 1)] if cells > 1 else []
        for block in compositions([*left, *rest]):
            yield np.column_stack([np.full(len(block), first), block])


def _product(parts: Sequence[Integers]) -> Integers:
    # every row of each with every row of the others
    rows = np.zeros((1, 0), dtype=np.int64)
    for part in parts:
        left = np.repeat(rows, len(part), axis=0)
        rows = np.hstack([left, np.tile(part, (len(rows), 1))])
    return rows


def _shares(total: int, cells: int) -> Integers:
    # (n, cells): every way to share the total among so many cells
    rows = np.zeros((1, 0), dtype=np.int64)
    left = np.array([total])
    for _ in range(cells - 1):
        n = left + 1
        ends = np.cumsum(n)
        here = np.arange(ends[-1]) - np.repeat(ends - n, n)
        rows = np.column_stack([np.repeat(rows, n, axis=0), here])
        left = np.repeat(left, n) - here
    return np.column_stack([rows, left])


@dataclass(frozen=True, slots=True)
class Asymmetry:
    """Weights V as squares: -δ'Vδ = factor · Σ (squares · δ)², where Σ δ = 0."""

    squares: Integers  # (n_squares, n_categories)
    factor: int

    @classmethod
    def of(cls, weights: AuditWeights, n_categories: int) -> "Asymmetry":
        """Return those of weights by name."""
        if weights == "identity":
            return cls(np.eye(n_categories, dtype=np.int64), 1)
        if weights == "linear":  # |k - l| counts the steps between them
            steps = np.tri(n_categories, dtype=np.int64)[:-1]
            return cls(steps, 2)
        return cls(np.arange(n_categories)[None, :], 2)


@dataclass(frozen=True, slots=True, eq=False)
class Hit:
    """Diagonals that go with one symmetric part, and what g must be for each."""

    between: Integers  # y, (n_pairs_of_categories,)
    diagonals: Integers  # (n, n_categories)
    symmetric: Integers  # s'Vs, (n,)
    windows: dict[Rule, Window]  # of 4 C


@dataclass(slots=True, eq=False)
class SquareTables:
    """The tables of two raters that a question allows."""

    question: Question
    work: Work
    # margins of both raters together, where they are known, (n_categories,)
    margins: Integers | None = None
    pairs: Integers = field(init=False)  # (n_pairs, 2), those of one distance together
    _steps: Integers = field(init=False)  # (n_squares, n_pairs): of squares · δ by pair
    _incidence: Integers = field(init=False)  # (n_pairs, n_categories)
    _v: Integers = field(init=False)  # (n_categories, n_categories), of kappa
    _asymmetry: Asymmetry = field(init=False)
    _block_cost: int = field(init=False)  # what a block of rows costs at the least
    _of_chance: dict[tuple[Rule, int], Window] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Lay out what all parts need."""
        q = self.question.n_categories
        self._block_cost = _STEP_COST + 100 * q**2
        self.pairs = np.array(
            [(i, i + lag) for lag in range(1, q) for i in range(q - lag)]
        )
        self._asymmetry = Asymmetry.of(self.question.kappa_weights, q)
        squares = self._asymmetry.squares
        self._steps = squares[:, self.pairs[:, 0]] - squares[:, self.pairs[:, 1]]
        self._incidence = np.zeros((len(self.pairs), q), dtype=np.int64)
        for column in (0, 1):
            self._incidence[np.arange(len(self.pairs)), self.pairs[:, column]] = 1
        self._v = matrix_of(by_distance(self.question.kappa_weights, q))

    def hits(self) -> Iterator[Hit]:
        """Yield every symmetric part that may belong to a table, with diagonals."""
        for distances, windows in self._distances():
            low, high = union(windows)
            if low > high:
                continue
            q = self.question.n_categories
            lags = [(int(n), q - lag) for lag, n in enumerate(distances, start=1)]
            n_equal = self.question.n_items - int(distances.sum())
            for between in compositions(lags):
                for diagonals in compositions([(n_equal, q)]):
                    yield from self._fitting(between, diagonals, windows, (low, high))

    def _distances(self) -> Iterator[tuple[Integers, dict[Rule, Window]]]:
        # how many items differ by how much, with the windows of 4 C; few that differ
        # first, since there tables are soon met where there are any
        question = self.question
        v_agreement, v_kappa = question.disagreements
        observed = question.observed()
        low, high = union(observed)
        for m in range(question.n_items + 1):
            for block in compositions([(m, question.n_categories - 1)]):
                self.work.charge(max(len(block), self._block_cost))
                sums = block @ v_agreement[1:]
                rows = block[(sums >= low) & (sums <= high)]
                self.work.charge(_ROW_COST * len(rows))
                for row in rows:
                    yield (
                        row,
                        self._windows(
                            m,
                            int(row @ v_agreement[1:]),
                            int(row @ v_kappa[1:]),
                            observed,
                        ),
                    )

    def _windows(
        self, m: int, s_agreement: int, s_kappa: int, observed: dict[Rule, Window]
    ) -> dict[Rule, Window]:
        # of 4 C by the rules that allow these sums; m items differ
        n, q = self.question.n_items, self.question.n_categories
        # least where all that agrees is in one category, and all that differs between
        # this and one other; for identity weights, s'Vs = 4 n^2 - s's
        least = 2 * m * (2 * n - m)
        greatest = 4 * int(self._v.max()) * n**2
        if self.question.kappa_weights == "identity":  # r'c is at least d'd
            greatest -= 4 * (n - m) ** 2 // q
        windows = {}
        for rule, (first, last) in observed.items():
            if first <= s_agreement <= last:
                if (rule, s_kappa) not in self._of_chance:
                    window = self.question.chance(rule, s_kappa)
                    self._of_chance[rule, s_kappa] = window
                low, high = self._of_chance[rule, s_kappa]
                if 4 * high >= least and 4 * low <= greatest:
                    windows[rule] = (4 * low, 4 * high)
        return windows

    def _fitting(
        self,
        between: Integers,  # (n_between, n_pairs)
        diagonals: Integers,  # (n_diagonals, n_categories)
        windows: dict[Rule, Window],
        window: Window,
    ) -> Iterator[Hit]:
        self.work.charge(max(len(between) * len(diagonals), self._block_cost))
        sides = between @ self._incidence  # s of what is off the diagonal
        chance = sides @ self._v  # (n_between, n_categories)
        diagonal = 4 * ((diagonals @ self._v) * diagonals).sum(axis=1)
        # whole numbers far below 2^53 are exact as floats, whose products are faster
        symmetric = (4.0 * chance @ diagonals.T.astype(float)).astype(np.int64)
        symmetric += diagonal + (chance * sides).sum(axis=1)[:, None]
        reach = ((between @ abs(self._steps).T) ** 2).sum(axis=1)
        reach *= self._asymmetry.factor
        fits = symmetric <= window[1]
        fits &= symmetric + reach[:, None] >= window[0]
        if self.margins is not None:
            both = 2 * diagonals + sides[:, None]  # (n_between, n_diagonals, q)
            fits &= (both == self.margins).all(axis=2)
        for row in np.flatnonzero(fits.any(axis=1)):
            fit = fits[row]
            yield Hit(between[row], diagonals[fit], symmetric[row, fit], windows)

    def count(self, hit: Hit) -> dict[Rule | None, int]:
        """Return how many tables a hit has by each rule, and by any of them (None)."""
        values, counts = self._asymmetries(hit.between)
        totals = np.concatenate([[0], np.cumsum(np.minimum(counts, MAX_COUNTED))])
        self.work.charge(_STEP_COST)
        numbers: dict[Rule | None, int] = {}
        by_window: dict[Window, int] = {}
        for rule, window in (*hit.windows.items(), (None, union(hit.windows))):
            if window not in by_window:
                low = np.searchsorted(values, window[0] - hit.symmetric)
                high = np.searchsorted(values, window[1] - hit.symmetric, "right")
                by_window[window] = int((totals[high] - totals[low]).sum())
            numbers[rule] = by_window[window]
        return numbers

    def _asymmetries(self, between: Integers) -> tuple[Integers, Integers]:
        # every g of a symmetric part, rising, and how many ways lead to it
        last = len(self._asymmetry.squares)
        if self.question.kappa_weights == "identity":
            last -= 1  # δ sums to 0
        steps = self._steps[:last]
        half = int((abs(steps) @ between).max())
        places = [(2 * half + 1) ** k for k in range(last)]
        if places[-1] * (2 * half + 1) >= 1 << 62:
            raise WorkLimitError
        keys, counts = np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.int64)
        for pair in np.flatnonzero(between):
            n = int(between[pair])
            self.work.charge(len(keys) * (n + 1))
            to_either = np.arange(-n, n + 1, 2) * int(places @ steps[:, pair])
            keys = (keys[:, None] + to_either).ravel()
            counts = np.repeat(counts, n + 1)
            if len(keys) > _MERGED:
                keys, counts = _merged(keys, counts)
        keys = keys + half * sum(places)
        digits = keys[:, None] // places % (2 * half + 1) - half  # (n, last)
        g = (digits**2).sum(axis=1)
        if last < len(self._asymmetry.squares):
            g += digits.sum(axis=1) ** 2
        return _merged(g * self._asymmetry.factor, counts)

    def tables(self, hit: Hit) -> Iterator[Integers]:
        """Yield blocks of the tables of a hit, (n, n_categories, n_categories)."""
        shape = tuple(int(n) + 1 for n in hit.between)
        n_ways = int(np.prod(shape, dtype=object))
        low, high = union(hit.windows)
        for first in range(0, n_ways, _MADE):
            last = min(first + _MADE, n_ways)
            self.work.charge(last - first)
            above = np.column_stack(np.unravel_index(np.arange(first, last), shape))
            z = (2 * above - hit.between) @ self._steps.T
            g = self._asymmetry.factor * (z**2).sum(axis=1)
            order = np.argsort(g, kind="stable")
            begin = np.searchsorted(g[order], low - hit.symmetric)
            end = np.searchsorted(g[order], high - hit.symmetric, "right")
            for k in np.flatnonzero(end > begin):
                chosen = above[order[begin[k] : end[k]]]
                yield self._made(hit.diagonals[k], chosen, hit.between - chosen)

    def _made(self, diagonal: Integers, above: Integers, below: Integers) -> Integers:
        q = self.question.n_categories
        tables = np.zeros((len(above), q, q), dtype=np.int64)
        tables[:, np.arange(q), np.arange(q)] = diagonal
        tables[:, self.pairs[:, 0], self.pairs[:, 1]] = above
        tables[:, self.pairs[:, 1], self.pairs[:, 0]] = below
        return tables


def _merged(keys: Integers, counts: Integers) -> tuple[Integers, Integers]:
    # equal keys once, rising, with their counts added up
    order = np.argsort(keys)
    keys, counts = keys[order], counts[order]
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    return keys[starts], np.minimum(np.add.reduceat(counts, starts), MAX_COUNTED)
