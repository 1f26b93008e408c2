"""What a study of a given size can show: exactly, simulated, or by a formula."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._closed_forms import critical, fit_power
from masrel.planning._icc_studies import FORMS
from masrel.planning._item_models import probabilities, rows_of
from masrel.planning._plan_question import Question
from masrel.planning._studies import StudyDesign, StudyMaker, StudySums
from masrel.planning._tasks import Errors, exact_sums, is_enumerable, simulated_sums

_PRIOR_NODES = 80
_PLACES = {"half-width": 0, "low": 1, "high": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A study of some size, and what it can show.

    Attributes
    ----------
    coefficient, weights : str
        What is estimated.
    value : float
        The coefficient that is taken to be true.
    n_items, n_raters : int
        The size of the study.
    model : str
        How the ratings of an item come about.
    target : {"items", "raters", "both"}
        What was sampled.
    interval : str
        The interval that is planned: "auto" is that of `masrel.intervals.estimate`.
    level : float
        Its level.
    sides : int
        2 leaves half of 1 - level in each tail, 1 all of it in one.
    method : {"exact", "simulation", "wald", "goodness-of-fit"}
        How the numbers were computed.
    prevalences : tuple of float
        Of the categories; empty where a model has none.
    table : tuple of tuple of float
        The joint probabilities of two raters, of model "table".
    p_missing : float
        Chance of every rating to be missing.
    half_width, lower, upper, null : float or None
        What `assurance` and `power` are of.
    expected_half_width : float
        Half the width of the interval, on average over studies.
    expected_low, expected_high : float
        Its ends, on average.
    assurance : float
        Chance that the interval is as narrow as wanted, or inside the limits; ``nan``
        without either.
    power : float
        Chance that the interval excludes the null value, or lies inside the limits of
        equivalence; ``nan`` without either.
    coverage : float
        How often the interval holds `value`.
    p_undefined : float
        How often a study has no coefficient or no interval.
    monte_carlo_error : float
        Standard error, from simulation, of the number that was aimed at: of
        `expected_half_width` without an aim. 0 where nothing was drawn.
    errors : mapping of str to float
        The same beside every number.
    reaches_aim : bool or None
        Whether it reaches what was aimed at; None without an aim.
    cost : float
        Of items, raters and ratings at their prices.
    n_studies : int
        Simulated studies; 0 where nothing was drawn.
    seed : int or None
        The seed from which they can be drawn again.
    notes : tuple of str
        What to know.

    Examples
    --------
    >>> from masrel.planning import precision
    >>> plan = precision(
    ...     "fleiss_kappa",
    ...     value=0.5,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_items=60,
    ...     n_raters=2,
    ...     method="wald",
    ... )
    >>> round(plan.expected_half_width, 3)
    0.239
    """

    coefficient: str
    weights: str
    value: float
    n_items: int
    n_raters: int
    model: str
    target: Target
    interval: str
    level: float
    sides: int
    method: str
    prevalences: tuple[float, ...] = ()
    table: tuple[tuple[float, ...], ...] = ()
    p_missing: float = 0.0
    half_width: float | None = None
    lower: float | None = None
    upper: float | None = None
    null: float | None = None
    expected_half_width: float = math.nan
    expected_low: float = math.nan
    expected_high: float = math.nan
    assurance: float = math.nan
    power: float = math.nan
    coverage: float = math.nan
    p_undefined: float = math.nan
    monte_carlo_error: float = 0.0
    errors: Mapping[str, float] = field(default_factory=dict)
    reaches_aim: bool | None = None
    cost: float = math.nan
    n_studies: int = 0
    seed: int | None = None
    notes: tuple[str, ...] = ()


def plan_of(question: Question, design: StudyDesign) -> Plan:
    """Return what a design shows."""
    if question.method in ("wald", "goodness-of-fit"):
        return plan_by_formula(question, design)
    is_exact = question.method == "exact" or (
        question.method == "auto" and is_enumerable(design)
    )
    sums = (
        exact_sums(design)
        if is_exact
        else simulated_sums(
            design, question.seed, question.rater_share, question.progress
        )
    )
    return plan_from(question, design, sums, is_exact)


def plan_from(
    question: Question, design: StudyDesign, sums: StudySums, is_exact: bool
) -> Plan:
    """Return the plan that sums over studies of a design make."""
    means = {name: sums.mean(place) for name, place in _PLACES.items()}
    aim = question.aim
    shares = [sums.share(place) for place in range(4)]
    assurance = shares[0] if aim.half_width is not None else math.nan
    is_inside = aim.lower is not None or aim.upper is not None
    if is_inside and aim.half_width is None:
        assurance = shares[2]
    power = shares[1] if aim.null is not None else math.nan
    if is_inside and aim.power is not None and aim.null is None:
        assurance, power = math.nan, shares[2]
    n = 0.0 if is_exact else sums.weight
    chances_of = {"assurance": assurance, "power": power, "coverage": shares[3]}
    errors = {} if is_exact else _errors(means, chances_of, sums.p_undefined, n)
    plan = Plan(
        **question.words(design),
        method="exact" if is_exact else "simulation",
        expected_half_width=means["half-width"][0],
        expected_low=means["low"][0],
        expected_high=means["high"][0],
        assurance=assurance,
        power=power,
        coverage=shares[3],
        p_undefined=sums.p_undefined,
        monte_carlo_error=errors.get(aim.number, 0.0),
        errors=errors,
        cost=question.cost(design.n_items, design.n_raters),
        n_studies=round(n),
        seed=None if is_exact else question.seed,
    )
    if aim.kind is None:
        return plan
    return replace(plan, reaches_aim=aim.is_met(plan))


def _errors(
    means: dict[str, tuple[float, float]],
    shares: dict[str, float],
    p_undefined: float,
    n: float,
) -> Errors:
    of_means = {
        "expected_half_width": means["half-width"][1],
        "expected_low": means["low"][1],
        "expected_high": means["high"][1],
    }
    of_shares = {
        name: math.sqrt(share * (1.0 - share) / n)
        for name, share in {**shares, "p_undefined": p_undefined}.items()
        if not math.isnan(share)
    }
    return {**of_means, **of_shares}


def plan_by_formula(question: Question, design: StudyDesign) -> Plan:
    """Return what a formula says of a design."""
    z = critical(question.level, question.sides)
    half, chance_of = math.nan, math.nan
    if design.coefficient in FORMS:
        raise ParameterError(
            f"method: {question.method} of {design.entry.title} gives a size only: it "
            'needs sample_size, or method "exact"'
        )
    n, value = design.n_items, design.value
    normal = _Normal(n, z)
    if question.method == "wald":
        sd = StudyMaker(design).item_sd()
        half = z * sd / math.sqrt(n)
        if question.aim.null is not None:
            sds = (StudyMaker(question.null_design(design)).item_sd(), sd)
            chance_of = normal.power(sds, abs(value - question.aim.null))
    elif question.aim.null is not None:
        chance_of = _fit_power(question, design, question.aim.null)
    return Plan(
        **question.words(design),
        method=question.method,
        expected_half_width=half,
        expected_low=value - half,
        expected_high=value + half,
        power=chance_of,
        cost=question.cost(n, design.n_raters),
    )


def _fit_power(question: Question, design: StudyDesign, null: float) -> float:
    if design.n_raters != 2 or design.model.n_categories != 2:
        raise ParameterError(
            "method: the power of a goodness-of-fit test at a given size needs two "
            f"raters and two categories, got {design.n_raters} and "
            f"{design.model.n_categories}"
        )

    def at(of: StudyDesign) -> float:
        return fit_power(
            of.n_items, fit_cells(of), null, question.level, question.sides
        )

    if question.prior is None:
        return at(design)
    from scipy.special import roots_jacobi

    # O'Hagan, Stevens and Campbell (2005): the mean of the power over a prior
    a, b = question.prior
    nodes, weight = roots_jacobi(_PRIOR_NODES, b - 1.0, a - 1.0)
    powers = [at(question.design_at(design, 0.5 * (x + 1.0))) for x in nodes.tolist()]
    return float(weight @ powers / weight.sum())


class _Normal(NamedTuple):
    n: int
    z: float

    def power(self, sds: tuple[float, float], difference: float) -> float:
        """Return the power of a test with the variance of the null value."""
        from scipy.special import ndtr

        of_null, of_value = sds
        return float(
            ndtr((difference * math.sqrt(self.n) - self.z * of_null) / of_value)
        )


def fit_cells(design: StudyDesign) -> np.ndarray:
    """Return the probabilities of the cells of a goodness-of-fit test."""
    # two categories: how many raters name the second; else each unanimous one, the rest
    model = design.model
    rows = rows_of(model, design.n_raters, ordered=False)
    p = probabilities(model, rows, ordered=False)
    if model.n_categories == 2:
        return p
    alike = (rows == rows[:, :1]).all(axis=1)
    return np.append(p[alike], p[~alike].sum())
