"""How many items or raters a study needs, and what a study of a given size shows."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, NoReturn

import numpy as np

from masrel.agreement import Label, WeightsLike
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._aims import (
    RATER_SHARE,
    Aim,
    Question,
    pose_question,
)
from masrel.planning._closed_forms import (
    critical,
    fit_power,
    n_by_fit,
    n_by_fit_power,
    n_for_half_width,
    n_for_power,
    n_icc_assurance,
    n_icc_power,
    n_icc_width,
)
from masrel.planning._icc_studies import FORMS, ONE_WAY
from masrel.planning._item_models import LatentModel, probabilities, rows_of
from masrel.planning._studies import StudyDesign, StudyMaker, StudySums
from masrel.planning._tasks import (
    Errors,
    exact_sums,
    is_enumerable,
    simulated_sums,
)

Method = Literal["auto", "wald", "goodness-of-fit", "exact", "simulation"]
Model = str | LatentModel | None

MAX_ITEMS, MAX_RATERS = 100_000, 60
_PRIOR_NODES = 80
_MAX_SCAN = 1_500_000  # tables that are looked at around a size
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
    expected_half_width: float = math.nan
    expected_low: float = math.nan
    expected_high: float = math.nan
    assurance: float = math.nan
    power: float = math.nan
    coverage: float = math.nan
    p_undefined: float = math.nan
    monte_carlo_error: float = 0.0
    errors: Mapping[str, float] = field(default_factory=dict)
    cost: float = math.nan
    n_studies: int = 0
    seed: int | None = None
    notes: tuple[str, ...] = ()


def sample_size(
    coefficient: str,
    *,
    value: float | None,
    n_raters: int | None = None,
    n_items: int | None = None,
    weights: WeightsLike = "identity",
    categories: int | Sequence[Label] | None = None,
    prevalences: object = None,
    model: Model = None,
    target: Target,
    p_missing: float = 0.0,
    level: float = 0.95,
    sides: int = 2,
    half_width: float | None = None,
    lower: float | None = None,
    upper: float | None = None,
    null: float | None = None,
    power: float | None = None,
    assurance: float | None = None,
    max_cost: float | None = None,
    prices: tuple[float, float, float] = (0.0, 0.0, 1.0),
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    rng: np.random.Generator | int | None = None,
    method: Method = "auto",
) -> Plan:
    """Solve for the number of items or of raters that a study needs.

    Parameters
    ----------
    coefficient : str
        Its name in the register; any that is a function of sums over items, and the
        intraclass correlations icc_1, icc_c1 and icc_a1.
    value : float or None
        The coefficient that is taken to be true; None where the model has it: a table,
        or a `LatentModel`.
    n_raters, n_items : int, optional
        Exactly one of them: the other is solved for.
    weights : str or array_like, optional
        How much two categories agree.
    categories : int or sequence, optional
        How many there are, or the scale in order.
    prevalences : sequence of float, optional
        Of the categories, with sum 1; equal when not given. With model "table" the
        joint probabilities of two raters, shape (n_categories, n_categories).
    model : {"mixture", "dirichlet-multinomial", "latent", "table"} or LatentModel
        How the ratings of an item come about. An intraclass correlation takes none:
        its ratings are normal.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    p_missing : float, optional
        Chance of every rating to be missing.
    level : float, optional
        Nominal level of the interval.
    sides : {1, 2}, optional
        How many tails share 1 - level.
    half_width : float, optional
        Aim: half the width of the interval, expected or with `assurance`.
    lower, upper : float, optional
        Aim: ends of the interval no lower, no higher; expected, or with `assurance`, or
        with `power` (non-inferiority by one, equivalence by both).
    null : float, optional
        Aim, with `power`: the interval excludes this value.
    power, assurance : float, optional
        Chances to be reached.
    max_cost : float, optional
        What the study may cost.
    prices : tuple of float, optional
        Of an item, a rater, and a rating.
    interval : {"auto", "t", "normal"}, optional
        The interval that is planned: that of an analysis, or estimate ± quantile times
        standard error, over items or (with "t") by leaving raters out.
    rater_share : float, optional
        Of the error of icc_a1, how much the levels of the raters make.
    rng : numpy.random.Generator or int, optional
        Seed of simulated studies; drawn and kept in the plan when not given.
    method : {"auto", "exact", "simulation", "wald", "goodness-of-fit"}, optional
        "auto" sums over all studies where there are few, and else draws them.

    Returns
    -------
    Plan
        The smallest study that reaches the aim, and what it shows.

    Raises
    ------
    ParameterError
        If an argument is out of range, or nothing reaches the aim; the message then
        says what is the best that can be had.

    Notes
    -----
    A chance is not monotone in the number of items: an exact plan with `assurance` or
    `power` gives the size from which on it holds, and notes the first.

    Examples
    --------
    How many items have an expected half-width of 0.15?

    >>> plan = sample_size(
    ...     "scott_pi",
    ...     value=0.5,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_raters=2,
    ...     half_width=0.15,
    ...     interval="normal",
    ... )
    >>> plan.n_items, plan.method
    (154, 'exact')
    """
    if (n_items is None) == (n_raters is None):
        both = "both" if n_items is not None else "none"
        raise ParameterError(
            f"n_items, n_raters: needs exactly one of them, since the other is solved "
            f"for; got {both}"
        )
    aim = Aim(
        half_width=half_width,
        lower=lower,
        upper=upper,
        null=null,
        power=power,
        assurance=assurance,
    ).checked()
    question = pose_question(
        coefficient=coefficient,
        value=value,
        weights=weights,
        categories=categories,
        prevalences=prevalences,
        model=model,
        target=target,
        p_missing=p_missing,
        level=level,
        sides=sides,
        interval=interval,
        method=method,
        aim=aim,
        prices=prices,
        max_cost=max_cost,
        rng=rng,
        rater_share=rater_share,
    )
    if aim.kind is None and max_cost is None:
        raise ParameterError(
            "half_width: needs an aim: a half-width, a lower or upper limit, or a null "
            "value with power; got none"
        )
    solve = _Search(question, n_items=n_items, n_raters=n_raters)
    return solve.plan()


def precision(
    coefficient: str,
    *,
    n_items: int,
    n_raters: int,
    value: float | None,
    weights: WeightsLike = "identity",
    categories: int | Sequence[Label] | None = None,
    prevalences: object = None,
    model: Model = None,
    target: Target,
    p_missing: float = 0.0,
    level: float = 0.95,
    sides: int = 2,
    half_width: float | None = None,
    lower: float | None = None,
    upper: float | None = None,
    null: float | None = None,
    prices: tuple[float, float, float] = (0.0, 0.0, 1.0),
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    prior: tuple[float, float] | None = None,
    rng: np.random.Generator | int | None = None,
    method: Method = "auto",
) -> Plan:
    """Say what a study of a given size can show.

    Parameters
    ----------
    coefficient : str
        Its name; see `sample_size`, which has the same parameters.
    n_items, n_raters : int
        The size of the study.
    value : float or None
        The coefficient that is taken to be true.
    weights : str or array_like, optional
        How much two categories agree.
    categories : int or sequence, optional
        How many there are, or the scale in order.
    prevalences : sequence of float, optional
        Of the categories, or the joint probabilities of two raters.
    model : str or LatentModel, optional
        How the ratings of an item come about; needed but for normal ratings.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    p_missing : float, optional
        Chance of every rating to be missing.
    level : float, optional
        Nominal level of the interval.
    sides : {1, 2}, optional
        How many tails share 1 - level.
    half_width : float, optional
        The plan's assurance is the chance of an interval as narrow as this.
    lower, upper : float, optional
        Its assurance is the chance of an interval inside these.
    null : float, optional
        Its power is the chance of an interval that excludes this.
    prices : tuple of float, optional
        Of an item, a rater, and a rating.
    interval : {"auto", "t", "normal"}, optional
        The interval that is planned.
    rater_share : float, optional
        Of the error of icc_a1, how much the levels of the raters make.
    prior : tuple of float, optional
        Parameters of a Beta distribution of the true value, over which the power of
        method "goodness-of-fit" is averaged.
    rng : numpy.random.Generator or int, optional
        Seed of simulated studies.
    method : {"auto", "exact", "simulation", "wald", "goodness-of-fit"}, optional
        How to compute.

    Returns
    -------
    Plan
        What the study shows.

    Raises
    ------
    ParameterError
        If an argument is out of range.

    Examples
    --------
    >>> plan = precision(
    ...     "icc_1", value=0.6, n_items=100, n_raters=3, target="both", half_width=0.1
    ... )
    >>> round(plan.expected_half_width, 4), round(plan.assurance, 3)
    (0.0995, 0.513)
    """
    aim = Aim(half_width=half_width, lower=lower, upper=upper, null=null)
    question = pose_question(
        coefficient=coefficient,
        value=value,
        weights=weights,
        categories=categories,
        prevalences=prevalences,
        model=model,
        target=target,
        p_missing=p_missing,
        level=level,
        sides=sides,
        interval=interval,
        method=method,
        aim=aim.checked(needs_chance=False),
        prices=prices,
        max_cost=None,
        rng=rng,
        rater_share=rater_share,
        prior=prior,
    )
    return _plan_of(question, question.design(n_items, n_raters))


# -- one size -----------------------------------------------------------------------


def _plan_of(question: Question, design: StudyDesign) -> Plan:
    """Return what a design shows."""
    if question.method in ("wald", "goodness-of-fit"):
        return _by_formula(question, design)
    is_exact = question.method == "exact" or (
        question.method == "auto" and is_enumerable(design)
    )
    sums = (
        exact_sums(design)
        if is_exact
        else simulated_sums(design, question.seed, question.rater_share)
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
    return Plan(
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


def _by_formula(question: Question, design: StudyDesign) -> Plan:
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


# -- the smallest size --------------------------------------------------------------


class _Search:
    """The smallest number of items, or of raters, that reaches an aim."""

    def __init__(
        self, question: Question, *, n_items: int | None, n_raters: int | None
    ) -> None:
        self.question, self.n_items, self.n_raters = question, n_items, n_raters
        self._plans: dict[int, Plan] = {}

    @property
    def _name(self) -> str:
        return "items" if self.n_items is None else "raters"

    def _design(self, n: int) -> StudyDesign:
        if self.n_items is None:
            return self.question.design(n, self.n_raters or 0)
        return self.question.design(self.n_items, n)

    def at(self, n: int) -> Plan:
        """Return the plan of a size, computed once."""
        if n not in self._plans:
            self._plans[n] = _plan_of(self.question, self._design(n))
        return self._plans[n]

    def plan(self) -> Plan:
        """Return the plan of the smallest size."""
        question = self.question
        if question.method in ("wald", "goodness-of-fit"):
            n = self._by_formula()
            plan = self._of_formula(n)
        elif question.aim.kind is None:
            plan = self.at(self._affordable_size())
        else:
            plan = self._searched()
        return self._affordable(plan)

    def _searched(self) -> Plan:
        lowest = self._lowest()
        highest = MAX_RATERS if self.n_items is not None else MAX_ITEMS
        n = smallest(
            lambda size: self.question.aim.is_met(self.at(size)),
            guess=self._guess(lowest, highest),
            lowest=lowest,
            highest=highest,
        )
        if n is None:
            self._refuse(highest)
        return self._stable(n)

    def _lowest(self) -> int:
        if self.n_items is None:
            return 3 if self.question.is_icc else 2
        fewest = 2 if self.question.target == "items" or self.question.is_icc else 3
        return max(fewest, self.question.entry.n_raters[0])

    def _guess(self, lowest: int, highest: int) -> int:
        # near the size by the normal formula; raters one by one from the fewest
        if self.n_items is not None:
            return lowest
        half = self.question.aim.distance(self.question.value)
        design = self._design(max(lowest, 20))
        z = critical(self.question.level, self.question.sides)
        if self.question.is_icc:
            n = n_icc_width(self.question.value, design.n_raters, 2 * half, z)
        elif self.question.target != "items" or not design.model.has_rows:
            n = 20
        else:
            n = n_for_half_width(StudyMaker(design).item_sd(), half, z)
        if n > highest:
            self._refuse(highest)
        return max(lowest, n)

    def _refuse(self, highest: int) -> NoReturn:
        aim, n = self.question.aim, highest
        if self.n_items is None and not self._design(20).has_rows:
            n = 200  # a study of so many whose ratings are drawn one by one
        best = self.at(n)
        raise ParameterError(
            f"{aim.name}: {aim.words} needs more than {highest} {self._name}; "
            f"the best that can be had with {n} is {aim.reached(best)}"
        )

    def _stable(self, n: int) -> Plan:
        # An exact chance goes up and down with n: from where on it holds.
        if not (self.question.aim.is_chance and self.at(n).method == "exact"):
            return self.at(n)
        if self.question.is_icc or self.n_items is not None:
            return self.at(n)
        around = range(max(self._lowest(), int(0.85 * n)), int(1.25 * n) + 2)
        if sum(self._design(size).n_tables for size in around) > _MAX_SCAN:
            note = "larger sizes were not looked at: a chance can fall with one more"
            return replace(self.at(n), notes=(note,))
        is_met = {size: self.question.aim.is_met(self.at(size)) for size in around}
        first = min(size for size in around if is_met[size])
        stable = 1 + max((size for size in around if not is_met[size]), default=n - 1)
        if first == stable:
            return self.at(stable)
        note = (
            f"{first} {self._name} reach it first, but {stable - 1} do not: the chance "
            "goes up and down"
        )
        return replace(self.at(stable), notes=(note,))

    # -- formulas ---------------------------------------------------------------------

    def _of_formula(self, n: int) -> Plan:
        design = self._design(n)
        if design.coefficient in FORMS:
            words = self.question.words(design)
            cost = self.question.cost(design.n_items, design.n_raters)
            return Plan(**words, method=self.question.method, cost=cost)
        if self.question.method == "goodness-of-fit" and design.n_raters > 2:
            words = self.question.words(design)
            cost = self.question.cost(design.n_items, design.n_raters)
            return Plan(**words, method=self.question.method, cost=cost)
        return _by_formula(self.question, design)

    def _by_formula(self) -> int:
        if self.n_items is not None:
            raise ParameterError(
                f"method: {self.question.method} solves for items, not for raters: it "
                "needs n_raters"
            )
        design = self._design(20)
        z = critical(self.question.level, self.question.sides)
        if self.question.is_icc:
            return self._icc_formula(design, z)
        if self.question.method == "wald":
            return self._wald_formula(design, z)
        return self._fit_formula(design, z)

    def _wald_formula(self, design: StudyDesign, z: float) -> int:
        aim, value = self.question.aim, self.question.value
        sd = StudyMaker(design).item_sd()
        if aim.kind == "power" and aim.null is not None and aim.power is not None:
            sds = (StudyMaker(self.question.null_design(design)).item_sd(), sd)
            return n_for_power(sds, value - aim.null, z, aim.power)
        return n_for_half_width(sd, aim.distance(value), z)

    def _fit_formula(self, design: StudyDesign, z: float) -> int:
        aim, value = self.question.aim, self.question.value
        p = fit_cells(design)
        if aim.kind == "power" and aim.null is not None and aim.power is not None:
            null = fit_cells(self.question.null_design(design))
            return n_by_fit_power(p, null, z, aim.power)
        limits = [aim.lower, aim.upper]
        if aim.half_width is not None:
            limits = [value - aim.half_width, value + aim.half_width]
        return n_by_fit(
            p,
            [
                fit_cells(self.question.design_at(design, limit))
                for limit in limits
                if limit is not None
            ],
            z,
        )

    def _icc_formula(self, design: StudyDesign, z: float) -> int:
        aim, r, k = self.question.aim, self.question.value, design.n_raters
        if design.coefficient != ONE_WAY:
            raise ParameterError(
                f"method: the formulas are of icc_1, got {design.coefficient}"
            )
        chance_of = aim.power or aim.assurance
        limit = aim.null if aim.null is not None else aim.lower
        if limit is not None and chance_of is not None:
            return n_icc_power(r, limit, k, z, chance_of)
        half = aim.distance(r)
        if aim.assurance is not None:
            return n_icc_assurance(r, k, half, z, aim.assurance)
        return n_icc_width(r, k, 2.0 * half, z)

    # -- cost -------------------------------------------------------------------------

    def _affordable_size(self) -> int:
        cost = self._cost
        n = smallest(
            lambda size: cost(size + 1) > (self.question.max_cost or 0.0),
            guess=10,
            lowest=self._lowest(),
            highest=MAX_ITEMS if self.n_items is None else MAX_RATERS,
        )
        if n is None or cost(n) > (self.question.max_cost or 0.0):
            raise ParameterError(
                f"max_cost: needs a limit between {cost(self._lowest()):g}, of the "
                f"smallest study, and what some study costs; got "
                f"{self.question.max_cost:g}"
            )
        return n

    def _cost(self, n: int) -> float:
        sizes = (n, self.n_raters or 0) if self.n_items is None else (self.n_items, n)
        return self.question.cost(*sizes)

    def _affordable(self, plan: Plan) -> Plan:
        limit = self.question.max_cost
        if limit is None or plan.cost <= limit:
            return plan
        aim, n = self.question.aim, self._affordable_size()
        best = ""
        if self.question.method not in ("wald", "goodness-of-fit"):
            best = f", which reach {aim.reached(self.at(n))}"
        raise ParameterError(
            f"max_cost: {aim.words} needs {plan.n_items} items and {plan.n_raters} "
            f"raters, which cost {plan.cost:g}; {limit:g} pays for {n} {self._name}"
            + best
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


def smallest(
    is_met: Callable[[int], bool], *, guess: int, lowest: int, highest: int
) -> int | None:
    """Return the smallest size that meets an aim, by steps and halves from a guess."""
    low, high = lowest - 1, min(max(guess, lowest), highest)  # not met, perhaps met
    step = max(1, high // 20)
    if is_met(high):
        while high - step > low and is_met(high - step):
            high, step = high - step, 2 * step
        low = max(low, high - step)
    else:
        while not is_met(high):
            if high == highest:
                return None
            low, high, step = high, min(high + step, highest), 2 * step
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_met(middle) else (middle, high)
    return high
