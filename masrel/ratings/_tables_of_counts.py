"""Tables of counts, items by categories, and contingency tables of two raters."""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._rows import count_items, count_table
from masrel.errors import ParameterError
from masrel.ratings._doubts import doubt_counts, doubt_names
from masrel.ratings._grade_texts import GradeOptions, Grades, coded_texts, is_number
from masrel.ratings._layout import Layout
from masrel.ratings._parts import Contents, RatingsPart, part_codes
from masrel.ratings._text_cells import Sheet
from masrel.scales import Scale


def counts_contents(sheet: Sheet, layout: Layout, options: GradeOptions) -> Contents:
    """Read a table of counts, or a contingency table."""
    names = [sheet.header[place] for place in layout.raters]
    table = _whole_numbers(sheet, layout, options)
    doubts = doubt_counts(sheet, layout, table)
    order = _order_of(sheet, names, options)
    scale = Scale(
        name="observed" if options.categories is None else "declared",
        grades=tuple(names[k] for k in order),
    )
    part_of, parts_named = part_codes(sheet, layout, np.arange(len(table)))
    doubts += doubt_names("groups", sorted({group or "" for group, _ in parts_named}))
    if layout.kind == "table":
        rows = _table_rows(sheet, layout, names)
        table = table[np.ix_([rows.index(names[k]) for k in order], order)]
        parts, n_items, n_raters = [_table_part(table, scale)], int(table.sum()), 2
        freq = table.sum(axis=0) + table.sum(axis=1)
    else:
        table = table[:, order]
        of_item, freq = table.sum(axis=1), table.sum(axis=0)
        n_items, n_raters = int((of_item > 0).sum()), int(of_item.max(initial=0))
        parts = [
            _counts_part(table[part_of == k], scale, name)
            for k, name in enumerate(parts_named)
        ]
    return Contents(
        parts=parts,
        grades=Grades(scale=scale, codes=np.arange(len(names))),
        scale=scale,
        freq=freq,
        raters=[],
        n_items=n_items,
        n_raters=n_raters,
        n_missing=None,
        doubts=doubts,
    )


def _whole_numbers(
    sheet: Sheet, layout: Layout, options: GradeOptions
) -> NDArray[np.int64]:
    # -> (n_rows, n_categories)
    if options.missing_codes:
        raise ParameterError(
            f"--missing: names grades that are missing, and cells of --{layout.kind} "
            f"are numbers of ratings; got {', '.join(options.missing_codes)}"
        )
    cells = sheet.cells[:, list(layout.raters)]
    codes, texts = coded_texts(cells.ravel())
    values = []
    for code, text in enumerate(texts):
        number = float(text) if is_number(text) else -1.0
        if text and not (number >= 0 and number.is_integer() and number < 2**53):
            row = int(np.argmax(codes == code)) // cells.shape[1]
            raise sheet.error(
                f"{sheet.where(row)}: --{layout.kind} needs whole numbers from 0, got "
                f"{text!r}"
            )
        values.append(int(number) if text else 0)
    if not any(values):
        raise sheet.error(f"--{layout.kind}: needed at least one rating, got none")
    return np.array(values, dtype=np.int64)[codes].reshape(cells.shape)


def _order_of(sheet: Sheet, names: list[str], options: GradeOptions) -> list[int]:
    # places of the categories in the order of the scale
    if options.categories is not None:
        if set(options.categories) != set(names):
            raise sheet.error(
                f"--categories: needed those of the columns, {', '.join(names)}, in "
                f"order, got {', '.join(options.categories)}"
            )
        return [names.index(category) for category in options.categories]
    if all(map(is_number, names)):
        return sorted(range(len(names)), key=lambda k: float(names[k]))
    return list(range(len(names)))


def _table_rows(sheet: Sheet, layout: Layout, names: list[str]) -> list[str]:
    # the categories of the rows of a contingency table
    if len(sheet.cells) != len(names):
        raise sheet.error(
            f"--table: needed as many rows as categories, {len(names)}, got "
            f"{len(sheet.cells)}; --no-item if no column names the rows"
        )
    if not layout.item:
        return names
    rows = [str(cell).strip() for cell in sheet.column(layout.item[0])]
    if set(rows) != set(names):
        raise sheet.error(
            f"--table: needed rows and columns of the same categories, got "
            f"{', '.join(map(repr, rows))} and {', '.join(map(repr, names))}"
        )
    return rows


def _table_part(table: NDArray[np.int64], scale: Scale) -> RatingsPart:
    ratings = count_table(table, categories=scale.values)
    return RatingsPart(
        group=None, session=None, items=(), raters=("rows", "columns"), ratings=ratings
    )


def _counts_part(
    table: NDArray[np.int64], scale: Scale, name: tuple[str | None, str | None]
) -> RatingsPart:
    ratings = count_items(table, categories=scale.values)
    return RatingsPart(
        group=name[0], session=name[1], items=(), raters=(), ratings=ratings
    )
