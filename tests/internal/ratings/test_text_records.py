"""How texts become cells: the short way and the long one read the same."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.ratings import _text_records, read_ratings
from masrel.ratings._grade_texts import alike_texts, normal_form

ROWS = "".join(f"p{k},{k % 3},{k % 2},1\n" for k in range(60))
PLAIN = f"item,A,B,C\n{ROWS}"


def _long_way(text: str) -> str:
    # the same cells: a quote is for the csv module
    return text.replace("item", '"item"')


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", ";").removesuffix("\n"),
        PLAIN.replace("p7,1,1,1", "p7,,NA,"),
        PLAIN.replace("p7,1,1,1", "p7,1, 1 ,1"),
        PLAIN.replace("p7,1,1,1\n", "p7,1,1,1\n\n"),
        PLAIN.replace("p7", "P\u00e4r 7"),
    ],
)
def test_a_text_without_quotes_holds_what_the_same_text_holds_with_them(
    text: str, tmp_path: Path
) -> None:
    files = []
    for name, body in (("plain.csv", text), ("quoted.csv", _long_way(text))):
        path = tmp_path / name
        path.write_bytes(body.encode())
        files.append(read_ratings(path))
    plain, quoted = files
    assert {**plain.read, "file": ""} == {**quoted.read, "file": ""}
    assert plain.parts[0].items == quoted.parts[0].items
    np.testing.assert_array_equal(
        plain.parts[0].ratings.codes, quoted.parts[0].ratings.codes
    )


@pytest.mark.parametrize("text", [PLAIN, PLAIN.replace("\n", "\r\n")])
def test_no_record_of_a_plain_text_is_parsed_by_itself(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: object) -> None:
        raise AssertionError("parsed record by record")

    path = tmp_path / "wide.csv"
    monkeypatch.setattr(_text_records._Lines, "_checked_records", refuse)
    path.write_bytes(text.encode())
    assert read_ratings(path).read["n_items"] == 60
    path.write_bytes(_long_way(text).encode())
    with pytest.raises(AssertionError):
        read_ratings(path)


@given(st.lists(st.text("0019aAeE.+", min_size=1, max_size=4), unique=True))
def test_texts_are_alike_whose_normal_forms_are_the_same(texts: list[str]) -> None:
    forms = list(map(normal_form, texts))
    expected = {
        t for t, form in zip(texts, forms, strict=True) if forms.count(form) > 1
    }
    assert {text for group in alike_texts(texts) for text in group} == expected
