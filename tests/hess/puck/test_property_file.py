"""A table of property numbers is read from a file, or refused with its name."""

from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.hess.puck.property_file import read_property_table
from tests.hess.puck.test_properties import LEAST


def test_a_table_of_ones_own_is_read(tmp_path: Path) -> None:
    path = tmp_path / "puck.toml"
    lines = [f"{name} = {number}" for name, number in LEAST.items()]
    path.write_text("\n".join(["[properties]", *lines]))
    assert read_property_table(path).numbers == LEAST


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", r"puck.toml: needs one table, \[properties\]"),
        ("properties = 3", r"puck.toml: needs one table, \[properties\]"),
        ("[properties]\nT = 42", "puck.toml: properties: need MODE, MT, "),
        ("[properties]\nT = '42'", "properties.T: needs a whole number, got '42'"),
        ("[properties", "puck.toml: not TOML"),
    ],
)
def test_a_file_that_is_no_table_is_refused(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "puck.toml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=words):
        read_property_table(path)
