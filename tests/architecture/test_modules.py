"""How modules import each other: never in a circle, and no more than they need."""

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


def _nodes(tree: ast.AST, types: bool) -> Iterator[ast.AST]:
    """Every node, without what is imported for type checkers alone unless asked for."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from _nodes(node, types) if types else ()
        else:
            yield node
            yield from _nodes(node, types)


@cache
def imported(module: str, *, lazy: bool) -> frozenset[str]:
    """Modules that a module imports, inside functions too.

    With `lazy` also those that a package loads when a name is first used: its
    ``__init__`` imports them for type checkers.
    """
    file, found = FILES[module], set()
    is_package = file.name == "__init__.py"
    for node in _nodes(ast.parse(file.read_text("utf-8")), lazy and is_package):
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
# wrote pages, which are modules of their own. A higher number needs a reason.
@pytest.mark.parametrize(
    ("commands", "at_most"),
    [
        (("agree",), 80),
        # one of them is masrel.agree, which stands beside the version
        (("agree", "compare", "diagnose", "limits", "latent", "plan", "audit"), 99),
    ],
)
def test_a_command_reaches_few_modules(commands: tuple[str, ...], at_most: int) -> None:
    reached = closure(f"masrel.cli.{command}" for command in commands)
    assert len(reached) <= at_most
