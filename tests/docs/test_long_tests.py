"""Every safety test in docs/evidence/long_tests_safety.csv is there under its name."""

import ast
import csv
from pathlib import Path

ROOT = Path(__file__).parents[2]


def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}


def test_every_listed_safety_test_is_there() -> None:
    with (ROOT / "docs/evidence/long_tests_safety.csv").open(encoding="utf-8") as file:
        listed = [(row["file"], row["test"]) for row in csv.DictReader(file)]
    names = {file: names_in(file) for file in {file for file, _ in listed}}
    assert len(listed) > 250
    assert len(set(listed)) == len(listed)
    assert [(file, name) for file, name in listed if name not in names[file]] == []
