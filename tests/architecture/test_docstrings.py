"""Docstrings of what is exported are whole numpydoc; the rest has a line."""

import dataclasses
import importlib
import inspect
import re
from collections.abc import Iterator

import pytest
from numpydoc.validate import validate

from docs.make.api import MODULES

# No examples or cross-references are forced on a class of data (EX01, SA01), a summary
# of one line may be all (ES01), it begins on the first line (GL01), and what a function
# returns has no name (RT02).
LEFT_OUT = {"EX01", "SA01", "ES01", "GL01", "GL08", "RT02"}


def exported() -> Iterator[str]:
    for name in MODULES:
        module = importlib.import_module(name)
        for entry in module.__all__:
            thing = getattr(module, entry)
            if inspect.isclass(thing) or inspect.isfunction(thing):
                yield f"{name}.{entry}"


def faults(name: str) -> list[str]:
    module, _, entry = name.rpartition(".")
    thing = getattr(importlib.import_module(module), entry)
    codes = {
        code: text for code, text in validate(name)["errors"] if code not in LEFT_OUT
    }
    if dataclasses.is_dataclass(thing):  # its fields are attributes: PR01 is of calls
        codes.pop("PR01", None)
        listed = inspect.getdoc(thing) or ""
        for field in dataclasses.fields(thing):
            if not re.search(rf"^{field.name}\b|^\w+,.*\b{field.name}\b", listed, re.M):
                codes[field.name] = "is not among the attributes"
    return [f"{code}: {text}" for code, text in codes.items()]


@pytest.mark.parametrize("name", sorted(exported()))
def test_an_exported_name_is_documented_whole(name: str) -> None:
    assert faults(name) == []
