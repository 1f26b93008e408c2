"""A study with its model: what the coefficient and its ratings are taken to be.

In: a `Study`. Out: a `Design`, whose model has the value that is taken to be true; the
coefficient of a design is a function of sums over items.
"""

import math
import warnings
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from masrel._input import refuse
from masrel.agreement import CodedRatings, Coefficient, coefficient
from masrel.errors import MasrelWarning, ParameterError
from masrel.intervals._problem import IntervalProblem, pose_problem
from masrel.planning._study_plan import RATER_SHARE, LatentModel, Study
from masrel.planning._truth import (
    Floats,
    Integers,
    ItemModel,
    declared_model,
    n_rows,
    probabilities,
    rows_of,
)

ONE_WAY, CONSISTENCY, AGREEMENT = "icc_1", "icc_c1", "icc_a1"
FORMS = (ONE_WAY, CONSISTENCY, AGREEMENT)

_MAX_ROWS = 20_000  # distinct rows above which ratings are drawn one by one
_LARGE = 1e12  # items of a population
_WALD = ("t", "normal", "analytic")  # computed for all studies at once
_MAX_CHOSEN = 4_000  # studies that are summed over where each has its interval chosen
MAX_TABLES = 1_000_000  # that are summed over


@dataclass(frozen=True, kw_only=True)
class Design:
    """A study with its model, and what is the same in all of its studies, made once."""

    study: Study
    model: ItemModel

    @property
    def entry(self) -> Coefficient:
        """The coefficient's entry in the register."""
        return coefficient(self.study.coefficient)

    @property
    def is_icc(self) -> bool:
        """Whether it is an intraclass correlation, of normal ratings."""
        return self.study.coefficient in FORMS

    @property
    def n_items(self) -> int:
        """Items of a design that has a size."""
        return int(self.study.n_items or 0)

    @property
    def n_raters(self) -> int:
        """Raters of a design that has a size."""
        return int(self.study.n_raters or 0)

    @property
    def value(self) -> float:
        """The true coefficient."""
        return float(self.study.value or 0.0)

    @property
    def level(self) -> float:
        """The level of the two-sided interval that is computed."""
        return 1.0 - (1.0 - self.study.level) * (2.0 / self.study.sides)

    @property
    def ordered(self) -> bool:
        """Whether it matters which rater gave which rating."""
        alike = not self.entry.tells_raters_apart or self.entry.name == "scott_pi"
        return self.model.name == "table" or not alike

    @property
    def has_rows(self) -> bool:
        """Whether a study is how often each distinct row of ratings occurs."""
        return (
            self.study.target == "items"
            and self.model.has_rows
            and self.entry.shape == "ratings"
            and n_rows(self.model, self.n_raters, ordered=self.ordered) <= _MAX_ROWS
        )

    @property
    def leaves_raters_out(self) -> bool:
        """Whether raters are left out, one at a time, of all studies at once."""
        of_raters = self.study.target == "raters" and self.entry.shape == "ratings"
        return of_raters and self.study.interval in ("auto", "t", "jackknife")

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
        cells = n_rows(self.model, self.n_raters, ordered=self.ordered)
        return math.comb(self.n_items + cells - 1, cells - 1)

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

    def of_size(self, n_items: int | None, n_raters: int | None) -> "Design":
        """Return the design with other numbers of items and raters."""
        study = replace(self.study, n_items=n_items, n_raters=n_raters)
        design = replace(self, study=study)
        _check_size(design)
        return design

    def at_value(self, value: float) -> "Design":
        """Return the design whose true coefficient is a value."""
        model = _model_at(self, value)
        return replace(self, study=replace(self.study, value=value), model=model)

    def cost(self, n_items: int, n_raters: int) -> float:
        """Return what a study of a size costs."""
        per_item, per_rater, per_rating = self.study.prices or (0.0, 0.0, 1.0)
        n_ratings = n_items * n_raters * (2 if self.entry.shape == "pairs" else 1)
        return per_item * n_items + per_rater * n_raters + per_rating * n_ratings

    # -- distinct rows of ratings, and the coefficient as a function of sums ----------

    @cached_property
    def rows(self) -> Integers:
        """Distinct rows of the ratings of an item, (n_rows, n_raters)."""
        return rows_of(self.model, self.n_raters, ordered=self.ordered)

    @cached_property
    def p(self) -> Floats:
        """How probable each is, (n_rows,)."""
        p = probabilities(self.model, self.rows, ordered=self.ordered)
        return np.asarray(np.maximum(p, 0.0) / np.maximum(p, 0.0).sum())

    @cached_property
    def problem(self) -> IntervalProblem:
        """The question about the ratings, of which each study has others."""
        per_rater = 2 if self.entry.shape == "pairs" else 1
        n_columns = max(self.n_raters, 2 // per_rater) * per_rater
        codes = np.repeat(np.arange(len(self.model.scale))[:, None], n_columns, axis=1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)
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
        rows = codes.reshape(-1, codes.shape[-1])
        features = self.problem.features(replace(self.problem.coded, codes=rows))
        return features.reshape(*codes.shape[:-1], -1)

    def values(self, sums: Floats) -> Floats:
        """Return the coefficient for sums (…, n_features); 0/0 where there is none."""
        with np.errstate(invalid="ignore"):
            return self.problem.values(sums)

    def slopes(self, sums: Floats) -> Floats:
        """Return the derivatives of the coefficient in sums (…, n_features)."""
        return self.problem.slopes(sums)

    @np.errstate(invalid="ignore")  # 0/0 where there is no coefficient
    def population(self, n_ratings: int, p_missing: float) -> tuple[float, float]:
        """Return the coefficient of all items, and the SD of one item's influence."""
        model = replace(self.model, p_missing=p_missing)
        rows = rows_of(model, n_ratings, ordered=self.ordered)
        p = probabilities(model, rows, ordered=self.ordered)
        features = self.features(rows)
        sums = _LARGE * (p @ features)
        u = _LARGE * (features @ self.slopes(sums[None])[0])
        p = p * features.any(axis=1)
        u -= p @ u / p.sum()
        return float(self.values(sums)), math.sqrt(float(p @ u**2))

    @property
    def item_sd(self) -> float:
        """Standard deviation of what one item moves the coefficient by."""
        if self.entry.shape == "ratings":
            return self.population(self.n_raters, self.study.p_missing)[1]
        # a pair of each rater, independent of one another
        _, of_pair = self.population(2, self.study.p_missing)
        return of_pair / math.sqrt(self.n_raters)


# -- from a study to its design -------------------------------------------------------


def design_of(study: Study) -> Design:
    """Return a study's design, or say what does not fit its coefficient."""
    entry = coefficient(study.coefficient)
    study = replace(study, coefficient=entry.name)
    if entry.name in FORMS:
        _check_normal(study, entry)
        design = Design(study=study, model=ItemModel(name="normal"))
    else:
        refuse(
            (
                entry.formula is None,
                f"coefficient: {entry.title} cannot be planned for: it is no function "
                f"of sums over items; the others and {', '.join(FORMS)} can",
            )
        )
        design = _with_value(Design(study=study, model=declared_model(study)))
    value, null, lower, upper = design.value, study.null, study.lower, study.upper
    refuse(
        (
            study.coefficient != AGREEMENT and study.rater_share != RATER_SHARE,
            f"rater_share: is of icc_a1 alone, got {study.coefficient}",
        ),
        (
            null is not None and math.isclose(null, value, abs_tol=1e-9),
            f"null: needs another number than value, {value:g}",
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
    absent = f"{entry.title} takes none, since its ratings are normal"
    value, target = study.value, entry.interval_target
    refuse(
        (is_weighted, f"weights: {absent} and complete"),
        (study.categories is not None, f"categories: {absent} and complete"),
        (study.prevalences is not None, f"prevalences: {absent} and complete"),
        (study.p_missing > 0.0, f"p_missing: {absent} and complete"),
        (study.model is not None, f"model: {absent}; got {study.model!r}"),
        (
            value is None or not 0.0 < value < 1.0,
            f"value: {entry.title} needs (0, 1), got {value}",
        ),
        (
            study.target != target,
            f'target: the interval of {entry.title} is of other "{target}", got '
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
            f"n_raters: a table is of two raters, got {n}",
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
        is_other = value is not None and abs(implied - value) > 5e-3
        refuse(
            (
                is_other,
                f"value: the model has {implied:.4f}, got {value}; None takes it",
            )
        )
        return replace(design, study=replace(study, value=implied))
    if value is None:
        raise ParameterError("value: needs the true coefficient, got none")
    return design.at_value(value)


def _true_value(design: Design) -> float:
    n_raters = 1 if design.entry.shape == "pairs" else 2
    of_two = replace(design, study=replace(design.study, n_raters=n_raters))
    return of_two.population(2, 0.0)[0]


def _model_at(design: Design, value: float) -> ItemModel:
    """Return the model whose true coefficient is a value."""
    from scipy.optimize import brentq  # loaded when a plan is made

    model, title = design.model, design.entry.title
    if model.name == "table":
        return _table_at(design, value)
    is_latent = model.name == "latent"
    # noise from much to little, or kappa from chance to agreement
    ends = (-4.0, 4.0) if is_latent else (0.0, 1.0)

    def at(x: float) -> ItemModel:
        return model.with_parameter(math.exp(-x) if is_latent else x)

    def short_of(x: float) -> float:
        return _true_value(replace(design, model=at(x))) - value

    refuse(
        (
            not model.prevalences,
            "model: a LatentModel has one value, and no null value",
        )
    )
    low, high = map(short_of, ends)
    if not is_latent and min(abs(low), abs(high)) < 1e-12:
        return at(ends[abs(high) < 1e-12])
    refuse(
        (
            math.isnan(low) or math.isnan(high),
            f"prevalences: {title} is undefined with these, {list(model.prevalences)}: "
            "it needs two categories that occur",
        ),
        (
            not low < 0.0 < high,
            f"value: {title} under {model.name} lies between {low + value:z.3f} and "
            f"{high + value:z.3f} with these prevalences, got {value:g}",
        ),
    )
    return at(float(brentq(short_of, *ends, xtol=1e-15, rtol=1e-14)))


def _table_at(design: Design, value: float) -> ItemModel:
    # With its margins, a table's kappa is proportional to how far it is from chance.
    table = np.array(design.model.table)
    chance = np.outer(table.sum(axis=1), table.sum(axis=0))
    other = chance + value / _true_value(design) * (table - chance)
    none = f"value: no table with these margins is as far from chance as {value:g}"
    refuse((other.min() < -1e-12, none))
    rows = tuple(map(tuple, np.maximum(other, 0.0).tolist()))
    return replace(design.model, table=rows)
