"""Files of random tables give the table's own numbers, or say why they may not."""

import gzip
import io
import json
import lzma
import math
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from masrel.agreement import fleiss_kappa, percent_agreement
from masrel.errors import UndefinedStatisticWarning
from tests.cli.process import Caller

Table = list[list[str | None]]  # items by raters

GRADES = {
    "numbers": ("0", "1", "2", "3", "4", "5"),
    "halves": ("0", "0.5", "1", "1.5", "2"),
    "ordinal": ("absent", "mild", "moderate", "severe"),
    "nominal": ("tonic", "phasic", "no spasm", "à-coups"),
    "ashworth": ("0", "1", "1+", "2", "3", "4"),
}
RATERS = ("Kim", "Lee", "Ann", "Oh", "José")
METADATA = {
    "age": ("61", "47", "72", "58"),
    "sex": ("F", "M", "F", "F"),
    "hand": ("left", "right", "left", "left"),
    "comment": ("restless, tired", "", "x", "see 2"),
}
# How a delimiter, an encoding or a way to pack is named, and what it needs.
DELIMITERS = (",", ";", "\t", "|", " ")
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1")
ENDS = ("\n", "\r\n", "\r")
HEADS = ("", "# made by hand\n", "# 1\n\n# 2\n", "\n")
PACKS = ("", ".gz", ".xz", ".zip")


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenTable:
    """A table as a file."""

    table: Table
    data: bytes
    ending: str
    options: tuple[str, ...]  # what says how it is to be read
    # whether nothing in the file shows what is left out of the options
    needs_options: bool
    shape: str

    def __repr__(self) -> str:
        return (
            f"{self.shape}{self.ending} {' '.join(self.options)}\n"
            f"{self.data!r}\n{self.table}"
        )


@dataclass(slots=True, kw_only=True)
class Layout:
    """Rows of cells, and what says what they are."""

    rows: list[list[str]]
    options: list[str]
    needs_options: bool = False
    has_header: bool = True


@st.composite
def written_tables(draw: st.DrawFn) -> WrittenTable:
    """A table of ratings, and its file."""
    kind = draw(st.sampled_from(sorted(GRADES)))
    shape = draw(st.sampled_from(sorted(SHAPES)))
    table = draw(true_tables(kind, is_full=shape == "contingency"))
    options: list[str] = []
    cells = spelled(draw, table, kind, shape, options)
    layout = SHAPES[shape](draw, table, cells)
    data, ending = written(draw, layout, options)
    return WrittenTable(
        table=table,
        data=data,
        ending=ending,
        options=(*layout.options, *options),
        needs_options=layout.needs_options,
        shape=shape,
    )


@st.composite
def true_tables(draw: st.DrawFn, kind: str, *, is_full: bool) -> Table:
    n_raters = 2 if is_full else draw(st.integers(2, 5))
    grade = st.sampled_from(GRADES[kind])
    cell = grade if is_full else st.one_of(grade, grade, grade, grade, st.none())
    row = st.lists(cell, min_size=n_raters, max_size=n_raters)
    table: Table = draw(st.lists(row, min_size=2, max_size=7))
    first = table[0]
    first[0] = first[0] or GRADES[kind][0]  # there is one grade at least
    return table


def spelled(
    draw: st.DrawFn, table: Table, kind: str, shape: str, options: list[str]
) -> list[list[str]]:
    """The cells of a table: equal numbers written differently, codes for no grade."""
    if shape in ("counts", "contingency"):
        return []
    codes = ["", "NA"]
    code = draw(st.sampled_from(["", "", "-99", "x", ".", "n/a"]))
    are_numbers = kind in ("numbers", "halves")
    if code == "x" and not are_numbers:
        code = ""  # "x" may be a grade among others that are text
    if code and any(None in row for row in table):
        codes.append(code)
        options += ["--missing", code]
    comma = are_numbers and draw(st.integers(0, 5)) == 0
    if comma:
        options += ["--decimal", ","]

    def spell(grade: str | None) -> str:
        if grade is None:
            return draw(st.sampled_from(codes))
        if are_numbers:
            ways = [grade, grade, f"{grade}.0" if "." not in grade else f"{grade}0"]
            grade = draw(st.sampled_from([*ways, f"0{grade}", f"{grade}e0"]))
            grade = grade.replace(".", ",") if comma else grade
        return grade

    return [[spell(grade) for grade in row] for row in table]


def names(draw: st.DrawFn, n_raters: int) -> list[str]:
    return list(draw(st.permutations(RATERS)))[:n_raters]


def items(n: int) -> list[str]:
    return [f"P{k}" for k in range(1, n + 1)]


def wide(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    item = draw(st.sampled_from(["item", "patient", "Subject", "P", "", "#item"]))
    rows = [[item, *names(draw, len(table[0]))]]
    options = ["--raters", ",".join(rows[0][1:])]  # or some might be no raters
    rows += [[i, *row] for i, row in zip(items(len(table)), cells, strict=True)]
    return Layout(rows=rows, options=options)


def wide_without_item(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    rows = [names(draw, len(table[0])), *cells]
    options = ["--no-item", "--raters", ",".join(rows[0])]
    # names of items that differ from all grades cannot be told from grades
    return Layout(rows=rows, options=options, needs_options=True)


def wide_with_metadata(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    name = draw(st.sampled_from(sorted(METADATA)))
    place = draw(st.integers(1, len(table[0]) + 1))
    plain = wide(draw, table, cells).rows
    raters = plain[0][1:]
    rows = [
        [*row[:place], value, *row[place:]]
        for row, value in zip(plain, [name, *(METADATA[name] * 2)], strict=False)
    ]
    named = ["--raters", ",".join(raters)]
    options = draw(st.sampled_from([["--ignore", name, *named], named]))
    return Layout(rows=rows, options=list(options))


def row_names(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    layout = wide(draw, table, cells)
    layout.rows[0] = layout.rows[0][1:]  # as R's write.table
    return layout


def without_header(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    layout = wide(draw, table, cells)
    numbers = ",".join(map(str, range(2, len(layout.rows.pop(0)) + 1)))
    layout.options = ["--no-header", "--raters", numbers]
    layout.has_header = False
    return layout


def transposed(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    rows = [["rater", *items(len(table))]]
    columns = zip(*cells, strict=True)
    raters = names(draw, len(table[0]))
    rows += [[name, *of] for name, of in zip(raters, columns, strict=True)]
    options = ["--transpose", "--raters", ",".join(raters)]
    return Layout(rows=rows, options=options)


def long(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    raters = names(draw, len(table[0]))
    triples = [
        [item, rater, cell]
        for item, row in zip(items(len(table)), cells, strict=True)
        for rater, cell in zip(raters, row, strict=True)
    ]
    header, options = draw(
        st.sampled_from(
            [
                (["item", "rater", "grade"], []),
                (["Patient", "observer", "score"], []),
                (["Bild", "rater", "label"], []),
                (
                    ["what", "who", "value"],
                    ["--item", "what", "--rater", "who", "--grade", "value"],
                ),
            ]
        )
    )
    rows = [header, *draw(st.permutations(triples))]
    if draw(st.booleans()) and header[0] != "Bild":  # numbered, as by pandas
        rows = [["" if k == 0 else str(k), *row] for k, row in enumerate(rows)]
    return Layout(rows=rows, options=list(options))


def counts(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    del cells
    met = sorted({grade for row in table for grade in row if grade is not None})
    order = draw(st.permutations(met))
    rows = [["item", *order]]
    rows += [
        [item, *(str(row.count(grade)) for grade in order)]
        for item, row in zip(items(len(table)), table, strict=True)
    ]
    # a wide table may be the same where not all raters rated, or no count is 0
    are_plain = all(grade in row for row in table for grade in order)
    return Layout(
        rows=rows,
        options=["--counts", "--raters", ",".join(order)],
        needs_options=are_plain or any(None in row for row in table) or len(order) < 2,
    )


def contingency(draw: st.DrawFn, table: Table, cells: list[list[str]]) -> Layout:
    del cells
    met = sorted({str(grade) for row in table for grade in row})
    columns = draw(st.permutations(met))
    rows = [["", *columns]]
    rows += [
        [one, *(str(table.count([one, other])) for other in columns)]
        for one in draw(st.permutations(met))
    ]
    return Layout(rows=rows, options=["--table"], needs_options=len(met) < 2)


SHAPES: dict[str, Callable[[st.DrawFn, Table, list[list[str]]], Layout]] = {
    "wide": wide,
    "wide without item": wide_without_item,
    "wide with metadata": wide_with_metadata,
    "row names": row_names,
    "no header": without_header,
    "transposed": transposed,
    "long": long,
    "counts": counts,
    "contingency": contingency,
}


def written(draw: st.DrawFn, layout: Layout, options: list[str]) -> tuple[bytes, str]:
    """The bytes of a file, and the ending of its name."""
    delimiter = draw(st.sampled_from(DELIMITERS))
    end = draw(st.sampled_from(ENDS))
    quotes_all = draw(st.booleans())
    pad = draw(st.sampled_from(["", "", " "])) if delimiter in ",;|" else ""
    lines = [
        delimiter.join(
            quoted(pad + cell if k else cell, delimiter, is_always=quotes_all)
            for k, cell in enumerate(row)
        )
        for row in layout.rows
    ]
    head = draw(st.sampled_from([*HEADS, f"sep={delimiter}\n"]))
    blank = draw(st.integers(0, 9))
    # a lone cell below an empty line, at the end, is a note
    if blank < len(lines) - 2 * (sum(map(bool, layout.rows[-1])) == 1):
        lines.insert(blank + 1, "")
    if layout.has_header:  # a line may be one of names, or a title
        options += ["--header", str(head.count("\n") + 1)]
    text = "\n".join(lines) + draw(st.sampled_from(["\n", "", "\n\n"]))
    text = (head + text).replace("\n", end)
    encoding = draw(st.sampled_from(ENCODINGS))
    if encoding == "latin-1":
        options += ["--encoding", "latin-1"]
    # decimal commas between blanks may be columns
    is_ambiguous = delimiter == " " and "--decimal" in options
    if is_ambiguous or draw(st.integers(0, 3)) == 0:
        options += [
            "--delimiter",
            {" ": "blanks", "\t": "tab"}.get(delimiter, delimiter),
        ]
    return packed(text.encode(encoding), draw(st.sampled_from(PACKS)))


def quoted(cell: str, delimiter: str, *, is_always: bool) -> str:
    needs = delimiter in cell or (delimiter == " " and not cell) or cell.startswith("#")
    # "#item" in quotes is a name and no comment
    return f'"{cell}"' if is_always or needs else cell


def packed(data: bytes, pack: str) -> tuple[bytes, str]:
    if pack == ".gz":
        return gzip.compress(data, 1), ".csv.gz"
    if pack == ".xz":
        return lzma.compress(data, preset=0), ".csv.xz"
    if pack == ".zip":
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as members:
            members.writestr("ratings.csv", data)
        return archive.getvalue(), ".zip"
    return data, ".csv"


QUICK = settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
ALL = settings(QUICK, max_examples=1000)


def true_values(table: Table) -> dict[str, float | None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        estimates = (percent_agreement(table), fleiss_kappa(table))
    return {
        estimate.coefficient: None if math.isnan(estimate.value) else estimate.value
        for estimate in estimates
    }


def check(written: WrittenTable, folder: Path, masrel: Caller) -> None:
    file = folder / f"ratings{written.ending}"
    file.write_bytes(written.data)
    expected = true_values(written.table)
    for options in (written.options, ()):
        done = masrel("agree", file, *options, "--json", "-")
        assert done.code in (0, 2), done
        if done.code == 2:
            assert not done.out
            assert len(done.err.splitlines()) == 1, done
            assert not options, done  # with all that says what it is, it is read
            continue
        estimates = json.loads(done.out)["estimates"]
        values = {e["coefficient"]: e["value"] for e in estimates}
        if options or not (written.needs_options or "warning:" in done.err):
            assert values == pytest.approx(expected, abs=1e-14), done


@given(written=written_tables())
@QUICK
def test_some_files(written: WrittenTable, tmp_path: Path, masrel: Caller) -> None:
    check(written, tmp_path, masrel)


@pytest.mark.long
@given(written=written_tables())
@ALL
def test_a_thousand_files(
    written: WrittenTable, tmp_path: Path, masrel: Caller
) -> None:
    check(written, tmp_path, masrel)
