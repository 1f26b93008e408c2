"""Ratings by grade: two raters, the use of grades, agreement on each, item by item.

Ordered grades are lighter to darker, others have colours that colour-blind readers
tell apart; the grade itself is written wherever there is room.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from masrel._input import refuse
from masrel.agreement import CodedRatings, Label, code_ratings, item_disagreement
from masrel.agreement._codes import item_counts, pair_table
from masrel.agreement._weights import category_values
from masrel.intervals.diagnosis import _names, _place
from masrel.plots._style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    PAGE,
    SEQUENTIAL,
    VERMILLION,
    Picture,
    colour_bar,
    legend_below,
    letters_on,
    short_name,
    shown,
)
from masrel.tables._tables import counted, number, percent

if TYPE_CHECKING:
    from masrel.intervals import Diagnosis

_Floats = NDArray[np.float64]
_Integers = NDArray[np.signedinteger[Any]]

# seven of Okabe and Ito's, neighbours far apart; black is what a page writes in
_HUES = (BLUE, ORANGE, "#009E73", "#CC79A7", "#56B4E9", VERMILLION, "#F0E442")
_OTHER = "#B3B3B3"  # the eighth grade, or all but the seven most common

_MAX_SHADES = 12  # ordered grades that have a shade each
_MAX_LETTERS = 6  # of a grade, in a cell or above a column
_MAX_NUMBERED = 24  # grades up to which numbers may stand for long names
_MAX_COUNTED = 20  # grades up to which counts are written in a table of two raters
_MAX_ROWS = 60  # grades that agreement is drawn of
_INTENDED = -1.3  # where intended grades stand; raters are at 0, 1, 2, ...
_ACROSS, _DOWN = 7.0, 9.0  # inches of many columns, and of many rows
_LETTER, _LINE = 0.075, 0.15  # inches of a letter of 9 points, and of a line


def confusion(
    ratings: object,
    *,
    raters: Sequence[str] | None = None,
    reference: str | int | None = None,
    categories: Sequence[Label] | None = None,
    ordered: bool | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how often a grade of one rater met each grade of the other.

    Shades are shares of the row, from 0 to 1 whatever the data, so that two pictures
    can be compared. The diagonal, on which both gave one grade, is framed.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    raters : sequence of str, optional
        What the raters are called; the columns of a DataFrame, else their places.
    reference : str or int, optional
        Name, or place, of the rater in the rows; all others are in the columns,
        together. The first of two raters unless given.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    ordered : bool, optional
        Whether the grades have an order; unless given, numbers and a declared scale
        have one.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those of the table; the colour bar below it is an inset of them.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no rating, or there are not two raters and no reference.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    >>> ax = confusion(ratings, raters=["Kim", "Lee"], ax=Figure().add_subplot())
    >>> ax.get_ylabel(), ax.get_xlabel(), [text.get_text() for text in ax.texts]
    ('Kim', 'Lee', ['1', '1', '2', '2', '2', '1', '3', '4'])
    """
    coded, names, labels, is_ordered = _read(ratings, raters, categories, ordered)
    refuse(
        (
            reference is None and len(names) != 2,
            "ratings: needs two raters, or a reference that the others are held "
            f"against, got {len(names)} raters",
        )
    )
    row = 0 if reference is None else _place(reference, names)
    others = [place for place in range(len(names)) if place != row]
    counts = np.zeros((len(labels), len(labels)), dtype=np.int64)
    for place in others:
        counts += pair_table(coded.codes[:, [row, place]], len(labels))
    column = names[others[0]] if len(others) == 1 else f"{len(others)} other raters"
    pair = names[row], column
    return shown(confusion_picture(counts, labels, pair, is_ordered), ax)


def _read(
    ratings: object,
    raters: Sequence[str] | None,
    categories: Sequence[Label] | None,
    ordered: bool | None,
) -> tuple[CodedRatings, tuple[str, ...], list[str], bool]:
    # codes, what raters and grades are called, and whether the latter have an order
    coded = code_ratings(ratings, categories)
    refuse((not coded.categories, "ratings: needs at least one, got none"))
    names = _names(ratings, raters, coded.codes.shape[1])
    if ordered is None:
        ordered = coded.declared or not isinstance(coded.categories[0], str)
    return coded, names, [number(of, None) for of in coded.categories], ordered


def confusion_picture(
    counts: _Integers, grades: Sequence[str], names: tuple[str, str], is_ordered: bool
) -> Picture:
    """Return a table of two raters' grades, shaded by shares of its rows."""
    label = f"share of the row\nsame grade: {_part(counts, 0)}"
    if is_ordered and len(grades) > 2:
        label += f"\nsame or next grade: {_part(counts, -1, 0, 1)}"
    used = np.flatnonzero(counts.sum(axis=0) + counts.sum(axis=1)).tolist()
    if len(grades) > _MAX_SHADES and 0 < len(used) < len(grades):
        counts, grades = counts[np.ix_(used, used)], [grades[k] for k in used]
        label += "\ngrades never met are left out"
    q, labels = len(grades), _labels(grades)
    n = q + (q <= _MAX_COUNTED)  # with totals, where counts are written
    heads, cell = [*labels, "all"][:n], min(0.42, _ACROSS / n)
    across = max(cell * n, 2.8)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    table = np.pad(counts, (0, 1))
    table[-1] = table.sum(axis=0)
    table[:, -1] = table.sum(axis=1)
    legend = _Legend.of(across, labels, grades)

    def draw(axes: Axes) -> None:
        _cells(axes, SEQUENTIAL(shares), q)
        for (row, column), freq in np.ndenumerate(table if n > q else table[:0]):
            is_cell = max(row, column) < q
            colour = letters_on(SEQUENTIAL(shares[row, column])) if is_cell else GREY
            if freq:
                _write(axes, column, row, str(freq), colour)
        for k in range(q):
            _frame(axes, k - 0.5, k, 1.0, BLACK, 1.2 if n > q else 0.5)
        axes.set(xlim=(-0.5, n - 0.5), ylim=(n - 0.5, -0.5))
        _name_columns(axes, range(n), heads, across / n)
        _name_rows(axes, heads, cell)
        axes.set_ylabel(short_name(names[0]))
        axes.set_xlabel(short_name(names[1]))
        axes.xaxis.set_label_position("top")
        colour_bar(axes, ScalarMappable(Normalize(0.0, 1.0), SEQUENTIAL), label)
        legend.draw(axes)

    room = 0.4 + _LETTER * max(map(len, heads))
    height = 1.3 + _head(heads, across / n) + cell * n + legend.height
    return Picture(room + across, height, draw)


def _part(counts: _Integers, *steps: int) -> str:
    # of the pairs, those so many grades apart
    n, total = sum(int(counts.trace(step)) for step in steps), int(counts.sum())
    return f"{n} of {total}" + (f" ({100.0 * n / total:.0f} %)" if total else "")


def grades(
    ratings: object,
    *,
    raters: Sequence[str] | None = None,
    categories: Sequence[Label] | None = None,
    ordered: bool | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how often each rater used each grade, as shares of the rater's ratings.

    Of more than 12 ordered grades, neighbours are drawn together; of more than 8
    others, all but the 7 most common.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    raters, categories, ordered : optional
        As of `confusion`.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no rating, or not a name for each rater.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = grades([["a", "a"], ["a", "b"]], ax=Figure().add_subplot())
    >>> [float(bar.get_width()) for bar in ax.patches]
    [1.0, 0.5, 0.5]
    """
    coded, names, labels, is_ordered = _read(ratings, raters, categories, ordered)
    counts = item_counts(coded.codes.T, len(labels))
    return shown(grades_picture(counts, names, labels, is_ordered), ax)


def grades_picture(
    counts: _Integers, raters: Sequence[str], grades: Sequence[str], is_ordered: bool
) -> Picture:
    """Return each rater's use of grades as a bar of shares."""
    counts, grades, labels = _merged(counts, grades, is_ordered)
    sizes = counts.sum(axis=1)
    colours = _colours(len(grades), is_ordered, counts.sum(axis=0))
    n, across = len(raters), 4.6
    cell = min(0.27, _DOWN / n)
    shares = counts / np.maximum(sizes, 1)[:, None]
    starts = np.cumsum(shares, axis=1) - shares
    legend = _Legend.of(across, labels, grades, colours)

    def draw(axes: Axes) -> None:
        for k, label in enumerate(labels):
            rows = np.flatnonzero(counts[:, k]).tolist()
            axes.barh(
                *(rows, shares[rows, k], 0.78, starts[rows, k]),
                **{"color": colours[k], "edgecolor": PAGE, "linewidth": 0.6},
            )
            for row in rows if cell > _LINE else ():
                if across * shares[row, k] > _LETTER * len(label) + 0.05:
                    middle = starts[row, k] + 0.5 * shares[row, k]
                    _write(axes, middle, row, label, letters_on(colours[k]))
        axes.set(xlim=(0.0, 1.0), ylim=(n - 0.5, -0.5))
        axes.set_xlabel("share of the rater's ratings")
        axes.spines["left"].set_visible(False)
        _name_rows(axes, [short_name(name) for name in raters], cell)
        for place, size in enumerate(sizes if cell >= _LINE else ()):
            _beside(axes, place, counted(int(size), "rating"))
        legend.draw(axes)

    height = 0.6 + cell * n + legend.height
    return Picture(_room(raters) + across + 0.9, height, draw)


def categories(
    diagnosis: "Diagnosis",
    *,
    names: Sequence[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how well raters agree on each grade, from 0 to 1, with intervals.

    Parameters
    ----------
    diagnosis : Diagnosis
        What `masrel.intervals.diagnose` returns; it has intervals with a target.
    names : sequence of str, optional
        What the grades are called, in the order of the scale.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Raises
    ------
    ParameterError
        If there is not a name for each grade.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from masrel.intervals import diagnose
    >>> found = diagnose([["a", "a"], ["b", "b"], ["a", "b"]])
    >>> ax = categories(found, ax=Figure().add_subplot())
    >>> [text.get_text() for text in ax.texts]
    ['0.67 of 3 ratings', '0.67 of 3 ratings']
    """
    scale = [number(of, None) for of in diagnosis.categories]
    labels = scale if names is None else list(names)
    refuse(
        (
            len(labels) != len(scale),
            f"names: needs one for each of {len(scale)} grades, got {len(labels)}",
        )
    )
    ends = diagnosis.category_low, diagnosis.category_high
    picture = categories_picture(
        *(diagnosis.category_values, *ends, diagnosis.category_counts),
        *(labels, diagnosis.level),
    )
    return shown(picture, ax)


def categories_picture(
    values: _Floats,
    low: _Floats,
    high: _Floats,
    counts: _Integers,
    grades: Sequence[str],
    level: float,
) -> Picture:
    """Return the agreement on each grade as a dot with its interval."""
    label = "of a grade's ratings, the share that meets the same of another rater"
    rows = list(range(len(grades)))
    if len(grades) > _MAX_ROWS:
        rows = sorted(np.argsort(-counts, kind="stable")[:_MAX_ROWS].tolist())
        label += f"\n(the {_MAX_ROWS} most used of {len(grades)} grades)"
    names = [short_name(grades[row]) for row in rows]
    n, cell = len(rows), min(0.3, _DOWN / len(rows))
    has_ends = bool(np.isfinite(low[rows]).any())
    dot: dict[str, Any] = {"marker": "o", "color": BLACK, "linestyle": "none"}
    line: dict[str, Any] = {"color": BLUE, "linewidth": 2.0}

    def draw(axes: Axes) -> None:
        axes.hlines(range(n), low[rows], high[rows], **line)
        axes.plot(values[rows], range(n), markersize=4.5, **dot, clip_on=False)
        axes.set(xlim=(0.0, 1.0), ylim=(n - 0.5, -0.5))
        axes.set_xlabel(label)
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x")
        _name_rows(axes, names, cell)
        for place, row in enumerate(rows):
            size = counted(int(counts[row]), "rating")
            _beside(axes, place, f"{number(float(values[row]), 2)} of {size}")
        marks = [
            Line2D([], [], label="estimate", **dot),
            Line2D([], [], label=f"{percent(level)} % confidence interval", **line),
        ]
        legend_below(axes, marks if has_ends else (), ncols=2)

    return Picture(_room(names) + 5.2, 0.9 + cell * n, draw)


def items(
    ratings: object,
    *,
    n_shown: int = 30,
    items: Sequence[str] | None = None,
    raters: Sequence[str] | None = None,
    categories: Sequence[Label] | None = None,
    ordered: bool | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the ratings of the items that raters disagree on most.

    Items come by `masrel.agreement.item_disagreement`, most first and those of one
    rating last: by linear weights where grades have an order. Missing ratings are
    blank.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    n_shown : int, optional
        Items that are drawn at most.
    items : sequence of str, optional
        What the items are called; the index of a DataFrame, else their places.
    raters, categories, ordered : optional
        As of `confusion`.
    ax : Axes, optional
        Where it is drawn; on a new figure of pyplot unless given.

    Returns
    -------
    Axes
        Those that it is drawn on.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no rating, or not a name for each item and rater.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = items([[1, 1], [1, 3], [1, 2]], ax=Figure().add_subplot())
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['1', '2', '0']
    """
    coded, columns, labels, is_ordered = _read(ratings, raters, categories, ordered)
    n = len(coded.codes)
    index = (
        getattr(ratings, "index", range(n)) if hasattr(ratings, "iloc") else range(n)
    )
    rows = list(map(str, index if items is None else items))
    refuse(
        (len(rows) != n, f"items: needs a name for each of {n}, got {len(rows)}"),
        (n_shown < 1, f"n_shown: needs at least 1 item, got {n_shown}"),
    )
    has_weights = is_ordered and len(labels) > 1
    weights = "linear" if has_weights else "identity"
    disagreement = item_disagreement(replace(coded, declared=True), weights=weights)
    chosen = np.argsort(-disagreement, kind="stable")[:n_shown]
    picture = items_picture(
        *(coded.codes[chosen], [rows[place] for place in chosen], columns, labels),
        *(is_ordered, category_values(coded.categories)),
    )
    return shown(picture, ax)


def items_picture(
    codes: _Integers,
    items: Sequence[str],
    raters: Sequence[str],
    grades: Sequence[str],
    is_ordered: bool,
    values: _Floats,
    intended: Sequence[int] | None = None,
) -> Picture:
    """Return ratings as a grid of coloured cells, with the grades in them."""
    # codes (n, k), or (n, k, r) of r ratings each, -1 without; values of the grades;
    # intended (n,): codes that have a column, and what differs from them a frame
    (n, k), q = codes.shape[:2], len(grades)
    blocks = [(0.0, codes.reshape(n, k, -1))]  # from where on, and codes (n, ., r)
    aims = np.full(n, -1) if intended is None else np.array(intended)
    if intended is not None:
        blocks.append((_INTENDED, aims.reshape(n, 1, 1)))
    parts, is_line = blocks[0][1].shape[2], is_ordered and q > _MAX_SHADES
    labels = list(grades) if is_line else _labels(grades)
    longest = max(map(len, labels))
    cell = max(0.34, _LETTER * min(longest, _MAX_LETTERS) + 0.1) * parts
    cell, height = min(cell, _ACROSS / k), min(0.26, _DOWN / n)
    has_room = 0.066 * longest + 0.03 < cell / parts and height >= _LINE
    colours = _colours(q, is_ordered, np.bincount(codes[codes >= 0], minlength=q))
    if is_line:  # by value
        values = values if np.isfinite(values).all() else np.arange(float(q))
        line = ScalarMappable(Normalize(values.min(), values.max()), SEQUENTIAL)
        colours = line.to_rgba(values)
    paint = np.vstack([colours, np.zeros(4)])  # nothing at -1
    places = [*([] if intended is None else [_INTENDED]), *range(k)]
    heads = ["intended"] * (len(places) - k) + [*map(short_name, raters)]
    across = max(cell * (k - min(places)), 2.0)
    legend = _Legend.of(across, labels, grades, colours)
    if is_line:
        legend = _Legend((), across)

    def draw(axes: Axes) -> None:
        for start, block in blocks:
            _cells(axes, paint[block.reshape(n, -1)], block.shape[1], start - 0.5)
            for (row, column, part), code in np.ndenumerate(block):
                left, width = start + column - 0.5, 1.0 / block.shape[2]
                left += part * width
                if code >= 0 and has_room:
                    colour = letters_on(colours[code])
                    _write(axes, left + 0.5 * width, row, labels[code], colour)
                if code != aims[row] and -1 not in (code, aims[row]):
                    _frame(axes, left, row, width, VERMILLION, 2.0)
        axes.set(xlim=(places[0] - 0.5, k - 0.5), ylim=(n - 0.5, -0.5))
        _name_columns(axes, places, heads, cell)
        _name_rows(axes, [short_name(name) for name in items], height)
        if is_line:
            ends = [int(values.argmin()), int(values.argmax())]
            bar = colour_bar(axes, line, "")
            bar.set_ticks(values[ends].tolist(), labels=[grades[end] for end in ends])
        legend.draw(axes)

    below = 0.5 if is_line else legend.height
    size = _room(items) + across, 0.2 + _head(heads, cell) + height * n + below
    return Picture(*size, draw)


# -- what they share -------------------------------------------------------------------


def _labels(grades: Sequence[str]) -> list[str]:
    """Return what is written of grades: numbers in the place of long names."""
    if max(map(len, grades)) <= _MAX_LETTERS:
        return list(grades)
    if len(grades) <= _MAX_NUMBERED:
        return [str(1 + k) for k in range(len(grades))]
    return [short_name(grade) for grade in grades]


def _colours(q: int, is_ordered: bool, freq: _Integers) -> _Floats:
    """Return the colour of each grade, (q, 4); freq is how often it is met."""
    if is_ordered:
        return np.asarray(SEQUENTIAL(np.linspace(0.0, 1.0, q)))
    colours = np.tile(to_rgba(_OTHER), (q, 1))
    for place, hue in zip(_usual(freq), _HUES, strict=False):
        colours[place] = to_rgba(hue)
    return colours


def _usual(freq: _Integers) -> list[int]:
    # grades that have a hue: all of eight but the last, else the most common
    n = len(_HUES)
    if len(freq) <= n + 1:
        return list(range(len(freq)))[:n]
    return sorted(np.argsort(-freq, kind="stable")[:n].tolist())


def _merged(
    counts: _Integers, grades: Sequence[str], is_ordered: bool
) -> tuple[_Integers, Sequence[str], list[str]]:
    """Put grades together that are too many to tell their colours apart."""
    # -> counts, names, and what is written of them: nothing of several together
    q = len(grades)
    if is_ordered and q > _MAX_SHADES:
        starts = np.linspace(0, q, _MAX_SHADES, endpoint=False).astype(int).tolist()
        ends = [end - 1 for end in [*starts[1:], q]]
        bands = [(grades[a], grades[b]) for a, b in zip(starts, ends, strict=True)]
        names = [a if a == b else f"{a} to {b}" for a, b in bands]
        return np.add.reduceat(counts, starts, axis=1), names, [""] * _MAX_SHADES
    usual = _usual(counts.sum(axis=0))
    if is_ordered or q <= len(usual) + 1:
        return counts, grades, _labels(grades)
    rest = counts.sum(axis=1) - counts[:, usual].sum(axis=1)
    names = [grades[k] for k in usual]
    labels = [*_labels(names), ""]
    names.append(f"other {q - len(usual)} grades")
    return np.column_stack([counts[:, usual], rest]), names, labels


@dataclass(frozen=True, slots=True)
class _Legend:
    """What is said below of grades: their colours, and the names of numbers."""

    entries: Sequence[tuple[str, Any]]  # texts, each with its colour, or None
    across: float  # inches

    @classmethod
    def of(
        cls,
        across: float,
        labels: Sequence[str],
        grades: Sequence[str],
        colours: _Floats | None = None,
    ) -> "_Legend":
        names = [short_name(grade) for grade in grades]
        texts = [
            name if label in (name, grade, "") else f"{label} = {name}"
            for label, name, grade in zip(labels, names, grades, strict=True)
        ]
        if colours is not None:
            entries = list(zip(texts, map(tuple, colours.tolist()), strict=True))
            rest = [of for of in entries if of[1] == to_rgba(_OTHER)]
            if len(entries) > _MAX_NUMBERED and len(rest) > 1:
                entries = [of for of in entries if of not in rest]
                entries.append((f"other {len(rest)} grades", to_rgba(_OTHER)))
            return cls(entries, across)
        return cls([] if texts == names else [(text, None) for text in texts], across)

    @property
    def _columns(self) -> int:
        longest = max((len(text) for text, _ in self.entries), default=0)
        return max(1, int(self.across / (0.45 + _LETTER * longest)))

    @property
    def height(self) -> float:
        return 0.05 + 0.175 * -(-len(self.entries) // self._columns)

    def draw(self, axes: Axes) -> None:
        handles = [
            Patch(label=text, **{"color": of} if of else {"alpha": 0.0})
            for text, of in self.entries
        ]
        has_colours = any(of for _, of in self.entries)
        how = {"handlelength": 1.2 if has_colours else 0.0, "columnspacing": 1.2}
        legend_below(axes, handles, ncols=self._columns, handleheight=1.0, **how)


def _cells(axes: Axes, paint: _Floats, n_columns: int, left: float = -0.5) -> None:
    """Draw a grid of cells, with gaps between the columns and the rows."""
    # paint (n, n_columns or a multiple of it, 4)
    n, right = len(paint), left + n_columns
    axes.imshow(
        paint,
        extent=(left, right, n - 0.5, -0.5),
        aspect="auto",
        interpolation="nearest",
    )
    width = 1.2 if max(n, n_columns) <= _MAX_COUNTED else 0.5
    axes.hlines(np.arange(0.5, n - 1.0), left, right, PAGE, linewidth=width)
    edges = np.arange(left + 1.0, right - 0.5)
    axes.vlines(edges, -0.5, n - 0.5, PAGE, linewidth=width)
    axes.spines[:].set_visible(False)


def _frame(
    axes: Axes, left: float, row: float, width: float, colour: str, line: float
) -> None:
    corner = left, row - 0.5
    look: dict[str, Any] = {"edgecolor": colour, "linewidth": line, "zorder": 3.0}
    axes.add_patch(Rectangle(corner, width, 1.0, facecolor="none", **look))


def _write(axes: Axes, x: float, y: float, text: str, colour: str) -> None:
    axes.text(x, y, text, ha="center", va="center", fontsize=8, color=colour)


def _beside(axes: Axes, row: int, text: str) -> None:
    """Write at the right of a row."""
    axes.annotate(
        text,
        (1.0, row),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=GREY,
    )


def _room(names: Sequence[str]) -> float:
    """Return the inches of names at the left."""
    return 0.3 + _LETTER * max(len(short_name(name)) for name in names)


def _name_rows(axes: Axes, names: Sequence[str], cell: float) -> None:
    """Name rows so many inches apart, as many as have room."""
    every = math.ceil(_LINE / cell)
    axes.set_yticks(range(len(names))[::every], names[::every])
    axes.tick_params(axis="y", length=0)


def _is_upright(names: Sequence[str], cell: float) -> bool:
    return _LETTER * max(map(len, names)) + 0.06 > cell


def _head(names: Sequence[str], cell: float) -> float:
    """Return the inches of names above columns."""
    return _room(names) if _is_upright(names, cell) else 0.3


def _name_columns(
    axes: Axes, places: Sequence[float], names: Sequence[str], cell: float
) -> None:
    """Name columns so many inches apart above them, upright where they are narrow."""
    is_upright = _is_upright(names, cell)
    every = math.ceil(_LINE / cell) if is_upright else 1
    axes.set_xticks(places[::every], names[::every], rotation=90 * is_upright)
    axes.tick_params(axis="x", length=0)
    axes.xaxis.tick_top()
