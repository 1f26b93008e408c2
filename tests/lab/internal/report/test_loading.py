"""A table loads nothing that draws; one module rounds."""

import ast
from pathlib import Path

import pytest

import masrel.lab.report
from tests.architecture.test_imports import loaded_after

REPORT = Path(masrel.lab.report.__file__).parent
MODULES = sorted(path.relative_to(REPORT) for path in REPORT.rglob("*.py"))

TABLES = """
from masrel.lab.analysis import analyze
from masrel.lab.report._document import SECTIONS
from masrel.lab.report._material import gather
from masrel.tables._tables import Table, as_csv, as_text
from tests.lab.analysis.studies import plan, protocol_with, table_v
protocol, ratings = protocol_with(plan(), sections=tuple(SECTIONS)), table_v()
analysis = analyze(protocol, ratings)
material = gather(protocol, ratings, analysis)
for name in SECTIONS:
    for block in SECTIONS[name](material).blocks:
        if isinstance(block, Table):
            as_csv(block), as_text(block)
"""


def test_tables_load_nothing_that_draws() -> None:
    assert loaded_after(TABLES.strip()) & {"matplotlib", "jinja2"} == set()


def test_a_report_without_figures_draws_nothing() -> None:
    code = (
        "import pathlib, tempfile\n"
        "from tests.lab.report.pages import published_report\n"
        "published_report(pathlib.Path(tempfile.mkdtemp()), 'design', 'intended')"
    )
    loaded = loaded_after(code)
    assert "jinja2" in loaded
    assert "matplotlib" not in loaded


def rounds(tree: ast.AST) -> list[int]:
    """Lines on which a number becomes text or a number with fewer digits."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
            found.append(node.lineno)
        if isinstance(node, ast.Call):
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            if name in ("round", "format", "around"):
                found.append(node.lineno)
    return sorted(found)


def test_the_detector_sees_rounding() -> None:
    assert rounds(ast.parse("round(x, 2)\nf'{x:.2f}'\nx.round(1)")) == [1, 2, 3]


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_one_module_rounds(module: Path) -> None:
    tree = ast.parse((REPORT / module).read_text(encoding="utf-8"))
    assert bool(rounds(tree)) == (module == Path("_tables.py"))
