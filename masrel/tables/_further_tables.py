"""What a file of ratings says beyond its agreement: test and retest, each category.

In: a `RatingsFile` and how every estimate is made. Out: a table, and the same as
plain values for JSON.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from masrel.analysis._file_estimates import (
    AgreementRow,
    EstimateOptions,
    category_rows,
)
from masrel.analysis._file_parts import part_names
from masrel.analysis._file_retest import Retest, retests
from masrel.plots._drawn_values import Content
from masrel.ratings import RatingsFile, RatingsPart
from masrel.tables._agreement_table import (
    agreement_table,
    estimate_documents,
    group_key,
)
from masrel.tables._tables import Column, Table, capital


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherTable:
    """A table below that of agreement, and the same for JSON."""

    key: str  # what it is called in the JSON
    table: Table
    documents: list[dict[str, object]]
    rows: tuple[AgreementRow, ...] = ()  # the estimates in it, for a figure
    figure: Content | None = None  # what takes the place of that figure


def data_of(file: RatingsFile) -> str:
    """Return where the ratings of a file come from, as tables have it."""
    return "simulated" if file.simulated else "foreign"


def finite(value: object) -> object:
    """Return a value as JSON has it: ``nan`` and infinities as None."""
    is_lost = isinstance(value, float) and not math.isfinite(value)
    return None if is_lost else value


def part_keys(file: RatingsFile, part: RatingsPart) -> dict[str, object]:
    """Return the same for JSON."""
    return {group_key(name): text for name, text in part_names(file, part).items()}


def name_columns(file: RatingsFile) -> list[Column]:
    """Return the columns that tell parts from each other."""
    return [
        Column(key=group_key(name), heading=capital(name), align="left")
        for name in part_names(file, file.parts[0])
    ]


def retest_table(
    file: RatingsFile, options: EstimateOptions, *, explain: bool
) -> FurtherTable:
    """Return how well raters agree with themselves, each and all together."""
    by = None if file.read["by"] is None else str(file.read["by"])
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    of_groups = retests(file, options)
    for retest in of_groups:
        rows += retest.rows
        keys = {} if by is None else {group_key(by): retest.group}
        n_of_all = len(retest.rows) - len(retest.raters)
        raters: list[str | None] = [*retest.raters, *[None] * n_of_all]
        estimates = estimate_documents(retest.rows, bands=options.words)
        documents += [
            {**keys, "rater": rater, **document}
            for rater, document in zip(raters, estimates, strict=True)
        ]
    table = agreement_table(
        rows,
        caption="Agreement of raters with themselves",
        by="rater" if by is None else f"{by}, rater",
        notes=_retest_notes(of_groups),
        explain=explain,
        bands=options.words,
        data=data_of(file),
    )
    return FurtherTable(
        key="retest",
        table=replace(table, name="retest"),
        documents=documents,
        rows=tuple(rows),
    )


def _retest_notes(retests: Sequence[Retest]) -> tuple[str, ...]:
    # which sessions these are, and who and what is of one of them only
    sessions: list[str] = []
    left_out: list[str] = []
    are_alike = len({retest.sessions for retest in retests}) == 1
    for retest in retests:
        of_group = "" if retest.group is None else f"{retest.group}: "
        first, second = retest.sessions
        text = f"Each rater's grades of {first} and of {second}."
        sessions.append(text if are_alike else f"{of_group}{text}")
        if retest.left_out:
            left_out.append(f"{of_group}Left out: {'; '.join(retest.left_out)}.")
    return (*dict.fromkeys(sessions), *left_out)


def category_table(
    file: RatingsFile, options: EstimateOptions, *, explain: bool
) -> FurtherTable:
    """Return how well raters tell each category from all others."""
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    for part in file.parts:
        names = part_names(file, part).values()
        of_part = category_rows(part, names, file.scale, options)
        rows += of_part
        of_grades = estimate_documents(of_part, bands=options.words)
        documents += [
            {**part_keys(file, part), "category": grade, **document}
            for grade, document in zip(file.scale.grades, of_grades, strict=True)
        ]
    table = agreement_table(
        rows,
        caption="Agreement on each category against all others",
        by=", ".join([*part_names(file, file.parts[0]), "category"]),
        explain=explain,
        bands=options.words,
        data=data_of(file),
    )
    return FurtherTable(
        key="categories",
        table=replace(table, name="categories"),
        documents=documents,
        rows=tuple(rows),
    )
