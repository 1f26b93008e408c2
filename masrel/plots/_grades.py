"""Ratings by grade: two raters, the use of grades, agreement on each, item by item.

Ordered grades are lighter to darker, others have colours that colour-blind readers
tell apart; the grade itself is written wherever there is room.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba_array
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from masrel._input import refuse
from masrel.agreement import CodedRatings, Label, code_ratings, item_disagreement
from masrel.agreement._codes import item_counts, pair_table
from masrel.agreement._weights import category_values
from masrel.intervals.diagnosis import Diagnosis, _names, _place
from masrel.plots._rater_pairs import (
    LINE,
    Floats,
    cells,
    inches_of,
    letters_on,
    name_columns,
    name_rows,
    room_of,
    rows_of_shares,
)
from masrel.plots._style import (
    BLACK,
    BLUE,
    ORANGE,
    PAGE,
    SEQUENTIAL,
    VERMILLION,
    Picture,
    colour_bar,
    legend_below,
    short_name,
    short_names,
    shown,
)
from masrel.tables._tables import counted, number, percent

_Integers = NDArray[np.signedinteger[Any]]

# seven of Okabe and Ito's, neighbours far apart, and grey for one more, or all others;
# black is what a page writes in, and of BLUE it has its own in the dark
_HUES = (
    "#0073B2",
    ORANGE,
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    VERMILLION,
    "#F0E442",
    "#B3B3B3",
)

_MAX_SHADES = 12  # ordered grades that have a shade each
_MAX_LETTERS = 6  # of a grade in a cell
_MAX_LEGEND = 60  # of a grade in the legend
_MAX_COUNTED = 20  # grades up to which counts are written in a table of two raters
_INTENDED = -1.3  # where intended grades stand; raters are at 0, 1, 2, ...
_ACROSS, _DOWN = 7.0, 9.0  # inches of many columns, and of many rows


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
    n = len(names)
    refuse(
        (
            n < 2 or (reference is None and n > 2),
            "ratings: needs two raters, or a reference to compare several others "
            f"with, got {counted(n, 'rater')}",
        )
    )
    row = 0 if reference is None else _place(reference, names)
    others = [place for place in range(n) if place != row]
    pairs = (coded.codes[:, [row, place]] for place in others)
    counts = np.sum([pair_table(of, len(labels)) for of in pairs], axis=0)
    column = names[others[0]] if len(others) == 1 else f"{len(others)} other raters"
    return shown(
        confusion_picture(counts, labels, (names[row], column), is_ordered), ax
    )


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
    near = f"\nsame or next grade: {_part(counts, -1, 0, 1)}"
    label += near * (is_ordered and len(grades) > 2)
    used = np.flatnonzero(counts.sum(axis=0) + counts.sum(axis=1)).tolist()
    if len(grades) > _MAX_SHADES and 0 < len(used) < len(grades):
        counts, grades = counts[np.ix_(used, used)], [grades[k] for k in used]
        label += "\nunused grades are left out"
    return counts_picture(counts, grades, grades, np.eye(len(grades)), names, label)


def confusions_pictures(
    tables: Mapping[str, Sequence[Sequence[float]]], grades: Sequence[str]
) -> list[tuple[str, Picture]]:
    """Return a table of classes and grades for each rater."""
    counts = {
        rater: np.rint(np.nan_to_num(np.array(table))).astype(np.int64)
        for rater, table in tables.items()
    }
    return [
        ("", confusion_picture(table, grades, ("class", rater), False))
        for rater, table in counts.items()
    ]


def counts_picture(
    counts: _Integers,
    rows: Sequence[str],
    grades: Sequence[str],
    framed: NDArray[Any],
    names: tuple[str, str],
    label: str = "share of the row",
) -> Picture:
    """Return how often each grade comes in each row, shaded by shares of the rows."""
    # counts, framed (n_rows, q); names of the rows together, and of the columns; label
    # of the bar that explains the shades, without which rows are low
    more = int(len(grades) <= _MAX_COUNTED)  # totals, where counts are written
    m, n = len(rows) + more, len(grades) + more
    heads, totals = [*grades, "all"][:n], [*rows, "all"][:m]
    cell = min(0.42, _ACROSS / n)
    across, height = max(cell * n, 2.8), min(cell if label else 0.28, _DOWN / m)
    of_row, of_column = counts.sum(axis=1, keepdims=True), counts.sum(axis=0)
    table = np.block([[counts, of_row], [of_column, counts.sum()]])
    letters = np.where(table > 0, table.astype(str), "")[: m * more]
    look: dict[str, Any] = {"cmap": SEQUENTIAL, "vmin": 0.0, "vmax": 1.0}

    def draw(axes: Axes) -> None:
        shares = counts / np.maximum(of_row, 1)
        drawn = cells(axes, shares, letters, framed=framed, **look)
        axes.set(xlim=(-0.5, n - 0.5), ylim=(m - 0.5, -0.5))
        axes.set(ylabel=short_names(names)[0], xlabel=short_names(names)[1])
        name_rows(axes, totals, height)
        name_columns(axes, heads, across / n, range(n))
        axes.xaxis.set_label_position("top")
        if label:
            colour_bar(axes, drawn, label)

    room = room_of(totals) + across, room_of(heads) + height * m
    return Picture(0.2 + room[0], (1.2 if label else 0.4) + room[1], draw)


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
        As for `confusion`.
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
    counts: _Integers,
    raters: Sequence[str],
    grades: Sequence[str],
    is_ordered: bool,
    *,
    noun: str = "rating",
) -> Picture:
    """Return each rater's use of grades as a bar of shares."""
    group, labels, texts, colours = _grouped(counts.sum(axis=0), grades, is_ordered)
    n, across, cell = len(raters), 4.6, min(0.27, _DOWN / len(raters))
    counts = counts @ np.eye(len(texts), dtype=np.int64)[group]
    sizes = [counted(size, noun) for size in counts.sum(axis=1).tolist()]
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    starts = np.cumsum(shares, axis=1) - shares
    height, explain = _legend(texts, colours, across)

    def draw(axes: Axes) -> None:
        for k, colour in enumerate(colours):
            rows = np.flatnonzero(counts[:, k])
            look: dict[str, Any] = {"color": colour, "edgecolor": PAGE}
            axes.barh(rows, shares[rows, k], 0.78, starts[rows, k], **look)
        for (row, k), share in np.ndenumerate(shares):
            if cell > LINE and inches_of(labels[k]) + 0.05 < across * share:
                look = {"color": letters_on(colours[k]), "ha": "center", "va": "center"}
                axes.text(
                    starts[row, k] + share / 2, row, labels[k], fontsize=8, **look
                )
        rows_of_shares(axes, raters, sizes, cell, f"share of the {noun}s")
        explain(axes)

    return Picture(room_of(raters) + across + 0.9, 0.6 + cell * n + height, draw)


def answer_pictures(
    questions: Sequence[tuple[str, Sequence[str], Sequence[int]]],
) -> list[tuple[str, Picture]]:
    """Return how often each answer was given, a bar a question, under its title."""
    return [
        (
            title,
            grades_picture(np.array([counts]), ["all"], answers, True, noun="answer"),
        )
        for title, answers, counts in questions
    ]


def categories(
    diagnosis: Diagnosis,
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
    ['0.67 (3 ratings)', '0.67 (3 ratings)']
    """
    n = len(diagnosis.categories)
    labels = [number(of, None) for of in diagnosis.categories if names is None]
    labels += names or ()
    refuse((len(labels) != n, f"names: needs one for each of {n}, got {len(labels)}"))
    picture = categories_picture(
        diagnosis.category_values,
        diagnosis.category_low,
        diagnosis.category_high,
        diagnosis.category_counts,
        labels,
        diagnosis.level,
    )
    return shown(picture, ax)


def categories_picture(
    values: Floats,
    low: Floats,
    high: Floats,
    counts: _Integers,
    grades: Sequence[str],
    level: float,
) -> Picture:
    """Return the agreement on each grade as a dot with its interval."""
    n, cell = len(grades), min(0.3, _DOWN / len(grades))
    texts = [
        f"{number(value, 2)} ({counted(size, 'rating')})"
        for value, size in zip(values.tolist(), counts.tolist(), strict=True)
    ]
    dot: dict[str, Any] = {"marker": "o", "color": BLACK, "linestyle": "none"}
    line: dict[str, Any] = {"color": BLUE, "linewidth": 2.0}
    marks = [
        Line2D([], [], label="estimate", **dot),
        Line2D([], [], label=f"{percent(level)} % confidence interval", **line),
    ]

    def draw(axes: Axes) -> None:
        axes.hlines(range(n), low, high, **line)
        axes.plot(values, range(n), markersize=4.5, **dot, clip_on=False)
        axes.grid(axis="x")
        rows_of_shares(
            *(axes, grades, texts, cell),
            "share of ratings with this grade\nthat another rater matched",
        )
        legend_below(axes, marks if np.isfinite(low).any() else (), ncols=2)

    return Picture(room_of(grades) + 5.2, 1.1 + cell * n, draw)


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
        As for `confusion`.
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
    is_frame = items is None and hasattr(ratings, "iloc")
    index = getattr(ratings, "index", ()) if is_frame else range(n)
    rows = list(map(str, index if items is None else items))
    refuse(
        (len(rows) != n, f"items: needs a name for each of {n}, got {len(rows)}"),
        (n_shown < 1, f"n_shown: needs at least 1 item, got {n_shown}"),
    )
    weights = "linear" if is_ordered and len(labels) > 1 else "identity"
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
    values: Floats,
    intended: Sequence[int] | None = None,
) -> Picture:
    """Return ratings as a grid of coloured cells, with the grades in them."""
    # codes (n, k), or (n, k, r) of r ratings each, -1 without; values of the grades;
    # intended (n,): codes that have a column, and what differs from them a frame
    n, k = codes.shape[:2]
    codes, has_aims = codes.reshape(n, k, -1), intended is not None
    aims = np.array(intended if has_aims else [-1] * n).reshape(n, 1, 1)
    freq = np.bincount(codes[codes >= 0], minlength=len(grades))
    group, labels, texts, colours = _grouped(freq, grades, is_ordered)
    is_short = max(map(len, grades)) <= _MAX_LETTERS
    written = list(grades) if is_short else [labels[place] for place in group]
    inches = max(map(inches_of, written)) + 0.03
    cell = min(max(0.34, inches) * codes.shape[2], _ACROSS / k)
    height = min(0.26, _DOWN / n)
    if inches > cell / codes.shape[2] or height < LINE:
        written = [""] * len(grades)
    paint, across = colours[group], max(cell * (k - _INTENDED * has_aims), 2.0)
    below, explain = _legend(texts, colours, across)
    if is_ordered and len(grades) > _MAX_SHADES:  # by value
        (paint, explain), below = _on_line(values, grades), 0.5
    # nothing at -1
    paint, letters = np.vstack([paint, np.zeros(4)]), np.array([*written, ""])
    places = [_INTENDED] * has_aims + [*range(k)]

    def draw(axes: Axes) -> None:
        for block, left in ((codes, -0.5), (aims, _INTENDED - 0.5))[: 1 + has_aims]:
            flat, differs = block.reshape(n, -1), (block != aims) & (block >= 0)
            cells(
                *(axes, paint[flat], letters[flat]),
                framed=(differs & (aims >= 0)).reshape(n, -1),
                n_columns=block.shape[1],
                left=left,
                frame=VERMILLION if is_ordered else BLACK,  # which is no hue
            )
        axes.set(xlim=(places[0] - 0.5, k - 0.5), ylim=(n - 0.5, -0.5))
        name_rows(axes, items, height)
        name_columns(axes, ["intended"] * has_aims + [*raters], cell, places)
        explain(axes)

    high = 0.1 + room_of(raters) + height * n + below
    return Picture(room_of(items) + across, high, draw)


# -- what they share -------------------------------------------------------------------


def _on_line(
    values: Floats, grades: Sequence[str]
) -> tuple[Floats, Callable[[Axes], None]]:
    """Return colours of grades by value, (q, 4), and what draws the bar of them."""
    ends = [int(values.argmin()), int(values.argmax())]
    line = ScalarMappable(Normalize(*values[ends]), SEQUENTIAL)

    def explain(axes: Axes) -> None:
        bar = colour_bar(axes, line, "")
        bar.set_ticks(values[ends].tolist(), labels=[grades[end] for end in ends])

    return line.to_rgba(values), explain


def _grouped(
    freq: _Integers, grades: Sequence[str], is_ordered: bool
) -> tuple[NDArray[np.intp], list[str], list[str], Floats]:
    """Put grades together whose colours could not be told apart, being too many."""
    # freq (q,): how often each is met -> group of each, (q,); by group, what is written
    # in cells, what a legend says, and colours, (m, 4); numbers stand for long names
    q, n = len(grades), _MAX_SHADES if is_ordered else len(_HUES)
    group = np.arange(q) * min(q, n) // q
    if q > n and not is_ordered:
        usual = np.sort(np.argsort(-freq, kind="stable")[: n - 1])
        group[:] = n - 1
        group[usual] = range(n - 1)
    is_short, labels, texts = max(map(len, grades)) <= _MAX_LETTERS, [], []
    for place in range(min(q, n)):
        names = [grades[k] for k in np.flatnonzero(group == place).tolist()]
        if len(names) == 1:
            name = short_name(names[0], _MAX_LEGEND)
            labels.append(names[0] if is_short else f"{place + 1}")
            texts.append(name if is_short else f"{place + 1} = {name}")
        else:
            together = f"{names[0]} to {names[-1]}" if is_ordered else ""
            labels.append("")
            texts.append(together or f"other {len(names)} grades")
    shades = np.linspace(0.0, 1.0, len(texts))
    hues = SEQUENTIAL(shades) if is_ordered else _HUES[: len(texts)]
    return group, labels, texts, to_rgba_array(hues)


def _legend(
    texts: Sequence[str], colours: Floats, across: float
) -> tuple[float, Callable[[Axes], None]]:
    """Return the inches of what explains colours, and what draws it."""
    most = max(1, int(across / (0.45 + max(map(inches_of, texts)))))
    n_rows = -(-len(texts) // most)
    ncols = -(-len(texts) // n_rows)  # so that rows are about equal
    patches = [
        Patch(color=colour, label=text)
        for text, colour in zip(texts, colours, strict=True)
    ]
    # row by row, where a legend goes down its columns
    marks = [patch for place in range(ncols) for patch in patches[place::ncols]]
    explain = partial(
        legend_below,
        handles=marks,
        ncols=ncols,
        handlelength=1.2,
        handleheight=1.0,
        columnspacing=1.2,
    )
    return 0.05 + 0.175 * n_rows, explain
