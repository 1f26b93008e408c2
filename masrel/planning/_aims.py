"""What is to be shown, and of what: the arguments of a plan, checked once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from masrel.agreement import Coefficient, Label, WeightsLike, coefficient
from masrel.agreement._kernel import check_level
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._icc_studies import AGREEMENT, FORMS
from masrel.planning._item_models import (
    ItemModel,
    LatentModel,
    ModelName,
    with_parameter,
)
from masrel.planning._studies import StudyDesign, StudyMaker, check_raters

if TYPE_CHECKING:
    from masrel.planning._precision import Plan

_METHODS = ("auto", "wald", "goodness-of-fit", "exact", "simulation")
_INTERVALS = ("auto", "t", "normal")
_PLANNED = {
    *(("auto", target) for target in get_args(Target)),
    ("t", "items"),
    ("normal", "items"),
    ("t", "raters"),  # the jackknife
}
_SUM = 1e-6  # by which prevalences may miss 1
_REACHED = 1e-9
RATER_SHARE = 1 / 3  # of the error of ICC(A,1) that raters' levels make


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """What a study is to show."""

    half_width: float | None = None
    lower: float | None = None
    upper: float | None = None
    null: float | None = None
    power: float | None = None
    assurance: float | None = None

    @property
    def kind(self) -> Literal["power", "width", "limits"] | None:
        """What kind of aim it is; None for none."""
        if self.power is not None:
            return "power"
        if self.half_width is not None:
            return "width"
        return None if self.lower is None and self.upper is None else "limits"

    @property
    def is_chance(self) -> bool:
        """Whether a chance is aimed at, and not what is expected."""
        return self.power is not None or self.assurance is not None

    @property
    def name(self) -> str:
        """The parameter that says the aim."""
        if self.kind == "power":
            return "power"
        if self.kind == "limits":
            return "upper" if self.lower is None else "lower"
        return "half_width"

    @property
    def number(self) -> str:
        """The number of a plan that is aimed at."""
        if self.power is not None:
            return "power"
        return "assurance" if self.assurance is not None else "expected_half_width"

    @property
    def words(self) -> str:
        """The aim for a reader."""
        if self.kind == "power":
            return f"power of {self.power:g}"
        what = (
            f"a half-width of {self.half_width:g}"
            if self.kind == "width"
            else f"an interval inside [{_end(self.lower)}, {_end(self.upper)}]"
        )
        with_ = "" if self.assurance is None else f" with assurance {self.assurance:g}"
        return what + with_

    def reached(self, plan: "Plan") -> str:
        """Say what a plan reaches of it."""
        if self.power is not None:
            return f"power {plan.power:.3f}"
        if self.assurance is not None:
            return f"assurance {plan.assurance:.3f}"
        if self.kind == "limits":
            low, high = plan.expected_low, plan.expected_high
            return f"an expected interval of {low:.3f} to {high:.3f}"
        return f"an expected half-width of {plan.expected_half_width:.3f}"

    def is_met(self, plan: "Plan") -> bool:
        """Whether a plan reaches it."""
        if self.power is not None:
            return plan.power >= self.power - _REACHED
        if self.assurance is not None:
            return plan.assurance >= self.assurance - _REACHED
        if self.half_width is not None:
            return plan.expected_half_width <= self.half_width * (1.0 + _REACHED)
        return (self.lower is None or plan.expected_low >= self.lower) and (
            self.upper is None or plan.expected_high <= self.upper
        )

    def distance(self, value: float) -> float:
        """Return about which half-width is needed."""
        if self.half_width is not None:
            return self.half_width
        limits = [x for x in (self.null, self.lower, self.upper) if x is not None]
        return max(min(abs(value - x) for x in limits), 1e-6)

    def checked(self, *, needs_chance: bool = True) -> "Aim":
        """Return the aim, or say what does not fit together."""
        self._check_ranges()
        if needs_chance:
            self._check_one_aim()
        return self

    def _check_ranges(self) -> None:
        for name in ("power", "assurance"):
            chance_of = getattr(self, name)
            if chance_of is not None and not 0.0 < chance_of < 1.0:
                raise ParameterError(f"{name}: needs (0, 1), got {chance_of:g}")
        if self.half_width is not None and not 0.0 < self.half_width <= 1.0:
            raise ParameterError(
                "half_width: needs (0, 1], since the scale from -1 to 1 is no wider; "
                f"got {self.half_width:g}"
            )
        for name in ("lower", "upper", "null"):
            limit = getattr(self, name)
            if limit is not None and not -1.0 <= limit <= 1.0:
                raise ParameterError(f"{name}: needs [-1, 1], got {limit:g}")

    def _check_one_aim(self) -> None:
        has_limits = self.lower is not None or self.upper is not None
        n_aims = has_limits + (self.half_width is not None) + (self.null is not None)
        if n_aims > 1:
            raise ParameterError(
                "half_width: needs to be alone, as null does, and lower and upper do: "
                "one aim a plan"
            )
        if self.power is not None and self.assurance is not None:
            raise ParameterError("assurance: needs no power beside it")
        if self.power is not None and self.null is None and not has_limits:
            raise ParameterError("power: needs null, lower or upper, got none")
        if self.power is None and self.null is not None:
            raise ParameterError(f"null: needs power, got null {self.null:g} without")
        if self.assurance is not None and self.half_width is None and not has_limits:
            raise ParameterError("assurance: needs half_width, lower or upper")


def _end(value: float | None) -> str:
    return "…" if value is None else f"{value:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """The arguments of a plan, but for its size."""

    entry: Coefficient
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
) -> Question:
    """Check the arguments of a plan."""
    entry = _entry(coefficient)
    check_level(level)
    _check_choice("sides", sides, (1, 2))
    _check_choice("target", target, get_args(Target))
    _check_choice("method", method, _METHODS)
    _check_choice("interval", interval, _INTERVALS)
    if sides == 1 and level <= 0.5:
        raise ParameterError(f"level: needs more than 0.5 with one side, got {level:g}")
    if not 0.0 <= p_missing < 1.0:
        raise ParameterError(f"p_missing: needs [0, 1), got {p_missing:g}")
    if (interval, target) not in _PLANNED:
        raise ParameterError(
            f'interval: "{interval}" is not of target "{target}", where "auto" is'
        )
    if min(prices) < 0.0 or len(prices) != 3:
        raise ParameterError(f"prices: needs three of at least 0, got {prices}")
    if value is not None and not -1.0 <= value <= 1.0:
        raise ParameterError(f"value: needs [-1, 1], got {value:g}")
    if entry.name in FORMS:
        item_model = _normal(entry, value, target, model)
    else:
        item_model = _item_model(model, categories, prevalences, p_missing)
        item_model = _with_value(entry, weights, item_model, value, model)
        if value is None or isinstance(model, LatentModel) or model == "table":
            value = _true_value(entry, weights, item_model)
    return Question(
        entry=entry,
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
    )


def _check_choice(name: str, value: object, choices: Sequence[object]) -> None:
    if value not in choices:
        known = ", ".join(map(str, choices))
        raise ParameterError(f"{name}: needs one of {known}, got {value!r}")


def _entry(name: str) -> Coefficient:
    entry = coefficient(name)
    if entry.kernel is None and entry.name not in FORMS:
        raise ParameterError(
            f"coefficient: {entry.title} cannot be planned for: it is no function of "
            f"sums over items; the others and {', '.join(FORMS)} can"
        )
    return entry


def _normal(
    entry: Coefficient, value: float | None, target: Target, model: object
) -> ItemModel:
    if model is not None:
        raise ParameterError(
            f"model: {entry.title} takes none, since its ratings are normal; got "
            f"{model!r}"
        )
    if value is None or not 0.0 < value < 1.0:
        raise ParameterError(f"value: {entry.title} needs (0, 1), got {value}")
    if target != entry.interval_target:
        raise ParameterError(
            f"target: the interval of {entry.title} is of other "
            f'"{entry.interval_target}", got "{target}"'
        )
    return ItemModel(name="mixture", prevalences=(1.0,))


def _item_model(
    model: str | LatentModel | None,
    categories: int | Sequence[Label] | None,
    prevalences: object,
    p_missing: float,
) -> ItemModel:
    if isinstance(model, LatentModel):
        q = len(model.thresholds) + 1
        return ItemModel(
            name="latent",
            prevalences=(1.0 / q,) * q,
            latent=model,
            p_missing=p_missing,
        )
    if model not in get_args(ModelName):
        raise ParameterError(
            f"model: needs one of {', '.join(get_args(ModelName))}, or a LatentModel, "
            f"since models of one kappa differ in precision; got {model!r}"
        )
    q = _n_categories(categories, prevalences)
    shares = np.full(q, 1.0 / q) if prevalences is None else _numbers(prevalences)
    if model == "table":
        if shares.shape != (q, q) or q < 2:
            raise ParameterError(
                "prevalences: a table needs the joint probabilities of two raters, as "
                f"many rows as columns; got shape {shares.shape}"
            )
        _check_sum(shares)
        rows = tuple(map(tuple, (shares / shares.sum()).tolist()))
        margin = tuple((0.5 * (shares.sum(0) + shares.sum(1))).tolist())
        return ItemModel(
            name="table", prevalences=margin, table=rows, p_missing=p_missing
        )
    if shares.shape != (q,) or q < 2:
        raise ParameterError(
            f"prevalences: needs one of each of {q} categories, at least 2; got shape "
            f"{shares.shape}"
        )
    _check_sum(shares)
    return ItemModel(
        name=model,  # type: ignore[arg-type]
        prevalences=tuple((shares / shares.sum()).tolist()),
        p_missing=p_missing,
    )


def _n_categories(categories: int | Sequence[Label] | None, prevalences: object) -> int:
    if categories is None:
        if prevalences is None:
            raise ParameterError("categories: needs these or prevalences, got none")
        return len(_numbers(prevalences))
    q = int(categories) if isinstance(categories, int) else len(categories)
    if q < 2:
        raise ParameterError(f"categories: needs at least 2, got {q}")
    return q


def _numbers(prevalences: object) -> "np.ndarray[Any, np.dtype[np.float64]]":
    try:
        numbers = np.asarray(prevalences, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"prevalences: needs numbers, got {prevalences!r}"
        ) from error
    return np.atleast_1d(numbers)


def _check_sum(shares: "np.ndarray[Any, np.dtype[np.float64]]") -> None:
    if not (shares >= 0.0).all() or not abs(shares.sum() - 1.0) <= _SUM:
        raise ParameterError(
            "prevalences: needs numbers of at least 0 with sum 1, got sum "
            f"{shares.sum():g}"
        )


def _with_value(
    entry: Coefficient,
    weights: WeightsLike,
    item_model: ItemModel,
    value: float | None,
    model: str | LatentModel | None,
) -> ItemModel:
    if not isinstance(model, LatentModel) and model != "table":
        if value is None:
            raise ParameterError("value: needs the true coefficient, got none")
        return at_value(entry, weights, item_model, value)
    if value is not None:
        implied = _true_value(entry, weights, item_model)
        if abs(implied - value) > 5e-3:
            raise ParameterError(
                f"value: the model has {implied:.4f}, got {value:g}; None takes it"
            )
    return item_model


def _true_value(entry: Coefficient, weights: WeightsLike, model: ItemModel) -> float:
    n_raters = 1 if entry.shape == "pairs" else 2
    design = StudyDesign(
        coefficient=entry.name,
        weights=weights,
        model=model,
        n_items=20,
        n_raters=n_raters,
        target="items",
        level=0.95,
        interval="t",
        value=0.0,
    )
    return StudyMaker(design).true_value()


def at_value(
    entry: Coefficient, weights: WeightsLike, model: ItemModel, value: float
) -> ItemModel:
    """Return the model whose true coefficient is a value."""
    from scipy.optimize import brentq

    if model.name == "table":
        return _table_at(entry, weights, model, value)
    if model.latent is not None and not model.latent_is_solved:
        raise ParameterError("model: a LatentModel has one value, and no null value")
    # noise from much to little, or kappa from chance to agreement
    ends = (-4.0, 4.0) if model.name == "latent" else (0.0, 1.0)

    def at(x: float) -> ItemModel:
        return with_parameter(model, math.exp(-x) if model.name == "latent" else x)

    def short_of(x: float) -> float:
        return _true_value(entry, weights, at(x)) - value

    low, high = short_of(ends[0]), short_of(ends[1])
    if model.name != "latent" and abs(low) < 1e-12:
        return at(ends[0])
    if model.name != "latent" and abs(high) < 1e-12:
        return at(ends[1])
    if math.isnan(low) or math.isnan(high):
        raise ParameterError(
            f"prevalences: {entry.title} is undefined with these, "
            f"{list(model.prevalences)}: it needs two categories that occur"
        )
    if not low < 0.0 < high:
        raise ParameterError(
            f"value: {entry.title} under {model.name} lies between {low + value:.3f} "
            f"and {high + value:.3f} with these prevalences, got {value:g}"
        )
    return at(float(brentq(short_of, *ends, xtol=1e-15, rtol=1e-14)))


def _table_at(
    entry: Coefficient, weights: WeightsLike, model: ItemModel, value: float
) -> ItemModel:
    # With its margins, a table's kappa is proportional to how far it is from chance.
    table = np.array(model.table)
    chance = np.outer(table.sum(axis=1), table.sum(axis=0))
    other = chance + value / _true_value(entry, weights, model) * (table - chance)
    if other.min() < -1e-12:
        raise ParameterError(
            f"value: no table with these margins is as far from chance as {value:g}"
        )
    rows = tuple(map(tuple, np.maximum(other, 0.0).tolist()))
    return replace(model, table=rows)


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
    if not 0.0 <= rater_share < 1.0:
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
