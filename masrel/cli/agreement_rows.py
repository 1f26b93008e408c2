"""The estimates of one session of a file of ratings."""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from masrel.cli.columns import listed
from masrel.errors import MasrelError, ParameterError
from masrel.estimates import Estimate, Interval, Target
from masrel.scales import MODIFIED_ASHWORTH

if TYPE_CHECKING:
    from masrel.agreement import Coefficient, WeightName
    from masrel.ratings import RatingMatrix, Ratings

__all__ = ["USUAL", "Row", "Wanted", "estimate_session", "scale_notes"]

USUAL = ("percent_agreement", "fleiss_kappa")
"""Coefficients that are estimated where none is named."""

_ANY_ORDER = ("all",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What is wanted of every session, as the command line has it."""

    # names of the register, separated by commas, or ``"all"``; None for `USUAL`
    coefficients: str | None
    # name of the weights, for coefficients that take any
    weights: "WeightName"  # checked where the weights are made
    target: Target | None  # what a new study would draw anew; no interval when None
    interval: str  # kind of interval; ``"auto"`` chooses one
    level: float  # its level
    # n_resamples, seed: for intervals that draw
    n_resamples: int
    seed: int
    words: str | None  # whose words for values

    @property
    def names(self) -> tuple[str, ...]:
        """The coefficients one by one, or ``("all",)``."""
        return USUAL if self.coefficients is None else tuple(listed(self.coefficients))

    @property
    def named(self) -> bool:
        """Whether somebody asked for just these: each must have the interval then."""
        return self.coefficients is not None and self.names != _ANY_ORDER


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One estimate, and what to say of it that is not in it."""

    # session, title: of what, and which coefficient
    session: str
    title: str
    estimate: Estimate  # the estimate
    # what it lacks of what was asked for, and what was assumed
    notes: tuple[str, ...] = ()


def estimate_session(ratings: "Ratings", session: str, wanted: Wanted) -> list[Row]:
    """Estimate the coefficients of one session."""
    from masrel.agreement import count_ratings
    from masrel.ratings import rating_matrix

    matrix = rating_matrix(ratings, session=session)
    values = ratings.scale.values
    counted = count_ratings(ratings.scale.weigh(matrix.grades), values)
    rows: list[Row] = []
    refused: list[MasrelError] = []
    for entry in _entries(wanted, matrix):
        title, notes = entry.title, []
        weights: WeightName = wanted.weights if entry.weighted else "identity"
        if weights != "identity":
            title += f", {weights}"
        elif weights != wanted.weights and wanted.names != _ANY_ORDER:
            notes.append("unweighted, there are no weights for it")
        estimate = entry(
            counted, categories=values, weights=weights, level=wanted.level
        )
        try:
            interval = _interval(entry, counted, values, weights, wanted)
            estimate = replace(estimate, interval=interval or estimate.interval)
        except MasrelError as error:
            if wanted.named:
                raise
            refused.append(error)
            notes.append(f"no interval: {error}")
        rows.append(
            Row(session=session, title=title, estimate=estimate, notes=tuple(notes))
        )
    if wanted.names != _ANY_ORDER and refused and len(refused) == len(rows):
        raise refused[0]
    return rows


def scale_notes(ratings: "Ratings", weights: str) -> tuple[str, ...]:
    """Say which scale was taken where none was declared."""
    scale, met = ratings.scale, ", ".join(ratings.scale.grades)
    if scale == MODIFIED_ASHWORTH:
        return (
            f"The scale is the Modified Ashworth Scale, {met}, told by its grade 1+; "
            "--categories declares another.",
        )
    if weights == "identity" or scale.name != "observed":
        return ()
    if not all(map(_is_number, scale.grades)):
        raise ParameterError(
            f"--weights {weights}: needs --categories with every grade of the scale in "
            f"order, the grades met are text: {met}"
        )
    return (f"The scale is the grades met, {met}; --categories declares another.",)


def _is_number(grade: str) -> bool:
    try:
        return math.isfinite(float(grade))
    except ValueError:
        return False


def _entries(wanted: Wanted, matrix: "RatingMatrix") -> list["Coefficient"]:
    from masrel.agreement import COEFFICIENTS, coefficient

    if wanted.names == _ANY_ORDER:
        n_raters = len(matrix.raters)
        return [
            entry
            for entry in COEFFICIENTS.values()
            if entry.shape == "ratings" and n_raters <= (entry.n_raters[1] or n_raters)
        ]
    entries = [coefficient(name) for name in wanted.names]
    for entry in entries:
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {entry.name} takes each rater's grades of two "
                "sessions; masrel analyze computes it from a study's plan"
            )
    return entries


def _interval(
    entry: "Coefficient",
    ratings: object,
    categories: tuple[float, ...],
    weights: "WeightName",
    wanted: Wanted,
) -> Interval | None:
    from masrel.analysis.interval import planned_interval

    comes_with_one = entry.has_interval and (
        wanted.interval == "auto" or wanted.names == _ANY_ORDER
    )
    if wanted.target is None or comes_with_one:
        return None
    return planned_interval(
        wanted.interval,
        entry.name,
        ratings,
        target=wanted.target,
        categories=categories,
        weights=weights,
        level=wanted.level,
        n_resamples=wanted.n_resamples,
        seed=wanted.seed,
    )
