"""An analysis pays only for what its plan asks."""

from tests.architecture.test_imports import loaded_after

ANALYZE = """
from tests.lab.analysis.studies import plan, protocol_with, table_v
from masrel.lab.analysis import analyze
analyze(protocol_with(plan(interval={interval!r})), table_v())
import sys
"""


def test_an_analysis_loads_no_library_that_draws() -> None:
    loaded = loaded_after(ANALYZE.format(interval="jackknife").strip())
    assert loaded & {"matplotlib", "jinja2", "emcee", "arviz_stats"} == set()


def test_a_kappa_without_interval_loads_none_of_the_intervals() -> None:
    script = ANALYZE.format(interval="none").strip()
    script += "\nassert not [m for m in sys.modules if m == 'masrel.intervals']"
    assert "scipy" not in loaded_after(script)
