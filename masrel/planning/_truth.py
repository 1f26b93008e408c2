"""What is taken to be true: how ratings come about, and a study with its true value.

In: what a `Study` declares. Out: an `ItemModel`, its distinct rows of ratings, how
probable each is, and drawn ratings of whole studies; and a `Design`, whose model has
the value that is taken to be true. A model is two functions, a row of `MODELS`; the
coefficient of a design is a function of sums over items.
"""

import itertools
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import gammaln, ndtr, ndtri

from masrel._input import refuse, shown
from masrel.agreement import CodedRatings, Coefficient, Label, coefficient
from masrel.agreement._engine import Floats, Integers
from masrel.errors import MasrelWarning, ParameterError
from masrel.intervals._question import IntervalProblem, pose_problem
from masrel.planning._study_plan import RATER_SHARE, LatentModel, Study

_SUM = 1e-6  # by which prevalences may miss 1
_NODES = 401  # of the trapezoid sum over the trait of an item, from -8 to 8
_NO_LATENT = LatentModel(thresholds=(0.0,), noise_sd=1.0)  # of the other models
_RATER_SHARE = 0.5  # standard deviation of raters' biases over that of the noise

ONE_WAY, CONSISTENCY, AGREEMENT = "icc_1", "icc_c1", "icc_a1"
FORMS = (ONE_WAY, CONSISTENCY, AGREEMENT)

_MAX_ROWS = 20_000  # distinct rows above which ratings are drawn one by one
_LARGE = 1e12  # items of a population
_FEW = 4  # times as many items as distinct rows are many
_WALD = ("t", "normal", "analytic")  # computed for all studies at once
_MAX_CHOSEN = 4_000  # studies that are summed over where each has its interval chosen
MAX_TABLES = 1_000_000  # that are summed over


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

    def with_parameter(self, x: float) -> "ItemModel":
        """Return the model with kappa x, or noise exp(-x) of a latent trait."""
        if self.name != "latent":
            return replace(self, kappa=x)
        noise, rater_sd = math.exp(-x), _RATER_SHARE * math.exp(-x)
        total = math.sqrt(1.0 + noise**2 + rater_sd**2)
        cuts = tuple((ndtri(np.cumsum(self.prevalences)[:-1]) * total).tolist())
        latent = LatentModel(thresholds=cuts, noise_sd=noise, rater_sd=rater_sd)
        return replace(self, latent=latent)


# -- what a study declares ------------------------------------------------------------


def declared_model(study: Study) -> ItemModel:
    """Return the model that a study declares, before its kappa is solved for."""
    if isinstance(study.model, LatentModel):
        return ItemModel(
            name="latent",
            scale=_scale(study, len(study.model.thresholds) + 1),
            latent=study.model,
            p_missing=study.p_missing,
        )
    name = str(study.model)
    refuse(
        (
            name not in MODELS,
            f"model: needs one of {', '.join(MODELS)}, or a LatentModel, because "
            f"models with the same kappa differ in precision, got {shown(study.model)}",
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
    q = categories if isinstance(categories, int) else len(categories or ())
    refuse(
        (
            categories is None and prevalences is None,
            "categories, prevalences: need one of them, got neither",
        ),
        (
            categories is not None and q < 2,
            f"categories: needs at least 2, got {q}",
        ),
    )
    declared = np.full(q, 1.0 / q) if prevalences is None else prevalences
    try:
        shares = np.atleast_1d(np.asarray(declared, dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"prevalences: needs numbers, got {prevalences!r}"
        ) from error
    q = q or len(shares)
    needed = (
        f"a table needs the joint probabilities of two raters, {q} × {q}"
        if is_table
        else f"needs one of each of {q} categories, at least 2"
    )
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
            f"categories: needs {q} different ones, as the model has, got "
            f"{n_different}",
        )
    )
    return tuple(study.categories)


# -- distinct rows of ratings and their probabilities ---------------------------------


def rows_of(model: ItemModel, n_raters: int, *, ordered: bool) -> Integers:
    """List the distinct rows of ratings: all, or one of each count of categories."""
    # -> (n_rows, n_raters), -1 where a rating is missing
    least, q = -int(model.p_missing > 0.0), len(model.scale)
    if ordered:
        return np.indices((q - least,) * n_raters).reshape(n_raters, -1).T + least
    rows = itertools.combinations_with_replacement(range(least, q), n_raters)
    return np.array(list(rows), dtype=np.int64).reshape(-1, n_raters)


def probabilities(model: ItemModel, rows: Integers, *, ordered: bool) -> Floats:
    """Return how probable each distinct row is."""
    # rows (n_rows, n_raters) -> (n_rows,)
    n_raters = rows.shape[1]
    counts = (rows[:, :, None] == np.arange(len(model.scale))).sum(axis=1)
    n = counts.sum(axis=1)
    probability, _ = MODELS[model.name]
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
    if not 0.0 < model.kappa < 1.0:
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


def _draw_mixture(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    codes = _places(np.cumsum(model.prevalences), rng.random(size))
    one = rng.random(size[:2]) < model.kappa
    return np.where(one[..., None], codes[..., :1], codes)


def _draw_dirichlet(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    if not 0.0 < model.kappa < 1.0:
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
    return np.searchsorted(np.array(latent.thresholds), y).astype(np.int64, copy=False)


def _draw_table(model: ItemModel, rng: np.random.Generator, size: Size) -> Integers:
    cell = _places(np.cumsum(np.array(model.table)), rng.random(size[:2]))
    return np.stack(np.divmod(cell, len(model.scale)), axis=-1)


def _places(cumulated: Floats, u: Floats) -> Integers:
    # the last is left out, so that rounding leads past no end
    return np.searchsorted(cumulated[:-1], u, side="right").astype(np.int64, copy=False)


# how probable rows of ratings are, and how they are drawn
MODELS: dict[
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


# -- a study with its model ----------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Design:
    """A study with its model, and what is the same in all of its studies, made once."""

    study: Study
    model: ItemModel
    entry: Coefficient  # in the register
    is_icc: bool  # an intraclass correlation, of normal ratings
    n_items: int  # of a design that has a size
    n_raters: int
    value: float  # the true coefficient
    level: float  # of the two-sided interval that is computed

    @classmethod
    def of(cls, study: Study, model: ItemModel) -> "Design":
        """Return the design of a study and its model."""
        return cls(
            study=study,
            model=model,
            entry=coefficient(study.coefficient),
            is_icc=study.coefficient in FORMS,
            n_items=int(study.n_items or 0),
            n_raters=int(study.n_raters or 0),
            value=float(study.value or 0.0),
            level=1.0 - (1.0 - study.level) * (2.0 / study.sides),
        )

    @property
    def ordered(self) -> bool:
        """Whether it matters which rater gave which rating."""
        return self.model.name == "table" or self.entry.raters_matter

    @property
    def has_rows(self) -> bool:
        """Whether a study is how often each distinct row of ratings occurs."""
        return (
            self.study.target == "items"
            and self.model.has_rows
            and self.entry.shape == "ratings"
            and self.n_rows <= _MAX_ROWS
        )

    @property
    def leaves_raters_out(self) -> bool:
        """Whether raters are left out, one at a time, of all studies at once."""
        return (
            self.study.target == "raters"
            and self.entry.shape == "ratings"
            and self.study.interval.startswith(("auto", "t", "jackknife"))
        )

    @property
    def is_chosen(self) -> bool:
        """Whether an interval is computed study by study."""
        return not (
            self.is_icc or self.study.interval in _WALD or self.leaves_raters_out
        )

    @property
    def n_tables(self) -> float:
        """How many studies there are that differ; infinite where none are listed."""
        if self.is_icc or not (self.has_rows and len(self.model.scale) == 2):
            return math.inf
        return math.comb(self.n_items + self.n_rows - 1, self.n_rows - 1)

    @property
    def is_exact(self) -> bool:
        """Whether all studies are summed over."""
        if self.study.method != "auto":
            return self.study.method == "exact"
        if self.is_icc:
            return self.study.coefficient != AGREEMENT
        most = _MAX_CHOSEN if self.is_chosen else MAX_TABLES
        return self.study.interval != "bootstrap" and self.n_tables <= most

    @property
    def min_raters(self) -> int:
        """The fewest raters that the coefficient and the target can have."""
        left_out = self.entry.shape == "ratings" and self.study.target != "items"
        least = 2 if self.is_icc else 3 if left_out else 1
        return max(self.entry.n_raters[0], least)

    @property
    def max_raters(self) -> float:
        """The most raters that there can be."""
        return 2 if self.model.name == "table" else self.entry.n_raters[1] or math.inf

    def of_size(self, **sizes: int) -> "Design":
        """Return the design with another number of items, or of raters."""
        design = Design.of(replace(self.study, **sizes), self.model)  # type: ignore[arg-type]
        _check_size(design)
        return design

    @property
    def cost(self) -> float:
        """What a study costs."""
        n, r = self.n_items, self.n_raters
        per_item, per_rater, per_rating = self.study.prices or (0.0, 0.0, 1.0)
        n_ratings = n * r * (2 if self.entry.shape == "pairs" else 1)
        return per_item * n + per_rater * r + per_rating * n_ratings

    # -- distinct rows of ratings, and the coefficient as a function of sums ----------

    @property
    def n_columns(self) -> int:
        """Ratings in a row: a pair, where raters are taken one by one."""
        return 2 if self.entry.shape == "pairs" else self.n_raters

    @property
    def n_rows(self) -> int:
        """Number of distinct rows of ratings."""
        q, n = len(self.model.scale) + (self.model.p_missing > 0.0), self.n_columns
        return int(q**n) if self.ordered else math.comb(n + q - 1, n)

    @cached_property
    def rows(self) -> Integers:
        """Distinct rows of the ratings of an item, (n_rows, n_columns)."""
        return rows_of(self.model, self.n_columns, ordered=self.ordered)

    @cached_property
    def p(self) -> Floats:
        """How probable each is, (n_rows,)."""
        p = np.maximum(probabilities(self.model, self.rows, ordered=self.ordered), 0.0)
        return np.asarray(p / p.sum())

    @cached_property
    def problem(self) -> IntervalProblem:
        """The question about the ratings, which differ from study to study."""
        per_rater = 2 if self.entry.shape == "pairs" else 1
        n_columns = max(self.n_raters, 2 // per_rater) * per_rater
        codes = np.repeat(np.arange(len(self.model.scale))[:, None], n_columns, axis=1)
        with warnings.catch_warnings(action="ignore", category=MasrelWarning):
            return pose_problem(
                replace(self.entry, code=lambda ratings, _categories: ratings),
                CodedRatings(codes=codes, categories=self.model.scale),
                target=self.study.target,
                categories=None,
                weights=self.study.weights,
                level=self.level,
            )

    def features(self, codes: Integers) -> Floats:
        """Return features of ratings (…, n_raters), (…, n_features)."""
        rows = codes.reshape(-1, n_raters := codes.shape[-1])
        if _FEW * (len(self.model.scale) + 1) ** n_raters > len(rows):
            return self.problem.features(rows).reshape(*codes.shape[:-1], -1)
        # items of many studies: those of every row once
        every = rows_of(self.model, n_raters, ordered=True)
        least = -int(self.model.p_missing > 0.0)
        shape = (len(self.model.scale) - least,) * n_raters
        places = np.ravel_multi_index(tuple(np.moveaxis(codes - least, -1, 0)), shape)
        return np.asarray(self.problem.features(every)[places])

    @np.errstate(invalid="ignore")  # 0/0 where there is no coefficient
    def population(self) -> tuple[float, float]:
        """Return the coefficient of all items, and the SD of one item's influence."""
        features = self.features(self.rows)
        sums = _LARGE * (self.p @ features)
        u = _LARGE * (features @ self.problem.slopes(sums[None])[0])
        p = self.p * features.any(axis=1)
        u -= p @ u / p.sum()
        return float(self.problem.values(sums)), math.sqrt(float(p @ u**2))

    @property
    def item_sd(self) -> float:
        """Standard deviation of what one item moves the coefficient by."""
        # of a pair of each rater, independent of one another
        n = self.n_raters if self.entry.shape == "pairs" else 1
        return self.population()[1] / math.sqrt(n)


# -- from a study to its design -------------------------------------------------------


def design_of(study: Study) -> Design:
    """Return a study's design, or say what does not fit its coefficient."""
    entry = coefficient(study.coefficient)
    study = replace(study, coefficient=entry.name)
    if entry.name in FORMS:
        _check_normal(study, entry)
        design = Design.of(study, ItemModel(name="normal"))
    else:
        refuse(
            (
                entry.formula is None or entry.has_interval,
                f"coefficient: {entry.title} cannot be planned for, because it is not "
                f"a function of sums over items; the others and {', '.join(FORMS)} can",
            )
        )
        design = _with_value(Design.of(study, declared_model(study)))
    value, null, lower, upper = design.value, study.null, study.lower, study.upper
    refuse(
        (
            study.coefficient != AGREEMENT and study.rater_share != RATER_SHARE,
            f"rater_share: is only for icc_a1, got {study.coefficient}",
        ),
        (
            null is not None and math.isclose(null, value, abs_tol=1e-9),
            f"null: needs a number other than value, {value:g}",
        ),
        (
            lower is not None and lower >= value,
            f"lower: needs to lie below value, {value:g}, got {lower}",
        ),
        (
            upper is not None and upper <= value,
            f"upper: needs to lie above value, {value:g}, got {upper}",
        ),
    )
    _check_size(design)
    return design


def _check_normal(study: Study, entry: Coefficient) -> None:
    # what normal ratings have none of
    is_weighted = not isinstance(study.weights, str) or study.weights != "identity"
    absent = f"{entry.title} takes none, because its ratings are normal"
    value, target = study.value, entry.interval_target
    refuse(
        (is_weighted, f"weights: {absent} and complete"),
        (study.categories is not None, f"categories: {absent} and complete"),
        (study.prevalences is not None, f"prevalences: {absent} and complete"),
        (study.p_missing > 0.0, f"p_missing: {absent} and complete"),
        (study.model is not None, f"model: {absent}; got {study.model!r}"),
        (
            value is None or not 0.0 < value < 1.0,
            f"value: {entry.title} needs a number in (0, 1), got {shown(value)}",
        ),
        (
            study.target != target,
            f'target: the interval of {entry.title} is for other "{target}", got '
            f'"{study.target}"',
        ),
    )


def _check_size(design: Design) -> None:
    # whether the coefficient, the target and the model can have so many
    study, entry = design.study, design.entry
    n, fewest, most = study.n_raters, design.min_raters, entry.n_raters[1]
    needed = f"{fewest} exactly" if most == fewest else f"{fewest} or more"
    n_positions = len(design.model.latent.positions)
    refuse(
        (
            n is not None and not fewest <= n <= (most or n),
            f"n_raters: {entry.title} for other {study.target} needs {needed}, got {n}",
        ),
        (
            design.model.name == "table" and n not in (None, 2),
            f"n_raters: a table needs two raters, got {n}",
        ),
        (
            n_positions and study.n_items not in (None, n_positions),
            f"n_items: the model has the positions of {n_positions} items, got "
            f"{study.n_items}",
        ),
    )


def _with_value(design: Design) -> Design:
    # the model's kappa is solved for, or the value is the one that it has
    study, value = design.study, design.study.value
    if isinstance(study.model, LatentModel) or study.model == "table":
        implied = _true_value(design)
        refuse(
            (
                value is not None and abs(implied - value) > 5e-3,
                f"value: the model implies {implied:.4f}, got {value}",
            )
        )
        return Design.of(replace(study, value=implied), design.model)
    refuse((value is None, "value: needs the true coefficient, got none"))
    return at_value(design, design.value)


def _true_value(design: Design) -> float:
    # of complete ratings by two raters, or by one who rates twice
    n_raters = 1 if design.entry.shape == "pairs" else 2
    model = replace(design.model, p_missing=0.0)
    return Design.of(replace(design.study, n_raters=n_raters), model).population()[0]


def at_value(design: Design, value: float) -> Design:
    """Return the design whose true coefficient is a value."""
    from scipy.optimize import brentq  # loaded when a plan is made

    study = replace(design.study, value=value)
    model, title = design.model, design.entry.title
    if model.name == "table":
        return Design.of(study, _table_at(design, value))
    # noise from much to little, or kappa from chance to agreement
    ends = (-4.0, 4.0) if model.name == "latent" else (0.0, 1.0)

    def short_of(x: float) -> float:
        return _true_value(replace(design, model=model.with_parameter(x))) - value

    refuse(
        (
            not model.prevalences,
            "model: a LatentModel has one value and no null value",
        )
    )
    low, high = map(short_of, ends)
    x = ends[abs(high) < 1e-12]
    if not min(abs(low), abs(high)) < 1e-12:
        refuse(
            (
                math.isnan(low) or math.isnan(high),
                f"prevalences: {title} is undefined with these, "
                f"{list(model.prevalences)}: it needs two categories that occur",
            ),
            (
                not low < 0.0 < high,
                f"value: {title} under {model.name} lies between {low + value:z.3f} "
                f"and {high + value:z.3f} with these prevalences, got {value:g}",
            ),
        )
        x = float(brentq(short_of, *ends, xtol=1e-15, rtol=1e-14))
    return Design.of(study, model.with_parameter(x))


def _table_at(design: Design, value: float) -> ItemModel:
    # With its margins held, a table's coefficient is a straight line in how far it is
    # from chance, where Cohen's kappa is 0 and others need not be.
    table = np.array(design.model.table)
    chance = np.outer(table.sum(axis=1), table.sum(axis=0))
    rows = tuple(map(tuple, chance.tolist()))
    at_chance = _true_value(replace(design, model=replace(design.model, table=rows)))
    share = (value - at_chance) / (_true_value(design) - at_chance)
    other = chance + share * (table - chance)
    none = f"value: no table with these margins is as far from chance as {value:g}"
    refuse((other.min() < -1e-12, none))
    rows = tuple(map(tuple, np.maximum(other, 0.0).tolist()))
    return replace(design.model, table=rows)
