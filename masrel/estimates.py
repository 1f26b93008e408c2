"""The result types of every statistic: an estimate with its interval, and a test."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "Distribution",
    "Estimate",
    "Interval",
    "IntervalMethod",
    "Significance",
    "Target",
    "Unit",
    "as_document",
]

Target = Literal["items", "raters", "both"]
"""The population that an interval generalises to: items, raters, or both."""

IntervalMethod = Literal[
    "auto",
    "auto-2026.1",
    "auto-2026.2",
    "analytic",
    "jackknife",
    "bootstrap",
    "posterior",
]
"""Methods of intervals; "auto" is the newest rule that chooses one."""

# Whose standard error an interval is made of, where it is not our own
_Convention = Literal["irrcac", "spss", "over_n"]

Unit = Literal["items", "raters", "both", "clusters"]
"""What is resampled or left out."""


class _LongNote(str):
    """A note of an interval that has no room below a table."""

    brief: str  # what stands there in its place; empty for nothing

    def __new__(cls, text: str, brief: str = "") -> "_LongNote":
        note = super().__new__(cls, text)
        note.brief = brief
        return note

    @classmethod
    def of(cls, what: str, note: str) -> str:
        """Return a note that says what it is of; a count says that itself."""
        if isinstance(note, _CountNote):
            return note
        brief = getattr(note, "brief", note)
        return cls(what + note, what + brief if brief else "")


class _Caution(str):
    """A note without which an interval would promise too much."""


class _CountNote(_Caution):
    """A caution that begins with how many there are of what is few."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Distribution:
    """How a coefficient is distributed: over resamples, or in a posterior.

    Attributes
    ----------
    values : ndarray, shape (n_values,)
        Ascending values.
    weights : ndarray, shape (n_values,)
        Their probabilities, which sum to 1; the density at each of a continuous one.
    continuous : bool
        Whether the values are points of a continuous distribution.
    words : str
        What it is, such as "exact bootstrap distribution, 35 resamples".
    """

    values: "NDArray[np.float64]" = field(repr=False)
    weights: "NDArray[np.float64]" = field(repr=False)
    continuous: bool
    words: str


_Lines = list[tuple[str, str]]  # what is shown of a result, by name


class _Shown:
    """A result that is shown as lines of names and texts."""

    __slots__ = ()

    def _lines(self) -> _Lines:
        raise NotImplementedError

    def __str__(self) -> str:
        # the first line, and the others below it
        return "\n  ".join(f"{name}: {text}" for name, text in self._lines())

    def _repr_html_(self) -> str:
        # a table with the names in the first column
        from html import escape  # loaded only in a notebook

        rows = (
            f"<tr><th scope='row' style='text-align: left'>{escape(name)}</th>"
            f"<td style='text-align: left'>{escape(text)}</td></tr>"
            for name, text in self._lines()
        )
        return f"<table>{''.join(rows)}</table>"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval(_Shown):
    """A confidence or credible interval that can be understood alone.

    Attributes
    ----------
    low, high : float
        Endpoints; ``nan`` when undefined.
    median : float or None
        Posterior median of a credible interval, which lies inside; None for others.
    level : float
        Nominal level, 0.95 unless stated otherwise.
    kind : {"confidence", "credible"}
        What the level promises.
    method : str
        How it was computed, in words.
    target : {"items", "raters", "both"}
        The population it generalises to.
    unit : {"items", "raters", "both", "clusters"} or None
        What was resampled or left out; None when nothing was.
    n_resamples : int or None
        Resamples or draws used; None when no Monte Carlo was used.
    n_undefined : int
        Resamples on which the statistic was undefined.
    monte_carlo_error : tuple of float or None
        Standard error of `low` and of `high` from Monte Carlo; None when exact.
    seed : int or None
        Seed that repeats it; None when nothing was drawn.
    notes : tuple of str
        What the reader must know before relying on it.
    reason : str or None
        Why it is undefined, or None.
    distribution : Distribution or None
        How the coefficient is distributed over resamples, or in the posterior: what
        the ends are read from. None where the method has no such thing.
    is_one_sided : bool
        Whether only the lower end is a bound, at the whole level.
    units_are : {"left out", "drawn"} or None
        What was done with units: one left out at a time, or all drawn with
        replacement; None when nothing was.
    raters_differ : bool
        Whether the model of a credible interval knows how raters differ.
    prior : str
        The prior of a posterior that an end rests on, in words; empty for none.
    """

    low: float
    high: float
    median: float | None = None
    level: float
    kind: Literal["confidence", "credible"]
    method: str
    target: Target
    unit: Unit | None = None
    n_resamples: int | None = None
    n_undefined: int = 0
    monte_carlo_error: tuple[float, float] | None = None
    seed: int | None = None
    notes: tuple[str, ...] = ()
    reason: str | None = None
    distribution: Distribution | None = field(default=None, compare=False, repr=False)
    # no repr has these, and no document: `method` or `notes` say it in words
    is_one_sided: bool = field(default=False, repr=False)
    units_are: Literal["left out", "drawn"] | None = field(default=None, repr=False)
    raters_differ: bool = field(default=False, repr=False)
    prior: str = field(default="", repr=False)

    def _lines(self) -> _Lines:
        # its ends, what it generalises to, and how it was made
        ends = f"{self.low:.4g} to {self.high:.4g}"
        why = f"undefined ({self.reason})"
        median = [] if self.median is None else [f"{self.median:.4g}"]
        return [
            (
                f"{100.0 * self.level:.6g} % {self.kind} interval",
                ends if self.reason is None else why,
            ),
            *(("posterior median", text) for text in median),
            ("generalises to", _population(self)),
            ("method", self.method),
            *(("note", note) for note in self.notes),
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate(_Shown):
    """An agreement coefficient with what it was computed from.

    Attributes
    ----------
    coefficient : str
        Name of the function that computed it, such as ``"fleiss_kappa"``.
    weights : str
        Name of the weights, ``"identity"`` when unweighted.
    value : float
        The coefficient; ``nan`` when undefined.
    standard_error : float
        Delta-method standard error, items random; ``nan`` when undefined.
    interval : Interval or None
        Only when one was asked for.
    observed, chance : float
        Observed and chance agreement; ``nan`` when undefined.
    n_items, n_raters, n_categories : int
        Items with at least one rating, raters with at least one, and declared
        categories. Coefficients that leave items of a single rating out altogether, as
        their pages say, do not count them.
    n_items_paired : int
        Items with a pair of ratings that the coefficient uses: what degrees of freedom
        and rules for small samples count.
    reason : str or None
        Why `value` is undefined, or None.
    """

    coefficient: str
    weights: str
    value: float
    standard_error: float
    interval: Interval | None = None
    observed: float
    chance: float
    n_items: int
    n_items_paired: int
    n_raters: int
    n_categories: int
    reason: str | None = None

    def _lines(self) -> _Lines:
        # the coefficient and, where there is one, its interval
        weights = f" ({self.weights})" * (self.weights != "identity")
        has_error = not math.isnan(self.standard_error)
        text = f"{self.value:.4g}" + f" (SE {self.standard_error:.2g})" * has_error
        if self.reason is not None:
            text = f"undefined ({self.reason})"
        interval = [] if self.interval is None else self.interval._lines()
        return [(self.coefficient + weights, text), *interval]


_POPULATIONS: dict[Target, str] = {
    "items": "items",
    "raters": "raters",
    "both": "items and raters",
}
"""What an interval is for others of, by its target."""


def _population(interval: Interval) -> str:
    """Return what an interval generalises to."""
    of_items = "clusters of items" if interval.unit == "clusters" else ""
    return f"other {of_items or _POPULATIONS[interval.target]}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Significance:
    """A test of a hypothesis; never an interval.

    Attributes
    ----------
    name : str
        Name of the function that computed it, such as ``"bowker"``.
    hypothesis : str
        What is tested, in words.
    statistic : float
        The test statistic; ``nan`` when undefined.
    distribution : str
        Its distribution under the hypothesis, such as ``"chi-squared"``.
    df : tuple of float
        Degrees of freedom of it; empty where it has none.
    p_value : float
        Two-sided where there are two sides, within [0, 1].
    n_items : int
        Items it rests on.
    reason : str or None
        Why it is undefined, or None.
    """

    name: str
    hypothesis: str
    statistic: float
    distribution: str
    df: tuple[float, ...]
    p_value: float
    n_items: int
    reason: str | None = None

    def __str__(self) -> str:
        if self.reason is not None:
            return f"{self.name}: undefined ({self.reason})"
        degrees = ", ".join(f"{df:g}" for df in self.df)
        of = f"({degrees})" if degrees else ""
        return (
            f"{self.name}: {self.statistic:.4g}, {self.distribution}{of}, "
            f"p = {self.p_value:.3g}"
        )


def as_document(result: Estimate | Interval) -> dict[str, object]:
    """Turn a result into plain values for JSON, ``nan`` and infinities as None.

    Parameters
    ----------
    result : Estimate or Interval
        The result, its interval nested.

    Returns
    -------
    dict
        Field name to value, in the order of the fields, of all that a repr has.

    Examples
    --------
    >>> interval = Interval(
    ...     low=0.1, high=float("nan"), level=0.95, kind="credible",
    ...     method="exact", target="items",
    ... )
    >>> as_document(interval)["high"] is None
    True
    """
    return {
        of.name: _plain(getattr(result, of.name))
        for of in dataclasses.fields(result)
        if of.repr
    }


def _plain(value: object) -> object:
    """Return a value of a result as JSON has it."""
    if isinstance(value, Interval | Estimate):
        return as_document(value)
    if isinstance(value, str):
        return str(value)  # also of a note that has a brief form
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
