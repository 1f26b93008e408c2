"""What the contingency table of two raters says: tests of symmetry, and indices.

In: a `RatingsFile`. Out: a table, and the same as plain values for JSON.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict

from masrel.agreement import Significance
from masrel.analysis._file_parts import label, part_names
from masrel.analysis._file_two_raters import symmetry_tests, table_indices
from masrel.ratings import RatingsFile
from masrel.tables._further_tables import (
    FurtherTable,
    data_of,
    finite,
    name_columns,
    part_keys,
)
from masrel.tables._tables import Column, Table, Value, p_text

_TESTS: dict[str, str] = {
    "mcnemar, exact": "McNemar, exact",
    "mcnemar, corrected": "McNemar, corrected",
    "bowker": "Bowker",
    "stuart_maxwell": "Stuart-Maxwell",
    "bhapkar": "Bhapkar",
}

_TEST_COLUMNS = (
    Column(key="test", heading="Test", align="left"),
    Column(key="statistic", heading="Statistic", digits=3),
    Column(key="distribution", heading="Distribution", align="left"),
    Column(key="df", heading="df"),
    Column(key="p", heading="p", where="page"),
    Column(key="p_value", heading="p", where="csv"),
    Column(key="n_items", heading="Items"),
)

_INDEX_COLUMNS = (
    Column(key="index", heading="Index", align="left"),
    Column(key="value", heading="Value", digits=3),
    Column(key="standard_error", heading="SE", digits=3),
)

_INDEX_NOTES = (
    "PABAK: 2 p_o − 1, which is Brennan-Prediger's coefficient of two categories; "
    "SE: delta method, items as the sample.",
    "Agreement on a category: of the ratings in it, the part that met the same of the "
    "other rater; of two categories negative and positive agreement.",
    "Largest κ: what the margins of the raters allow.",
)

_INFINITE = "infinite: all items changed, and one way"


def symmetry_table(file: RatingsFile) -> FurtherTable:
    """Return whether changes between categories go both ways alike often."""
    cells: list[tuple[Value, ...]] = []
    documents: list[dict[str, object]] = []
    notes: dict[str, None] = {}
    for part in file.parts:
        for name, result in symmetry_tests(file, part).items():
            names, title = part_names(file, part).values(), _TESTS[name]
            cells.append((*names, *_test_cells(title, result)))
            keys, note = part_keys(file, part), _why(result)
            documents.append(_test_document(keys, name, result, note))
            size = "; df: the items that changed" * (result.distribution == "binomial")
            notes[f"{title}: whether {result.hypothesis}{size}."] = None
            if note is not None:
                notes[f"{label([*names, title])}: {note}."] = None
    return FurtherTable(
        key="symmetry",
        table=_table(
            file,
            "symmetry",
            "Do the changes from one rater to the other balance?",
            _TEST_COLUMNS,
            cells,
            tuple(notes),
        ),
        documents=documents,
    )


def _test_cells(title: str, result: Significance) -> tuple[Value, ...]:
    (df,) = result.df
    return (
        title,
        result.statistic,
        result.distribution,
        int(df),
        p_text(result.p_value),
        result.p_value,
        result.n_items,
    )


def _why(result: Significance) -> str | None:
    # why a number of a test is none
    if result.reason is not None:
        return f"undefined: {result.reason}"
    return _INFINITE if math.isinf(result.statistic) else None


def _test_document(
    keys: dict[str, object], name: str, result: Significance, note: str | None
) -> dict[str, object]:
    test, _, kind = name.partition(", ")
    fields = {
        key: finite(value)
        for key, value in asdict(result).items()
        if key not in ("name", "df")
    }
    return {
        **keys,
        "test": test,
        "kind": kind or None,
        **fields,
        "df": list(result.df),
        "reason": result.reason or note,
    }


def index_table(file: RatingsFile) -> FurtherTable:
    """Return what the margins of two raters and two categories do to kappa."""
    cells: list[tuple[Value, ...]] = []
    documents: list[dict[str, object]] = []
    notes = list(_INDEX_NOTES)
    for part in file.parts:
        names = part_names(file, part).values()
        for index in table_indices(file, part):
            error = index.standard_error
            cells.append((*names, index.title, index.value, error))
            fields = {key: finite(value) for key, value in asdict(index).items()}
            documents.append({**part_keys(file, part), **fields})
            if index.reason is not None:
                notes.append(f"{label([*names, index.title])}: {index.reason}.")
    caption = "Prevalence, bias and agreement on each category"
    return FurtherTable(
        key="indices",
        table=_table(file, "indices", caption, _INDEX_COLUMNS, cells, tuple(notes)),
        documents=documents,
    )


def _table(
    file: RatingsFile,
    name: str,
    caption: str,
    columns: Sequence[Column],
    cells: list[tuple[Value, ...]],
    notes: tuple[str, ...],
) -> Table:
    return Table(
        name=name,
        caption=caption,
        columns=(*name_columns(file), *columns),
        rows=tuple(cells),
        notes=notes,
        data=data_of(file),
    )
