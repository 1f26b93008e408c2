"""Numbers of properties, of a firmware or from a file."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess.puck import PropertyTable, property_table, read_property_table

# The least that a table needs
REQUIRED = {
    "MODE": 8,
    "T": 42,
    "MT": 43,
    "P": 48,
    "CTS": 68,
    "IPNM": 86,
    "GRPA": 26,
    "GRPB": 27,
    "GRPC": 28,
}


@pytest.mark.parametrize("firmware", [65, 113, 119, 131, 132, 148, 200])
def test_known_firmware_has_the_numbers_that_the_driver_needs(firmware: int) -> None:
    table = property_table(firmware)
    assert {name: table.number(name) for name in REQUIRED} == REQUIRED


@pytest.mark.parametrize(("firmware", "enable", "hold"), [(131, 77, 94), (132, 94, 77)])
def test_two_numbers_change_places_at_132(
    firmware: int, enable: int, hold: int
) -> None:
    table = property_table(firmware)
    assert (table.number("EN"), table.number("HOLD")) == (enable, hold)


@given(st.integers(-1, 64) | st.integers(114, 118))
def test_unknown_firmware_is_refused(firmware: int) -> None:
    with pytest.raises(DeviceError, match=rf"puck: needs firmware .* got {firmware}$"):
        property_table(firmware)


@pytest.mark.parametrize("name", ["SAVE", "LOAD", "DEF", "LOCK"])
def test_what_writes_its_memory_is_never_set(name: str) -> None:
    with pytest.raises(DeviceError, match=f"{name} writes the puck's permanent memory"):
        property_table(148).settable(name)


def test_a_property_outside_the_table_is_named() -> None:
    with pytest.raises(DeviceError, match="property KP is not in this firmware's"):
        property_table(148).number("KP")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"MT": 42}, "needs a number of its own, 42 is taken by"),
        ({"MT": 49}, "needs a number of its own, 49 is taken by"),  # P takes 48 and 49
        ({"T": 5}, "properties.T: needs 8 to 126, got 5"),
        ({"T": 128}, "properties.T: needs 8 to 126, got 128"),
    ],
)
def test_a_table_that_contradicts_itself_is_refused(
    change: dict[str, int], words: str
) -> None:
    with pytest.raises(ParameterError, match=words):
        PropertyTable(numbers={**REQUIRED, **change})


def test_a_table_of_ones_own_is_read(tmp_path: Path) -> None:
    path = tmp_path / "puck.toml"
    lines = [f"{name} = {number}" for name, number in REQUIRED.items()]
    path.write_text("\n".join(["[properties]", *lines]))
    assert read_property_table(path).numbers == REQUIRED


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
