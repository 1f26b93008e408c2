"""What in a table looks as if it were something else: refused, or warned of by name."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from masrel.ratings._grades import alike_texts, is_number
from masrel.ratings._layout import Layout
from masrel.ratings._sheets import Sheet
from masrel.scales import Scale

# Names of columns that are seldom those of raters.
_NO_RATER = re.compile(
    r"(age|sex|gender|comments?|notes?|remarks?|mean|average|avg|median|sd|total|sum|"
    r"id|index|date|day|time|timestamp|duration|lead_time|gold|truth|ground_truth|"
    r"reference|consensus|majority|adjudicated|weight|height|bmi|group|site|cent(er|re)|"
    r"diagnosis|side|text|email|n|count|unnamed: \d+)",
    re.IGNORECASE,
)
# Parts of names of columns that name items.
_ITEM_NAME = re.compile(
    r"|#|no\.?|nr\.?|.*(id|item|subject|patient|person|case|row|index|unit|record|"
    r"target|stimulus|image|document|sample|name|file|model|video|task).*",
    re.IGNORECASE,
)
_MAX_COMPARED = 2000  # columns that are compared with all others
_SHOWN = 6


def without_second_header(sheet: Sheet) -> tuple[Sheet, list[str]]:
    """Leave Qualtrics' lines of questions and import ids out, and say so."""
    from dataclasses import replace

    for row in range(min(2, len(sheet.cells))):
        cells = sheet.cells.iloc[row].tolist()
        if all('"ImportId"' in cell for cell in cells if cell):
            kept = sheet.cells.iloc[row + 1 :]
            text = (
                f"{sheet.where(0)} to {sheet.where(row)} are questions and import ids "
                "of Qualtrics, no ratings: left out"
            )
            dropped = {**sheet.dropped, "second header": row + 1}
            return replace(sheet, cells=kept, dropped=dropped), [text]
    return sheet, []


def doubt_columns(
    sheet: Sheet, layout: Layout, codes: NDArray[np.int64], scale: Scale
) -> list[str]:
    """Refuse or warn of columns of a wide table that are no raters."""
    # codes (n_items, n_raters): places in the scale, -1 where missing
    names = [sheet.header[place] for place in layout.raters]
    _refuse_contingency(sheet, layout, names)
    warnings = _first_column(sheet, layout, scale)
    odd = _unlike(codes, scale) if len(names) <= _MAX_COMPARED else set()
    named = {k for k, name in enumerate(names) if _NO_RATER.fullmatch(name)}
    nonsense = sorted(odd & named)
    if nonsense and len(names) > 1:
        doubtful = sorted(odd | named) if len(odd) < len(names) else nonsense
        listed = [names[k] for k in doubtful]
        raise sheet.error(
            f"{', '.join(map(repr, listed))}: no grade in common with the other "
            "columns, or the name of something else: --ignore "
            f"{_option(listed)} leaves such columns aside, --raters names those that "
            "rate"
        )
    warnings += [
        f"column {names[k]!r} counts as a rater; if it is none, --ignore "
        f"{_option([names[k]])}"
        for k in sorted(named)
    ]
    alone = [names[k] for k in sorted(odd - named)][:_SHOWN]
    if alone and len(names) > 1:
        warnings.append(
            f"no grade in common with the other columns: {', '.join(map(repr, alone))}"
            f"; if it is no rater, --ignore {_option(alone)}"
        )
    return [*warnings, *_looks_counted(codes, scale), *_second_header(sheet, codes)]


def _option(names: Sequence[str]) -> str:
    import shlex

    return shlex.quote(",".join(names))


def _refuse_contingency(sheet: Sheet, layout: Layout, names: Sequence[str]) -> None:
    if len(layout.item) != 1 or len(names) != len(sheet.cells) or len(names) < 2:
        return
    rows = [str(cell).strip() for cell in sheet.column(layout.item[0])]
    if set(rows) == set(names):
        raise sheet.error(
            "rows and columns have the same names, so that this looks like a "
            "contingency table of two raters: --table reads it as one"
        )


def _first_column(sheet: Sheet, layout: Layout, scale: Scale) -> list[str]:
    # The first column is the item because nothing else was: it may be a rater.
    if not layout.is_item_guessed:
        return []
    place = layout.item[0]
    name = sheet.header[place]
    cells = [str(cell).strip() for cell in sheet.column(place)]
    distinct = set(cells)
    numbers = {float(g) for g in scale.grades if is_number(g)}
    in_scale = all(
        c in scale.grades or (is_number(c) and float(c) in numbers) for c in distinct
    )
    if not in_scale:
        return []
    choices = (
        f"--no-item if it is a rater, --item {_option([name])} if it names the items"
    )
    if len(distinct) < len(cells):
        raise sheet.error(
            f"{sheet.line_of(0)}: the first column, {name!r}, holds grades like the "
            f"others: {choices}"
        )
    if _ITEM_NAME.fullmatch(name):
        return []
    return [f"the first column, {name!r}, is taken for the names of items: {choices}"]


def _unlike(codes: NDArray[np.int64], scale: Scale) -> set[int]:
    # columns without a grade, or a value, in common with any other
    n_columns = codes.shape[1]
    rated = [np.unique(column[column >= 0]) for column in codes.T]
    if all(map(is_number, scale.grades)):
        ends = [(c[0], c[-1]) if len(c) else None for c in rated]
        values = [
            None if e is None else (scale.values[e[0]], scale.values[e[1]])
            for e in ends
        ]
        return {
            k
            for k, mine in enumerate(values)
            if mine is not None
            and any(other is not None for j, other in enumerate(values) if j != k)
            and not any(
                other is not None and mine[0] <= other[1] and other[0] <= mine[1]
                for j, other in enumerate(values)
                if j != k
            )
        }
    n_columns_of = np.bincount(
        np.concatenate(rated) if n_columns else [], minlength=len(scale.grades)
    )
    return {
        k
        for k, mine in enumerate(rated)
        if len(mine) and (n_columns_of[mine] == 1).all()
    }


def _looks_counted(codes: NDArray[np.int64], scale: Scale) -> list[str]:
    # whole numbers whose sum is the same in every row, 0 among them
    if not all(map(is_number, scale.grades)) or len(codes) < 3 or codes.shape[1] < 2:
        return []
    values = np.array(scale.values)
    if (codes < 0).any() or (values < 0).any() or (values % 1 != 0).any():
        return []
    sums = values[codes].sum(axis=1)
    if sums[0] < 2 or (sums != sums[0]).any() or 0 not in values:
        return []
    return [
        f"every row sums to {sums[0]:g}, so that this may be a table of counts, items "
        "by categories: --counts reads it as one"
    ]


def _second_header(sheet: Sheet, codes: NDArray[np.int64]) -> list[str]:
    # a first row whose grades occur nowhere else, while those of the others do
    if len(codes) < 4 or not sheet.has_header or (codes[0] < 0).all():
        return []
    first, rest = np.unique(codes[0][codes[0] >= 0]), codes[1:]
    if np.isin(first, rest).any() or len(np.unique(rest)) > rest.size / 2:
        return []
    return [
        f"{sheet.where(0)} holds grades that occur nowhere else: if it is a second "
        "line of names, delete it"
    ]


def doubt_long(
    sheet: Sheet, layout: Layout, items: NDArray[np.int64], raters: NDArray[np.int64]
) -> list[str]:
    """Warn of a long table whose items are numbers of rows, or of a second header."""
    warnings = []
    if len(items) > 2 and items.max(initial=0) + 1 == len(items):
        names = ", ".join(repr(sheet.header[place]) for place in layout.item)
        warnings.append(
            f"no item was rated twice: {names} may number the rows, --item names the "
            "column of the items"
        )
    is_first_alone = len(items) > 4 and not (
        (items[1:] == items[0]).any() or (raters[1:] == raters[0]).any()
    )
    if is_first_alone and sheet.has_header:
        warnings.append(
            f"{sheet.where(0)} names a rater and an item that occur nowhere else: if "
            "it is a second line of names, delete it"
        )
    return warnings


def doubt_names(kind: str, names: Sequence[str]) -> list[str]:
    """Warn of names that differ by spelling alone."""
    return [
        f"{kind} that differ by spelling alone are counted as different: "
        + ", ".join(map(repr, group))
        for group in alike_texts(names)[:_SHOWN]
    ]
