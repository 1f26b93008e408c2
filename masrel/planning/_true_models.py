"""The model of the ratings that the arguments of a plan declare, at its true value."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from masrel.agreement import Coefficient, Label, WeightsLike
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._item_models import (
    ItemModel,
    LatentModel,
    ModelName,
    with_parameter,
)
from masrel.planning._studies import StudyDesign, StudyMaker

_SUM = 1e-6  # by which prevalences may miss 1


def normal_model(
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


def declared_model(
    model: str | LatentModel | None,
    categories: int | Sequence[Label] | None,
    prevalences: object,
    p_missing: float,
) -> ItemModel:
    """Return the model that the arguments declare, before its kappa is solved for."""
    if isinstance(model, LatentModel):
        q = len(model.thresholds) + 1
        made = ItemModel(name="latent", prevalences=(1.0 / q,) * q, latent=model)
    elif model not in get_args(ModelName):
        raise ParameterError(
            f"model: needs one of {', '.join(get_args(ModelName))}, or a LatentModel, "
            f"since models of one kappa differ in precision; got {model!r}"
        )
    else:
        q = _n_categories(categories, prevalences)
        shares = np.full(q, 1.0 / q) if prevalences is None else _numbers(prevalences)
        made = _of_table(shares, q) if model == "table" else _of_shares(shares, q)
        made = replace(made, name=model)  # type: ignore[arg-type]
    return replace(
        made, p_missing=p_missing, scale=_scale(categories, made.n_categories)
    )


def _of_table(shares: "np.ndarray[Any, np.dtype[np.float64]]", q: int) -> ItemModel:
    if shares.shape != (q, q) or q < 2:
        raise ParameterError(
            "prevalences: a table needs the joint probabilities of two raters, as "
            f"many rows as columns; got shape {shares.shape}"
        )
    _check_sum(shares)
    rows = tuple(map(tuple, (shares / shares.sum()).tolist()))
    margin = tuple((0.5 * (shares.sum(0) + shares.sum(1))).tolist())
    return ItemModel(name="table", prevalences=margin, table=rows)


def _of_shares(shares: "np.ndarray[Any, np.dtype[np.float64]]", q: int) -> ItemModel:
    if shares.shape != (q,) or q < 2:
        raise ParameterError(
            f"prevalences: needs one of each of {q} categories, at least 2; got shape "
            f"{shares.shape}"
        )
    _check_sum(shares)
    shown = tuple((shares / shares.sum()).tolist())
    return ItemModel(name="mixture", prevalences=shown)


def _scale(categories: int | Sequence[Label] | None, q: int) -> tuple[Label, ...]:
    # the scale in order, by which weights of numbers go
    if categories is None or isinstance(categories, int):
        return ()
    if len(categories) != q or len(set(categories)) != q:
        raise ParameterError(
            f"categories: needs {q} that differ, as the model has, got "
            f"{len(set(categories))}"
        )
    return tuple(categories)


def _n_categories(categories: int | Sequence[Label] | None, prevalences: object) -> int:
    if categories is None:
        if prevalences is None:
            raise ParameterError(
                "categories, prevalences: need one of both, got neither"
            )
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


def with_value(
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
        implied = true_value(entry, weights, item_model)
        if abs(implied - value) > 5e-3:
            raise ParameterError(
                f"value: the model has {implied:.4f}, got {value:g}; None takes it"
            )
    return item_model


def true_value(entry: Coefficient, weights: WeightsLike, model: ItemModel) -> float:
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
        return true_value(entry, weights, at(x)) - value

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
            f"value: {entry.title} under {model.name} lies between "
            f"{low + value + 1e-15:.3f} and {high + value:.3f} with these prevalences, "
            f"got {value:g}"
        )
    return at(float(brentq(short_of, *ends, xtol=1e-15, rtol=1e-14)))


def _table_at(
    entry: Coefficient, weights: WeightsLike, model: ItemModel, value: float
) -> ItemModel:
    # With its margins, a table's kappa is proportional to how far it is from chance.
    table = np.array(model.table)
    chance = np.outer(table.sum(axis=1), table.sum(axis=0))
    other = chance + value / true_value(entry, weights, model) * (table - chance)
    if other.min() < -1e-12:
        raise ParameterError(
            f"value: no table with these margins is as far from chance as {value:g}"
        )
    rows = tuple(map(tuple, np.maximum(other, 0.0).tolist()))
    return replace(model, table=rows)
