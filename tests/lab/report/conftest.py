"""Two reports, each made once: of published and of simulated ratings."""

import pytest

from masrel.lab.report._document import ReportFiles
from tests.lab.report.pages import published_report, simulated_report


@pytest.fixture(scope="session")
def published(tmp_path_factory: pytest.TempPathFactory) -> ReportFiles:
    return published_report(tmp_path_factory.mktemp("published"))


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> ReportFiles:
    return simulated_report(tmp_path_factory.mktemp("simulated"))
