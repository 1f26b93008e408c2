"""masrel.agree: any table in memory gives what the command gives of its file."""

import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import masrel
from masrel.agreement import declared_weights, fleiss_kappa
from masrel.errors import MasrelError
from masrel.ratings import read_ratings
from tests.cli.process import Caller
from tests.conftest import masrel as command

__all__ = ["command"]

WIDE = """patient,Kim,Lee,Ann
A,1,1,2
B,2,,2
C,1,1,1
D,3,3,3
E,2,3,2
F,1,2,1
G,3,3,3
H,2,2,1
"""
_NAMES, *_ROWS = [line.split(",") for line in WIDE.splitlines()]
LONG = "site,patient,rater,score\n" + "".join(
    f"{'NS'[row % 2]},{patient},{rater},{grade}\n"
    for row, (patient, *grades) in enumerate(_ROWS)
    for rater, grade in zip(_NAMES[1:], grades, strict=True)
)
COUNTS = "item,mild,severe\na,3,0\nb,1,2\nc,0,3\nd,2,1\ne,3,0\n"

# a file, options of the command, and arguments of the call
CASES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "wide": (WIDE, "", {}),
    "interval": (
        WIDE,
        "--target items --coefficients ICC(2,1),fleiss_kappa",
        {"target": "items", "coefficients": "ICC(2,1),fleiss_kappa"},
    ),
    "two raters": (
        WIDE,
        "--raters Kim,Ann --coefficients cohen_kappa",
        {"raters": ["Kim", "Ann"], "coefficients": ["cohen_kappa"]},
    ),
    "groups": (
        LONG,
        "--by site --weights linear --target items",
        {
            "target": "items",
            "reading": masrel.Reading(by="site"),
            "estimating": masrel.Estimating(weights="linear"),
        },
    ),
    "all": (
        LONG,
        "--ignore site --coefficients all",
        {"coefficients": "all", "reading": masrel.Reading(ignore="site")},
    ),
    "counts": (COUNTS, "--counts", {"reading": masrel.Reading(counts=True)}),
}


def columns(path: Path) -> dict[str, list[Any]]:
    frame = pd.read_csv(path)
    return frame.astype(object).where(frame.notna(), None).to_dict("list")


FORMS: dict[str, Callable[[Path], Any]] = {
    "path": lambda path: path,
    "text of a path": str,
    "pandas": pd.read_csv,
    "pandas, as text": lambda path: pd.read_csv(path, dtype=str),
    "pandas, types of Arrow": lambda path: pd.read_csv(path, dtype_backend="pyarrow"),
    "pandas, a part": lambda path: pd.concat([(f := pd.read_csv(path)), f])[len(f) :],
    "pandas, index": lambda path: pd.read_csv(path, index_col=0),
    "polars": pl.read_csv,
    "polars, lazy": pl.scan_csv,
    "Arrow": lambda path: pa.Table.from_pandas(pd.read_csv(path)),
    "DuckDB": lambda path: duckdb.sql(f"SELECT * FROM '{path}'"),
    "columns": columns,
}


def printed(document: dict[str, Any]) -> list[dict[str, Any]]:
    """The rows of a document of the command that a table of the call has."""
    of = ("coefficient", "value", "standard_error", "n_items", "n_raters")
    ends = ("low", "high", "method")
    return [
        {
            **({"site": row["site"]} if "site" in row else {}),
            **{name: row[name] for name in of},
            **{name: (row["interval"] or {}).get(name) for name in ends},
        }
        for row in document["estimates"]
    ]


def rows(table: pd.DataFrame) -> list[dict[Any, Any]]:
    return table.astype(object).where(table.notna(), None).to_dict("records")


@pytest.mark.parametrize(
    ("case", "form"),
    [*(("wide", form) for form in FORMS), *((case, "polars") for case in CASES)],
)
def test_every_form_gives_what_the_command_gives(
    command: Caller, tmp_path: Path, case: str, form: str
) -> None:
    text, options, arguments = CASES[case]
    path = tmp_path / "ratings.csv"
    path.write_text(text, encoding="utf-8")
    document = json.loads(command("agree", path, "--json", "-", *options.split()).out)
    result = masrel.agree(FORMS[form](path), **arguments)
    assert rows(result.table) == printed(document)
    assert result.file.read["grades"] == document["read"]["grades"]
    head = ["site"] if case == "groups" else []
    assert [*result.table] == [
        *(*head, "coefficient", "value", "standard_error", "low", "high", "method"),
        *("n_items", "n_raters"),
    ]


GRADES = [[1, 1, 2], [2, None, 2], [1, 1, 1], [3, 3, 3]]


@pytest.mark.parametrize(
    "data",
    [
        GRADES,
        tuple(map(tuple, GRADES)),
        np.array(GRADES, dtype=float),
        np.array(GRADES, dtype=object),
        np.ma.masked_invalid(np.array(GRADES, dtype=float)),
        pd.DataFrame(GRADES, index=list("ABCD"), columns=["1", "2", "3"]),
    ],
)
def test_rows_without_names_are_items_by_raters(data: Any) -> None:
    result = masrel.agree(data)
    value = result.table.set_index("coefficient").loc["fleiss_kappa", "value"]
    assert value == fleiss_kappa(GRADES).value
    assert result.file.parts[0].raters == ("1", "2", "3")


# ---- what is read of a frame ----

KIM_LEE = {"Kim": ["lo", "hi", "lo"], "Lee": ["lo", "mid", "mid"]}
ORDER = pd.CategoricalDtype(["lo", "mid", "hi", "top"], ordered=True)


@pytest.mark.parametrize(
    ("frame", "items"),
    [
        (pd.DataFrame(KIM_LEE, index=["x", "y", "z"]), ("x", "y", "z")),
        (pd.DataFrame(KIM_LEE, index=pd.Index([7, 8, 9], name="id")), ("7", "8", "9")),
        (
            pd.DataFrame(KIM_LEE, index=pd.MultiIndex.from_tuples(
                [("N", 1), ("N", 2), ("S", 1)], names=["site", "item"])),
            ("N 1", "N 2", "S 1"),
        ),
        (pd.DataFrame({"case": [5, 6, 7], **KIM_LEE}).iloc[::-1], ("7", "6", "5")),
        ({name: dict(enumerate(labels)) for name, labels in KIM_LEE.items()}, None),
    ],
)  # fmt: skip
def test_names_of_rows_are_items(frame: Any, items: tuple[str, ...] | None) -> None:
    if items is None:  # numbers of rows are no names
        with pytest.raises(MasrelError, match="--no-item"):
            masrel.agree(frame)
        return
    item = ["site", "item"] if items[0] == "N 1" else None
    assert masrel.agree(frame, item=item).file.parts[0].items == items


@pytest.mark.parametrize(
    "frame",
    [
        pd.DataFrame({"item": list("abc"), **KIM_LEE}).astype(
            {"Kim": ORDER, "Lee": ORDER}
        ),
        pl.DataFrame({"item": list("abc"), **KIM_LEE}).with_columns(
            pl.col("Kim", "Lee").cast(pl.Enum(ORDER.categories.tolist()))
        ),
        duckdb.sql(
            "SELECT i AS item, k::ENUM('lo', 'mid', 'hi', 'top') AS Kim, "
            "l::ENUM('lo', 'mid', 'hi', 'top') AS Lee FROM (VALUES ('a', 'lo', 'lo'), "
            "('b', 'hi', 'mid'), ('c', 'lo', 'mid')) AS t(i, k, l)"
        ),
        pd.DataFrame({"item": list("abc"), **KIM_LEE})
        .melt("item", var_name="rater", value_name="grade")
        .astype({"grade": ORDER}),
    ],
    ids=["pandas", "polars", "DuckDB", "long"],
)
def test_ordered_categories_are_the_scale(frame: Any, tmp_path: Path) -> None:
    linear = masrel.Estimating(weights="linear")
    result = masrel.agree(frame, coefficients="fleiss_kappa", estimating=linear)
    assert result.file.scale.grades == ("lo", "mid", "hi", "top")
    rows = list(zip(*KIM_LEE.values(), strict=True))
    ours = fleiss_kappa(rows, categories=["lo", "mid", "hi", "top"], weights="linear")
    assert result.estimates[0].value == ours.value
    if isinstance(frame, pd.DataFrame):
        frame.to_parquet(tmp_path / "o.parquet")
        file = read_ratings(tmp_path / "o.parquet")
        assert (file.scale, file.read["scale"]["declared"]) == (result.file.scale, True)


# ---- refusals ----

FRAME = pd.DataFrame(
    {"patient": list("ABCD"), "Kim": [1, 2, 1, 2], "Lee": [1, 2, 2, 2]}
)
ONE_WAY = {"item": "patient", "reading": masrel.Reading(item="patient")}


@pytest.mark.parametrize(
    ("data", "arguments", "why"),
    [
        ([[1, 2], [1]], {}, "rows of equal length"),
        ([1, 2, 1], {}, "the data: needed a path, a DataFrame"),
        ([], {}, "needed a path"),
        (np.zeros(3), {}, "needed a path"),
        (np.zeros((0, 2)), {}, "needed a path"),
        (pd.Series([1, 2]), {}, "got Series"),
        (pl.Series([1, 2]), {}, "got Series"),
        ({"Kim": [1], "Lee": [1, 2]}, {}, "got dict: All arrays must be"),
        ({"Kim": 1}, {}, "got dict"),
        (3, {}, "got int: 3"),
        (
            pa.table([[1], [2]], names=["Kim", "Kim"]),
            {},
            "Expected unique column names",
        ),
        (duckdb.sql("SELECT 1 AS Kim, 2 AS Kim"), {}, "Expected unique column names"),
        (
            pl.DataFrame({"Kim": [object()], "Lee": [1]}),
            {},
            "'Kim', value 1: .* object",
        ),
        (None, {}, "got NoneType"),
        (FRAME[:0], {}, "needed rows of ratings"),
        (FRAME.assign(Lee=[[1], [2], [1], [2]]), {}, "'Lee', value 1: needed text or"),
        (FRAME.drop(columns="patient"), {}, "--no-item"),
        (FRAME, {"raters": "Kim,Le"}, "did you mean 'Lee'"),
        (
            FRAME,
            {"reading": masrel.Reading(encoding="utf-8")},
            "needed a file, got a DataFrame",
        ),
        (FRAME, {"reading": masrel.Reading(stream=True)}, "needed a file"),
        (FRAME, ONE_WAY, "item: needed once"),
        (FRAME, {"reading": {"item": "patient"}}, r"needs masrel.Reading\(…\)"),
        (FRAME, {"estimating": masrel.Reading()}, r"needs masrel.Estimating\(…\)"),
        (FRAME, {"target": "item"}, "target: needs one of items, raters, both"),
        (FRAME, {"coefficients": "fleis_kappa"}, "did you mean"),
        (FRAME, {"estimating": masrel.Estimating(interval="boot")}, "interval: needs"),  # type: ignore[arg-type]
        (FRAME, {"estimating": masrel.Estimating(words="good")}, "words: needs one"),  # type: ignore[arg-type]
        (FRAME, {"estimating": masrel.Estimating(weights=np.eye(3))}, "needs 2 × 2"),
        (
            FRAME.replace({1: "x", 2: "y"}),
            {"estimating": masrel.Estimating(weights=np.eye(2))},
            "weights: a matrix: needs grades that are numbers or --categories",
        ),
    ],
)
def test_one_sentence(data: Any, arguments: dict[str, Any], why: str) -> None:
    with pytest.raises(MasrelError, match=why) as refused:
        masrel.agree(data, **arguments)
    assert "\n" not in str(refused.value)


def test_an_error_says_what_its_options_are_called_in_python() -> None:
    with pytest.raises(MasrelError) as refused:
        masrel.agree(FRAME.drop(columns="patient"))
    (note,) = refused.value.__notes__
    assert "--no-item is reading=Reading(no_item=True)" in note
    frame = FRAME.drop(columns="patient")
    assert masrel.agree(frame, reading=masrel.Reading(no_item=True)).file.read["raters"]


# ---- the result ----


def test_a_matrix_of_weights_is_in_the_order_of_the_scale(tmp_path: Path) -> None:
    matrix = [[1, 0.5, 0], [0.5, 1, 0.5], [0, 0.5, 1]]
    path = tmp_path / "w.csv"
    path.write_text("\n".join(",".join(map(str, row)) for row in matrix), "utf-8")
    data = pd.DataFrame(GRADES, index=list("ABCD"), columns=["Kim", "Lee", "Ann"])
    kappas = {
        masrel.agree(
            data, coefficients="fleiss_kappa", estimating=masrel.Estimating(weights=of)
        )
        .estimates[0]
        .value
        for of in (matrix, path, declared_weights(matrix, [1, 2, 3]), "linear")
    }
    assert kappas == {fleiss_kappa(GRADES, weights="linear").value}


def test_the_text_is_the_first_screen_of_the_command(
    command: Caller, tmp_path: Path
) -> None:
    path = tmp_path / "ratings.csv"
    path.write_text(WIDE, encoding="utf-8")
    shown = str(masrel.agree(path, target="items"))
    assert shown == command("agree", path, "--target", "items").out.rstrip("\n")
    sentence = command("agree", path, "--sentence").out.rstrip("\n")
    assert masrel.agree(path).sentence() == sentence


def test_html_has_the_table_and_no_markup_of_the_data() -> None:
    frame = FRAME.rename(columns={"Kim": "<b>Kim</b>"})
    html = masrel.agree(frame)._repr_html_()
    assert "&lt;b&gt;Kim&lt;/b&gt;" in html
    assert "<b>" not in html
    assert html.count("<tr>") == 3


def test_what_is_read_of_a_table_can_be_pickled() -> None:
    file = masrel.agree(FRAME).file
    assert pickle.loads(pickle.dumps(file)) == file
    assert file.sha256() == ""  # there are no bytes of a file
