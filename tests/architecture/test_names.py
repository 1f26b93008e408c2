"""Names are the field's words, and say whether they are exported.

The joint model (`masrel.lab.elbow`) is not held to this yet.
"""

import ast
import importlib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import masrel

ROOT = Path(masrel.__file__).parent
MODULES = [file for file in sorted(ROOT.rglob("*.py")) if "elbow" not in file.parts]

# Words that say nothing, or only to who wrote them.
DIALECT = frozenset(
    """
    found asked wanted given told said heard own apart Found Asked Told
    Case Pool ground rule_of spread speaks_of chances Tally add_up FewItems ManyItems
    Shares Place Horizon softness EmulatedVoice DueActs Arrivals Neighbour turning
    ending missing kept Walk put tell bench freedom
    """.split()
)
PREFIXES = ("least_", "most_")  # min_, max_
# Here `times` are seconds; elsewhere it would be a count, which is a frequency.
OF_SECONDS = ("hess", "run", "report", "recording.py", "cli")

# One name, one subject: a verb is named after the package that it wires.
VERBS = frozenset(file.stem for file in ROOT.glob("**/cli/[a-z]*.py"))


def bound(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Every name that a module binds, and the line."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno
            case (
                ast.FunctionDef(name=name)
                | ast.AsyncFunctionDef(name=name)
                | ast.ClassDef(name=name)
            ):
                yield name, node.lineno
            case ast.alias(asname=str(name)):
                yield name, 0


def dialect(file: Path, text: str) -> list[str]:
    place = file.relative_to(ROOT)
    is_of_seconds = not {*place.parts}.isdisjoint(OF_SECONDS)
    return [
        f"{place}:{line}: {name}"
        for name, line in bound(ast.parse(text))
        if (plain := name.lstrip("_")) in DIALECT
        or plain.startswith(PREFIXES)
        or (plain == "times" and not is_of_seconds)
    ]


def test_no_name_is_of_the_dialect() -> None:
    names = [
        line for file in MODULES for line in dialect(file, file.read_text("utf-8"))
    ]
    assert names == []


def test_no_two_modules_have_one_name() -> None:
    places = defaultdict(list)
    for file in MODULES:
        if file.stem not in {"__init__", "__main__"}:
            plain = file.stem.lstrip("_")
            if file.parent.name != "cli" or plain not in VERBS:
                places[plain].append(str(file.relative_to(ROOT)))
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


def exports(folder: Path) -> set[str]:
    names: set[str] = set()
    while folder != ROOT.parent:
        package = ".".join(folder.relative_to(ROOT.parent).parts)
        names |= set(getattr(importlib.import_module(package), "__all__", ()))
        folder = folder.parent
    return names


def test_a_name_without_an_underscore_is_exported() -> None:
    loose = []
    for file in MODULES:
        place = file.relative_to(ROOT)
        if any(part.startswith("_") for part in place.parts) or "cli" in place.parts:
            continue
        tree = ast.parse(file.read_text("utf-8"))
        name = ".".join(("masrel", *place.with_suffix("").parts))
        public = set(getattr(importlib.import_module(name), "__all__", ()))
        if place.parent not in (Path(), Path("lab")):  # the vocabulary lists its own
            public |= exports(file.parent)
        loose += [
            f"{place}:{node.lineno}: {name}"
            for node in tree.body
            for name in names_of(node)
            if not name.startswith("_") and name not in public
        ]
    assert loose == []


def names_of(node: ast.stmt) -> list[str]:
    match node:
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            return [name]
        case ast.Assign(targets=[ast.Name(id=name)]):
            return [name]
        case ast.AnnAssign(target=ast.Name(id=name)):
            return [name]
    return []
