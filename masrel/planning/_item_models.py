"""How the ratings of one item come about: the models a plan can name.

In: numbers of raters and categories, prevalences and kappa. Out: the distinct rows of
ratings of an item with their probabilities, or drawn ratings of whole studies.
"""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import Label
from masrel.errors import ParameterError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
ModelName = Literal["mixture", "dirichlet-multinomial", "latent", "table"]

MAX_ROWS = 20_000  # distinct rows of ratings above which ratings are drawn one by one
_NODES = 401  # of the trapezoid sum over the trait of an item, from -8 to 8
_RATER_SHARE = 0.5  # standard deviation of raters' biases over that of the noise


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentModel:
    """Grades cut from an item's trait, plus a rater's bias, plus noise.

    Attributes
    ----------
    thresholds : tuple of float
        Where one category ends and the next begins, ascending, on the scale of the
        trait, whose standard deviation over items is 1.
    noise_sd : float
        Standard deviation of the noise of a rating.
    rater_sd : float
        Standard deviation of the raters' biases.
    positions : tuple of float
        The traits of the items where every study has the same items; empty where they
        are drawn anew.

    Examples
    --------
    >>> LatentModel(thresholds=(-0.4, 0.4), noise_sd=0.5).rater_sd
    0.0
    """

    thresholds: tuple[float, ...]
    noise_sd: float
    rater_sd: float = 0.0
    positions: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check what must be positive or ascending."""
        if not (self.noise_sd > 0.0 and self.rater_sd >= 0.0):
            raise ParameterError(
                "model: needs noise_sd above 0 and rater_sd of at least 0, got "
                f"{self.noise_sd:g} and {self.rater_sd:g}"
            )
        ascending = all(a < b for a, b in itertools.pairwise(self.thresholds))
        if not (self.thresholds and ascending):
            raise ParameterError(
                f"model: needs ascending thresholds, got {self.thresholds}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemModel:
    """A model with its numbers."""

    name: ModelName
    prevalences: tuple[float, ...]  # of the categories
    kappa: float = math.nan  # of the mixture and the Dirichlet-multinomial
    latent: LatentModel | None = None
    table: tuple[tuple[float, ...], ...] = ()  # joint probabilities of two raters
    p_missing: float = 0.0  # of every rating, independently
    scale: tuple[Label, ...] = ()  # the categories, where they were named

    @property
    def n_categories(self) -> int:
        """Categories of the scale."""
        return len(self.prevalences)

    @property
    def shown_prevalences(self) -> tuple[float, ...]:
        """Prevalences that were declared: none of normal ratings or own thresholds."""
        is_declared = self.n_categories > 1 and self.latent_is_solved
        return self.prevalences if is_declared else ()

    @property
    def latent_is_solved(self) -> bool:
        """Whether the latent model follows from prevalences and a value."""
        latent = self.latent
        return latent is None or (
            latent == latent_by_noise(self.prevalences, latent.noise_sd)
        )

    @property
    def has_rows(self) -> bool:
        """Whether items of a study are independent draws of one distribution."""
        of_study = self.latent is not None and (
            self.latent.rater_sd > 0.0 or len(self.latent.positions) > 0
        )
        return not of_study


def n_rows(model: ItemModel, n_raters: int, *, ordered: bool) -> int:
    """Count the distinct rows of ratings of an item."""
    q = model.n_categories + (model.p_missing > 0.0)
    return int(q**n_raters) if ordered else math.comb(n_raters + q - 1, n_raters)


def rows_of(model: ItemModel, n_raters: int, *, ordered: bool) -> Integers:
    """List the distinct rows of ratings: all, or one of each count of categories."""
    # -> (n_rows, n_raters), -1 where a rating is missing
    first = -1 if model.p_missing > 0.0 else 0
    codes = range(first, model.n_categories)
    rows = (
        itertools.product(codes, repeat=n_raters)
        if ordered
        else itertools.combinations_with_replacement(codes, n_raters)
    )
    return np.array(list(rows), dtype=np.int64).reshape(-1, n_raters)


def probabilities(model: ItemModel, rows: Integers, *, ordered: bool) -> Floats:
    """Return how probable each distinct row is."""
    # rows (n_rows, n_raters) -> (n_rows,)
    q, n_raters = model.n_categories, rows.shape[1]
    counts = (rows[:, :, None] == np.arange(q)).sum(axis=1)  # (n_rows, q)
    n = counts.sum(axis=1)
    if model.name == "mixture":
        p = _mixture(model, counts, n)
    elif model.name == "dirichlet-multinomial":
        p = _dirichlet_multinomial(model, counts, n)
    elif model.name == "latent":
        p = _latent(model, rows)
    else:
        p = _joint(model, rows)
    p = p * model.p_missing ** (n_raters - n) * (1.0 - model.p_missing) ** n
    if not ordered:
        p = p * _arrangements(np.column_stack([counts, n_raters - n]))
    return np.asarray(p)


def _mixture(model: ItemModel, counts: Integers, n: Integers) -> Floats:
    # with probability kappa one category for all, else each rater independently
    pi = np.array(model.prevalences)
    one = ((counts == n[:, None]) * pi).sum(axis=1)
    return np.asarray(model.kappa * one + (1.0 - model.kappa) * (pi**counts).prod(1))


def _dirichlet_multinomial(model: ItemModel, counts: Integers, n: Integers) -> Floats:
    # parameters π (1 - κ)/κ; both ends of κ are those of the mixture
    if model.kappa <= 0.0 or model.kappa >= 1.0:
        return _mixture(model, counts, n)
    from scipy.special import gammaln  # loaded when a plan needs it

    scale = (1.0 - model.kappa) / model.kappa
    a = np.maximum(np.array(model.prevalences), 1e-300) * scale
    logs = (gammaln(a + counts) - gammaln(a)).sum(axis=1)
    return np.asarray(np.exp(logs + gammaln(scale) - gammaln(scale + n)))


def _latent(model: ItemModel, rows: Integers) -> Floats:
    weight, of_node = _grade_probabilities(model)
    every = np.column_stack([of_node, np.ones(len(of_node))])  # a missing one: 1
    products = np.ones((len(weight), len(rows)))
    for column in rows.T:
        products *= every[:, column]
    return np.asarray(weight @ products)


def _grade_probabilities(model: ItemModel) -> tuple[Floats, Floats]:
    # weights of traits (n_nodes,), and grades of a rater drawn anew (n_nodes, q)
    from scipy.special import ndtr

    latent = _latent_of(model)
    if latent.positions:
        trait = np.array(latent.positions)
        weight = np.full(len(trait), 1.0 / len(trait))
    else:
        trait = np.linspace(-8.0, 8.0, _NODES)
        weight = np.exp(-0.5 * trait**2)
        weight /= weight.sum()
    sd = math.hypot(latent.noise_sd, latent.rater_sd)
    below = ndtr((np.array(latent.thresholds) - trait[:, None]) / sd)
    return weight, np.diff(below, axis=1, prepend=0.0, append=1.0)


def _joint(model: ItemModel, rows: Integers) -> Floats:
    table = np.array(model.table)
    # a margin where one of the two is missing
    whole = np.block(
        [[table, table.sum(1, keepdims=True)], [table.sum(0, keepdims=True), 1.0]]
    )
    return np.asarray(whole[rows[:, 0], rows[:, 1]])


def _arrangements(counts: Integers) -> Floats:
    # how many rows have these counts: R! / Π n_k!
    from scipy.special import gammaln

    logs = gammaln(counts.sum(axis=1) + 1.0) - gammaln(counts + 1.0).sum(axis=1)
    return np.asarray(np.round(np.exp(logs)) if logs.max() < 30 else np.exp(logs))


def _latent_of(model: ItemModel) -> LatentModel:
    if model.latent is None:
        raise ParameterError("model: latent needs its numbers")
    return model.latent


def latent_by_noise(prevalences: tuple[float, ...], noise_sd: float) -> LatentModel:
    """Return the latent model with these prevalences and this noise."""
    from scipy.special import ndtri

    rater_sd = _RATER_SHARE * noise_sd
    total = math.sqrt(1.0 + noise_sd**2 + rater_sd**2)
    cuts = ndtri(np.cumsum(prevalences)[:-1]) * total
    return LatentModel(
        thresholds=tuple(cuts.tolist()), noise_sd=noise_sd, rater_sd=rater_sd
    )


def with_parameter(model: ItemModel, parameter: float) -> ItemModel:
    """Return the model with another kappa, or another noise of a latent trait."""
    if model.name == "latent":
        return replace(model, latent=latent_by_noise(model.prevalences, parameter))
    return replace(model, kappa=parameter)


def draw_ratings(
    model: ItemModel,
    rng: np.random.Generator,
    *,
    n_studies: int,
    n_items: int,
    n_raters: int,
) -> Integers:
    """Draw the ratings of whole studies, rater by rater."""
    # -> (n_studies, n_items, n_raters)
    size = (n_studies, n_items, n_raters)
    if model.name == "latent":
        codes = _draw_latent(_latent_of(model), rng, size)
    elif model.name == "table":
        cells = np.cumsum(np.array(model.table).ravel())
        cell = _places(cells, rng.random(size[:2]))
        codes = np.stack(np.divmod(cell, model.n_categories), axis=-1)
    else:
        codes = _draw_alike(model, rng, size)
    if model.p_missing > 0.0:
        codes[rng.random(size) < model.p_missing] = -1
    return codes


def _draw_latent(
    latent: LatentModel, rng: np.random.Generator, size: tuple[int, int, int]
) -> Integers:
    n_studies, n_items, n_raters = size
    trait = (
        np.array(latent.positions)[None, :, None]
        if latent.positions
        else rng.standard_normal((n_studies, n_items, 1))
    )
    bias = latent.rater_sd * rng.standard_normal((n_studies, 1, n_raters))
    y = trait + bias + latent.noise_sd * rng.standard_normal(size)
    return np.searchsorted(np.array(latent.thresholds), y).astype(np.int64)


def _draw_alike(
    model: ItemModel, rng: np.random.Generator, size: tuple[int, int, int]
) -> Integers:
    pi, kappa = np.array(model.prevalences), model.kappa
    if model.name == "dirichlet-multinomial" and 0.0 < kappa < 1.0:
        parameters = np.maximum(pi, 1e-300) * (1.0 - kappa) / kappa
        shares = rng.dirichlet(parameters, size=size[:2]).cumsum(axis=-1)
        beyond = rng.random(size)[..., None] > shares[:, :, None, :-1]
        return np.asarray(beyond.sum(axis=-1))
    codes = _places(np.cumsum(pi), rng.random(size))
    one = rng.random(size[:2]) < kappa
    codes[one] = codes[one][:, :1]
    return codes


def _places(cumulated: Floats, u: Floats) -> Integers:
    # the last is left out, so that rounding leads past no end
    return np.searchsorted(cumulated[:-1], u, side="right").astype(np.int64)
