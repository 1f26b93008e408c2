"""What is exported was promised, and its docstrings are whole numpydoc."""

import dataclasses
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from numpydoc.validate import validate

import masrel

# No examples or cross-references are forced on a class of data (EX01, SA01), a summary
# of one line may be all (ES01), it begins on the first line (GL01), and what a function
# returns has no name (RT02).
DOCS = Path(__file__).parents[2] / "docs" / "reference"
PROTOCOL_PAGE = DOCS / "protocol.md"
API = (DOCS / "api" / "index.md").read_text("utf-8")
MODULES = re.findall(r"^   (masrel[\w.]*)$", API, re.M)
PROMISED = Path(__file__).with_name("public_names.txt").read_text("utf-8").split()
LEFT_OUT = {"EX01", "SA01", "ES01", "GL01", "GL08", "RT02"}


def exported(name: str) -> Iterator[str]:
    module = importlib.import_module(name)
    for entry in module.__all__:
        thing = getattr(module, entry)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            yield f"{name}.{entry}"


def fields(thing: object) -> tuple[str, ...]:
    """Names of the fields of a class of data."""
    if dataclasses.is_dataclass(thing):
        return tuple(field.name for field in dataclasses.fields(thing))
    for attribute in ("__struct_fields__", "_fields"):  # msgspec's, named tuples'
        if names := getattr(thing, attribute, ()):
            return tuple(names)
    return ()


def faults(name: str) -> list[str]:
    module, _, entry = name.rpartition(".")
    thing = getattr(importlib.import_module(module), entry)
    codes = {
        code: text for code, text in validate(name)["errors"] if code not in LEFT_OUT
    }
    if fields(thing) or getattr(thing, "_is_protocol", False):
        codes.pop("PR01", None)  # is of calls; fields are attributes
    listed = inspect.getdoc(thing) or ""
    if (
        module == "masrel.lab.protocol"
    ):  # keys of a protocol file have a page of their own
        listed += PROTOCOL_PAGE.read_text(encoding="utf-8")
    for field in fields(thing):
        if not re.search(
            rf"^(\w+, )*{field}\b.*:|^\| `{field}` \||\[+{field}\b", listed, re.M
        ):
            codes[field] = "is not among the attributes"
    return [f"{code}: {text}" for code, text in codes.items()]


@pytest.mark.parametrize("module", MODULES)
def test_an_exported_name_is_documented_whole(module: str) -> None:
    assert {n: why for n in exported(module) if (why := faults(n))} == {}


def test_public_names_are_those_that_were_promised() -> None:
    """One that is to go warns for a release: docs/explanation/stability.md."""
    names = {f"{m}.{n}" for m in MODULES for n in importlib.import_module(m).__all__}
    assert sorted(names) == PROMISED


def test_no_package_that_exports_is_left_out() -> None:
    packages = [
        info.name
        for info in pkgutil.walk_packages(masrel.__path__, "masrel.")
        if info.ispkg and info.name.count(".") == 1
    ]
    exporting = {p for p in packages if hasattr(importlib.import_module(p), "__all__")}
    assert exporting - {"masrel.cli"} <= set(MODULES)
