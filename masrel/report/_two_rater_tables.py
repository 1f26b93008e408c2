"""What the contingency table of two raters says: tests of symmetry, and indices.

In: a `RatingsFile`. Out: a table, and the same as plain values for JSON.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import (
    Significance,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    contingency_table,
    kappa_max,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.errors import RatingsError, UndefinedStatisticWarning
from masrel.ratings import RatingsFile, RatingsPart
from masrel.report._agreement_table import group_key
from masrel.report._further_tables import (
    FurtherTable,
    coded_part,
    data_of,
    finite,
    label,
    named,
    part_keys,
    part_names,
)
from masrel.report._tables import Column, Table, Value, p_text

_T = TypeVar("_T")

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
        table = _two_raters(file, part, "--symmetry")
        for name, result in _symmetry(table).items():
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


def _symmetry(table: NDArray[np.int64]) -> dict[str, Significance]:
    tests: dict[str, Significance] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # the results say it
        if len(table) == 2:
            tests["mcnemar, exact"] = mcnemar(table)
            tests["mcnemar, corrected"] = mcnemar(table, kind="corrected")
        tests["bowker"] = bowker(table)
        tests["stuart_maxwell"] = stuart_maxwell(table)
        tests["bhapkar"] = bhapkar(table)
    return tests


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
        for index in _indices(file, part):
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Index:
    """A number that describes the table of two raters."""

    index: str  # name of it in the JSON
    title: str
    category: str | None = None  # of which, if it is of one
    value: float
    standard_error: float | None = None  # None where it has none
    n_items: int
    reason: str | None  # why it is undefined, or None


def _indices(file: RatingsFile, part: RatingsPart) -> list[_Index]:
    table, grades = _two_raters(file, part, "--indices"), file.scale.grades
    if len(grades) != 2:
        raise RatingsError(
            f"--indices: needs a scale of two categories, got {len(grades)} "
            f"({named(grades)})"
        )
    n_items = int(table.sum())
    estimate, why = _with_reason(lambda: brennan_prediger(part.counted))
    pabak = _Index(
        index="pabak",
        title="PABAK",
        value=estimate.value,
        standard_error=estimate.standard_error,
        n_items=n_items,
        reason=why,
    )
    of_table: list[_Index] = []
    for name, title, function in (
        ("prevalence_index", "Prevalence index", prevalence_index),
        ("bias_index", "Bias index", bias_index),
        ("kappa_max", "Largest κ", kappa_max),
    ):
        value, why = _with_reason(partial(function, table))
        of_table.append(
            _Index(index=name, title=title, value=value, n_items=n_items, reason=why)
        )
    shares, why = _with_reason(lambda: specific_agreement(table))
    return [
        pabak,
        *of_table,
        *(
            _Index(
                index="specific_agreement",
                title=f"Agreement on {grade}",
                category=grade,
                value=share,
                n_items=n_items,
                reason=why if math.isnan(share) else None,
            )
            for grade, share in zip(grades, shares, strict=True)
        ),
    ]


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UndefinedStatisticWarning)
        value = call()
    return value, str(caught[0].message) if caught else None


def _two_raters(file: RatingsFile, part: RatingsPart, option: str) -> NDArray[np.int64]:
    """Return the contingency table of a part, of which there must be two raters."""
    coded = coded_part(part, option)
    if coded.codes.shape[1] != 2:
        of_part = "".join(f"{name}: " for name in part_names(file, part).values())
        raise RatingsError(
            f"{option}: {of_part}needs two raters, got {len(part.raters)} "
            f"({named(part.raters)})"
        )
    return contingency_table(coded)


def _table(
    file: RatingsFile,
    name: str,
    caption: str,
    columns: Sequence[Column],
    cells: list[tuple[Value, ...]],
    notes: tuple[str, ...],
) -> Table:
    names = [
        Column(key=group_key(name), heading=name[:1].upper() + name[1:], align="left")
        for name in part_names(file, file.parts[0])
    ]
    return Table(
        name=name,
        caption=caption,
        columns=(*names, *columns),
        rows=tuple(cells),
        notes=notes,
        data=data_of(file),
    )
