"""masrel report: writes pages, says where, and one sentence when it cannot."""

from pathlib import Path

import pytest

from tests.architecture.test_imports import loaded_after
from tests.cli.process import Caller
from tests.files import contents, edit, published_study


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """The published study: no estimates, one section with a figure and one without."""
    plan = '[report]\nsections = ["intended", "grades"]\n'
    return published_study(tmp_path / "study", plan)


READ = "read: 32 ratings from {}/ratings/published.csv\n"


def test_the_page_is_written_and_its_place_printed(masrel: Caller, study: Path) -> None:
    done = masrel("report", study, "--quiet")
    page = study / "report" / "report.html"
    assert (done.code, done.out, done.err) == (0, f"{page}\n", READ.format(study))
    assert {*contents(study / "report")} == {
        "report.html",
        "report.md",
        "analysis.json",
        "manifest.json",
        "tables/intended.csv",
        "tables/grades_test.csv",
        "figures/grades_test.png",
        "figures/grades_test.svg",
    }


def test_progress_is_on_a_terminal_unless_quiet(masrel: Caller, study: Path) -> None:
    page = f"{study / 'report' / 'report.html'}\n"
    done = masrel("report", study)
    assert (done.out, done.err) == (page, READ.format(study))
    (study / "report/report.md").unlink()  # else there is nothing to do
    done = masrel.at_a_terminal("report", study)
    assert done.out == page
    assert "parts" in done.err
    assert masrel.at_a_terminal("report", study, "--quiet").err == READ.format(study)


def test_ratings_can_be_named(masrel: Caller, study: Path) -> None:
    text = (study / "ratings/published.csv").read_text(encoding="utf-8")
    made = study / "simulated.csv"
    made.write_text(text.replace("published", "simulated"), encoding="utf-8")
    assert masrel("report", study, "--quiet", "--ratings", made).code == 0
    page = (study / "report/report.html").read_text(encoding="utf-8")
    assert "SIMULATED DATA" in page


@pytest.mark.parametrize(
    "name", ["protocol.toml", "ratings/published.csv", "ratings/in_person.csv"]
)
def test_a_spoilt_file_is_named_and_nothing_is_written(
    masrel: Caller, study: Path, name: str
) -> None:
    (study / name).write_text("spoilt\n", encoding="utf-8")
    done = masrel("report", study, "--quiet")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("masrel: ")
    assert Path(name).name in done.err
    assert not (study / "report").exists()


def test_without_a_figure_no_matplotlib_is_loaded(study: Path) -> None:
    tables = '"design", "test-retest", "in-person", "order", "claims", "methods"'
    edit(study / "protocol.toml", '"grades"]', f"{tables}]")
    call = f"from masrel.cli import cli\ncli(['report', {str(study)!r}, '--quiet'])"
    assert "matplotlib" not in loaded_after(call)


def test_dollars_in_a_text_are_no_mathematics(masrel: Caller, study: Path) -> None:
    protocol = study / "protocol.toml"
    lines = protocol.read_text(encoding="utf-8").splitlines()
    lines = [
        f"{key} = 'x $\\frac$ $^$'"
        if (key := line.partition(" =")[0]) in TEXTS
        else line
        for line in lines
    ]
    protocol.write_text("\n".join(lines), encoding="utf-8")
    done = masrel("report", study, "--quiet")
    assert (done.code, done.err) == (0, READ.format(study))


TEXTS = ("title", "source", "notes")
