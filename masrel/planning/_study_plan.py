"""A study to be planned, the plan that results, and a pilot."""

import itertools
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from numbers import Integral, Real
from types import UnionType
from typing import Any, Literal, get_args

import numpy as np

from masrel._input import refuse, shown
from masrel.agreement import Label, WeightsLike, code_ratings
from masrel.errors import RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate, IntervalMethod, Target
from masrel.intervals import estimate

Method = Literal["auto", "wald", "goodness-of-fit", "exact", "simulation"]
Interval = Literal[IntervalMethod, "t", "normal"]
Progress = Callable[[int, int], None]  # what is done, and of how many

FORMULAS = ("wald", "goodness-of-fit")
RATER_SHARE = 1 / 3  # of the error of ICC(A,1) that raters' levels make
_OF_ITEMS_ALONE = ("normal", "analytic", "posterior")
_REACHED = 1e-9


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
        The traits of the items if every study has the same items; empty if each study
        draws new ones.

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
        refuse(
            (
                not (self.noise_sd > 0.0 and self.rater_sd >= 0.0),
                "model: needs noise_sd above 0 and rater_sd of at least 0, got "
                f"{self.noise_sd:g} and {self.rater_sd:g}",
            ),
            (
                not self.thresholds
                or any(a >= b for a, b in itertools.pairwise(self.thresholds)),
                f"model: needs ascending thresholds, got {self.thresholds}",
            ),
        )


@dataclass(frozen=True, slots=True)
class Study:
    """A study to be planned: what is taken to be true, its size, and its aim.

    Attributes
    ----------
    coefficient : str
        Its name in the register; any that is a function of sums over items, and the
        intraclass correlations icc_1, icc_c1 and icc_a1.
    target : {"items", "raters", "both"}
        Population that the interval is about: other items, other raters, or both.
    value : float or None
        The coefficient that is taken to be true; None where the model has it: a table,
        or a `LatentModel`.
    n_items, n_raters : int or None
        The size of the study; what is None is solved for.
    weights : str or array_like
        How much two categories agree.
    categories : int or sequence or None
        How many there are, or the scale in order, by which weights of numbers go.
    prevalences : sequence of float or None
        Of the categories, with sum 1; equal when not given. With model "table" the
        joint probabilities of two raters, shape (n_categories, n_categories).
    model : {"mixture", "dirichlet-multinomial", "latent", "table"} or LatentModel
        How the ratings of an item come about. An intraclass correlation takes none:
        its ratings are normal.
    p_missing : float
        Chance of every rating to be missing.
    level : float
        Nominal level of the interval.
    sides : {1, 2}
        How many tails share 1 - level.
    interval : str
        The interval that is planned: a method of `masrel.intervals.estimate`, such as
        "auto" or "jackknife", or estimate ± quantile times standard error, not cut at
        the ends of the scale: "t" or "normal".
    half_width : float or None
        Aim: half the width of the interval, expected or with `assurance`.
    lower, upper : float or None
        Aim: ends of the interval no lower, no higher; expected, or with `assurance`, or
        with `power` (non-inferiority by one, equivalence by both).
    null : float or None
        Aim, with `power`: the interval excludes this value.
    power, assurance : float or None
        Chances to be reached.
    prices : tuple of float or None
        Prices of an item, a rater, and a rating; (0, 0, 1) unless given.
    max_cost : float or None
        What the study may cost; without an aim, the study is the most that this buys.
    method : {"auto", "exact", "simulation", "wald", "goodness-of-fit"}
        "auto" sums over all studies where there are few, and else draws them.
    prior : tuple of float or None
        Parameters of a Beta distribution of the true value, over which the power of
        method "goodness-of-fit" at a given size is averaged.
    rater_share : float
        Share of the error of icc_a1 that comes from the levels of the raters.
    n_studies : int or None
        Studies that are drawn; as many as a small Monte Carlo error needs when not
        given.
    rng : numpy.random.Generator or int or None
        Seed of simulated studies, or where it comes from; it is kept as `seed`.

    Raises
    ------
    ParameterError
        If a number or a choice is out of range. What does not fit the coefficient is
        said when the study is planned.

    Examples
    --------
    >>> Study("icc_1", target="both", value=0.6, n_items=100, n_raters=3).level
    0.95
    """

    coefficient: str
    _: KW_ONLY
    target: Target
    value: float | None = None
    n_items: int | None = None
    n_raters: int | None = None
    weights: WeightsLike = "identity"
    categories: int | Sequence[Label] | None = None
    prevalences: object = None
    model: str | LatentModel | None = None
    p_missing: float = 0.0
    level: float = 0.95
    sides: int = 2
    interval: Interval = "auto"
    half_width: float | None = None
    lower: float | None = None
    upper: float | None = None
    null: float | None = None
    power: float | None = None
    assurance: float | None = None
    prices: tuple[float, float, float] | None = None
    max_cost: float | None = None
    method: Method = "auto"
    prior: tuple[float, float] | None = None
    rater_share: float = RATER_SHARE
    n_studies: int | None = None
    rng: np.random.Generator | int | None = None

    @property
    def seed(self) -> int:
        """The seed of simulated studies."""
        return int(self.rng)  # type: ignore[arg-type]  # since it was made one below

    def __post_init__(self) -> None:
        """Check numbers and choices, and draw the seed where none was given."""
        for name, (needed, of_kind, holds) in _RULES.items():
            value = getattr(self, name)
            is_absent = value is None and name not in _ALWAYS
            is_right = is_absent or (isinstance(value, of_kind) and holds(value))
            refuse((not is_right, f"{name}: needs {needed}, got {shown(value)}"))
        is_of_items = self.interval in _OF_ITEMS_ALONE and self.target != "items"
        refuse(
            (
                self.sides == 1 and self.level <= 0.5,
                f"level: needs more than 0.5 with one side, got {self.level:g}",
            ),
            (
                is_of_items or (self.interval, self.target) == ("t", "both"),
                f'interval: "{self.interval}" is not available for target '
                f'"{self.target}"; use "auto" or "jackknife"',
            ),
            (
                self.prior is not None and self.method != "goodness-of-fit",
                f'prior: is only for method "goodness-of-fit", got "{self.method}"',
            ),
        )
        if not isinstance(self.rng, Integral):
            seed = int(np.random.default_rng(self.rng).integers(2**63))
            object.__setattr__(self, "rng", seed)


# what is needed, of which kind it is, and whether it is right
_Rule = tuple[str, type | UnionType, Callable[[Any], bool]]


def _whole(least: int) -> _Rule:
    return f"a whole number above {least - 1}", Integral, lambda n: n >= least


def _one_of(*choices: object) -> _Rule:
    return f"one of {', '.join(map(str, choices))}", object, lambda x: x in choices


_RULES: dict[str, _Rule] = {
    "half_width": ("a number in (0, 1]", Real, lambda x: 0.0 < x <= 1.0),
    **dict.fromkeys(
        ("power", "assurance", "level"),
        ("a number in (0, 1)", Real, lambda x: 0.0 < x < 1.0),
    ),
    **dict.fromkeys(
        ("lower", "upper", "null", "value"),
        ("a number in [-1, 1]", Real, lambda x: -1.0 <= x <= 1.0),
    ),
    **dict.fromkeys(
        ("p_missing", "rater_share"),
        ("a number in [0, 1)", Real, lambda x: 0.0 <= x < 1.0),
    ),
    "max_cost": ("a number above 0", Real, lambda x: x > 0.0),
    "prices": (
        "three numbers of at least 0",
        Sequence,
        lambda x: len(x) == 3 and all(0.0 <= price < math.inf for price in x),
    ),
    "prior": (
        "two numbers above 0",
        Sequence,
        lambda x: len(x) == 2 and all(0.0 < part < math.inf for part in x),
    ),
    "n_items": _whole(2),
    **dict.fromkeys(("n_raters", "n_studies"), _whole(1)),
    "sides": _one_of(1, 2),
    "rng": (
        "a seed of at least 0",
        Integral | np.random.Generator,
        lambda x: isinstance(x, np.random.Generator) or x >= 0,
    ),
    "target": (
        "items, raters or both: the population to generalise to",
        object,
        lambda x: x in get_args(Target),
    ),
    "interval": _one_of(*get_args(Interval)),
    "method": _one_of(*get_args(Method)),
}
# what is never None
_ALWAYS = ("level", "p_missing", "rater_share", "sides", "target", "interval", "method")


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
        Shares of the categories; empty if the model has none.
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
        How often the interval holds `value`; of one side, how often its bound does.
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
        Cost of items, raters and ratings at their prices.
    n_studies : int
        Simulated studies; 0 where nothing was drawn.
    seed : int or None
        The seed from which they can be drawn again.
    notes : tuple of str
        What to know.

    Examples
    --------
    >>> from masrel.planning import Study, precision
    >>> study = Study(
    ...     "fleiss_kappa",
    ...     value=0.5,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_items=60,
    ...     n_raters=2,
    ...     method="wald",
    ... )
    >>> round(precision(study).expected_half_width, 3)
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


# -- aims -----------------------------------------------------------------------------


def limits_of(study: Study) -> tuple[float, float]:
    """Return the limits of the interval, infinite where it has none."""
    return (
        -math.inf if study.lower is None else study.lower,
        math.inf if study.upper is None else study.upper,
    )


def has_aim(study: Study) -> bool:
    """Whether a study is to show something."""
    return any(
        aim is not None
        for aim in (study.half_width, study.lower, study.upper, study.power)
    )


def chance_of(study: Study) -> float | None:
    """Return the chance that is aimed at; None where it is what is expected."""
    return study.assurance if study.power is None else study.power


def number_of(study: Study) -> str:
    """Return the name of the number of a plan that is aimed at."""
    of_assurance = "expected_half_width" if study.assurance is None else "assurance"
    return of_assurance if study.power is None else "power"


def is_met(study: Study, plan: Plan) -> bool:
    """Whether a plan reaches what a study aims at."""
    number, chance = getattr(plan, number_of(study)), chance_of(study)
    if chance is not None:
        return bool(number >= chance - _REACHED)
    widest = math.inf if study.half_width is None else study.half_width
    low, high = limits_of(study)
    is_inside = low <= plan.expected_low and plan.expected_high <= high
    return is_inside and bool(number <= widest * (1.0 + _REACHED))


def aim_words(study: Study) -> tuple[str, str]:
    """Return the parameter that says the aim, and the aim for a reader."""
    names = ("power", "assurance", "half_width", "lower", "upper", "null")
    aims = {name: getattr(study, name) for name in names}
    there = {name: aim for name, aim in aims.items() if aim is not None}
    words = [f"{name.replace('_', '-')} {aim:g}" for name, aim in there.items()]
    named = next((name for name in there if name != "assurance"), "max_cost")
    return named, " with ".join(words)


def reached_words(study: Study, plan: Plan) -> str:
    """Say what a plan reaches of what a study aims at."""
    if chance_of(study) is not None:
        return f"{number_of(study)} {getattr(plan, number_of(study)):.3f}"
    return (
        f"an expected half-width of {plan.expected_half_width:.3f} "
        f"({plan.expected_low:.3f} to {plan.expected_high:.3f})"
    )


def check_aim(study: Study, *, is_solved: bool) -> None:
    """Check that a study has one aim, and all of it, if it needs any.

    It does where its size is solved for, or where it names a chance.
    """
    null, power = study.null, study.power
    limits = study.lower is not None or study.upper is not None
    n_aims = limits + (study.half_width is not None) + (null is not None)
    if not is_solved and chance_of(study) is None:
        return
    refuse(
        (
            n_aims > 1,
            "half_width: needs a single aim per plan: half_width, or null, or lower "
            "and upper",
        ),
        (
            power is not None and study.assurance is not None,
            "assurance: cannot be combined with power",
        ),
        (
            power is not None and null is None and not limits,
            "power: needs null, lower or upper, got none",
        ),
        (
            power is None and null is not None,
            f"null: needs power as well, got only null {null}",
        ),
        (
            study.assurance is not None and not has_aim(study),
            "assurance: needs half_width, lower or upper",
        ),
        (
            not has_aim(study) and study.max_cost is None,
            "half_width: needs an aim: a half-width, a lower or upper limit, or a null "
            "value with power; got none",
        ),
    )


# -- what a pilot says ----------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """What a pilot study says about the study that is planned.

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
    """Return what a pilot's ratings say about the study that is planned.

    Parameters
    ----------
    coefficient : str
        Name in the register.
    ratings : array_like or DataFrame, shape (n_items, n_raters)
        The pilot's ratings, as the coefficient takes them.
    target : {"items", "raters", "both"}
        Population that the interval is about: other items, other raters, or both.
    weights : str or Weights, optional
        Weights of the coefficient.
    categories : sequence of str, int or float, optional
        The scale in order; the categories met unless given.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Pilot
        Coefficient, prevalences and share of missing ratings.

    Raises
    ------
    RatingsError
        If they are not a table of ratings, or the coefficient is undefined in them.
    ParameterError
        If an option does not fit the coefficient.

    Examples
    --------
    >>> made = pilot("fleiss_kappa", [[0, 0], [0, 1], [1, 1], [1, 1]], target="items")
    >>> round(made.estimate.value, 3), made.prevalences, made.p_missing
    (0.467, (0.375, 0.625), 0.0)
    """
    coded = code_ratings(ratings, categories)
    # that it is undefined is an error
    with warnings.catch_warnings(action="ignore", category=UndefinedStatisticWarning):
        result = estimate(
            coefficient, coded, target=target, weights=weights, level=level
        )
    why = f"pilot: {coefficient} is undefined in it: {result.reason}"
    refuse((result.reason is not None, why), error=RatingsError)
    codes = coded.codes
    counts = np.bincount(codes[codes >= 0], minlength=len(coded.categories))
    return Pilot(
        estimate=result,
        categories=tuple(coded.categories),
        prevalences=tuple((counts / counts.sum()).tolist()),
        p_missing=float((codes < 0).mean()),
    )
