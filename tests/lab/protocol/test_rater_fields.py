"""Fields of raters: declared with a type, filled in, and refused where they are not."""

from pathlib import Path
from typing import Any

import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import presented_hash, protocol_hash, read_protocol
from tests.lab.protocol.documents import VALID, changed, write

FIELDS: dict[str, Any] = {
    "profession": {"type": "choice", "choices": ["PT", "MD"], "public": True},
    "years": {"type": "whole", "title": "Experience", "unit": "years"},
    "height_m": {"type": "number", "unit": "m"},
    "since": {"type": "date"},
    "clinic": {"type": "text"},
}


def with_values(values: dict[str, Any], fields: dict[str, Any] = FIELDS) -> Any:
    document = changed("raters", 0, "fields", to=values)
    return {**document, "rater_fields": fields}


def problems(document: Any, folder: Path) -> tuple[str, ...]:
    with pytest.raises(ProtocolError) as caught:
        read_protocol(write(document, folder))
    return caught.value.problems


def test_fields_are_read_and_enter_no_hash_of_what_is_presented(tmp_path: Path) -> None:
    plain = read_protocol(write(VALID, tmp_path))
    values = {"profession": "PT", "years": 12, "height_m": 2, "since": "2001-02-03"}
    protocol = read_protocol(write(with_values(values), tmp_path))
    assert protocol.raters[0].fields == values
    assert protocol.raters[1].fields == {}
    assert presented_hash(protocol) == presented_hash(plain)
    assert protocol_hash(protocol) != protocol_hash(plain)


def test_a_date_stands_with_or_without_quotes(tmp_path: Path) -> None:
    path = write(with_values({"since": "2001-02-03"}), tmp_path)
    quoted = read_protocol(path)
    path.write_text(path.read_text().replace('"2001-02-03"', "2001-02-03"))
    assert protocol_hash(read_protocol(path)) == protocol_hash(quoted)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("age", 40, "needed a field of [rater_fields] (profession, years, height_m,"),
        ("profession", "MSc", 'needed one of "PT", "MD", got "MSc"'),
        ("years", 1.5, "needed a whole number, got 1.5"),
        ("years", True, "needed a whole number, got true"),
        ("years", 2**63, "needed a whole number, got 9223372036854775808"),
        ("height_m", "2", 'needed a number, got "2"'),
        ("since", "3.2.2001", 'needed a date, YYYY-MM-DD, got "3.2.2001"'),
        ("since", "20010203", 'needed a date, YYYY-MM-DD, got "20010203"'),
        ("clinic", " ", 'needed text that is not empty (in quotes), got " "'),
        ("clinic", ["a"], "needed text that is not empty (in quotes), got an array"),
    ],
)
def test_a_value_of_another_type_is_refused_with_its_key(
    tmp_path: Path, name: str, value: object, reason: str
) -> None:
    (problem,) = problems(with_values({name: value}), tmp_path)
    assert problem.startswith(f"{tmp_path / 'protocol.toml'}: raters[0].fields.{name}:")
    assert reason in problem
    assert problem.endswith('(id "R1")')


@pytest.mark.parametrize(
    ("name", "field", "reason"),
    [
        ("Years", {"type": "whole"}, "needed a name of 1 to 32 small letters"),
        ("status", {"type": "text"}, "other than rater, site, status, late"),
        ("x", {"type": "choice"}, "rater_fields.x.choices: needed at least 2"),
        ("x", {"type": "choice", "choices": ["a", "a"]}, "needed at least 2"),
        ("x", {"type": "text", "choices": ["a", "b"]}, 'for type "choice" only'),
        ("x", {"type": "date", "unit": "d"}, "rater_fields.x.unit: needed for numbers"),
        ("x", {"type": "years"}, 'rater_fields.x.type: needed one of "choice"'),
        ("x", {}, "rater_fields.x.type: needed one of"),
    ],
)
def test_a_field_that_cannot_be_is_refused(
    tmp_path: Path, name: str, field: dict[str, Any], reason: str
) -> None:
    (problem,) = problems({**VALID, "rater_fields": {name: field}}, tmp_path)
    assert reason in problem
