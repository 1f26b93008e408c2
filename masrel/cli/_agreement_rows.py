"""What `masrel agree` estimates: which coefficients, with which interval and bound."""

import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli._options import grouped, split_commas
from masrel.errors import MasrelError, MasrelWarning, ParameterError
from masrel.estimates import Estimate, Target

if TYPE_CHECKING:
    from masrel.agreement import (
        BandScale,
        CodedRatings,
        Coefficient,
        CountedRatings,
        Metric,
        WeightName,
    )
    from masrel.ratings import RatingsPart
    from masrel.report._agreement_table import AgreementRow
    from masrel.scales import Scale

_USUAL = ["percent_agreement", "fleiss_kappa"]

_OF_METRIC = "krippendorff_alpha"
"""The coefficient that has metrics."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateOptions:
    """What is estimated of every part of the ratings."""

    coefficients: list[str] | None  # names, or "all" alone; None for `_USUAL`
    weights: "WeightName"  # for coefficients that take any; checked where they are made
    target: Target | None  # what a new study would draw anew; no interval when None
    interval: Literal["auto", "analytic", "jackknife", "bootstrap", "posterior"]
    level: float
    # n_resamples, seed: for intervals that draw
    n_resamples: int
    seed: int
    words: "BandScale | None"  # whose words for values
    metric: "Metric | None" = None  # of Krippendorff's alpha
    clusters: tuple[str, ...] = ()  # that of every item of the part, if items have any

    @property
    def takes_all(self) -> bool:
        """Whether all coefficients are estimated that fit."""
        return self.coefficients == ["all"]

    @property
    def names(self) -> list[str]:
        """The coefficients that are named, or the usual ones."""
        if self.coefficients is not None:
            return self.coefficients
        return _USUAL if self.metric is None else [_OF_METRIC]

    def by_metric(self, entry: "Coefficient") -> "Coefficient":
        """Return the coefficient by the metric that was chosen, if it has metrics."""
        return entry.by_metric(self.metric) if entry.name == _OF_METRIC else entry

    def record(self) -> dict[str, object]:
        """Return every option that decides a number."""
        by_metric = {} if self.metric is None else {"metric": self.metric}
        return {
            "coefficients": self.names,
            "weights": self.weights,
            "target": self.target,
            "interval": self.interval,
            "level": self.level,
            "resamples": self.n_resamples,
            "seed": self.seed,
            "words": self.words,
            **by_metric,
        }


def _list_register(
    context: click.Context, _: click.Parameter, value: list[str] | None
) -> list[str] | None:
    # "list" needs no file: it is seen before the file is missed
    if value == ["list"] and not context.resilient_parsing:
        click.echo(_register())
        context.exit()
    return value


def _plain_weights(name: str) -> str:
    from masrel.agreement._weights import plain_name

    return plain_name(name)


estimate_options = grouped(
    "options",
    EstimateOptions,
    click.option(
        "--coefficients",
        metavar="NAMES",
        show_default=",".join(_USUAL),
        type=split_commas,
        is_eager=True,
        callback=_list_register,
        help="Names of coefficients, separated by commas; all that fit (but "
        "lin_ccc, sem and mdc); or list, which prints them and ends.",
    ),
    click.option(
        "--weights",
        default="identity",
        type=_plain_weights,
        metavar="NAME",
        show_default=True,
        help="identity, linear, quadratic, ordinal, radical, ratio, circular or "
        "bipolar.",
    ),
    click.option(
        "--metric",
        type=click.Choice(
            ["nominal", "ordinal", "interval", "ratio", "jaccard", "masi"]
        ),
        help="Krippendorff's alpha by his difference function in place of weights; "
        "jaccard and masi take grades of several labels, as a;b.",
    ),
    click.option(
        "--target",
        type=click.Choice(["items", "raters", "both"]),
        help="What a new study would draw anew; no interval without it.",
    ),
    click.option(
        "--interval",
        type=click.Choice(["auto", "analytic", "jackknife", "bootstrap", "posterior"]),
        default="auto",
        show_default=True,
        help="Kind of interval; auto chooses by target and size.",
    ),
    click.option(
        "--level", default=0.95, show_default=True, help="Level of intervals."
    ),
    click.option("--resamples", "n_resamples", default=10_000, show_default=True),
    click.option("--seed", default=0, show_default=True, help="Seed of resampling."),
    click.option(
        "--words",
        type=click.Choice(["landis_koch", "altman", "fleiss", "cicchetti"]),
        help="Name the best band that the true value reaches with 95 % probability.",
    ),
)


def _register() -> str:
    from masrel.agreement import COEFFICIENTS
    from masrel.report._tables import aligned

    lines = [("name", "title", "raters", "weights", "also called")]
    for entry in COEFFICIENTS.values():
        fewest, most = entry.n_raters
        raters = str(fewest) if most == fewest else f"{fewest} or more"
        if entry.shape == "pairs":
            raters += ", each twice (--retest)"
        weights = "any" if entry.weighted else "none"
        aliases = ", ".join(entry.aliases)
        lines.append((entry.name, entry.title, raters, weights, aliases))
    return "\n".join(aligned(lines, ["left"] * 5, rule=True))


def estimate_rows(
    part: "RatingsPart",
    *,
    group: str,
    n_raters: int,
    scale: "Scale",
    is_ordered: bool,
    options: EstimateOptions,
) -> "list[AgreementRow]":
    """Estimate one part of the ratings, every coefficient as a row."""
    # is_ordered: whether the order of the grades is more than the alphabet's
    rows, refused = [], []
    of_part = replace(options, clusters=part.clusters)
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        for entry in entries(options, n_raters, scale, is_ordered):
            ratings = part.ratings if entry.kernel is None else part.counted
            if entry.metric in ("jaccard", "masi"):
                ratings = _on_grades(ratings, scale)
            row, refusal = _row(entry, ratings, group, of_part)
            rows.append(row)
            refused += [] if refusal is None else [refusal]
    if not options.takes_all and refused and len(refused) == len(rows):
        raise refused[0]
    return rows


def _on_grades(
    ratings: "CodedRatings | CountedRatings", scale: "Scale"
) -> "CodedRatings | CountedRatings":
    """Return ratings with the text of their grades, of which a metric takes sets."""
    from masrel.agreement import CodedRatings

    if isinstance(ratings, CodedRatings):
        return replace(ratings, categories=scale.grades)
    coded = ratings.coded
    if coded is not None:
        coded = replace(coded, categories=scale.grades)
    return replace(ratings, categories=scale.grades, source=coded)


def _row(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    group: str,
    options: EstimateOptions,
) -> "tuple[AgreementRow, MasrelError | None]":
    """Return the row of a coefficient, and why it has no interval if it should."""
    from masrel.report._agreement_table import AgreementRow

    title, notes, refusal = entry.title, [], None
    if entry.weighted and options.weights != "identity":
        title += f", {options.weights}"
    elif options.weights != "identity" and not options.takes_all and not entry.metric:
        notes.append("unweighted, there are no weights for it")
    has_target = options.target is not None
    try:
        estimate = _estimate(entry, ratings, options, options.level, has_target)
    except MasrelError as error:
        if not has_target or not (options.coefficients is None or options.takes_all):
            raise  # just these were named: each must have the interval
        none = "it is no function of sums over items" if entry.kernel is None else error
        notes.append(f"no interval: {none}")
        refusal, has_target = error, False
        estimate = _estimate(entry, ratings, options, options.level, has_target)
    bound = None
    if options.words and entry.chance_corrected:
        from masrel.report._estimate_words import surely_reached

        bound = surely_reached(
            estimate.interval,
            lambda level: (
                _estimate(entry, ratings, options, level, has_target).interval
            ),
        )
    row = AgreementRow(
        group=group,
        title=title,
        estimate=estimate,
        notes=tuple(notes),
        lower_bound=bound,
    )
    return row, refusal


def _estimate(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    options: EstimateOptions,
    level: float,
    has_target: bool,
) -> Estimate:
    """Return the coefficient, with the interval that answers for the target."""
    weights: WeightName = options.weights if entry.weighted else "identity"
    # Among all that fit, one that comes with an interval has it, whatever its target.
    is_done = entry.has_interval and options.takes_all and not options.clusters
    if options.target is None or not has_target or is_done:
        result = entry(
            ratings, categories=ratings.categories, weights=weights, level=level
        )
        # one that comes with the coefficient knows of no clusters
        return replace(result, interval=None) if options.clusters else result
    from masrel import intervals

    return intervals.estimate(
        entry,
        ratings,
        target=options.target,
        method=options.interval,
        categories=ratings.categories,
        weights=weights,
        level=level,
        n_resamples=options.n_resamples,
        rng=options.seed,
        clusters=options.clusters or None,
    )


def check_order(options: EstimateOptions, scale: "Scale", is_ordered: bool) -> None:
    """Refuse weights of grades without an order."""
    if options.weights != "identity" and not is_ordered:
        raise ParameterError(
            f"--weights {options.weights}: needs --categories with every grade of the "
            f"scale in order, the grades met are text: {', '.join(scale.grades)}"
        )


def entries(
    options: EstimateOptions, n_raters: int, scale: "Scale", is_ordered: bool
) -> list["Coefficient"]:
    """Return the coefficients that are estimated, or refuse those that do not fit."""
    from masrel.agreement import COEFFICIENTS, coefficient

    check_order(options, scale, is_ordered)
    if options.takes_all:
        return [
            entry
            for entry in map(options.by_metric, COEFFICIENTS.values())
            if entry.shape == "ratings"
            and not entry.by_name_only
            and n_raters <= (entry.n_raters[1] or n_raters)
            and (is_ordered or not entry.needs_order)
        ]
    if options.metric is not None and _OF_METRIC not in options.names:
        raise ParameterError(
            f"--metric {options.metric}: is of {_OF_METRIC}, which is not among "
            f"--coefficients {','.join(options.names)}"
        )
    chosen = [options.by_metric(coefficient(name)) for name in options.names]
    for entry in chosen:
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {entry.name} takes each rater's grades of two "
                "sessions: --session COL --retest computes it"
            )
        if entry.needs_order and not is_ordered:
            raise ParameterError(
                f"{entry.name}: needs grades that are numbers or --categories with "
                "every grade in order, the grades met are text: "
                f"{', '.join(scale.grades)}"
            )
    return chosen
