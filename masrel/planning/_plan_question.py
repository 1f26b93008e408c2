"""The arguments of a plan, but for its size, checked once."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from masrel.agreement import Coefficient, Label, WeightsLike, coefficient
from masrel.agreement._engine import check_level
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._aims import Aim, checked_number
from masrel.planning._icc_studies import AGREEMENT, FORMS
from masrel.planning._item_models import ItemModel, LatentModel
from masrel.planning._studies import StudyDesign, check_raters
from masrel.planning._tasks import Progress
from masrel.planning._true_models import (
    at_value,
    declared_model,
    normal_model,
    true_value,
    with_value,
)

_METHODS = ("auto", "wald", "goodness-of-fit", "exact", "simulation")
_INTERVALS = ("auto", "t", "normal", "analytic", "jackknife", "bootstrap", "posterior")
_PLANNED = {
    *itertools.product(("auto", "jackknife", "bootstrap"), get_args(Target)),
    *itertools.product(("t", "normal", "analytic", "posterior"), ("items",)),
    ("t", "raters"),  # the jackknife
}
RATER_SHARE = 1 / 3  # of the error of ICC(A,1) that raters' levels make


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """The arguments of a plan, but for its size."""

    name: str  # of the coefficient
    weights: WeightsLike
    value: float
    model: ItemModel
    target: Target
    level: float  # nominal
    sides: int
    interval: str
    method: str
    aim: Aim
    prices: tuple[float, float, float]
    max_cost: float | None
    seed: int
    rater_share: float
    prior: tuple[float, float] | None
    progress: Progress | None

    @property
    def entry(self) -> Coefficient:
        """The coefficient's entry in the register."""
        return coefficient(self.name)

    @property
    def is_icc(self) -> bool:
        """Whether it is an intraclass correlation, of normal ratings."""
        return self.entry.name in FORMS

    def design(self, n_items: int, n_raters: int) -> StudyDesign:
        """Return the design of a size."""
        for name, n in (("n_items", n_items), ("n_raters", n_raters)):
            if not isinstance(n, int | np.integer) or n < 1:
                raise ParameterError(f"{name}: needs a whole number above 0, got {n!r}")
        if n_items < 2:
            raise ParameterError(f"n_items: needs at least 2, got {n_items}")
        design = StudyDesign(
            coefficient=self.entry.name,
            weights=self.weights,
            model=self.model,
            n_items=int(n_items),
            n_raters=int(n_raters),
            target=self.target,
            level=1.0 - 2.0 * (1.0 - self.level) if self.sides == 1 else self.level,
            interval=self.interval,
            value=self.value,
            half_width=self.aim.half_width,
            lower=self.aim.lower,
            upper=self.aim.upper,
            null=self.aim.null,
        )
        self._check_size(design)
        return design

    def _check_size(self, design: StudyDesign) -> None:
        if self.is_icc:
            if design.n_raters < 2:
                raise ParameterError(
                    f"n_raters: {design.entry.title} needs at least 2, got "
                    f"{design.n_raters}"
                )
            return
        check_raters(design)
        latent = design.model.latent
        if latent is not None and len(latent.positions) not in (0, design.n_items):
            raise ParameterError(
                f"n_items: the model has the positions of {len(latent.positions)} "
                f"items, got {design.n_items}"
            )
        if design.model.name == "table" and design.n_raters != 2:
            raise ParameterError(
                f"n_raters: a table is of two raters, got {design.n_raters}"
            )

    @property
    def min_raters(self) -> int:
        """The fewest raters that the coefficient and the target can have."""
        if self.is_icc or self.entry.shape == "pairs":
            return max(1, self.entry.n_raters[0])
        return max(2 if self.target == "items" else 3, self.entry.n_raters[0])

    @property
    def max_raters(self) -> int | None:
        """The most raters that there can be; None without a limit."""
        if not self.is_icc and self.model.name == "table":
            return 2
        return self.entry.n_raters[1]

    def null_design(self, design: StudyDesign) -> StudyDesign:
        """Return the design with the null value as the truth."""
        return self.design_at(design, self.aim.null or 0.0)

    def design_at(self, design: StudyDesign, value: float) -> StudyDesign:
        """Return the design with another true value."""
        model = at_value(self.entry, self.weights, self.model, value)
        return replace(design, model=model, value=value)

    def words(self, design: StudyDesign) -> dict[str, Any]:
        """Return what a plan repeats of the question."""
        return {
            "coefficient": self.entry.name,
            "weights": self.weights if isinstance(self.weights, str) else "custom",
            "value": self.value,
            "n_items": design.n_items,
            "n_raters": design.n_raters,
            "model": "normal" if self.is_icc else self.model.name,
            "target": self.target,
            "interval": self.interval,
            "level": self.level,
            "sides": self.sides,
            "prevalences": self.model.shown_prevalences,
            "table": self.model.table,
            "p_missing": self.model.p_missing,
            "half_width": self.aim.half_width,
            "lower": self.aim.lower,
            "upper": self.aim.upper,
            "null": self.aim.null,
        }

    def cost(self, n_items: int, n_raters: int) -> float:
        """Return what a study of this size costs."""
        per_item, per_rater, per_rating = self.prices
        ratings = n_items * n_raters * (2 if self.entry.shape == "pairs" else 1)
        return per_item * n_items + per_rater * n_raters + per_rating * ratings


def pose_question(
    *,
    coefficient: str,
    value: float | None,
    weights: WeightsLike,
    categories: int | Sequence[Label] | None,
    prevalences: object,
    model: str | LatentModel | None,
    target: Target,
    p_missing: float,
    level: float,
    sides: int,
    interval: str,
    method: str,
    aim: Aim,
    prices: tuple[float, float, float],
    max_cost: float | None,
    rng: np.random.Generator | int | None,
    rater_share: float,
    prior: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> Question:
    """Check the arguments of a plan."""
    entry = _entry(coefficient)
    _check_choice("method", method, _METHODS)
    _check_interval(interval, target, level, sides)
    if not 0.0 <= checked_number("p_missing", p_missing) < 1.0:
        raise ParameterError(f"p_missing: needs [0, 1), got {p_missing:g}")
    _check_costs(prices, max_cost)
    if value is not None and not -1.0 <= checked_number("value", value) <= 1.0:
        raise ParameterError(f"value: needs [-1, 1], got {value:g}")
    if prior is not None:
        _check_prior(prior, method)
    if entry.name in FORMS:
        _refuse_of_categories(entry, weights, categories, prevalences, p_missing)
        item_model = normal_model(entry, value, target, model)
    else:
        item_model = declared_model(model, categories, prevalences, p_missing)
        item_model = with_value(entry, weights, item_model, value, model)
        if value is None or isinstance(model, LatentModel) or model == "table":
            value = true_value(entry, weights, item_model)
    return Question(
        name=entry.name,
        weights=weights,
        value=float(value if value is not None else math.nan),
        model=item_model,
        target=target,
        level=level,
        sides=sides,
        interval=interval,
        method=method,
        aim=_within(aim, float(value or 0.0)),
        prices=prices,
        max_cost=max_cost,
        seed=_seed(rng),
        rater_share=_share(rater_share, entry),
        prior=prior,
        progress=progress,
    )


def _check_interval(interval: str, target: Target, level: float, sides: int) -> None:
    check_level(level)
    _check_choice("sides", sides, (1, 2))
    _check_choice("target", target, get_args(Target))
    _check_choice("interval", interval, _INTERVALS)
    if sides == 1 and level <= 0.5:
        raise ParameterError(f"level: needs more than 0.5 with one side, got {level:g}")
    if (interval, target) not in _PLANNED:
        raise ParameterError(
            f'interval: "{interval}" is not of target "{target}", where "auto" and '
            '"jackknife" are'
        )


def _check_costs(prices: tuple[float, float, float], max_cost: float | None) -> None:
    if len(prices) != 3 or not all(0.0 <= price < math.inf for price in prices):
        raise ParameterError(f"prices: needs three of at least 0, got {prices}")
    if max_cost is not None and not 0.0 < checked_number("max_cost", max_cost):
        raise ParameterError(f"max_cost: needs a number above 0, got {max_cost:g}")


def _check_prior(prior: tuple[float, float], method: str) -> None:
    if len(prior) != 2 or not all(0.0 < part < math.inf for part in prior):
        raise ParameterError(f"prior: needs two numbers above 0, got {prior}")
    if method != "goodness-of-fit":
        raise ParameterError(
            f'prior: is of method "goodness-of-fit" alone, got "{method}"'
        )


def _refuse_of_categories(
    entry: Coefficient,
    weights: WeightsLike,
    categories: object,
    prevalences: object,
    p_missing: float,
) -> None:
    # what normal ratings have none of
    is_weighted = not isinstance(weights, str) or weights != "identity"
    for name, is_there in (
        ("weights", is_weighted),
        ("categories", categories is not None),
        ("prevalences", prevalences is not None),
        ("p_missing", p_missing > 0.0),
    ):
        if is_there:
            raise ParameterError(
                f"{name}: {entry.title} takes none, since its ratings are normal and "
                "complete"
            )


def _check_choice(name: str, value: object, choices: Sequence[object]) -> None:
    if value not in choices:
        known = ", ".join(map(str, choices))
        raise ParameterError(f"{name}: needs one of {known}, got {value!r}")


def _entry(name: str) -> Coefficient:
    entry = coefficient(name)
    if entry.formula is None and entry.name not in FORMS:
        raise ParameterError(
            f"coefficient: {entry.title} cannot be planned for: it is no function of "
            f"sums over items; the others and {', '.join(FORMS)} can"
        )
    return entry


def _within(aim: Aim, value: float) -> Aim:
    if aim.null is not None and math.isclose(aim.null, value, abs_tol=1e-9):
        raise ParameterError(f"null: needs another number than value, {value:g}")
    if aim.lower is not None and not aim.lower < value:
        raise ParameterError(
            f"lower: needs to lie below value, {value:g}, got {aim.lower:g}"
        )
    if aim.upper is not None and not aim.upper > value:
        raise ParameterError(
            f"upper: needs to lie above value, {value:g}, got {aim.upper:g}"
        )
    return aim


def _share(rater_share: float, entry: Coefficient) -> float:
    if not 0.0 <= checked_number("rater_share", rater_share) < 1.0:
        raise ParameterError(f"rater_share: needs [0, 1), got {rater_share:g}")
    if entry.name != AGREEMENT and rater_share != RATER_SHARE:
        raise ParameterError(f"rater_share: is of icc_a1 alone, got {entry.name}")
    return rater_share


def _seed(rng: np.random.Generator | int | None) -> int:
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(2**63))
    if rng is None:
        return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    if not isinstance(rng, int | np.integer) or rng < 0:
        raise ParameterError(f"rng: needs a seed of at least 0, got {rng!r}")
    return int(rng)
