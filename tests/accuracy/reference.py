"""Every coefficient from its textbook formula, in exact fractions.

An item is listed as its pairs of ratings. A coefficient is a function of sums over
items; its value is that function of the sums, and its standard error follows from the
function's derivatives, which are taken by arithmetic on dual numbers, not by formulas.
"""

import dataclasses
import itertools
import math
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath

Sums = Mapping[Hashable, Any]  # Fraction, or Dual for a derivative
Agreement = Mapping[tuple[int, int], Fraction]  # w_kl where it is not 0

_DIGITS = 50


@dataclass(frozen=True)
class Item:
    """What raters said of one item, or of `times` items alike."""

    counts: Mapping[int, int]  # raters per category, where there are any
    pairs: Mapping[tuple[int, int], int]  # ordered pairs of different raters
    raters: tuple[int | None, ...] = ()  # each rater's category, where it is known
    times: int = 1


def items_of_ratings(
    rows: Iterable[Sequence[int | None]], times: int = 1
) -> list[Item]:
    """List the pairs of raters of every item, one by one."""
    items = []
    for row in rows:
        given = [k for k in row if k is not None]
        pairs = Counter(itertools.permutations(given, 2))
        items.append(Item(Counter(given), pairs, tuple(row), times))
    return items


def items_of_counts(rows: Iterable[Sequence[int]], times: int = 1) -> list[Item]:
    """Count pairs of raters category by category, nobody with themselves."""
    items = []
    for row in rows:
        counts = {k: int(n) for k, n in enumerate(row) if n}
        pairs = {
            (k, l): n * (m - (k == l))
            for k, n in counts.items()
            for l, m in counts.items()  # noqa: E741 - k, l as in the formulas
        }
        items.append(Item(counts, pairs, (), times))
    return items


def items_of_table(table: Sequence[Sequence[int]]) -> list[Item]:
    """List the cells of a contingency table of two raters."""
    return [
        item
        for k, row in enumerate(table)
        for l, n in enumerate(row)  # noqa: E741 - k, l as in the formulas
        if n
        for item in items_of_ratings([(k, l)], int(n))
    ]


# Weights: Gwet (2014), Handbook of Inter-Rater Reliability, 4th ed., ch. 3


def agreement(name: str, values: Sequence[Any]) -> Agreement | None:
    """Return w of a scale; None where a formula divides by 0."""
    q = len(values)
    if name == "identity":
        return {(k, k): Fraction(1) for k in range(q)}
    x = [Fraction(value) for value in values]
    try:
        apart = {(k, m): _apart(name, x, k, m) for k in range(q) for m in range(q)}
        largest = max(apart.values())
        return {at: 1 - distance / largest for at, distance in apart.items()}
    except ZeroDivisionError:
        return None


def _apart(name: str, x: Sequence[Fraction], k: int, m: int) -> Fraction:
    low, high = min(x), max(x)
    if name == "ratio":
        return ((x[k] - x[m]) / (x[k] + x[m])) ** 2
    if k == m:
        return Fraction(0)
    if name == "linear":
        return abs(x[k] - x[m]) / (high - low)
    if name == "quadratic":
        return (x[k] - x[m]) ** 2 / (high - low) ** 2
    if name == "radical":
        share = abs(x[k] - x[m]) / (high - low)
        return _digits(lambda: mpmath.sqrt(_mpf(share)))
    if name == "ordinal":
        return Fraction(math.comb(abs(k - m) + 1, 2))
    if name == "circular":
        turn = (x[k] - x[m]) / (high - low + 1)
        return _digits(lambda: mpmath.sin(mpmath.pi * _mpf(turn)) ** 2)
    assert name == "bipolar"
    return (x[k] - x[m]) ** 2 / ((x[k] + x[m] - 2 * low) * (2 * high - x[k] - x[m]))


def _mpf(value: Fraction) -> Any:
    return mpmath.mpf(value.numerator) / value.denominator


def _digits(compute: Callable[[], Any]) -> Fraction:
    with mpmath.workdps(_DIGITS + 10):
        return Fraction(mpmath.nstr(compute(), _DIGITS, strip_zeros=False))


def agreement_of_metric(
    metric: str, values: Sequence[Any], items: Sequence[Item]
) -> Agreement:
    """Return 1 - δ² of Krippendorff (2004), pp. 232-236."""
    q, x = len(values), [Fraction(value) for value in values]
    n: Counter[int] = Counter()  # pairable ratings
    for item in items:
        if sum(item.counts.values()) > 1:
            for k, of_k in item.counts.items():
                n[k] += item.times * of_k
    apart = {}
    for c, k in itertools.product(range(q), repeat=2):
        if metric == "nominal":
            apart[c, k] = Fraction(c != k)
        elif metric == "interval":
            apart[c, k] = (x[c] - x[k]) ** 2
        elif metric == "ratio":
            apart[c, k] = (
                ((x[c] - x[k]) / (x[c] + x[k])) ** 2 if c != k else Fraction(0)
            )
        else:
            between = sum(n[g] for g in range(min(c, k), max(c, k) + 1))
            apart[c, k] = (between - Fraction(n[c] + n[k], 2)) ** 2 * (c != k)
    return {at: 1 - distance for at, distance in apart.items()}


# Coefficients: what an item adds to the sums, and the coefficient of the sums


def _mean_agreement(item: Item, w: Agreement) -> Fraction:
    agreeing = sum(n * w.get(at, Fraction(0)) for at, n in item.pairs.items())
    return Fraction(agreeing) / sum(item.pairs.values())


def _pooled(item: Item, w: Agreement) -> Sums:
    n = sum(item.counts.values())
    if n == 0:
        return {}
    found: dict[Hashable, Fraction] = {"rated": Fraction(1)}
    found |= {("share", k): Fraction(of_k, n) for k, of_k in item.counts.items()}
    if n > 1:
        found |= {"usable": Fraction(1), "agreeing": _mean_agreement(item, w)}
    return found


def _shares(sums: Sums, q: int) -> list[Any]:
    return [sums.get(("share", k), 0) / sums["rated"] for k in range(q)]


def _beyond_chance(observed: Any, chance: Any) -> Any:
    return (observed - chance) / (1 - chance)


def _percent(sums: Sums, w: Agreement, q: int) -> Any:  # noqa: ARG001 - no chance in it
    return sums["agreeing"] / sums["usable"]


def _fleiss(sums: Sums, w: Agreement, q: int) -> Any:
    p = _shares(sums, q)
    chance = sum(of_w * p[k] * p[m] for (k, m), of_w in w.items())
    return _beyond_chance(sums["agreeing"] / sums["usable"], chance)


def _brennan_prediger(sums: Sums, w: Agreement, q: int) -> Any:
    chance = sum(w.values()) / q**2
    return _beyond_chance(sums["agreeing"] / sums["usable"], chance)


def _gwet(sums: Sums, w: Agreement, q: int) -> Any:
    spread = sum(p * (1 - p) for p in _shares(sums, q))
    chance = Fraction(sum(w.values())) / (q * (q - 1)) * spread
    return _beyond_chance(sums["agreeing"] / sums["usable"], chance)


def _two(item: Item, w: Agreement) -> Sums:
    k, m = item.raters
    if k is None or m is None:
        return {}
    return {
        "both": Fraction(1),
        "agreeing": w.get((k, m), Fraction(0)),
        ("first", k): Fraction(1),
        ("second", m): Fraction(1),
    }


def _cohen(sums: Sums, w: Agreement, q: int) -> Any:  # noqa: ARG001 - q is in w
    n = sums["both"]
    chance = sum(
        of_w * (sums.get(("first", k), 0) / n) * (sums.get(("second", m), 0) / n)
        for (k, m), of_w in w.items()
    )
    return _beyond_chance(sums["agreeing"] / n, chance)


def _two_pooled(item: Item, w: Agreement) -> Sums:
    return {} if None in item.raters else _pooled(item, w)


def _of_raters(item: Item, w: Agreement) -> Sums:
    found: dict[Hashable, Fraction] = {}
    for g, k in enumerate(item.raters):
        found["by", g] = Fraction(k is not None)  # every rater, also without ratings
        if k is not None:
            found["by", g, k] = Fraction(1)
    if item.pairs:
        found |= {"usable": Fraction(1), "agreeing": _mean_agreement(item, w)}
    return found


def _conger(sums: Sums, w: Agreement, q: int) -> Any:
    raters = [key[1] for key in sums if isinstance(key, tuple) and len(key) == 2]
    p = {
        g: [sums.get(("by", g, k), 0) / sums["by", g] for k in range(q)] for g in raters
    }
    of_pairs = [
        sum(of_w * p[g][k] * p[h][m] for (k, m), of_w in w.items())
        for g, h in itertools.combinations(sorted(raters), 2)
    ]
    chance = sum(of_pairs) / Fraction(len(of_pairs))
    return _beyond_chance(sums["agreeing"] / sums["usable"], chance)


def _complete(item: Item, w: Agreement) -> Sums:
    if None in item.raters:
        return {}
    found = {}
    for pair in itertools.combinations(enumerate(item.raters), 2):
        (g, k), (h, m) = pair
        two = _two(Item({}, {}, (k, m)), w)
        found |= {((g, h), key): value for key, value in two.items()}
    return found


def _light(sums: Sums, w: Agreement, q: int) -> Any:
    pairs = {key[0] for key in sums}
    if not pairs:
        raise ZeroDivisionError
    kappas = [
        _cohen({key[1]: value for key, value in sums.items() if key[0] == pair}, w, q)
        for pair in sorted(pairs)
    ]
    return sum(kappas) / Fraction(len(kappas))


def _coincidences(item: Item, w: Agreement) -> Sums:
    n = sum(item.counts.values())
    if n < 2:
        return {}
    # coincidences o_ck = pairs c-k of the item over n - 1
    apart = sum(
        (
            Fraction(pairs, n - 1) * (1 - w.get(at, 0))
            for at, pairs in item.pairs.items()
        ),
        Fraction(0),
    )
    found: dict[Hashable, Fraction] = {"apart": apart}
    return found | {("n", k): Fraction(of_k) for k, of_k in item.counts.items()}


def _alpha(sums: Sums, w: Agreement, q: int) -> Any:
    n_of = [sums.get(("n", k), Fraction(0)) for k in range(q)]
    n = sum(n_of)
    # Σ_ck n_c n_k (1 - w_ck), and w_ck is 0 for most pairs of many categories
    alike = sum(of_w * n_of[c] * n_of[k] for (c, k), of_w in w.items())
    expected = n * n - alike
    return 1 - (sums["apart"] / n) / (expected / (n * (n - 1)))


_Features = Callable[[Item, Agreement], Sums]
_Function = Callable[[Sums, Agreement, int], Any]

COEFFICIENTS: Mapping[str, tuple[_Features, _Function]] = {
    "percent_agreement": (_pooled, _percent),
    "fleiss_kappa": (_pooled, _fleiss),
    "brennan_prediger": (_pooled, _brennan_prediger),
    "gwet_ac": (_pooled, _gwet),
    "scott_pi": (_two_pooled, _fleiss),
    "cohen_kappa": (_two, _cohen),
    "conger_kappa": (_of_raters, _conger),
    "light_kappa": (_complete, _light),
    "krippendorff_alpha": (_coincidences, _alpha),
}


def value(
    name: str, items: Sequence[Item], w: Agreement | None, q: int
) -> Fraction | None:
    """Return the coefficient; None where its formula divides by 0."""
    if w is None:
        return None
    features, function = COEFFICIENTS[name]
    items = _of_who_rated(items)
    try:
        return Fraction(function(_sum(items, features, w), w, q))
    except (
        ZeroDivisionError,
        KeyError,
    ):  # a key that no item has: nothing to divide by
        return None


def _of_who_rated(items: Sequence[Item]) -> list[Item]:
    """Leave out raters who rated nothing; of one rater or none, there are no pairs."""
    width = max((len(item.raters) for item in items), default=0)
    rated = [
        g for g in range(width) if any(item.raters[g] is not None for item in items)
    ]
    if len(rated) < 2 or len(rated) == width:
        return list(items)
    return [
        dataclasses.replace(item, raters=tuple(item.raters[g] for g in rated))
        for item in items
    ]


def _sum(items: Sequence[Item], features: _Features, w: Agreement) -> dict[Any, Any]:
    sums: dict[Any, Fraction] = {}
    for item in items:
        for key, part in features(item, w).items():
            sums[key] = sums.get(key, Fraction(0)) + item.times * part
    return sums


def standard_error(
    name: str, items: Sequence[Item], w: Agreement, q: int
) -> "mpmath.mpf | None":
    """Return the delta-method standard error to 50 digits; None of a single item.

    The coefficient is g(S) with S = Σ_i t_i over n items, t_i what item i adds. Were
    item i there 1 + ε times, S would move by ε t_i and the coefficient by ε D_i, where
    D_i = Σ_j ∂g/∂S_j t_ij. Items being a sample, each moves S independently, so that
    the variance of g is n times the variance of D_i over items,

        SE² = n · Σ_i (D_i - D̄)² / (n - 1).

    The mean of D_i is 0 wherever g does not change when every item is doubled. Alpha
    does change, by its n - 1.
    """
    features, function = COEFFICIENTS[name]
    items = _of_who_rated(items)
    sums = _sum(items, features, w)
    slopes = {key: _slope(function, sums, key, w, q) for key in sums}
    n, total, squares = 0, Fraction(0), Fraction(0)
    for item in items:
        t = features(item, w)
        if any(t.values()):
            n += item.times
            moved = sum((slopes[key] * part for key, part in t.items()), Fraction(0))
            total += item.times * moved
            squares += item.times * moved**2
    if n < 2:
        return None
    squares -= total**2 / n
    with mpmath.workdps(_DIGITS):
        return mpmath.sqrt(_mpf(squares * n / (n - 1)))


def _slope(
    function: _Function, sums: Sums, key: Hashable, w: Agreement, q: int
) -> Fraction:
    moved = {k: Dual(s, Fraction(int(k == key))) for k, s in sums.items()}
    found = function(moved, w, q)
    return found.slope if isinstance(found, Dual) else Fraction(0)


class Dual:
    """A value and its slope: arithmetic on both is exact differentiation."""

    __slots__ = ("slope", "value")

    def __init__(self, value: Fraction, slope: Fraction = Fraction(0)) -> None:
        self.value, self.slope = value, slope

    @classmethod
    def of(cls, other: "Dual | Fraction | int") -> "Dual":
        return other if isinstance(other, Dual) else cls(Fraction(other))

    def __add__(self, other: Any) -> "Dual":
        other = Dual.of(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    __radd__ = __add__

    def __neg__(self) -> "Dual":
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> "Dual":
        return self + -Dual.of(other)

    def __rsub__(self, other: Any) -> "Dual":
        return Dual.of(other) - self

    def __mul__(self, other: Any) -> "Dual":
        other = Dual.of(other)
        return Dual(
            self.value * other.value,
            self.slope * other.value + self.value * other.slope,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Dual":
        other = Dual.of(other)
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __rtruediv__(self, other: Any) -> "Dual":
        return Dual.of(other) / self

    def __eq__(self, other: object) -> bool:
        return self.value == Dual.of(other).value  # type: ignore[arg-type]

    __hash__ = None  # type: ignore[assignment]


def units_off(found: float, exact: Fraction) -> float:
    """Return how far a float is from a value, in units of its last place."""
    return float(abs(Fraction(found) - exact) / Fraction(math.ulp(float(exact))))
