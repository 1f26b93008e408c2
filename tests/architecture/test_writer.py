"""Files are written by these modules alone."""

import ast
from collections.abc import Iterator
from pathlib import Path

import masrel

PACKAGE = Path(masrel.__file__).parent

WRITERS = {
    "_files.py",
    "lab/_study_files.py",  # bit by bit
    "lab/_event_log.py",  # lines are added to a log
    "lab/cli/_gating.py",  # a summary that a CI system gives is added to
    "lab/hess/_recorder.py",  # samples while they are taken
    "ratings/_exports.py",  # a temporary file for a library that reads no bytes
}

CALLS = {
    "write_text",
    "write_bytes",
    "savefig",
    "savez",
    "to_csv",
    "copyfile",
    "rename",
}


def writes(tree: ast.AST) -> Iterator[int]:
    # Lines of a module that open a file to write into it, or write one
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        constants = [a.value for a in node.args if isinstance(a, ast.Constant)]
        modes = [c for c in constants if isinstance(c, str) and len(c) <= 3]
        if name in CALLS or (
            name == "open" and any(set(m) & set("wax+") for m in modes)
        ):
            yield node.lineno


def test_no_other_module_writes_files() -> None:
    found = {}
    for path in PACKAGE.rglob("*.py"):
        lines = list(writes(ast.parse(path.read_text(encoding="utf-8"))))
        if lines and str(path.relative_to(PACKAGE)) not in WRITERS:
            found[str(path.relative_to(PACKAGE))] = lines
    assert found == {}
