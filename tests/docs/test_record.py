"""Every promise of docs/evidence/record.md is held by the test in its line."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in (ROOT / "docs/evidence/record.md")
    .read_text(encoding="utf-8")
    .splitlines()
    if re.match(r"\| (curious|careless|dishonest|hostile)", line)
]


@cache
def names_in(file: str) -> frozenset[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return frozenset(n.name for n in tree.body if isinstance(n, ast.FunctionDef))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[1][:40])
def test_a_promise_names_a_test_that_there_is(row: list[str]) -> None:
    assert len(row) == 4
    for name in row[3].split(", "):
        match = re.fullmatch(r"`(tests/[\w/]+\.py)::(test_\w+)`", name)
        assert match, name
        assert match[2] in names_in(match[1])
