"""What the printed numbers allow: sums of disagreement, and chance for each of them.

With integer weights v of disagreement by the distance of two categories, S the sum of
v over all pairs of ratings and C the sum expected by chance, agreement is 1 - S / (N
v_max) and kappa 1 - f S / C, where N pairs and the factor f depend on the design alone.
A printed percentage allows a range of S, a printed kappa for every S a range of C.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.audit._printed import (
    RULES,
    PrintedNumber,
    Rule,
    first_whole,
    last_whole,
    parse_printed,
)
from masrel.errors import ParameterError

Integers = NDArray[np.int64]

AuditWeights = Literal["identity", "linear", "quadratic"]
"""Weights of printed coefficients."""

WEIGHTS: tuple[AuditWeights, ...] = get_args(AuditWeights)

Window = tuple[int, int]
"""The least and the greatest whole number that is allowed; nothing where it is less."""

_NOTHING: Window = (1, 0)
UNBOUNDED = 1 << 60
"""More than any sum."""

MAX_ITEMS = 10_000
MAX_CATEGORIES = 20
MAX_RATERS = 1_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """Printed numbers and how they are to be read."""

    n_items: int
    n_categories: int
    n_raters: int
    agreement: PrintedNumber | None
    kappa: PrintedNumber | None
    agreement_weights: AuditWeights
    kappa_weights: AuditWeights
    rules: tuple[Rule, ...]

    @property
    def disagreements(self) -> tuple[Integers, Integers]:
        """Weights by distance, of agreement and of kappa; (n_categories,) each."""
        q = self.n_categories
        return by_distance(self.agreement_weights, q), by_distance(
            self.kappa_weights, q
        )

    @property
    def n_pairs(self) -> int:
        """Ordered pairs of raters over all items; of two raters one a item."""
        if self.n_raters == 2:
            return self.n_items
        return self.n_items * self.n_raters * (self.n_raters - 1)

    @property
    def factor(self) -> Fraction:
        """The factor f of kappa = 1 - f S / C."""
        if self.n_raters == 2:  # C = Σ v_ij r_i c_j
            return Fraction(self.n_items)
        # Fleiss: C = Σ v_ij T_i T_j, of the totals T of categories
        return Fraction(self.n_items * self.n_raters, self.n_raters - 1)

    def observed(self) -> dict[Rule, Window]:
        """Return which sums S the printed percentage allows, by each rule."""
        most = self.n_pairs * int(self.disagreements[0].max())
        if self.agreement is None:
            return dict.fromkeys(self.rules, (0, most))
        windows = {}
        for rule in self.rules:
            bounds = self.agreement.bounds(rule)
            # 100 (1 - S / most) lies in the bounds
            low, high = (
                most * (1 - bounds.high / 100),
                most * (1 - bounds.low / 100),
            )
            first = first_whole(low, bounds.has_high)
            windows[rule] = (max(first, 0), min(last_whole(high, bounds.has_low), most))
        return windows

    def chance(self, rule: Rule, observed: int) -> Window:
        """Return which C the printed kappa allows where S is `observed`."""
        if self.kappa is None:
            return 0, UNBOUNDED
        bounds = self.kappa.bounds(rule)
        if observed == 0:  # kappa is 1, if it is defined
            return (1, UNBOUNDED) if bounds.holds(Fraction(1)) else _NOTHING
        # 1 - f S / C lies in the bounds
        total = self.factor * observed
        if bounds.low >= 1:
            return _NOTHING
        high = UNBOUNDED
        if bounds.high < 1:
            high = last_whole(total / (1 - bounds.high), bounds.has_high)
        return first_whole(total / (1 - bounds.low), bounds.has_low), high


def union(windows: Mapping[Rule, Window]) -> Window:
    """Return what any rule allows."""
    # One rule's values are among the other's, since both differ in the ends alone.
    some = [window for window in windows.values() if window[0] <= window[1]]
    if not some:
        return _NOTHING
    return min(low for low, _ in some), max(high for _, high in some)


def by_distance(weights: AuditWeights, n_categories: int) -> Integers:
    """Return disagreement by the distance of two categories, in whole numbers."""
    k = np.arange(n_categories)
    return {"identity": np.minimum(k, 1), "linear": k, "quadratic": k * k}[weights]


def matrix_of(distances: Integers) -> Integers:
    """Return disagreement of any two categories, (n_categories, n_categories)."""
    codes = np.arange(len(distances))
    return np.asarray(distances[abs(codes[:, None] - codes)])


def pose_question(
    *,
    n_items: int,
    n_categories: int,
    n_raters: int,
    agreement: str | None,
    kappa: str | None,
    agreement_weights: str,
    kappa_weights: str,
    rounding: str,
) -> Question:
    """Return the question that parameters ask, checked."""
    for name, count, least, limit in (
        ("n_items", n_items, 1, MAX_ITEMS),
        ("n_categories", n_categories, 2, MAX_CATEGORIES),
        ("n_raters", n_raters, 2, MAX_RATERS),
    ):
        check_count(name, count, least, limit)
    if agreement is None and kappa is None:
        raise ParameterError(
            "agreement, kappa: needs at least one of them, got neither"
        )
    return Question(
        n_items=n_items,
        n_categories=n_categories,
        n_raters=n_raters,
        agreement=None if agreement is None else parse_agreement(agreement),
        kappa=None if kappa is None else parse_kappa(kappa),
        agreement_weights=check_weights("agreement_weights", agreement_weights),
        kappa_weights=check_weights("kappa_weights", kappa_weights),
        rules=check_rounding(rounding),
    )


def parse_agreement(text: object, where: str = "agreement") -> PrintedNumber:
    """Return a printed percentage."""
    return parse_printed(text, where, low=0, high=100, example="97.4")


def parse_kappa(text: object, where: str = "kappa") -> PrintedNumber:
    """Return a printed kappa."""
    return parse_printed(text, where, low=-1, high=1, example="0.81")


def check_count(name: str, count: object, least: int, limit: int) -> None:
    """Refuse what is no whole number between limits."""
    is_whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
    if not is_whole or not least <= count <= limit:  # type: ignore[operator]
        raise ParameterError(
            f"{name}: needs a whole number from {least} to {limit}, got {count!r}"
        )


def check_weights(
    name: str, weights: object, *, more: tuple[str, ...] = ()
) -> AuditWeights:
    """Return the name of weights that can be audited; `more` may be said as well."""
    for known in WEIGHTS:
        if weights == known:
            return known
    names = ", ".join((*WEIGHTS, *more))
    raise ParameterError(f"{name}: needs one of {names}, got {weights!r}")


def check_rounding(rounding: object) -> tuple[Rule, ...]:
    """Return the rules that a name stands for."""
    if rounding == "either":
        return RULES
    for rule in RULES:
        if rounding == rule:
            return (rule,)
    raise ParameterError(
        f"rounding: needs half_even, half_up or either, got {rounding!r}"
    )
