"""Every exported name is on the page of the interface, with what it is."""

import importlib
import pkgutil
from functools import cache

import masrel
from docs.make import api

page = cache(api.page)


def test_the_page_is_what_the_packages_export() -> None:
    """If it is not: ``python -m docs.make.api``."""
    assert api.PAGE.read_text(encoding="utf-8") == page()


def test_every_name_has_a_line_that_says_what_it_is() -> None:
    empty = [line for line in page().splitlines() if line.endswith("|  |")]
    assert empty == []


def test_no_package_that_exports_is_left_out() -> None:
    packages = [
        info.name
        for info in pkgutil.walk_packages(masrel.__path__, "masrel.")
        if info.ispkg and info.name.count(".") == 1
    ]
    exporting = {p for p in packages if hasattr(importlib.import_module(p), "__all__")}
    assert exporting - {"masrel.cli"} <= set(api.MODULES)
