"""What is taken to be true: how the ratings of one item come about.

In: what a `Study` declares. Out: an `ItemModel`, its distinct rows of ratings, how
probable each is, and drawn ratings of whole studies. A model is two functions, a row of
`_MODELS`.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, ndtr, ndtri

from masrel._input import refuse
from masrel.agreement import Label, WeightsLike, code_ratings
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Target
from masrel.intervals import estimate
from masrel.planning._study_plan import LatentModel, Study

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SUM = 1e-6  # by which prevalences may miss 1
_NODES = 401  # of the trapezoid sum over the trait of an item, from -8 to 8
_NO_LATENT = LatentModel(thresholds=(0.0,), noise_sd=1.0)  # of the other models
_RATER_SHARE = 0.5  # standard deviation of raters' biases over that of the noise


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemModel:
    """A model with its numbers."""

    name: str
    scale: tuple[Label, ...] = ()  # the categories
    prevalences: tuple[float, ...] = ()  # of these; none of a `LatentModel`
    kappa: float = math.nan  # of the mixture and the Dirichlet-multinomial
    latent: LatentModel = _NO_LATENT
    table: tuple[tuple[float, ...], ...] = ()  # joint probabilities of two raters
    p_missing: float = 0.0  # of every rating, independently

    @property
    def has_rows(self) -> bool:
        """Whether items of a study are independent draws of one distribution."""
        return self.latent.rater_sd == 0.0 and not self.latent.positions

    def with_parameter(self, parameter: float) -> "ItemModel":
        """Return the model with another kappa, or another noise of a latent trait."""
        if self.name != "latent":
            return replace(self, kappa=parameter)
        rater_sd = _RATER_SHARE * parameter
        total = math.sqrt(1.0 + parameter**2 + rater_sd**2)
        cuts = ndtri(np.cumsum(self.prevalences)[:-1]) * total
        latent = LatentModel(
            thresholds=tuple(cuts.tolist()), noise_sd=parameter, rater_sd=rater_sd
        )
        return replace(self, latent=latent)


# -- what a study declares ------------------------------------------------------------


def declared_model(study: Study) -> ItemModel:
    """Return the model that a study declares, before its kappa is solved for."""
    if isinstance(study.model, LatentModel):
        scale = _scale(study, len(study.model.thresholds) + 1)
        model = ItemModel(name="latent", scale=scale, latent=study.model)
        return replace(model, p_missing=study.p_missing)
    name, known = str(study.model), ", ".join(_MODELS)
    refuse(
        (
            name not in _MODELS,
            f"model: needs one of {known}, or a LatentModel, since models of one kappa "
            f"differ in precision; got {study.model!r}",
        )
    )
    shares = _shares(study, is_table=name == "table")
    is_table = shares.ndim == 2
    margins = 0.5 * (shares.sum(axis=0) + shares.sum(axis=1)) if is_table else shares
    return ItemModel(
        name=name,
        scale=_scale(study, len(shares)),
        prevalences=tuple(margins.tolist()),
        table=tuple(map(tuple, shares.tolist())) if is_table else (),
        p_missing=study.p_missing,
    )


def _shares(study: Study, *, is_table: bool) -> Floats:
    # prevalences (n_categories,), or a table (n_categories, n_categories), with sum 1
    categories, prevalences = study.categories, study.prevalences
    if categories is None and prevalences is None:
        raise ParameterError("categories, prevalences: need one of both, got neither")
    try:
        shares = np.atleast_1d(np.asarray(prevalences, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"prevalences: needs numbers, got {prevalences!r}"
        ) from error
    q = len(shares)
    if categories is not None:
        q = categories if isinstance(categories, int) else len(categories)
    refuse((categories is not None and q < 2, f"categories: needs at least 2, got {q}"))
    if prevalences is None:
        shares = np.full(q, 1.0 / q)
    needed = f"needs one of each of {q} categories, at least 2"
    if is_table:
        needed = f"a table needs the joint probabilities of two raters, {q} × {q}"
    is_shaped = q > 1 and shares.shape == ((q, q) if is_table else (q,))
    refuse(
        (not is_shaped, f"prevalences: {needed}; got shape {shares.shape}"),
        (
            not ((shares >= 0.0).all() and abs(shares.sum() - 1.0) <= _SUM),
            "prevalences: needs numbers of at least 0 with sum 1, got sum "
            f"{shares.sum():g}",
        ),
    )
    return np.asarray(shares / shares.sum())


def _scale(study: Study, q: int) -> tuple[Label, ...]:
    # the scale in order, by which weights of numbers go
    if study.categories is None or isinstance(study.categories, int):
        return tuple(range(q))
    n_different = len(set(study.categories))
    refuse(
        (
            (len(study.categories), n_different) != (q, q),
            f"categories: needs {q} that differ, as the model has, got {n_different}",
        )
    )
    return tuple(study.categories)


# -- distinct rows of ratings and their probabilities ---------------------------------


def n_rows(model: ItemModel, n_raters: int, *, ordered: bool) -> int:
    """Count the distinct rows of ratings of an item."""
    q = len(model.scale) + (model.p_missing > 0.0)
    return int(q**n_raters) if ordered else math.comb(n_raters + q - 1, n_raters)


def rows_of(model: ItemModel, n_raters: int, *, ordered: bool) -> Integers:
    """List the distinct rows of ratings: all, or one of each count of categories."""
    # -> (n_rows, n_raters), -1 where a rating is missing
    codes = range(-1 if model.p_missing > 0.0 else 0, len(model.scale))
    rows = (
        itertools.product(codes, repeat=n_raters)
        if ordered
        else itertools.combinations_with_replacement(codes, n_raters)
    )
    return np.array(list(rows), dtype=np.int64).reshape(-1, n_raters)


def probabilities(model: ItemModel, rows: Integers, *, ordered: bool) -> Floats:
    """Return how probable each distinct row is."""
    # rows (n_rows, n_raters) -> (n_rows,)
    n_raters = rows.shape[1]
    counts = (rows[:, :, None] == np.arange(len(model.scale))).sum(axis=1)
    n = counts.sum(axis=1)
    probability, _ = _MODELS[model.name]
    p = probability(model, rows, counts)  # counts (n_rows, n_categories)
    p = p * model.p_missing ** (n_raters - n) * (1.0 - model.p_missing) ** n
    if not ordered:  # as many rows have these counts: R! / Π n_k!
        every = np.column_stack([counts, n_raters - n])
        p = p * np.exp(gammaln(n_raters + 1.0) - gammaln(every + 1.0).sum(axis=1))
    return np.asarray(p)


def _mixture(model: ItemModel, _rows: Integers, counts: Integers) -> Floats:
    # with probability kappa one category for all, else each rater independently
    pi = np.array(model.prevalences)
    one = ((counts == counts.sum(axis=1, keepdims=True)) * pi).sum(axis=1)
    return np.asarray(model.kappa * one + (1.0 - model.kappa) * (pi**counts).prod(1))


def _dirichlet_multinomial(
    model: ItemModel, rows: Integers, counts: Integers
) -> Floats:
    # parameters π (1 - κ)/κ; both ends of κ are those of the mixture
    if model.kappa <= 0.0 or model.kappa >= 1.0:
        return _mixture(model, rows, counts)
    scale = (1.0 - model.kappa) / model.kappa
    a = np.maximum(np.array(model.prevalences), 1e-300) * scale
    logs = (gammaln(a + counts) - gammaln(a)).sum(axis=1)
    return np.asarray(np.exp(logs + gammaln(scale) - gammaln(scale + counts.sum(1))))


def _latent(model: ItemModel, rows: Integers, _counts: Integers) -> Floats:
    latent = model.latent
    # weights of traits (n_nodes,), and grades of a rater drawn anew (n_nodes, q)
    trait = np.array(latent.positions or np.linspace(-8.0, 8.0, _NODES))
    weight = np.ones(len(trait)) if latent.positions else np.exp(-0.5 * trait**2)
    sd = math.hypot(latent.noise_sd, latent.rater_sd)
    below = ndtr((np.array(latent.thresholds) - trait[:, None]) / sd)
    grades = np.diff(below, axis=1, prepend=0.0, append=1.0)
    every = np.column_stack([grades, np.ones(len(trait))])  # a missing one: 1
    products = np.ones((len(trait), len(rows)))
    for column in rows.T:
        products *= every[:, column]
    return np.asarray(weight / weight.sum() @ products)


def _table(model: ItemModel, rows: Integers, _counts: Integers) -> Floats:
    table = np.array(model.table)
    # a margin where one of the two is missing
    whole = np.block(
        [[table, table.sum(1, keepdims=True)], [table.sum(0, keepdims=True), 1.0]]
    )
    return np.asarray(whole[rows[:, 0], rows[:, 1]])


# -- drawn ratings --------------------------------------------------------------------

Size = tuple[int, int, int]  # studies, items, raters


def draw_ratings(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    """Draw the ratings of whole studies, (n_studies, n_items, n_raters)."""
    _, draw = _MODELS[model.name]
    codes = draw(model, rng, size)
    if model.p_missing > 0.0:
        codes[rng.random(size) < model.p_missing] = -1
    return codes


def _draw_mixture(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    codes = _places(np.cumsum(model.prevalences), rng.random(size))
    one = rng.random(size[:2]) < model.kappa
    codes[one] = codes[one][:, :1]
    return codes


def _draw_dirichlet(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    if model.kappa <= 0.0 or model.kappa >= 1.0:
        return _draw_mixture(model, rng, size)
    scale = (1.0 - model.kappa) / model.kappa
    parameters = np.maximum(np.array(model.prevalences), 1e-300) * scale
    shares = rng.dirichlet(parameters, size=size[:2]).cumsum(axis=-1)
    beyond = rng.random(size)[..., None] > shares[:, :, None, :-1]
    return np.asarray(beyond.sum(axis=-1))


def _draw_latent(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    n_studies, n_items, n_raters = size
    latent = model.latent
    trait = (
        np.array(latent.positions)[None, :, None]
        if latent.positions
        else rng.standard_normal((n_studies, n_items, 1))
    )
    bias = latent.rater_sd * rng.standard_normal((n_studies, 1, n_raters))
    y = trait + bias + latent.noise_sd * rng.standard_normal(size)
    return np.searchsorted(np.array(latent.thresholds), y).astype(np.int64)


def _draw_table(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    cell = _places(np.cumsum(np.array(model.table)), rng.random(size[:2]))
    return np.stack(np.divmod(cell, len(model.scale)), axis=-1)


def _places(cumulated: Floats, u: Floats) -> Integers:
    # the last is left out, so that rounding leads past no end
    return np.searchsorted(cumulated[:-1], u, side="right").astype(np.int64)


# how probable rows of ratings are, and how they are drawn
_MODELS: dict[
    str,
    tuple[
        Callable[[ItemModel, Integers, Integers], Floats],
        Callable[[ItemModel, np.random.Generator, Size], Integers],
    ],
] = {
    "mixture": (_mixture, _draw_mixture),
    "dirichlet-multinomial": (_dirichlet_multinomial, _draw_dirichlet),
    "latent": (_latent, _draw_latent),
    "table": (_table, _draw_table),
}


# -- what a pilot says of it ----------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """A pilot, as a plan takes it.

    Attributes
    ----------
    estimate : Estimate
        The coefficient with its interval, which says how little a pilot may know.
    categories : tuple of str, int or float
        The scale.
    prevalences : tuple of float
        Share of each category among the ratings.
    p_missing : float
        Share of the item × rater table without a rating.
    """

    estimate: Estimate
    categories: tuple[Label, ...]
    prevalences: tuple[float, ...]
    p_missing: float


def pilot(
    coefficient: str,
    ratings: object,
    *,
    target: Target,
    weights: WeightsLike = "identity",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Pilot:
    """Return what a pilot's ratings say of the study that is planned.

    Parameters
    ----------
    coefficient : str
        Name in the register.
    ratings : array_like or DataFrame, shape (n_items, n_raters)
        The pilot's ratings, as the coefficient takes them.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    weights : str or Weights, optional
        As of the coefficient.
    categories : sequence of str, int or float, optional
        The scale in order; the categories met unless given.
    level : float, optional
        Of the interval.

    Returns
    -------
    Pilot
        Coefficient, prevalences and share of missing ratings.

    Raises
    ------
    RatingsError
        If the ratings are no table of them, or the coefficient is undefined in them.
    ParameterError
        If an option does not fit the coefficient.

    Examples
    --------
    >>> made = pilot("fleiss_kappa", [[0, 0], [0, 1], [1, 1], [1, 1]], target="items")
    >>> round(made.estimate.value, 3), made.prevalences, made.p_missing
    (0.467, (0.375, 0.625), 0.0)
    """
    coded = code_ratings(ratings, categories)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # it is an error
        result = estimate(
            coefficient, coded, target=target, weights=weights, level=level
        )
    if result.reason is not None:
        raise RatingsError(f"pilot: {coefficient} is undefined in it: {result.reason}")
    codes = coded.codes
    counts = np.bincount(codes[codes >= 0], minlength=len(coded.categories))
    return Pilot(
        estimate=result,
        categories=tuple(coded.categories),
        prevalences=tuple((counts / counts.sum()).tolist()),
        p_missing=float((codes < 0).mean()),
    )
