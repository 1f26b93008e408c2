"""What a stream of ratings holds: its distinct rows on a scale, and doubts of them."""

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._doubts import doubt_columns, doubt_names
from masrel.ratings._grade_texts import GradeOptions, Grades, read_grades
from masrel.ratings._large_files import LargeFile
from masrel.ratings._layout import Layout
from masrel.ratings._parts import Contents, patterns_part
from masrel.ratings._stream_codes import merged_rows
from masrel.ratings._streams import Progress, Streamed, stream_long, stream_wide


def stream_contents(
    large: LargeFile, layout: Layout, options: GradeOptions, progress: Progress
) -> Contents:
    """Read a long or a wide table batch by batch."""
    read = stream_long if layout.kind == "long" else stream_wide
    ratings = read(large, layout, progress)
    codes, grades = _graded(large, ratings, options)
    rows, freq = merged_rows(codes, ratings.freq)
    doubts = [*ratings.doubts, *doubt_names("raters", ratings.raters)]
    if layout.kind == "wide":
        doubts = [*_doubts_of_rows(large, layout, ratings, grades, rows, freq), *doubts]
    doubts.append(
        "read as a stream: names of items that differ by spelling alone, or sum up "
        "others, are not looked for"
    )
    of_grades = _freq_of_codes(rows, freq, len(grades.scale.grades))
    n_cells = int(ratings.freq @ (ratings.rows >= 0).sum(axis=1))
    return Contents(
        parts=[patterns_part(rows, freq, ratings.raters, grades.scale)],
        grades=grades,
        scale=grades.scale,
        freq=of_grades,
        raters=ratings.raters,
        n_items=ratings.n_items,
        n_raters=len(ratings.raters),
        n_missing=n_cells - int(of_grades.sum()),
        doubts=doubts,
        facts={"dropped": {"blank": ratings.n_blank} if ratings.n_blank else {}},
        is_simulated=ratings.is_simulated,
    )


def _freq_of_codes(
    rows: NDArray[np.int8], freq: NDArray[np.int64], n_codes: int
) -> NDArray[np.int64]:
    # rows (n_distinct, n_raters), freq (n_distinct,): how often each -> (n_codes,)
    each = [int(freq @ (rows == code).sum(axis=1)) for code in range(n_codes)]
    return np.array(each, dtype=np.int64)


def _graded(
    large: LargeFile, ratings: Streamed, options: GradeOptions
) -> tuple[NDArray[np.int8], Grades]:
    # the rows on the scale, (n_distinct, n_raters)
    sheet = large.sheet
    freq = _freq_of_codes(ratings.rows, ratings.freq, len(ratings.texts))

    def where(text: int) -> str:
        row, column = ratings.places[text]
        return f"{large.where(row)}, column {sheet.header[column]!r}"

    try:
        grades = read_grades(ratings.texts, freq, options, where)
    except RatingsError as error:
        raise sheet.error(str(error)) from None
    codes = np.append(grades.codes, -1).astype(np.int8)
    return codes[ratings.rows], grades


def _doubts_of_rows(
    large: LargeFile,
    layout: Layout,
    ratings: Streamed,
    grades: Grades,
    rows: NDArray[np.int8],
    freq: NDArray[np.int64],
) -> list[str]:
    # of a wide table whose rows are counted: its first row, and the others
    first = np.append(grades.codes, -1)[ratings.first]
    others = freq - (rows == first).all(axis=1)
    codes = np.concatenate([first[None, :], rows[others > 0]]).astype(np.int64)
    weights = np.append(1, others[others > 0])
    doubts = doubt_columns(large.sheet, layout, codes, grades.scale, weights)
    unrated = (rows < 0).all(axis=0)
    doubts += [
        f"{ratings.raters[k]!r} has no grade" for k in np.flatnonzero(unrated)[:6]
    ]
    return doubts
