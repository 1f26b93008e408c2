"""A table loads nothing that draws."""

from tests.architecture.test_imports import loaded_after

TABLES = """
from masrel.lab.analysis import analyze
from masrel.lab.report._document import SECTIONS, made_section
from masrel.lab.report._material import gather
from masrel.tables._tables import Table, as_csv, as_text
from tests.lab.analysis.studies import plan, protocol_with, table_v
protocol, ratings = protocol_with(plan()), table_v()
analysis = analyze(protocol, ratings)
material = gather(protocol, ratings, analysis)
for name in SECTIONS:
    for block in made_section(name, material).blocks:
        if isinstance(block, Table):
            as_csv(block), as_text(block)
"""


def test_tables_load_nothing_that_draws() -> None:
    assert loaded_after(TABLES.strip()) & {"matplotlib", "jinja2"} == set()
