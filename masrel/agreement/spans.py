"""Agreement on spans: where units of a text or a recording begin and end.

In: the units of each observer in one document or several. Out: unitizing alpha, of each
category and of all, from sums of whole numbers; and F1 of every two observers.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import combinations
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option, listed, refuse, shown
from masrel.agreement._engine import (
    Floats,
    Integers,
    check_level,
    divide,
    logit_ends,
    student_t,
    undefined,
)
from masrel.agreement._labels import Label, coded, columns_of, is_missing
from masrel.errors import RatingsError
from masrel.estimates import Estimate, Interval

SpanMatch = Literal["strict", "overlap", "token"]
"""When spans of two observers match."""

_MOST = 2**31  # beyond which squares of lengths leave 64 bits
_NO_ENDS = "leaving out a document leaves the value unchanged or undefined"
_FIELDS = ("document", "observer", "category", "begin", "length")


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitizingAlpha:
    """Agreement of observers on the units of a continuum, or of several.

    Attributes
    ----------
    value : float
        1 − Σ D_o/Σ D_e over the categories; ``nan`` for 0/0.
    by_category : mapping of label to float
        1 − D_o/D_e of each category.
    estimates : mapping of label or None to Estimate
        The same with intervals: of all categories together under None, and of each.
        Items are documents; those with a pair have two observers, and count.
    """

    value: float
    by_category: Mapping[Label, float]
    estimates: Mapping[Label | None, Estimate] = field(repr=False)


def unitizing_alpha(
    spans: object,
    *,
    begin: int = 0,
    length: int | Mapping[Any, int],
    level: float = 0.95,
) -> UnitizingAlpha:
    """Estimate Krippendorff's alpha for units of a continuum, such as spans of a text.

    Parameters
    ----------
    spans : iterable of (observer, category, begin, length), or DataFrame
        One row a unit; begin and length are whole numbers, such as characters or
        milliseconds. If there are several documents, rows begin with the document.
        A row whose category is None says that an observer looked at it all.
    begin : int, optional
        Where every continuum begins.
    length : int or mapping of document to int
        How long the continuum is, or each document.
    level : float, optional
        Nominal level of the intervals.

    Returns
    -------
    UnitizingAlpha
        Alpha of all categories together, and of each.

    Raises
    ------
    RatingsError
        If rows are not such units, a unit lies outside its continuum, two units of an
        observer and a category overlap, or no two observers annotated a document.
    ParameterError
        If `level` is not a level.

    Warns
    -----
    UndefinedStatisticWarning
        If no disagreement could be expected, as where there are no units.

    Notes
    -----
    Two units that overlap differ by the squares of the distances of their beginnings
    and of their ends; a unit that lies in a gap of the other observer by its squared
    length. All is summed in whole numbers, and divided once. An observer without a unit
    of a category takes all of a document for a gap.

    Several documents are one continuum, at whose seams gaps end. A pair of observers
    counts 1/(m - 1) in a document of m observers, as in alpha of ratings with gaps.
    Intervals leave out one document at a time, with Student's t on the logit of the
    place from -1 to 1.

    References
    ----------
    .. [1] Krippendorff, K. (1995). On the reliability of unitizing continuous data.
       Sociological Methodology, 25, 47-76. https://doi.org/10.2307/271061
    .. [2] Krippendorff, K. (2004). Measuring the reliability of qualitative text
       analysis data. Quality & Quantity, 38(6), 787-800.
       https://doi.org/10.1007/s11135-004-8107-7

    Examples
    --------
    >>> spans = [("Kim", "c", 225, 70), ("Kim", "c", 370, 30), ("Lee", "c", 220, 80),
    ...          ("Lee", "c", 355, 20), ("Lee", "c", 400, 20)]
    >>> round(unitizing_alpha(spans, begin=150, length=300).value, 4)
    0.7286
    """
    check_level(level)
    lengths = length if isinstance(length, Mapping) else {"": length}
    columns = columns_of(spans, _FIELDS[lengths is not length :])
    columns = [[""] * len(columns[0]), *columns][lengths is length :]
    line = _laid(columns, begin, lengths)
    d_o, d_e, without = _disagreements(line)
    estimates = {
        of: _estimate(
            float(1 - observed / expected) if expected else np.nan,
            left_out,
            level,
            lowest=-1.0,
            coefficient="unitizing_alpha",
            weights="identity",
            observed=float(1 - observed),
            chance=float(1 - expected),
            n_items=len(line.lengths),
            n_raters=len(line.observers),
            n_categories=len(line.categories),
        )
        for of, observed, expected, left_out in zip(
            [None, *line.categories], d_o, d_e, without, strict=True
        )
    }
    return UnitizingAlpha(
        value=estimates[None].value,
        by_category={of: estimates[of].value for of in line.categories},
        estimates=estimates,
    )


def span_f1(
    spans: object, *, match: SpanMatch = "strict", level: float = 0.95
) -> dict[tuple[Label, Label], Estimate]:
    """Compute F1 of the spans of every two observers.

    Parameters
    ----------
    spans : iterable of (document, observer, category, begin, length), or DataFrame
        One row a span; begin and length are whole numbers from 0 on. A row whose
        category is None says that an observer looked and found nothing.
    match : {"strict", "overlap", "token"}, optional
        Spans match that are of one category and have the same ends; or those that
        share a place; or what is counted is not spans but the places in them, which
        are tokens where begin and length count tokens.
    level : float, optional
        Nominal level of the intervals.

    Returns
    -------
    dict of (observer, observer) to Estimate
        F1 of every two observers, in the order in which they are met.

    Raises
    ------
    RatingsError
        If rows are not such spans, two spans of an observer and a category overlap, or
        no two observers annotated a document.
    ParameterError
        If an option is invalid.

    Warns
    -----
    UndefinedStatisticWarning
        If neither of two observers has a span in what both annotated.

    Notes
    -----
    F1 is the share of the spans of both, or of their tokens, that match: with as many
    matches on either side, 2/(1/precision + 1/recall). Counts are summed over documents
    and categories first. If two spans of one observer overlap with one of the
    other, all three match.

    Intervals leave out one document at a time, with Student's t on the logit.

    Examples
    --------
    >>> spans = [("a", "Kim", "PER", 0, 4), ("a", "Kim", "LOC", 9, 6),
    ...          ("a", "Lee", "PER", 0, 4), ("a", "Lee", "LOC", 9, 3),
    ...          ("b", "Kim", "PER", 2, 3), ("b", "Lee", "PER", 2, 3)]
    >>> for match in ("strict", "overlap"):
    ...     print(round(span_f1(spans, match=match)["Kim", "Lee"].value, 3))
    0.667
    1.0
    """
    check_option("match", match, get_args(SpanMatch))
    check_level(level)
    line, estimates = _laid(columns_of(spans, _FIELDS), 0), {}
    place, end, n = line.place, line.place + line.size, len(line.lengths)
    for pair, one, other, i, j in line.meetings():
        same = (place[i] == place[j]) & (end[i] == end[j]) | (match != "strict")
        every, met = np.append(one, other), np.append(i[same], j[same])
        parts: list[tuple[Integers, Any]] = [
            (every, np.isin(every, met, kind="table")),
            (every, None),
        ]
        if match == "token":
            shared = np.minimum(end[i], end[j]) - np.maximum(place[i], place[j])
            parts = [(i, 2 * shared), (every, line.size[every])]
        counts = [np.bincount(place[of] // _MOST % n, freq, n) for of, freq in parts]
        top, bottom = np.array(counts)[:, line.is_there[pair].sum(axis=0) == 2]
        value = float(divide(top.sum(), bottom.sum()))
        estimates[line.observers[pair[0]], line.observers[pair[1]]] = _estimate(
            value,
            divide(top.sum() - top, bottom.sum() - bottom),
            level,
            lowest=0.0,
            coefficient="span_f1",
            weights=match,
            observed=value,
            chance=0.0,
            n_items=len(top),
            n_raters=2,
            n_categories=len(line.categories),
        )
    return estimates


def _estimate(
    value: float, without: Floats, level: float, *, lowest: float, **facts: Any
) -> Estimate:
    """Return a value with its interval on the logit of the place from `lowest` to 1."""
    # without (n_documents,): the values without each document
    n, no_spans = len(without), "0/0: there are no spans to compare"
    # (n - 1)/n Σ (θ_i - mean)²
    error = float(np.sqrt((n - 1) * without.var())) if n > 1 else np.nan
    reason = undefined(facts["coefficient"], no_spans) if np.isnan(value) else None
    why = None if error > 1e-12 and lowest < value < 1.0 else reason or _NO_ENDS
    low = high = np.nan
    if why is None:
        low, high = logit_ends(value, student_t(level, n - 1) * error, lowest)
    interval = Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method=f"document jackknife, t({n - 1}) on the logit",
        target="items",
        unit="items",
        reason=why,
        units_are="left out",
    )
    return Estimate(
        value=value,
        standard_error=error,
        interval=interval,
        n_items_paired=n,
        reason=reason,
        **facts,
    )


# -- spans on a line -------------------------------------------------------------------


class _Line(NamedTuple):
    """Spans of all observers: category by category, in each document by document."""

    observers: list[Any]
    categories: list[Any]
    lengths: Integers  # of the documents; 0 of those of fewer than two observers
    is_there: NDArray[np.bool_]  # who annotated what of the others, (n_observers, n)
    # of each span, in the order of observers and places
    observer: Integers
    # where it begins: (category × n_documents + document) × _MOST + place in this
    place: Integers
    size: Integers

    def meetings(
        self,
    ) -> Iterator[tuple[list[int], Integers, Integers, Integers, Integers]]:
        """Return every two observers, spans of either, and which two overlap."""
        place, end = self.place, self.place + self.size
        document = place // _MOST % len(self.lengths)
        for pair in map(list, combinations(range(len(self.observers)), 2)):
            is_used = (self.is_there[pair].sum(axis=0) == 2)[document]
            one, other = (np.flatnonzero(is_used & (self.observer == k)) for k in pair)
            # the other's from the first that ends after this begins, to the last that
            # begins before this ends
            low = np.searchsorted(end[other], place[one], side="right")
            n = np.searchsorted(place[other], end[one], side="left") - low
            steps = np.arange(n.sum()) - np.repeat(n.cumsum() - n - low, n)
            yield pair, one, other, np.repeat(one, n), other[steps]


def _laid(
    columns: list[list[Any]], begin: int, lengths: Mapping[Any, int] | None = None
) -> _Line:
    """Check spans, and lay those of documents of two observers or more on a line."""
    (of_document, documents), (observer, observers) = map(coded, columns[:2], _FIELDS)
    is_there = np.zeros((len(observers), len(documents)), dtype=bool)
    is_there[observer, of_document] = True
    # a row without a category says that somebody looked
    rows = np.flatnonzero([not is_missing(of) for of in columns[2]])
    *names, starts, sizes = ([column[row] for row in rows] for column in columns)
    observer, of_document = observer[rows], of_document[rows]
    of_category, categories = coded(names[2], "category")
    limits = [_MOST - 1 if lengths is None else lengths.get(of) for of in documents]
    _check_whole(limits, [begin, *starts, *sizes])
    first, size, room = (np.array(of, dtype=np.int64) for of in (starts, sizes, limits))
    place = (of_category * len(documents) + of_document) * _MOST + first - begin
    order = np.lexsort((place, observer))
    outside = (size < 1) | (first < begin) | (first + size - begin > room[of_document])
    crosses = np.flatnonzero(
        (np.diff(observer[order]) == 0) & (np.diff(place[order]) < size[order[:-1]])
    )[:1]
    _check_spans(
        [*names, starts, sizes],
        (np.flatnonzero(outside)[:1], "to end after they begin, within the document"),
        (
            order[[*crosses, *crosses + 1]],
            ("of the same observer and category not to overlap"),
        ),
    )
    is_there &= is_there.sum(axis=0) > 1
    refuse(
        (
            not is_there.any(),
            f"spans: needs two observers of a document, got {shown(observers)}",
        ),
        error=RatingsError,
    )
    order = order[is_there[:, of_document[order]].any(axis=0)]
    return _Line(
        observers=observers,
        categories=categories,
        lengths=room * is_there.any(axis=0),
        is_there=is_there,
        observer=observer[order],
        place=place[order],
        size=size[order],
    )


def _check_whole(lengths: list[Any], others: list[Any]) -> None:
    """Refuse numbers that are not whole or too large, and lengths below 1."""
    wrong = [
        number
        for fewest, of in ((1, lengths), (1 - _MOST, others))
        for number in of
        if not isinstance(number, int | float | np.integer)
        or number % 1
        or not fewest <= number < _MOST
    ]
    refuse(
        (
            wrong,
            f"begin, length: needs whole numbers below {_MOST}, and a length of each "
            f"document of at least 1, got {shown(next(iter(wrong), None))}",
        ),
        error=RatingsError,
    )


def _check_spans(columns: list[list[Any]], *rules: tuple[Integers, str]) -> None:
    """Refuse the spans that break a rule, by what is needed of them."""
    *names, starts, sizes = columns
    for bad, needed in rules:
        spans = [
            f"{listed(repr(of[k]) for of in names if of[k] != '')} from {starts[k]} to "
            f"{starts[k] + sizes[k]}"
            for k in bad
        ]
        refuse(
            (spans, f"spans: needs spans {needed}, got {' and '.join(spans)}"),
            error=RatingsError,
        )


# -- disagreements ---------------------------------------------------------------------


def _disagreements(line: _Line) -> tuple[list[Fraction], list[Fraction], Floats]:
    """Return D_o and D_e of all and of each category, and alphas without a document."""
    # alphas are (1 + n_categories, n_documents)
    n, q, n_raters = len(line.lengths), len(line.categories), line.is_there.sum(axis=0)

    def by_cell(cells: Integers, values: Any) -> NDArray[Any]:
        sums = np.zeros(q * n, dtype=object)  # beyond 64 bits
        np.add.at(sums, cells, values)
        return sums.reshape(q, n)

    cell, end = line.place // _MOST, line.place + line.size
    size, distances = line.size.astype(object), by_cell(cell, 0)
    for _, one, other, i, j in line.meetings():
        in_gaps = np.append(
            one[~np.isin(one, i, kind="table")], other[~np.isin(other, j, kind="table")]
        )
        off = (line.place[i] - line.place[j]) ** 2 + (end[i] - end[j]) ** 2
        distances += by_cell(cell[i], off.astype(object))
        distances += by_cell(cell[in_gaps], size[in_gaps] ** 2)
    gaps, of_gap = _gaps(line)
    once, squares = np.ones_like(gaps), size**2
    sums = np.array(
        [
            distances * [Fraction(1, max(m - 1, 1)) for m in n_raters.tolist()],
            by_cell(cell, 1),
            by_cell(cell, size * (size - 1) * (2 * size - 1) // 3),
            by_cell(cell, squares - size),
            by_cell(
                cell, squares * _fits(line.size, cell // n, gaps, of_gap // n, once)
            ),
        ]
    )  # (5, n_categories, n_documents)
    lengths = line.lengths.astype(object)
    places, whole = lengths * n_raters, sums.sum(axis=2)
    exact = _ratios(whole * Fraction(1), places.sum(), lengths.sum())
    # of a unit and a gap both go with the document that either is in
    sums[4] += by_cell(
        of_gap, _fits(-gaps, of_gap // n, -line.size, cell // n, squares)
    )
    sums[4] -= by_cell(cell, squares * _fits(line.size, cell, gaps, of_gap, once))
    rest = whole[:, :, None] - sums, places.sum() - places, lengths.sum() - lengths
    with np.errstate(divide="ignore", invalid="ignore"):
        d_o, d_e = _ratios(*(part.astype(np.float64) for part in rest))
        return exact[0].tolist(), exact[1].tolist(), (1.0 - d_o / d_e)[:, n_raters > 0]


def _ratios(sums: NDArray[Any], places: Any, length: Any) -> NDArray[Any]:
    """Return D_o and D_e [1]_ of all categories and of each."""
    # sums (5, n_categories, ...); L is the length, and places are m L
    distances, n, cubes, taken, room = sums
    # distances: Σ δ²; cubes: Σ (2l³ - 3l² + l)/3; taken: Σ l (l - 1); room: over units
    # and gaps at least as long, Σ l² Σ (l' - l + 1)
    d_e = ((n - 1) * cubes + room) / (places * (places - 1) - taken)
    both = np.array([2 * distances / (places * length), 2 * d_e / length])
    return np.concatenate([both.sum(axis=1, keepdims=True), both], axis=1)


def _gaps(line: _Line) -> tuple[Integers, Integers]:
    """Return the lengths of the gaps between units of an observer, and their cells."""
    n, q = len(line.lengths), len(line.categories)
    who, document = (np.tile(of, q) for of in np.nonzero(line.is_there))
    # each observer has a line of his own
    seams = (who * q + np.arange(q).repeat(len(who) // max(q, 1))) * n + document
    places = line.observer * q * n * _MOST + line.place
    # every gap is from where a document begins, or a unit ends, to what comes next
    starts = np.sort(np.append(seams * _MOST, places + line.size))
    stops = np.sort(np.append(seams * _MOST + line.lengths[document], places))
    return stops - starts, starts // _MOST % (q * n)


def _fits(
    size: Integers, of_size: Integers, gaps: Integers, of_gap: Integers, weights: Any
) -> NDArray[Any]:
    """Return in how many places each unit would lie in the gaps of its group."""
    keys, last = of_gap * 2 * _MOST + gaps, of_size * 2 * _MOST  # gaps may be negative
    order = np.argsort(keys)
    n, total = (np.append(0, of[order].cumsum()) for of in (weights, weights * gaps))
    low, high = np.searchsorted(keys[order], [last + size, last + _MOST])
    # Σ (l' - l + 1) over gaps l' at least as long
    return np.asarray(total[high] - total[low] - (n[high] - n[low]) * (size - 1))
