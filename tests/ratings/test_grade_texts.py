"""Units, marks of thousands and decimals, and sets of labels in cells of text."""

from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, Reading
from tests.ratings.by_hand import read as read_text


def read(
    folder: Path, cells: str, *, between: str = "\t", **options: Any
) -> RatingsFile:
    """Read cells between bars, two an item."""
    texts = cells.split("|")
    rows = [["item", "Kim", "Lee"]]
    rows += [[f"i{k}", *texts[k : k + 2]] for k in range(0, len(texts), 2)]
    text = "\n".join(map(between.join, rows)) + "\n"
    return read_text(folder, text, ".tsv", **options)


# cells, options, grades of the scale, what was taken off
READ: list[tuple[str, dict[str, Any], str, dict[str, str]]] = [
    # beside hundreds, or with two marks, a mark before three digits is of thousands
    ("1,200|900|780|3,400", {}, "780|900|1200|3400", {"thousands": ","}),
    ("1.200|900|780|3.400", {}, "780|900|1200|3400", {"thousands": "."}),
    ("1'200|900|780|3’400", {}, "780|900|1200|3400", {"thousands": "'"}),
    ("1 200|900|780|3\u202f400", {}, "780|900|1200|3400", {"thousands": " "}),
    ("1,200,000|15|-2,000|7", {}, "-2000|7|15|1200000", {"thousands": ","}),
    ("1,200.5|15|2,000|0.5", {}, "0.5|15|1200.5|2000", {"thousands": ","}),
    ("1'200|1'250|1'300|2'000", {}, "1200|1250|1300|2000", {"thousands": "'"}),
    # as the caller says
    ("1,200|9|7|3,400", {"thousands": ","}, "7|9|1200|3400", {"thousands": ","}),
    ("1.200|9|7,5|3", {"thousands": "."}, "3|7.5|9|1200", {"thousands": "."}),
    ("1_200|9|7|3", {"thousands": "_"}, "3|7|9|1200", {"thousands": "_"}),
    (
        "12.750,5|9|0,5|1.300",
        {"decimal": ","},
        "0.5|9|1300|12750.5",
        {"thousands": "."},
    ),
    ("1.200|900|780|3.400", {"decimal": "."}, "1.200|3.400|780|900", {}),
    ("1,200|2,500|3,125|4", {"decimal": ","}, "1.200|2.500|3.125|4", {}),
    # three decimals are no thousands
    ("0.125|0.250|1.200|3.375", {}, "0.125|0.250|1.200|3.375", {}),
    ("1.234|2.500|12.345|3.125", {}, "1.234|2.500|3.125|12.345", {}),
    ("1.333|2|2.667|5", {}, "1.333|2|2.667|5", {}),
    ("45.125|50|62.375|75", {}, "45.125|50|62.375|75", {}),
    # units
    ("5%|6 %|7\u00a0%|12%", {"units": True}, "5|6|7|12", {"unit": "%"}),
    ("5 \u00b5m|6 \u03bcm||7\u00b5m", {"units": True}, "5|6|7", {"unit": "\u03bcm"}),
    (
        *("78,0%|71,5%|80%|75%", {"units": True, "decimal": ","}),
        *("71.5|75|78.0|80", {"unit": "%"}),
    ),
    (
        *("1,200 m|900 m|1,250m|780 m", {"units": True}),
        *("780|900|1200|1250", {"thousands": ",", "unit": "m"}),
    ),
    ("5%|10%|5 %|0%", {"units": True, "categories": ["0", "5", "10"]}, "0|5|10", {}),
    # suffixes that differ, and signs, are no units
    *(
        (cells, {}, cells, {})
        for cells in ("0|1+|2+|3+", "1a|2a|2b|3", "2/5|3/5|4/5|5/5", "T1|T2|T3|T4")
    ),
    # one grade
    ("1|TRUE|false|0", {}, "0|1", {}),
    ("TRUE|FALSE|TRUE|TRUE", {}, "FALSE|TRUE", {}),
    # sets of labels
    ("x / y|y/x|x|z", {"set_separator": "/"}, "x|x; y|z", {}),
    ("['x' 'y']|['y']|['x']|[]", {"set_separator": " "}, "x|x; y|y|∅", {}),
]


@pytest.mark.parametrize(("cells", "options", "grades", "taken_off"), READ)
def test_what_is_read(
    cells: str,
    options: dict[str, Any],
    grades: str,
    taken_off: dict[str, str],
    tmp_path: Path,
) -> None:
    file = read(tmp_path, cells, **options)
    assert file.scale.grades == tuple(grades.split("|"))
    assert taken_off.items() <= file.read.items()
    # what nobody asked for is said
    codes = {finding.code for finding in file.warnings}
    is_asked = "thousands" in options or "thousands" not in taken_off
    assert ("thousands read" in codes) != is_asked


BOTH = ["--thousands", "--decimal"]


@pytest.mark.parametrize(
    ("cells", "options", "named"),
    [
        *(
            (cells, {}, ["line 2", *BOTH])
            for cells in (
                *("1,200|3|2|4", "1,200|2,500|3,125|12,000", "1,200|1500|780|3,400"),
                *(
                    "1.200|90|78|3.400",
                    "1.200|1500|780|3.400",
                    "450.000|900|120|80.500",
                ),
            )
        ),
        ("1.200|1.350|2.000|1.900", {"between": ";"}, BOTH),  # of a German program
        ("1 200|90|78|3 400", {}, ["--thousands ' '"]),
        ("1.200,5|900|780|3.400", {}, ["--thousands ."]),
        ("0,125|1,200|2,500|3", {}, ["--decimal ,"]),
        ("1 200,5|900|780|3 400", {}, ["--decimal ,"]),
        ("900|1,20|780|3,400", {"thousands": ","}, ["line 2", "Lee", "'1,20'"]),
        ("900|0,125|780|3,400", {"thousands": ","}, ["'0,125'"]),
        ("5%|6 %|7%|12%", {}, ["line 2", "--units"]),
        ("78,0%|71,5%|80%|75%", {"decimal": ","}, ["--units"]),
        ("1a|2a|3a|4a", {}, ["--units"]),
        ("5 mm|6 mm|1 cm|7 mm", {}, ["--units"]),
        ("5%|x|7%|9%", {}, ["--units"]),
        ("5%|x|7%|9%", {"units": True}, ["line 2", "Lee", "--missing x"]),
        ("5%|7%|6|9%", {"units": True}, ["line 3", "'6'"]),
        ("5 mm|6 mm|1 cm|7 mm", {"units": True}, ["line 3", "'1 cm'"]),
        ("5|6|1|7", {"units": True}, ["--units"]),
        ("n/a|na|?|-|missing|NULL", {}, ["--missing 'n/a,na,?,-,missing'"]),
        ("x|y|x|y", {"set_separator": "/"}, ["--set-separator"]),
        ("x;y/z|y|x|y", {"set_separator": "/"}, ["--set-separator", "'x;y/z'"]),
    ],
)
def test_what_is_refused(
    cells: str, options: dict[str, Any], named: list[str], tmp_path: Path
) -> None:
    with pytest.raises(RatingsError) as error:
        read(tmp_path, cells, **options)
    assert [text for text in named if text not in str(error.value)] == []


@pytest.mark.parametrize(
    ("cells", "codes"),
    [
        ("1|2|3|1|2|3|1|x", "x"),
        ("mild|severe|mild|mild|mild|5|mild|mild", "5"),
        ("1|2|3|1|2|3|1|99", "99"),
        # a large part of the ratings, or what an option cannot name
        *(("1|2|x|y|z|1", None), ("1|2|3|1|2|3|1|x, y", None), ("1|1|2|99", "99")),
        ("1|9|9|9|2|1", None),
    ],
)
def test_a_few_codes_alone_are_suggested_as_missing(
    cells: str, codes: str | None, tmp_path: Path
) -> None:
    said = " ".join(read(tmp_path, cells).warnings)
    assert ("--missing" in said) is (codes is not None)
    assert codes is None or f"--missing {codes}" in said


@pytest.mark.parametrize(
    ("text", "options", "n_items"),
    [
        (',a,b\na,"1,200",30\nb,12,950\n', {"thousands": ","}, 2192),
        (";a;b\na;1.200;30\nb;12;950\n", {"thousands": "."}, 2192),
        (";a;b\na;1.000;30\nb;12;950\n", {"decimal": "."}, 993),
        (";a;b\na;1.000;30\nb;12;950\n", {}, "--thousands ."),
        (',a,b\na,"1,200",30\nb,12,950\n', {}, "--thousands ,"),
    ],
)
def test_numbers_of_items_with_thousands(
    text: str, options: dict[str, Any], n_items: int | str, tmp_path: Path
) -> None:
    if isinstance(n_items, int):
        file = read_text(tmp_path, text, table=True, **options)
        assert file.read["n_items"] == n_items
    else:
        with pytest.raises(RatingsError, match=n_items):
            read_text(tmp_path, text, table=True, **options)


@pytest.mark.parametrize(
    "options",
    [
        {"thousands": ",", "decimal": ","},
        {"thousands": "12"},
        {"thousands": 5},
        {"decimal": 5},
        {"set_separator": ""},
        {"set_separator": 3},
        {"set_separator": ",", "units": True},
        {"set_separator": ",", "categories": ["x"]},
        {"units": True, "counts": True},
    ],
)
def test_options_that_contradict_each_other(options: dict[str, Any]) -> None:
    with pytest.raises(ParameterError, match=f"--{next(iter(options))[:3]}"):
        Reading(**options)
