"""Tables of more than two raters that give printed numbers, item by item.

Of a table only two sums matter: disagreement, which adds up over items, and how often
each category was chosen in all. Items are added one by one; tables that have both sums
alike are one state from there on, which keeps how many they are. A printed percentage
drops states from which it cannot be reached any more. Where the states get too many for
the bound on work, an even choice of them is gone on with: what is counted then is a
part of the tables, and nothing follows from none.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from math import comb

import numpy as np

from masrel.audit._printed import Rule
from masrel.audit._square_tables import (
    MAX_COUNTED,
    Work,
    WorkLimitError,
    compositions,
)
from masrel.audit._windows import Integers, Question, matrix_of, union

MAX_VISITED_ITEMS = 20_000_000
"""States that are visited before a search is given up."""

FIRST_VISITED_ITEMS = 1_000_000
"""States of a first search, which is enough where tables are many."""

_BLOCK = 1_000_000  # states that are made at once

Rows = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    """The states after so many items."""

    keys: Integers  # sums, as one number
    counts: Integers  # tables that have them, no more than are counted
    before: Integers  # one of the states they come from
    row: Integers  # and the item that was added


@dataclass(slots=True, eq=False)
class ItemTables:
    """The tables of items that a question allows."""

    question: Question
    work: Work
    _rows: Integers = field(init=False)  # (n_rows, n_categories): what an item may be
    _sums: Integers = field(init=False)  # (n_rows, n_sums): what it adds
    _bases: list[int] = field(init=False)  # one more than each sum can be

    def __post_init__(self) -> None:
        """Lay out what an item may be."""
        q, raters, items = (
            self.question.n_categories,
            self.question.n_raters,
            self.question.n_items,
        )
        self.work.charge(comb(raters + q - 1, q - 1))
        self._rows = np.vstack(list(compositions([(raters, q)])))
        disagreements = [
            ((self._rows @ matrix_of(v)) * self._rows).sum(axis=1)
            for v in self.question.disagreements
        ]
        # of the last category the total follows from the others
        self._sums = np.column_stack([*disagreements, self._rows[:, :-1]])
        self._bases = [int(n) * items + 1 for n in self._sums.max(axis=0)]
        if np.prod(self._bases, dtype=object) >= 1 << 62:
            raise WorkLimitError

    def counts(
        self,
    ) -> Iterator[tuple[dict[Rule | None, int], Callable[[], Iterator[Rows]]]]:
        """Yield how many tables there are by rule and by any (None), and these."""
        n_items = self.question.n_items
        places = np.cumprod([1, *self._bases[:-1]])
        steps = self._sums @ places
        zero = np.zeros(1, dtype=np.int64)
        layers = [_Layer(zero, zero + 1, zero, zero)]
        is_whole = True
        for left in range(n_items - 1, -1, -1):
            layer, is_thinned = self._thinned(layers[-1], left + 1)
            layers[-1] = layer
            is_whole &= not is_thinned
            self.work.charge(len(layer.keys) * len(steps))
            if left:
                layers.append(self._added(layer, steps, left))
                continue
            for begin in range(0, len(layer.keys), max(_BLOCK // len(steps), 1)):
                end = begin + max(_BLOCK // len(steps), 1)
                yield self._fitting(layers, steps, begin, end)
        if not is_whole:
            raise WorkLimitError

    def _thinned(self, layer: _Layer, n_left: int) -> tuple[_Layer, bool]:
        # no more states than the work that is left allows
        allowed = (self.work.limit - self.work.n_visited) // n_left // len(self._rows)
        n = len(layer.keys)
        if n <= allowed:
            return layer, False
        if not allowed:
            raise WorkLimitError
        kept_states = np.linspace(0, n - 1, allowed).astype(np.int64)
        return _chosen(layer, kept_states), True

    def _added(self, layer: _Layer, steps: Integers, left: int) -> _Layer:
        # the states with one item more
        size = max(_BLOCK // len(steps), 1)
        parts = []
        for begin in range(0, len(layer.keys), size):
            keys = (layer.keys[begin : begin + size, None] + steps).ravel()
            before = np.repeat(
                np.arange(begin, begin + len(keys) // len(steps)), len(steps)
            )
            row = np.tile(np.arange(len(steps)), len(keys) // len(steps))
            part = _Layer(keys, layer.counts[before], before, row)
            parts.append(_merged(_chosen(part, self._reachable(keys, left))))
        if not parts:
            return layer
        return _merged(
            _Layer(
                *(
                    np.concatenate([getattr(part, name) for part in parts])
                    for name in ("keys", "counts", "before", "row")
                )
            )
        )

    def _reachable(self, keys: Integers, left: int) -> Integers:
        # states from which so many items can still reach the percentage
        low, high = union(self.question.observed())
        observed = keys % self._bases[0]
        more = left * int(self._sums[:, 0].max())
        return np.flatnonzero((observed <= high) & (observed + more >= low))

    def _fitting(
        self, layers: list[_Layer], steps: Integers, begin: int, end: int
    ) -> tuple[dict[Rule | None, int], Callable[[], Iterator[Rows]]]:
        # the tables that end in some of the states before the last item
        layer = layers[-1]
        keys = (layer.keys[begin:end, None] + steps).ravel()
        counts = np.repeat(layer.counts[begin:end], len(steps))
        fits = self._fits(keys)
        numbers = {rule: int(counts[fit].sum()) for rule, fit in fits.items()}
        places = np.flatnonzero(fits[None]) + begin * len(steps)
        return numbers, partial(self._examples, layers, places)

    def _fits(self, keys: Integers) -> dict[Rule | None, Integers]:
        sums = []
        for base in self._bases:
            keys, sum_ = np.divmod(keys, base)
            sums.append(sum_)
        agreement, kappa, *chosen = sums
        totals = np.column_stack(chosen)
        all_ = self.question.n_items * self.question.n_raters
        totals = np.column_stack([totals, all_ - totals.sum(axis=1)])
        v = matrix_of(self.question.disagreements[1])
        chance = ((totals @ v) * totals).sum(axis=1)
        fits: dict[Rule | None, Integers] = {}
        values, places = np.unique(kappa, return_inverse=True)
        for rule, (low, high) in self.question.observed().items():
            windows = np.array([self.question.chance(rule, int(s)) for s in values])
            fit = (agreement >= low) & (agreement <= high)
            fit &= chance >= windows[places, 0]
            fits[rule] = fit & (chance <= windows[places, 1])
        fits[None] = np.logical_or.reduce(list(fits.values()))
        return fits

    def _examples(self, layers: list[_Layer], places: Integers) -> Iterator[Rows]:
        # one table of each state, from its last item back
        for place in places:
            state, row = divmod(int(place), len(self._rows))
            rows = [row]
            for layer in reversed(layers[1:]):
                rows.append(int(layer.row[state]))
                state = int(layer.before[state])
            yield tuple(tuple(self._rows[k].tolist()) for k in reversed(rows))


def _chosen(layer: _Layer, states: Integers) -> _Layer:
    return _Layer(
        layer.keys[states],
        layer.counts[states],
        layer.before[states],
        layer.row[states],
    )


def _merged(layer: _Layer) -> _Layer:
    # equal states once, rising, with their counts added up
    if not len(layer.keys):
        return layer
    order = np.argsort(layer.keys, kind="stable")
    keys, counts = layer.keys[order], layer.counts[order]
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    counts = np.minimum(np.add.reduceat(counts, starts), MAX_COUNTED)
    return _Layer(
        keys[starts], counts, layer.before[order][starts], layer.row[order][starts]
    )
