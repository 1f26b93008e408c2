"""The search: how many tables give printed numbers, counted with bounded work.

With integer weights v of disagreement by the distance of two categories, S the sum of
v over all pairs of ratings and C the sum expected by chance, agreement is 1 - S / (N
v_max) and kappa 1 - f S / C, where N pairs and the factor f depend on the design alone.
A printed percentage allows a range of S, a printed kappa for every S a range of C.
`SquareTables` has the tables of two raters, `ItemTables` those of more.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import cache, lru_cache
from itertools import combinations, islice
from math import comb, prod
from typing import Self

import numpy as np
from numpy.typing import NDArray

from masrel.audit._claims import Claim, Rule, Window, whole_numbers

Integers = NDArray[np.int64]

MAX_COUNTED = 10_000  # of more tables it is said that there are at least as many
N_EXAMPLES = 10  # tables that are shown
_MAX_VISITED = 100_000_000  # partial tables of two raters, until a search is given up
_MAX_VISITED_ITEMS = 20_000_000  # states of items of more raters
_FIRST_VISITED_ITEMS = 1_000_000  # of a first search, enough where tables are many
_UNBOUNDED = 1 << 60  # more than any sum
_MAX_KEY = 1 << 62
_BLOCK = 1000  # rows that are made at once
_STATES = 1_000_000  # states of items that are made at once
_WAYS = 100_000  # ways to fill both sides of a table that are looked at at once
_STEP_COST = 1000  # what a step costs at the least, in partial tables
_ROW_COST = 50  # what it costs to see in which range kappa lets the chance sum lie


class WorkLimitError(Exception):
    """The bound on work is met."""


# tables that were met at one step
Step = tuple[
    Mapping[Rule | None, int],  # how many by rule, and by any of them (None)
    set[int],  # on how many items two raters agree in them
    Iterator[Integers],  # the tables, made one by one
]


def search_tables(
    claim: Claim, *, n_made: int = N_EXAMPLES
) -> "SquareTables | ItemTables":
    """Search the tables of a claim with named weights, and make up to `n_made`."""
    if claim.n_raters == 2:
        return SquareTables(claim).run(n_made)
    first = ItemTables(claim, _FIRST_VISITED_ITEMS).run(n_made)
    if first.is_whole or first.numbers[None] >= MAX_COUNTED:
        return first
    return ItemTables(claim, _MAX_VISITED_ITEMS).run(n_made)


def disagreement(weights: str, n_categories: int) -> Integers:
    """Return v of any two categories in whole numbers, (n_categories, n_categories)."""
    codes = np.arange(n_categories)
    steps = abs(codes[:, None] - codes)
    known = {"identity": np.minimum(steps, 1), "linear": steps, "quadratic": steps**2}
    return np.asarray(known[weights])


class _Search(ABC):
    """The tables of a claim with named weights, as far as work bounds the search."""

    def __init__(self, claim: Claim, limit: int = _MAX_VISITED) -> None:
        self.claim, self.limit, self.n_visited = claim, limit, 0
        self.numbers: dict[Rule | None, int] = dict.fromkeys((None, *claim.rules), 0)
        self.tables: list[Integers] = []  # the first of them
        self.n_agreed: set[int] = set()
        self.is_whole = False  # whether all was looked at
        n, m, q = claim.n_items, claim.n_raters, claim.n_categories
        printed = claim.printed()
        self._kappa = printed.get("kappa")
        self.v_agreement = disagreement(claim.agreement_weights, q)
        self.v = disagreement(claim.kappa_weights, q)
        # of two raters one pair an item and C = Σ v_ij r_i c_j; of more Fleiss' kappa:
        # ordered pairs, and C = Σ v_ij T_i T_j of the totals T of categories
        n_pairs = n if m == 2 else n * m * (m - 1)
        self._factor = Fraction(n) if m == 2 else Fraction(n * m, m - 1)
        most = n_pairs * int(self.v_agreement.max())
        windows: dict[Rule, Window] = dict.fromkeys(claim.rules, (0, most))
        if "agreement" in printed:
            for rule in claim.rules:  # 100 (1 - S / most) lies in the bounds
                low, high, has_low, has_high = printed["agreement"].bounds(rule)
                ends = most * (1 - high / 100), most * (1 - low / 100)
                first, last = whole_numbers((*ends, has_high, has_low))
                windows[rule] = max(first, 0), min(last, most)
        self.observed = _with_any(windows)
        self.chance = cache(self._chance)

    @abstractmethod
    def steps(self) -> Iterator[Step]:
        """Yield the tables, some at a time."""

    def run(self, n_made: int) -> Self:
        """Search until all was looked at, or enough was met, or work ended."""
        with suppress(WorkLimitError):
            for numbers, n_agreed, tables in self.steps():
                for rule, n in numbers.items():
                    self.numbers[rule] += n
                if numbers[None]:
                    self.n_agreed |= n_agreed
                    self.tables += islice(tables, n_made - len(self.tables))
                # margins are looked at only where tables are made
                is_made = n_made >= MAX_COUNTED
                if (len(self.tables) if is_made else self.numbers[None]) >= MAX_COUNTED:
                    return self
            self.is_whole = True
        return self

    def charge(self, n: int) -> None:
        """Count work before it is done."""
        if self.n_visited + n > self.limit:
            raise WorkLimitError
        self.n_visited += n

    def _chance(self, rule: Rule, observed: int) -> Window:
        """Return which C the printed kappa allows where S is `observed`."""
        if self._kappa is None:
            return 0, _UNBOUNDED
        bounds = low, high, has_low, has_high = self._kappa.bounds(rule)
        if observed == 0:  # kappa is 1, if it is defined
            first, last = whole_numbers(bounds)
            return (1, _UNBOUNDED) if first <= 1 <= last else (1, 0)
        if low >= 1:
            return 1, 0
        # 1 - f S / C lies in the bounds
        total = self._factor * observed
        most = total / (1 - high) if high < 1 else Fraction(_UNBOUNDED)
        return whole_numbers((total / (1 - low), most, has_low, has_high))


def _with_any(windows: Mapping[Rule, Window]) -> dict[Rule | None, Window]:
    # What any rule allows (None): one rule's values are among the other's, since both
    # differ in the ends alone.
    some = [window for window in windows.values() if window[0] <= window[1]]
    first = min((window[0] for window in some), default=1)
    last = max((window[1] for window in some), default=0)
    return {None: (first, last)} | dict(windows)


def _compositions(parts: Sequence[tuple[int, int]]) -> Iterator[Integers]:
    """Yield blocks of rows: every way to share each total among its cells."""
    # parts: (total, cells); rows have the cells of all parts, side by side
    if prod(comb(total + cells - 1, cells - 1) for total, cells in parts) <= _BLOCK:
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
       matters of it is one number g = -δ'Vδ.

    For the three weights g lies between 0 and a bound that y has: diagonals whose 4 C
    cannot be reached are dropped before (3) is looked at. All is in integers. Margins
    of the claim are looked at only where tables are made.
    """

    def __init__(self, claim: Claim) -> None:
        """Lay out what all parts need."""
        super().__init__(claim)
        q = claim.n_categories
        # pairs of categories, those of one distance together
        pairs = [(i, i + lag) for lag in range(1, q) for i in range(q - lag)]
        self.first, self.second = np.array(pairs).T
        ones = np.eye(q, dtype=np.int64)
        self.incidence = ones[self.first] + ones[self.second]  # (n_pairs, n_categories)
        # -δ'Vδ = z'Gz of what z more items of each pair are on the one side
        sides = ones[self.first] - ones[self.second]
        self.g_of_pairs = -sides @ self.v @ sides.T
        self.block_cost = _STEP_COST + 100 * q**2

    def steps(self) -> Iterator[Step]:
        """Yield what each symmetric part has, and some ways to fill both sides."""
        q = self.claim.n_categories
        for distances, windows in self._distances():
            lags = [(int(n), q - lag) for lag, n in enumerate(distances, start=1)]
            n_equal = self.claim.n_items - int(distances.sum())
            for between in _compositions(lags):
                for diagonals in _compositions([(n_equal, q)]):
                    yield from self._fitting(between, diagonals, windows)

    def _distances(self) -> Iterator[tuple[Integers, dict[Rule | None, Window]]]:
        # how many items differ by how much, with the windows of 4 C; few that differ
        # first, since there tables are soon met where there are any
        low, high = self.observed[None]
        for m in range(self.claim.n_items + 1):
            for block in _compositions([(m, self.claim.n_categories - 1)]):
                self.charge(max(len(block), self.block_cost))
                sums = block @ self.v_agreement[0, 1:]
                rows = block[(sums >= low) & (sums <= high)]
                self.charge(_ROW_COST * len(rows))
                for row in rows:
                    if windows := self._windows(m, row):
                        yield row, _with_any(windows)

    def _windows(self, m: int, row: Integers) -> dict[Rule, Window]:
        # of 4 C by the rules that allow these sums; m items differ
        n, claim = self.claim.n_items, self.claim
        s_agreement = int(row @ self.v_agreement[0, 1:])
        # least where all that agrees is in one category, and all that differs between
        # this and one other; for identity weights, s'Vs = 4 n^2 - s's
        least = 2 * m * (2 * n - m)
        greatest = 4 * int(self.v.max()) * n**2
        if claim.kappa_weights == "identity":  # r'c is at least d'd
            greatest -= 4 * (n - m) ** 2 // claim.n_categories
        windows = {}
        for rule in claim.rules:
            first, last = self.observed[rule]
            low, high = self.chance(rule, int(row @ self.v[0, 1:]))
            can_be = low <= high and 4 * high >= least and 4 * low <= greatest
            if first <= s_agreement <= last and can_be:
                windows[rule] = (4 * low, 4 * high)
        return windows

    def _fitting(
        self,
        between: Integers,  # (n_between, n_pairs)
        diagonals: Integers,  # (n_diagonals, n_categories)
        windows: dict[Rule | None, Window],
    ) -> Iterator[Step]:
        self.charge(max(len(between) * len(diagonals), self.block_cost))
        sides = between @ self.incidence  # s of what is off the diagonal
        chance = sides @ self.v  # (n_between, n_categories)
        diagonal = 4 * ((diagonals @ self.v) * diagonals).sum(axis=1)
        # whole numbers far below 2^53 are exact as floats, whose products are faster
        symmetric = (4.0 * chance @ diagonals.T.astype(float)).astype(np.int64)
        symmetric += diagonal + (chance * sides).sum(axis=1)[:, None]
        reach = ((between @ abs(self.g_of_pairs)) * between).sum(axis=1)
        low, high = windows[None]
        fits = (symmetric <= high) & (symmetric + reach[:, None] >= low)
        first, second = self.claim.margins_1, self.claim.margins_2
        if first is not None and second is not None:
            both = 2 * diagonals + sides[:, None]  # (n_between, n_diagonals, q)
            fits &= (both == np.add(first, second)).all(axis=2)
        for row in np.flatnonzero(fits.any(axis=1)):
            fit = fits[row]
            yield from self._filled(
                between[row], diagonals[fit], symmetric[row, fit], windows
            )

    def _filled(
        self,
        between: Integers,  # y, (n_pairs,)
        diagonals: Integers,  # (n, n_categories)
        symmetric: Integers,  # s'Vs, (n,)
        windows: dict[Rule | None, Window],
    ) -> Iterator[Step]:
        # the ways in which y falls to either side, some at a time
        n_agreed, shape = {int(diagonals[0].sum())}, between + 1
        places = np.cumprod([1, *shape[:0:-1]], dtype=object)[::-1]
        n_ways = int(places[0] * shape[0])
        if n_ways >= _MAX_KEY:
            raise WorkLimitError
        for start in range(0, n_ways, _WAYS):
            ways = np.arange(start, min(start + _WAYS, n_ways))
            self.charge(max(len(ways), _STEP_COST))
            above = ways[:, None] // places.astype(np.int64) % shape
            z = 2 * above - between
            g = ((z @ self.g_of_pairs) * z).sum(axis=1)
            order = np.argsort(g, kind="stable")
            ends = {}
            for rule, (low, high) in windows.items():
                begin = np.searchsorted(g[order], low - symmetric)
                end = np.searchsorted(g[order], high - symmetric, "right")
                ends[rule] = np.array([begin, end])
            numbers = {rule: int(np.diff(e, axis=0).sum()) for rule, e in ends.items()}
            tables = self._tables(diagonals, between, above[order], ends[None])
            yield numbers, n_agreed, tables

    def _tables(
        self, diagonals: Integers, between: Integers, above: Integers, ends: Integers
    ) -> Iterator[Integers]:
        # tables that have the margins; above: ways of y, of which each diagonal has
        # those between two ends
        codes = np.arange(self.claim.n_categories)
        for diagonal, begin, end in zip(diagonals, *ends, strict=True):
            tables = np.zeros((end - begin, len(codes), len(codes)), dtype=np.int64)
            tables[:, codes, codes] = diagonal
            tables[:, self.first, self.second] = above[begin:end]
            tables[:, self.second, self.first] = between - above[begin:end]
            for margins, axis in ((self.claim.margins_1, 2), (self.claim.margins_2, 1)):
                if margins is not None:
                    tables = tables[(tables.sum(axis=axis) == margins).all(axis=1)]
            yield from tables


class ItemTables(_Search):
    """Tables of more than two raters that a claim allows, item by item.

    Of a table only two sums matter: disagreement, which adds up over items, and how
    often each category was chosen in all. Items are added one by one; tables that have
    both sums alike become one state, which keeps their number. A
    printed percentage drops states from which it can no longer be reached. If there are
    too many states for the bound on work, an even choice of them is kept: then only a
    part of the tables is counted, and nothing follows if none fits.

    States are columns: the sums as one number (key), how many tables have them, one of
    the states they come from, and the item that was added to it.
    """

    def _lay_out(self) -> None:
        # what an item may be
        q, raters = self.claim.n_categories, self.claim.n_raters
        self.charge(comb(raters + q - 1, q - 1))
        self.rows = np.vstack(list(_compositions([(raters, q)])))  # (n_rows, q)
        disagreements = [
            ((self.rows @ v) * self.rows).sum(axis=1)
            for v in (self.v_agreement, self.v)
        ]
        # what a row adds; of the last category the total follows from the others
        self.sums = np.column_stack([*disagreements, self.rows[:, :-1]])
        self.bases = [int(n) * self.claim.n_items + 1 for n in self.sums.max(axis=0)]
        if prod(self.bases) >= _MAX_KEY:
            raise WorkLimitError
        self.places = np.cumprod([1, *self.bases[:-1]])
        self.per_row = self.sums @ self.places

    def steps(self) -> Iterator[Step]:
        """Yield the tables that end in some of the states before the last item."""
        self._lay_out()
        layers = [np.array([[0], [1], [0], [0]])]
        is_whole = True
        for left in range(self.claim.n_items - 1, -1, -1):
            # no more states than the work that is left allows
            n_states = layers[-1].shape[1]
            allowed = (self.limit - self.n_visited) // (left + 1) // len(self.rows)
            if n_states > allowed:
                if not allowed:
                    raise WorkLimitError
                is_whole = False
                chosen = np.linspace(0, n_states - 1, allowed).astype(np.int64)
                layers[-1] = layers[-1][:, chosen]
            self.charge(min(n_states, allowed) * len(self.rows))
            if left:
                layers.append(self._added(layers[-1], left))
        for begin, keys in self._with_one_more(layers[-1]):
            yield self._fitting(layers, begin, keys)
        if not is_whole:
            raise WorkLimitError

    def _with_one_more(self, layer: Integers) -> Iterator[tuple[int, Integers]]:
        # keys of some states with one item more, (n, n_rows), from a first state on
        n = max(_STATES // len(self.rows), 1)
        for begin in range(0, layer.shape[1], n):
            yield begin, layer[0, begin : begin + n, None] + self.per_row

    def _added(self, layer: Integers, left: int) -> Integers:
        # states from which so many more items can still reach the percentage
        low, high = self.observed[None]
        more = left * int(self.sums[:, 0].max())
        parts = [np.zeros((4, 0), dtype=np.int64)]
        for begin, keys in self._with_one_more(layer):
            observed = keys % self.bases[0]
            before, row = np.nonzero((observed <= high) & (observed + more >= low))
            counts = layer[1, begin + before]
            states = [keys[before, row], counts, begin + before, row]
            parts.append(_merged(np.array(states)))
        return _merged(np.hstack(parts))

    def _fitting(self, layers: list[Integers], begin: int, keys: Integers) -> Step:
        counts = layers[-1][1, begin : begin + len(keys)]
        fits = self._fits(keys)
        numbers = {rule: int(counts @ fit.sum(axis=1)) for rule, fit in fits.items()}
        before, row = np.nonzero(fits[None])
        return numbers, set(), self._tables(layers, begin + before, row)

    def _tables(
        self, layers: list[Integers], before: Integers, last: Integers
    ) -> Iterator[Integers]:
        # one table of each state, from its last item back
        for state, row in zip(before, last, strict=True):
            rows = [row]
            for layer in reversed(layers[1:]):
                rows.append(layer[3, state])
                state = layer[2, state]
            yield self.rows[rows[::-1]]

    def _fits(self, keys: Integers) -> dict[Rule | None, NDArray[np.bool_]]:
        # keys (n, n_rows) -> both sums, and how often all categories but the last
        sums = keys[..., None] // self.places % self.bases
        agreement, kappa, totals = sums[..., 0], sums[..., 1], sums[..., 2:]
        last = self.claim.n_items * self.claim.n_raters - totals.sum(axis=-1)
        totals = np.concatenate([totals, last[..., None]], axis=-1)
        chance = ((totals @ self.v) * totals).sum(axis=-1)
        values, places = np.unique(kappa, return_inverse=True)
        fits: dict[Rule | None, NDArray[np.bool_]] = {}
        for rule in self.claim.rules:
            low, high = self.observed[rule]
            ends = np.array([self.chance(rule, int(s)) for s in values])
            least, most = ends[places.reshape(kappa.shape)].T
            fits[rule] = (agreement >= low) & (agreement <= high)
            fits[rule] &= (chance >= least.T) & (chance <= most.T)
        return {None: np.any(list(fits.values()), axis=0), **fits}


def _merged(states: Integers) -> Integers:
    # equal keys once, rising, with their counts added up
    keys, first, place = np.unique(states[0], return_index=True, return_inverse=True)
    merged = states[:, first]
    counts = np.bincount(place, states[1], minlength=len(keys))
    merged[1] = np.minimum(counts, MAX_COUNTED)
    return merged
