"""How modules import each other, never in a circle, and which of them write files."""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "masrel"


def _name(file: Path) -> str:
    return ".".join(file.relative_to(ROOT.parent).with_suffix("").parts)


FILES = {_name(file).removesuffix(".__init__"): file for file in ROOT.rglob("*.py")}


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(FILES[module].read_text("utf-8"))


def _nodes(tree: ast.AST, types: bool) -> Iterator[ast.AST]:
    """Every node, without what is imported for type checkers alone unless asked for."""
    left = [tree]
    while left:
        node = left.pop()
        yield node
        is_typing = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
        if types or not is_typing:
            left += ast.iter_child_nodes(node)


@cache
def imported(module: str, *, lazy: bool) -> frozenset[str]:
    """Modules that a module imports, inside functions too.

    With `lazy` also those that a package loads when a name is first used: its
    ``__init__`` imports them for type checkers.
    """
    is_package, found = FILES[module].name == "__init__.py", set()
    for node in _nodes(_tree(module), lazy and is_package):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (names & FILES.keys()) or {node.module}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return frozenset(found & FILES.keys())


def closure(modules: Iterable[str]) -> set[str]:
    """Modules of the package that can be reached, those of the laboratory left out."""
    reached: set[str] = set()
    left = list(modules)
    while left:
        module = left.pop()
        if module not in reached and not module.startswith("masrel.lab"):
            reached.add(module)
            left += imported(module, lazy=True)
    return reached


def test_no_module_imports_in_a_circle() -> None:
    graph = {module: imported(module, lazy=False) for module in FILES}
    assert len(list(TopologicalSorter(graph).static_order())) == len(FILES)


# Fewer is better: 60 and 85 were aimed at before commands drew pictures of ratings and
# wrote pages, which are modules of their own. A higher number needs a reason: limits
# with repeats and spans are subjects, and so modules, of their own.
@pytest.mark.parametrize(
    ("commands", "at_most"),
    [
        (("agree",), 83),
        # one of them is masrel.agree, which stands beside the version
        (("agree", "compare", "diagnose", "limits", "latent", "plan", "audit"), 102),
    ],
)
def test_a_command_reaches_few_modules(commands: tuple[str, ...], at_most: int) -> None:
    reached = closure(f"masrel.cli.{command}" for command in commands)
    assert len(reached) <= at_most


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
    places = {name: str(file.relative_to(ROOT)) for name, file in FILES.items()}
    lines = {places[name]: list(writes(_tree(name))) for name in FILES}
    assert {of: at for of, at in lines.items() if at and of not in WRITERS} == {}
