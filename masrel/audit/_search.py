"""The search: how many tables give printed numbers, counted with bounded work.

With integer weights v of disagreement by the distance of two categories, S the sum of
v over all pairs of ratings and C the sum expected by chance, agreement is 1 - S / (N
v_max) and kappa 1 - f S / C, where N pairs and the factor f depend on the design alone.
A printed percentage allows a range of S, a printed kappa for every S a range of C.
`SquareTables` has the tables of two raters, `ItemTables` those of more.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache, lru_cache
from itertools import combinations, islice
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.audit._claims import Claim
from masrel.audit._printed import Bounds, Rule, Window, whole_numbers

Integers = NDArray[np.int64]
CellRows = tuple[tuple[int, ...], ...]

MAX_COUNTED = 10_000
"""Tables that are counted; of more it is said that there are at least as many."""

N_EXAMPLES = 10
"""Tables that are shown."""

_MAX_VISITED = 100_000_000  # partial tables of two raters, until a search is given up
_MAX_VISITED_ITEMS = 20_000_000  # states of items of more raters
_FIRST_VISITED_ITEMS = 1_000_000  # of a first search, enough where tables are many
_UNBOUNDED = 1 << 60  # more than any sum
_MAX_KEY = 1 << 62
_BLOCK = 1000  # rows that are made at once
_STATES = 1_000_000  # states of items that are made at once
_MADE = 100_000  # tables that are made at once
_STEP_COST = 1000  # what a step costs at the least, in partial tables
_ROW_COST = 50  # what it costs to see in which range kappa lets the chance sum lie
_MERGED = 512  # states from which equal ones are put together


class WorkLimitError(Exception):
    """The bound on work is met."""


class Step(NamedTuple):
    """Tables that were met at one step."""

    numbers: Mapping[Rule | None, int]  # by rule, and by any of them (None)
    n_agreed: Iterable[int]  # on how many items two raters agree in them
    examples: Callable[[], Iterator[CellRows]]


def disagreement(weights: str, n_categories: int) -> Integers:
    """Return v by the distance of two categories, in whole numbers."""
    steps = np.arange(n_categories)
    if weights == "identity":
        return np.minimum(steps, 1)
    return steps if weights == "linear" else steps**2


def matrix_of(distances: Integers) -> Integers:
    """Return disagreement of any two categories, (n_categories, n_categories)."""
    codes = np.arange(len(distances))
    return np.asarray(distances[abs(codes[:, None] - codes)])


class _Search:
    """A search for the tables of a claim with named weights, and its bound on work."""

    def __init__(self, claim: Claim, limit: int = _MAX_VISITED) -> None:
        self.claim, self.limit = claim, limit
        self.n_visited = 0
        n, m, q = claim.n_items, claim.n_raters, claim.n_categories
        printed = claim.printed()
        self._kappa = printed.get("kappa")
        self.v_agreement = disagreement(claim.agreement_weights, q)
        self.v_kappa = disagreement(claim.kappa_weights, q)
        # of two raters one pair an item and C = Σ v_ij r_i c_j; of more Fleiss' kappa:
        # ordered pairs, and C = Σ v_ij T_i T_j of the totals T of categories
        n_pairs = n if m == 2 else n * m * (m - 1)
        self._factor = Fraction(n) if m == 2 else Fraction(n * m, m - 1)
        most = n_pairs * int(self.v_agreement.max())
        self.observed: dict[Rule, Window] = dict.fromkeys(claim.rules, (0, most))
        if "agreement" in printed:
            for rule in claim.rules:  # 100 (1 - S / most) lies in the bounds
                low, high, has_low, has_high = printed["agreement"].bounds(rule)
                ends = most * (1 - high / 100), most * (1 - low / 100)
                first, last = whole_numbers(Bounds(*ends, has_high, has_low))
                self.observed[rule] = max(first, 0), min(last, most)
        self.v = matrix_of(self.v_kappa)
        self.chance = cache(self._chance)

    def charge(self, n: int) -> None:
        """Count work before it is done."""
        if self.n_visited + n > self.limit:
            raise WorkLimitError
        self.n_visited += n

    def _chance(self, rule: Rule, observed: int) -> Window:
        """Return which C the printed kappa allows where S is `observed`."""
        if self._kappa is None:
            return 0, _UNBOUNDED
        low, high, has_low, has_high = self._kappa.bounds(rule)
        if observed == 0:  # kappa is 1, if it is defined
            is_one = (
                low < 1 < high or (high == 1 and has_high) or (low == 1 and has_low)
            )
            return (1, _UNBOUNDED) if is_one else (1, 0)
        if low >= 1:
            return 1, 0
        # 1 - f S / C lies in the bounds
        total = self._factor * observed
        most = total / (1 - high) if high < 1 else Fraction(_UNBOUNDED)
        return whole_numbers(Bounds(total / (1 - low), most, has_low, has_high))


def _union(windows: Mapping[Rule, Window]) -> Window:
    # What any rule allows: one rule's values are among the other's, since both differ
    # in the ends alone.
    some = [window for window in windows.values() if window[0] <= window[1]]
    return min((w[0] for w in some), default=1), max((w[1] for w in some), default=0)


def _compositions(parts: Sequence[tuple[int, int]]) -> Iterator[Integers]:
    """Yield blocks of rows: every way to share each total among its cells."""
    # parts: (total, cells); rows have the cells of all parts, side by side
    sizes = [comb(total + cells - 1, cells - 1) for total, cells in parts]
    if np.prod(sizes, dtype=object) <= _BLOCK:
        rows = np.zeros((1, 0), dtype=np.int64)
        for total, cells in parts:
            ways = _shares(total, cells)
            left = np.repeat(rows, len(ways), axis=0)
            rows = np.hstack([left, np.tile(ways, (len(rows), 1))])
        yield rows
        return
    (total, cells), *rest = parts
    for first in range(total + 1) if cells > 1 else (total,):
        unshared = [(total - first, cells - 1)] if cells > 1 else []
        for block in _compositions([*unshared, *rest]):
            yield np.column_stack([np.full(len(block), first), block])


@lru_cache(maxsize=4096)
def _shares(total: int, cells: int) -> Integers:
    # (n, cells): every way to share the total, between bars among total + cells - 1
    n = total + cells - 1
    bars = [(-1, *places, n) for places in combinations(range(n), cells - 1)]
    places = np.array(bars, dtype=np.int64)
    return places[:, 1:] - places[:, :-1] - 1


def _merged(states: Integers) -> Integers:
    # states (2 or more, n): keys, counts, and whatever stands beside them; equal keys
    # once, rising, with their counts added up
    if not states.shape[1]:
        return states
    states = states[:, np.argsort(states[0], kind="stable")]
    keys, counts = states[:2]
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    merged = states[:, starts]
    merged[1] = np.minimum(np.add.reduceat(counts, starts), MAX_COUNTED)
    return merged


class _Hit(NamedTuple):
    """Diagonals that go with one symmetric part, and what g must be for each."""

    between: Integers  # y, (n_pairs_of_categories,)
    diagonals: Integers  # (n, n_categories)
    symmetric: Integers  # s'Vs, (n,)
    windows: dict[Rule, Window]  # of 4 C


class SquareTables(_Search):
    """All tables of two raters that a claim allows, counted without making them.

    A table is taken apart in three, and each part is enumerated only where the one
    before allows it:

    1. How many items differ by 0, 1, 2, ... categories. This alone fixes the sum S of
       disagreement, for agreement and for kappa; a percentage leaves few of them, and
       kappa then says in which range the chance sum C must lie.
    2. The symmetric part: the diagonal d, and for every two categories how many items y
       are between them, whoever gave the higher. It fixes s = r + c, the margins of
       both raters together.
    3. The asymmetric part: how the y of every two categories fall to either side. It
       fixes δ = r - c. Since 4 C = s'Vs - δ'Vδ for symmetric weights V, all that
       matters of it is one number g = -δ'Vδ; how many ways lead to each g is counted
       once for a y.

    For the three weights g is a sum of squares, between 0 and a bound that y has:
    diagonals whose 4 C cannot be reached are dropped before (3) is looked at. All is in
    integers. Margins of the claim are looked at only where tables are made.
    """

    def __init__(self, claim: Claim, limit: int = _MAX_VISITED) -> None:
        """Lay out what all parts need."""
        super().__init__(claim, limit)
        q = claim.n_categories
        self.margins = [
            None if m is None else np.array(m)
            for m in (claim.margins_1, claim.margins_2)
        ]
        # pairs of categories, those of one distance together
        pairs = [(i, i + lag) for lag in range(1, q) for i in range(q - lag)]
        self.first, self.second = np.array(pairs).T
        self.incidence = np.eye(q, dtype=np.int64)[self.first]
        self.incidence[np.arange(len(pairs)), self.second] = 1  # (n_pairs, q)
        self.squares, self.factor = _as_squares(claim.kappa_weights, q)
        # squares · δ by pair, (n_squares, n_pairs)
        self.by_pair = self.squares[:, self.first] - self.squares[:, self.second]
        self.block_cost = _STEP_COST + 100 * q**2

    def steps(self) -> Iterator[Step]:
        """Yield what each symmetric part has."""
        for hit in self._hits():

            def examples(hit: _Hit = hit) -> Iterator[CellRows]:
                for block in self._tables(hit):
                    yield from as_rows(block)

            yield Step(self._count(hit), {int(hit.diagonals[0].sum())}, examples)

    def tables(self) -> Iterator[Integers]:
        """Yield blocks of all tables, (n, n_categories, n_categories)."""
        for hit in self._hits():
            yield from self._tables(hit)

    def _hits(self) -> Iterator[_Hit]:
        # every symmetric part that may belong to a table, with diagonals
        q = self.claim.n_categories
        for distances, windows in self._distances():
            lags = [(int(n), q - lag) for lag, n in enumerate(distances, start=1)]
            n_equal = self.claim.n_items - int(distances.sum())
            for between in _compositions(lags):
                for diagonals in _compositions([(n_equal, q)]):
                    yield from self._fitting(between, diagonals, windows)

    def _distances(self) -> Iterator[tuple[Integers, dict[Rule, Window]]]:
        # how many items differ by how much, with the windows of 4 C; few that differ
        # first, since there tables are soon met where there are any
        low, high = _union(self.observed)
        for m in range(self.claim.n_items + 1):
            for block in _compositions([(m, self.claim.n_categories - 1)]):
                self.charge(max(len(block), self.block_cost))
                sums = block @ self.v_agreement[1:]
                rows = block[(sums >= low) & (sums <= high)]
                self.charge(_ROW_COST * len(rows))
                for row in rows:
                    if windows := self._windows(m, row):
                        yield row, windows

    def _windows(self, m: int, row: Integers) -> dict[Rule, Window]:
        # of 4 C by the rules that allow these sums; m items differ
        n = self.claim.n_items
        s_agreement = int(row @ self.v_agreement[1:])
        s_kappa = int(row @ self.v_kappa[1:])
        # least where all that agrees is in one category, and all that differs between
        # this and one other; for identity weights, s'Vs = 4 n^2 - s's
        least = 2 * m * (2 * n - m)
        greatest = 4 * int(self.v.max()) * n**2
        if self.claim.kappa_weights == "identity":  # r'c is at least d'd
            greatest -= 4 * (n - m) ** 2 // self.claim.n_categories
        windows = {}
        for rule, (first, last) in self.observed.items():
            if first <= s_agreement <= last:
                low, high = self.chance(rule, s_kappa)
                if low <= high and 4 * high >= least and 4 * low <= greatest:
                    windows[rule] = (4 * low, 4 * high)
        return windows

    def _fitting(
        self,
        between: Integers,  # (n_between, n_pairs)
        diagonals: Integers,  # (n_diagonals, n_categories)
        windows: dict[Rule, Window],
    ) -> Iterator[_Hit]:
        self.charge(max(len(between) * len(diagonals), self.block_cost))
        sides = between @ self.incidence  # s of what is off the diagonal
        chance = sides @ self.v  # (n_between, n_categories)
        diagonal = 4 * ((diagonals @ self.v) * diagonals).sum(axis=1)
        # whole numbers far below 2^53 are exact as floats, whose products are faster
        symmetric = (4.0 * chance @ diagonals.T.astype(float)).astype(np.int64)
        symmetric += diagonal + (chance * sides).sum(axis=1)[:, None]
        reach = self.factor * ((between @ abs(self.by_pair).T) ** 2).sum(axis=1)
        low, high = _union(windows)
        fits = (symmetric <= high) & (symmetric + reach[:, None] >= low)
        first, second = self.margins
        if first is not None and second is not None:
            both = 2 * diagonals + sides[:, None]  # (n_between, n_diagonals, q)
            fits &= (both == first + second).all(axis=2)
        for row in np.flatnonzero(fits.any(axis=1)):
            fit = fits[row]
            yield _Hit(between[row], diagonals[fit], symmetric[row, fit], windows)

    def _count(self, hit: _Hit) -> dict[Rule | None, int]:
        # tables of a hit by each rule, and by any of them (None)
        values, counts = self._asymmetries(hit.between)
        totals = np.concatenate([[0], np.cumsum(np.minimum(counts, MAX_COUNTED))])
        self.charge(_STEP_COST)

        @cache
        def within(low: int, high: int) -> int:
            first = np.searchsorted(values, low - hit.symmetric)
            last = np.searchsorted(values, high - hit.symmetric, "right")
            return int((totals[last] - totals[first]).sum())

        numbers: dict[Rule | None, int] = {None: within(*_union(hit.windows))}
        return numbers | {rule: within(*window) for rule, window in hit.windows.items()}

    def _asymmetries(self, between: Integers) -> tuple[Integers, Integers]:
        # every g of a symmetric part, rising, and how many ways lead to it
        last = len(self.squares)
        if self.claim.kappa_weights == "identity":
            last -= 1  # δ sums to 0
        steps = self.by_pair[:last]
        half = int((abs(steps) @ between).max())
        places = [(2 * half + 1) ** k for k in range(last)]
        if places[-1] * (2 * half + 1) >= _MAX_KEY:
            raise WorkLimitError
        states = np.array([[0], [1]])  # keys, counts
        for pair in np.flatnonzero(between):
            n = int(between[pair])
            self.charge(states.shape[1] * (n + 1))
            to_either = np.arange(-n, n + 1, 2) * int(places @ steps[:, pair])
            keys = (states[0, :, None] + to_either).ravel()
            states = np.vstack([keys, np.repeat(states[1], n + 1)])
            if len(keys) > _MERGED:
                states = _merged(states)
        keys = states[0] + half * sum(places)
        digits = keys[:, None] // places % (2 * half + 1) - half  # (n, last)
        g = (digits**2).sum(axis=1)
        if last < len(self.squares):
            g += digits.sum(axis=1) ** 2
        values, counts = _merged(np.vstack([g * self.factor, states[1]]))
        return values, counts

    def _tables(self, hit: _Hit) -> Iterator[Integers]:
        # blocks of the tables of a hit that have the margins
        shape = tuple(int(n) + 1 for n in hit.between)
        n_ways = int(np.prod(shape, dtype=object))
        low, high = _union(hit.windows)
        for first in range(0, n_ways, _MADE):
            last = min(first + _MADE, n_ways)
            self.charge(last - first)
            above = np.column_stack(np.unravel_index(np.arange(first, last), shape))
            z = (2 * above - hit.between) @ self.by_pair.T
            g = self.factor * (z**2).sum(axis=1)
            order = np.argsort(g, kind="stable")
            begin = np.searchsorted(g[order], low - hit.symmetric)
            end = np.searchsorted(g[order], high - hit.symmetric, "right")
            for k in np.flatnonzero(end > begin):
                chosen = above[order[begin[k] : end[k]]]
                yield self._made(hit.diagonals[k], chosen, hit.between - chosen)

    def _made(self, diagonal: Integers, above: Integers, below: Integers) -> Integers:
        codes = np.arange(len(diagonal))
        tables = np.zeros((len(above), len(codes), len(codes)), dtype=np.int64)
        tables[:, codes, codes] = diagonal
        tables[:, self.first, self.second] = above
        tables[:, self.second, self.first] = below
        for margins, axis in zip(self.margins, (2, 1), strict=True):
            if margins is not None:
                tables = tables[(tables.sum(axis=axis) == margins).all(axis=1)]
        return tables


def _as_squares(weights: str, n_categories: int) -> tuple[Integers, int]:
    # V as squares, (n, n_categories): -δ'Vδ = factor · Σ (squares · δ)², where Σ δ = 0
    if weights == "identity":
        return np.eye(n_categories, dtype=np.int64), 1
    if weights == "linear":  # |k - l| counts the steps between them
        return np.tri(n_categories, dtype=np.int64)[:-1], 2
    return np.arange(n_categories)[None, :], 2


def as_rows(tables: Integers) -> list[CellRows]:
    """Return tables as tuples of rows."""
    return [tuple(map(tuple, table)) for table in tables.tolist()]


class ItemTables(_Search):
    """Tables of more than two raters that a claim allows, item by item.

    Of a table only two sums matter: disagreement, which adds up over items, and how
    often each category was chosen in all. Items are added one by one; tables that have
    both sums alike are one state from there on, which keeps how many they are. A
    printed percentage drops states from which it cannot be reached any more. Where the
    states get too many for the bound on work, an even choice of them is gone on with:
    what is counted then is a part of the tables, and nothing follows from none.

    States are columns: the sums as one number (key), how many tables have them, one of
    the states they come from, and the item that was added to it.
    """

    def _lay_out(self) -> None:
        # what an item may be
        q, raters = self.claim.n_categories, self.claim.n_raters
        self.charge(comb(raters + q - 1, q - 1))
        self.rows = np.vstack(list(_compositions([(raters, q)])))  # (n_rows, q)
        disagreements = [
            ((self.rows @ matrix_of(v)) * self.rows).sum(axis=1)
            for v in (self.v_agreement, self.v_kappa)
        ]
        # what a row adds; of the last category the total follows from the others
        self.sums = np.column_stack([*disagreements, self.rows[:, :-1]])
        self.bases = [int(n) * self.claim.n_items + 1 for n in self.sums.max(axis=0)]
        if np.prod(self.bases, dtype=object) >= _MAX_KEY:
            raise WorkLimitError
        self.per_row = self.sums @ np.cumprod([1, *self.bases[:-1]])

    def steps(self) -> Iterator[Step]:
        """Yield the tables that end in some of the states before the last item."""
        self._lay_out()
        layers = [np.array([[0], [1], [0], [0]])]
        is_whole = True
        for left in range(self.claim.n_items - 1, -1, -1):
            layer = self._thinned(layers[-1], left + 1)
            is_whole &= layer.shape == layers[-1].shape
            layers[-1] = layer
            self.charge(layer.shape[1] * len(self.per_row))
            if left:
                parts = [
                    self._added(layer, begin, left) for begin in self._blocks(layer)
                ]
                layers.append(_merged(np.hstack(parts)) if parts else layer)
        for begin in self._blocks(layers[-1]):
            yield self._fitting(layers, begin)
        if not is_whole:
            raise WorkLimitError

    def _blocks(self, layer: Integers) -> range:
        return range(0, layer.shape[1], max(_STATES // len(self.per_row), 1))

    def _thinned(self, layer: Integers, n_left: int) -> Integers:
        # no more states than the work that is left allows
        n = layer.shape[1]
        allowed = (self.limit - self.n_visited) // n_left // len(self.rows)
        if n <= allowed:
            return layer
        if not allowed:
            raise WorkLimitError
        return layer[:, np.linspace(0, n - 1, allowed).astype(np.int64)]

    def _block(self, layer: Integers, begin: int) -> Integers:
        # keys of some states with one item more, (n, n_rows)
        end = begin + self._blocks(layer).step
        return np.asarray(layer[0, begin:end, None] + self.per_row)

    def _added(self, layer: Integers, begin: int, left: int) -> Integers:
        # those from which so many more items can still reach the percentage
        keys = self._block(layer, begin).ravel()
        before, row = np.divmod(np.arange(len(keys)), len(self.per_row))
        before += begin
        low, high = _union(self.observed)
        observed = keys % self.bases[0]
        more = left * int(self.sums[:, 0].max())
        can_reach = (observed <= high) & (observed + more >= low)
        states = np.vstack([keys, layer[1, before], before, row])
        return _merged(states[:, can_reach])

    def _fitting(self, layers: list[Integers], begin: int) -> Step:
        keys = self._block(layers[-1], begin)
        counts = layers[-1][1, begin : begin + len(keys)]
        fits = {rule: f.reshape(keys.shape) for rule, f in self._fits(keys.ravel())}
        places = np.flatnonzero(fits[None]) + begin * len(self.per_row)

        def examples() -> Iterator[CellRows]:
            # one table of each state, from its last item back
            for place in places:
                state, row = divmod(int(place), len(self.rows))
                rows = [row]
                for layer in reversed(layers[1:]):
                    rows.append(int(layer[3, state]))
                    state = int(layer[2, state])
                yield tuple(tuple(self.rows[k].tolist()) for k in reversed(rows))

        numbers = {rule: int(counts @ fit.sum(axis=1)) for rule, fit in fits.items()}
        return Step(numbers, (), examples)

    def _fits(self, keys: Integers) -> Iterator[tuple[Rule | None, NDArray[np.bool_]]]:
        sums = []
        for base in self.bases:
            keys, sum_ = np.divmod(keys, base)
            sums.append(sum_)
        agreement, kappa, *chosen = sums
        all_ = self.claim.n_items * self.claim.n_raters
        totals = np.column_stack([*chosen, all_ - sum(chosen)])
        chance = ((totals @ self.v) * totals).sum(axis=1)
        values, places = np.unique(kappa, return_inverse=True)
        any_ = np.zeros(len(chance), dtype=bool)
        for rule, (low, high) in self.observed.items():
            ends = [self.chance(rule, int(s)) for s in values]
            least, most = np.array(ends).T[:, places]
            fit = (agreement >= low) & (agreement <= high)
            fit &= (chance >= least) & (chance <= most)
            any_ |= fit
            yield rule, fit
        yield None, any_


class Count:
    """Tables of a search that were counted until all were, or enough, or work ended."""

    def __init__(self, search: SquareTables | ItemTables) -> None:
        """Go through the search."""
        rules = search.claim.rules
        self.numbers: dict[Rule | None, int] = dict.fromkeys((None, *rules), 0)
        self.examples: list[CellRows] = []
        self.n_agreed: set[int] = set()
        self.is_whole = self.is_enough = False
        try:
            for step in search.steps():
                for rule, n in step.numbers.items():
                    self.numbers[rule] += n
                if step.numbers[None]:
                    self.n_agreed.update(step.n_agreed)
                    lacking = N_EXAMPLES - len(self.examples)
                    self.examples += islice(step.examples(), lacking)
                if self.numbers[None] >= MAX_COUNTED:
                    self.is_enough = True
                    break
            self.is_whole = not self.is_enough
        except WorkLimitError:
            pass  # neither whole nor enough
        self.n_visited = search.n_visited


def count_tables(claim: Claim) -> Count:
    """Count the tables that give percentage and kappa of a claim with named weights."""
    if claim.n_raters == 2:
        return Count(SquareTables(claim))
    first = Count(ItemTables(claim, _FIRST_VISITED_ITEMS))
    if first.is_whole or first.is_enough:
        return first
    return Count(ItemTables(claim, _MAX_VISITED_ITEMS))
