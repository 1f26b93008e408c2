"""Ratings on an ordered scale as severities, biases, noises and thresholds."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from masrel._input import refuse
from masrel.agreement import Label, code_ratings
from masrel.agreement._engine import Floats, check_level, recorded_generator
from masrel.agreement._labels import Codes
from masrel.errors import RatingsError
from masrel.estimates import Distribution, Estimate, Interval, Target
from masrel.intervals.latent._implied import (
    Agreement,
    Items,
    PredictiveCheck,
    agreement_on_items,
    agreement_on_new_items,
    grade_probabilities,
    predictive_checks,
)
from masrel.intervals.latent._model import LatentDensity, LatentPrior
from masrel.intervals.latent._sampler import (
    Chains,
    Progress,
    begin,
    n_warm_up_steps,
    quantile_error,
    sample_smooth,
)
from masrel.intervals.posterior import Quantity

_TARGETS: dict[str, Target] = {"fixed": "raters", "random": "both"}
_REPLICATES = 4_000
_SHOWN = 2_000
_MAX_KAPPAS = 8_192  # positions where an integral over new items is computed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LatentChains:
    """The draws themselves.

    Attributes
    ----------
    kappa : ndarray, shape (n_chains, n_kept)
        Kappa; fewer a chain than of the others when items are random.
    severity, bias, noise, thresholds : ndarray, shape (n_chains, n_kept, n)
        Items' severities, raters' biases and noises, and the thresholds, severities
        and thresholds from the mean severity of these items.
    shares : ndarray, shape (n_chains, n_kept, 3)
        Shares of the variance: of the items, of the biases, of the noises.
    noise_spread : ndarray, shape (n_chains, n_kept, 1)
        η, the standard deviation of the logarithms of raters' noises.
    """

    kappa: Floats = field(repr=False)
    severity: Floats = field(repr=False)
    bias: Floats = field(repr=False)
    noise: Floats = field(repr=False)
    thresholds: Floats = field(repr=False)
    shares: Floats = field(repr=False)
    noise_spread: Floats = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentTrait:
    """Items, raters and thresholds on one scale, and the agreement they imply.

    The scale has its 0 at the mean severity of these items, and its unit is the
    standard deviation of a rating of a random item by a random rater.

    Attributes
    ----------
    kappa : Estimate
        Fleiss' kappa of two new raters: posterior median, its standard
        deviation as `standard_error`, and interval; `observed` and `chance` are the
        posterior medians of both agreements.
    items : tuple of Quantity
        Severity of every item with a rating.
    raters : tuple of Quantity
        Bias of every rater with a rating, against the population of raters: positive
        for one who grades high.
    noises : tuple of Quantity
        Standard deviation of the same rater's perception of the same item.
    thresholds : tuple of Quantity
        Where one grade ends and the next begins.
    shares : tuple of Quantity
        Shares of the variance: items, raters' biases, raters' noise.
    noise_spread : Quantity
        Standard deviation of the logarithms of raters' noises.
    grades : tuple of tuple of float
        Per item, the probability of each grade by a new rater (posterior mean).
    checks : tuple of PredictiveCheck
        Whether the model makes ratings such as these.
    prior : LatentPrior
        What was believed before the data.
    other : LatentTrait or None
        The same under another prior, or None if there was no other.
    r_hat, ess : float
        The largest R-hat and the smallest effective size of all reported quantities.
    n_chains, n_steps : int
        Chains, and steps of each after warm-up.
    seed : int or None
        Seed that repeats it; None when a generator was passed.
    chains : LatentChains or None
        The draws, when they were asked for.
    """

    kappa: Estimate
    items: tuple[Quantity, ...]
    raters: tuple[Quantity, ...]
    noises: tuple[Quantity, ...]
    thresholds: tuple[Quantity, ...]
    shares: tuple[Quantity, ...]
    noise_spread: Quantity
    grades: tuple[tuple[float, ...], ...]
    checks: tuple[PredictiveCheck, ...]
    prior: LatentPrior
    other: "LatentTrait | None"
    r_hat: float
    ess: float
    n_chains: int
    n_steps: int
    seed: int | None
    chains: LatentChains | None = field(default=None, compare=False, repr=False)


def latent_trait(
    ratings: object,
    *,
    items: Items,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    prior: LatentPrior | None = None,
    other_prior: LatentPrior | None = None,
    compare: bool = True,
    n_steps: int = 250,
    max_steps: int = 32_000,
    keep_chains: bool = False,
    progress: Progress | None = None,
    rng: np.random.Generator | int | None = None,
) -> LatentTrait:
    """Place items, raters and thresholds on one scale, and derive kappa from it.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    items : {"fixed", "random"}
        Whether kappa is for new raters on these items, or for new raters on new
        items of the same population.
    categories : sequence of str, int or float, optional
        The declared scale in order; numbers need none. Categories nobody used count.
    level : float, optional
        Level of the central credible intervals.
    prior : LatentPrior, optional
        What is believed before the data.
    other_prior : LatentPrior, optional
        The prior under which everything is computed once more, to show how much the
        prior matters.
    compare : bool, optional
        Whether it is; False halves the time.
    n_steps, max_steps : int, optional
        Steps of each of 64 chains at first, and where the sampler gives up.
    keep_chains : bool, optional
        Whether the result holds the draws.
    progress : callable, optional
        Called with how many steps are made, and how many there will be as far as is
        known.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without it a
        fresh seed is drawn and recorded.

    Returns
    -------
    LatentTrait
        Kappa; severities, biases, noises and thresholds; the predictive check.

    Raises
    ------
    ParameterError
        If an option is invalid, or the order of the scale is not known.
    RatingsError
        If the ratings do not fit, have fewer than two items, no item rated by two
        raters, or no disagreement.
    ConvergenceError
        If the sampler has not converged after `max_steps`; says how many it needs.

    Notes
    -----
    Rater r perceives item i at θ_i + b_r + σ_r ε and gives the grade between whose
    thresholds that lies; θ_i ~ N(0, ρ), b_r ~ N(0, (1 - ρ)(1 - f)), and the
    logarithm of σ_r² is normal around that of (1 - ρ) f. Missing ratings are taken
    as missing at random. Kappa follows by quadrature from every draw. The posterior
    is sampled by Hamiltonian proposals within emcee, whose own moves need far more
    steps in that many dimensions.

    References
    ----------
    .. [1] Johnson, V. E., Albert, J. H. (1999). Ordinal Data Modeling, ch. 5.
       Springer. https://doi.org/10.1007/b98832
    .. [2] Uebersax, J. S., Grove, W. M. (1993). A latent trait finite mixture model
       for the analysis of rating agreement. Biometrics, 49(3), 823-835.
       https://doi.org/10.2307/2532202

    Examples
    --------
    >>> ratings = [[1, 1, 2], [2, 2, 2], [3, 4, 3]]
    >>> model = latent_trait(  # doctest: +SKIP
    ...     ratings, items="fixed", categories=[1, 2, 3, 4], rng=1
    ... )
    """
    refuse(
        (items not in _TARGETS, f'items: needs "fixed" or "random", got {items!r}'),
        (min(n_steps, max_steps) < 20, "n_steps, max_steps: need at least 20"),
    )
    check_level(level)
    checked = _Ratings.of(ratings, categories)
    generator, seed = recorded_generator(rng)
    seeds = generator.integers(2**63, size=2).tolist()
    question = _Question(
        ratings=checked,
        items=items,
        level=level,
        n_steps=n_steps,
        max_steps=max_steps,
        keep_chains=keep_chains,
        progress=progress,
        n_runs=1 + compare,
        seed=seed,
    )
    against = other_prior or LatentPrior.other()
    other = _summarize(question, against, seeds[1], None) if compare else None
    return _summarize(question, prior or LatentPrior(), seeds[0], other)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ratings:
    """Checked ratings, without items or raters that have none."""

    # (n_items, n_raters): positions in the scale, -1 where missing
    codes: Codes = field(compare=False, repr=False)
    categories: tuple[Label, ...]  # the declared scale
    # items, raters: names: of the index and the columns of a DataFrame, or numbers from
    # 1
    items: tuple[str, ...]
    raters: tuple[str, ...]

    @classmethod
    def of(cls, ratings: object, categories: Sequence[Label] | None) -> "_Ratings":
        """Check ratings, (n_items, n_raters)."""
        coded = code_ratings(ratings, categories)
        refuse(
            (
                not coded.declared and isinstance(coded.categories[0], str),
                "categories: the model needs the declared scale in order, because the "
                "ratings are text",
            ),
            (
                coded.n_categories < 2,
                "categories: the model needs two or more, got one",
            ),
        )
        rated = coded.codes >= 0
        rows, columns = (np.flatnonzero(rated.any(axis=axis)) for axis in (1, 0))
        highest = coded.codes.max(axis=1)
        lowest = np.where(rated, coded.codes, highest[:, None]).min(axis=1)
        refuse(
            (
                not (rated.sum(axis=1) >= 2).any(),
                "ratings: the model needs an item rated by two raters",
            ),
            (
                rows.size < 2,
                "ratings: the model needs two items or more with ratings, got "
                f"{rows.size}",
            ),
            (
                (highest <= lowest).all(),
                "ratings: no two raters disagree on any item, so biases and noises "
                "cannot be estimated; masrel.intervals.posterior gives a bound for "
                "kappa",
            ),
            error=RatingsError,
        )
        return cls(
            codes=coded.codes[rows][:, columns],
            categories=coded.categories,
            items=_names(getattr(ratings, "index", None), "item", rows.tolist()),
            raters=_names(getattr(ratings, "columns", None), "rater", columns.tolist()),
        )


def _names(labels: object, what: str, numbers: list[int]) -> tuple[str, ...]:
    # of the rows or columns of a DataFrame; otherwise counted from 1
    if isinstance(labels, Iterable):  # the index of a list is a method
        every = list(labels)
        return tuple(str(every[i]) for i in numbers)
    return tuple(f"{what} {i + 1}" for i in numbers)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Question:
    """What the model is to answer, checked."""

    ratings: _Ratings  # the data
    items: Items  # which kappa
    level: float  # level of the intervals
    # n_steps, max_steps: steps of every chain at first, and where it gives up
    n_steps: int
    max_steps: int
    keep_chains: bool  # whether the result holds the draws
    progress: Progress | None = field(compare=False, repr=False)  # of all runs
    n_runs: int  # one for each prior
    seed: int | None  # the seed to be recorded


def fit_latent(
    density: LatentDensity,
    items: Items,
    *,
    generator: np.random.Generator,
    n_steps: int,
    max_steps: int,
    progress: Progress | None = None,
) -> tuple[Chains, Agreement]:
    """Sample the model until every reported quantity has converged."""

    def agreement(positions: Floats) -> Agreement:
        if items == "random":
            return agreement_on_new_items(density.traits(_some(positions, _MAX_KAPPAS)))
        flat = positions.reshape(-1, density.n_dimensions)
        return agreement_on_items(density.traits(flat))

    def quantities(positions: Floats) -> dict[str, Floats]:
        traits = density.traits(positions.reshape(-1, density.n_dimensions))
        # Severities and thresholds can all move together: from the mean of these items
        # they are known better than from the mean of their population.
        centre = traits.severity.mean(axis=1, keepdims=True)
        columns = {
            "kappa": agreement(positions).kappa[:, None],
            "severity": traits.severity - centre,
            "bias": traits.bias,
            "noise": traits.noise,
            "thresholds": traits.thresholds - centre,
            "shares": np.column_stack(
                (traits.item_share, traits.bias_variance, traits.noise_variance)
            ),
            "noise_spread": traits.noise_spread[:, None],
        }
        n_chains = len(positions)
        return {
            name: of.reshape(n_chains, -1, of.shape[1]) for name, of in columns.items()
        }

    chains = sample_smooth(
        density,
        quantities,
        begin(density, generator),
        generator=generator,
        n_steps=n_steps,
        max_steps=max_steps,
        progress=progress,
    )
    return chains, agreement(chains.positions)


def _some(positions: Floats, max_draws: int) -> Floats:
    # (n_chains, n_kept, d) -> (n, d): every so many of each chain, the last included
    n_chains, n_kept, d = positions.shape
    every = -(-n_chains * n_kept // max_draws)
    return positions[:, (n_kept - 1) % every :: every].reshape(-1, d)


def _summarize(
    question: _Question, prior: LatentPrior, seed: int, other: LatentTrait | None
) -> LatentTrait:
    """Sample the model and put its result together."""
    data, generator = question.ratings, np.random.default_rng(seed)

    def progress(n_made: int, n_expected: int) -> None:
        # the run before this one is `other`, one after it takes as long
        if question.progress is not None:
            before = other.n_steps + n_warm_up_steps() if other else 0
            left = question.n_runs - (other is not None)
            question.progress(before + n_made, before + left * n_expected)

    density = LatentDensity.of(data.codes, len(data.categories), prior)
    chains, agreement = fit_latent(
        density,
        question.items,
        generator=generator,
        n_steps=question.n_steps,
        max_steps=question.max_steps,
        progress=progress,
    )
    some = density.traits(_some(chains.positions, _REPLICATES))

    def part(name: str, of: Sequence[str]) -> tuple[Quantity, ...]:
        diagnostics = chains.diagnostics[name].tolist()
        return tuple(
            Quantity(
                name=whose,
                value=float(np.median(chains.draws(name, k))),
                interval=_interval(question, chains.draws(name, k)),
                r_hat=r_hat,
                ess=ess,
            )
            for k, (whose, (r_hat, ess)) in enumerate(zip(of, diagnostics, strict=True))
        )

    r_hat, ess = chains.worst
    thresholds = [
        f"{low} | {high}" for low, high in itertools.pairwise(data.categories)
    ]
    draws = {**chains.values, "kappa": chains.draws("kappa")}
    return LatentTrait(
        kappa=_kappa(question, chains.draws("kappa"), agreement, prior, other),
        items=part("severity", data.items),
        raters=part("bias", data.raters),
        noises=part("noise", data.raters),
        thresholds=part("thresholds", thresholds),
        shares=part("shares", ("items", "raters' biases", "raters' noise")),
        noise_spread=part("noise_spread", ("spread of raters' noises",))[0],
        grades=tuple(map(tuple, grade_probabilities(some).mean(axis=0).tolist())),
        checks=predictive_checks(data.codes, some, data.categories, generator),
        prior=prior,
        other=other,
        r_hat=r_hat,
        ess=ess,
        n_chains=len(chains.positions),
        n_steps=chains.n_steps,
        seed=question.seed,
        chains=LatentChains(**draws) if question.keep_chains else None,
    )


def _interval(question: _Question, draws: Floats) -> Interval:
    # of draws, (n_chains, n_kept)
    tail = 0.5 * (1.0 - question.level)
    low, high = np.quantile(draws, (tail, 1.0 - tail)).tolist()
    return Interval(
        low=low,
        high=high,
        level=question.level,
        kind="credible",
        method="ordinal latent-trait model, emcee",
        raters_differ=True,
        target=_TARGETS[question.items],
        n_resamples=draws.size,
        monte_carlo_error=(
            quantile_error(draws, tail),
            quantile_error(draws, 1.0 - tail),
        ),
        seed=question.seed,
    )


def _kappa(
    question: _Question,
    draws: Floats,
    agreement: Agreement,
    prior: LatentPrior,
    other: LatentTrait | None,
) -> Estimate:
    shown = np.sort(draws.ravel()[:: -(-draws.size // _SHOWN)])
    notes: tuple[str, ...] = ()
    if other is not None and other.kappa.interval is not None:
        low, high = other.kappa.interval.low, other.kappa.interval.high
        notes = (f"under another prior {low:.3f} to {high:.3f}: {other.prior.words}",)
    interval = replace(
        _interval(question, draws),
        notes=notes,
        distribution=Distribution(
            values=shown,
            weights=np.full(shown.size, 1.0 / shown.size),
            continuous=False,
            words=f"posterior draws of kappa, prior {prior.words}",
        ),
    )
    codes = question.ratings.codes
    n_items, n_raters = codes.shape
    return Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=float(np.median(draws)),
        standard_error=float(draws.std()),
        interval=interval,
        observed=float(np.median(agreement.observed)),
        chance=float(np.median(agreement.chance)),
        n_items=n_items,
        n_items_paired=int(((codes >= 0).sum(axis=1) > 1).sum()),
        n_raters=n_raters,
        n_categories=len(question.ratings.categories),
    )
