"""Every safety test in docs/evidence/long_tests.md is there under its name."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
LISTED = re.findall(
    r"(?m)^\| `(tests/[\w/]+\.py)::(\w+)` \|",
    (ROOT / "docs/evidence/long_tests.md").read_text(encoding="utf-8"),
)


def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}


def test_every_listed_safety_test_is_there() -> None:
    names = {file: names_in(file) for file in {file for file, _ in LISTED}}
    assert len(LISTED) > 250
    assert len(set(LISTED)) == len(LISTED)
    assert [(file, name) for file, name in LISTED if name not in names[file]] == []
