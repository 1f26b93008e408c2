"""Who gave the grades and on which device are two facts, and both are said."""

import io
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings import ratings_from_logs, read_study_ratings, write_ratings
from masrel.lab.run import ConsoleGrades, SimulatedGrades, run_session

Small = tuple[StudyPaths, Protocol]
SHORT = '[report]\nsections = ["design", "intended"]\n\n[simulated_raters]'


@pytest.fixture
def study(new_study: Callable[..., Small]) -> Small:
    return new_study(("[simulated_raters]", SHORT))


def by_a_person(study: Small, rater: str) -> None:
    answers = io.StringIO("\n1\n\n2\n\n3\n")
    source = ConsoleGrades(scale_of(study[1]), answers=answers, questions=io.StringIO())
    run_session(*study, rater, "test", grades=source, clock="simulated")


def by_a_simulated_rater(study: Small, rater: str) -> None:
    source = SimulatedGrades(study[1])
    run_session(*study, rater, "test", grades=source, clock="simulated")


def reported(study: Small) -> dict[Path, str]:
    """Every page and table of the report, as text."""
    result = CliRunner().invoke(cli, ["report", str(study[0].root), "--quiet"])
    assert result.exit_code == 0, result.output
    files = study[0].report.rglob("*.*")
    return {f: f.read_text("utf-8") for f in files if f.suffix in (".html", ".md")}


def test_grades_of_persons_on_the_simulated_device_never_say_no_person(
    study: Small,
) -> None:
    by_a_person(study, "R1")
    by_a_person(study, "R2")
    pages = reported(study)
    assert len(pages) == 2
    for text in pages.values():
        assert "no person" not in text
        assert "every simulated rater" not in text
        assert "SIMULATED DATA" not in text
        assert "SIMULATED DEVICE – persons gave these grades, none of them" in text
        assert "Simulated device." in text


def test_some_of_both_say_so_with_the_raters(study: Small) -> None:
    by_a_person(study, "R1")
    by_a_simulated_rater(study, "R2")
    for text in reported(study).values():
        assert "no person gave some of these grades" in text
        assert "console: R1; simulated: R2" in text


def test_both_facts_are_columns_that_are_read_back(study: Small) -> None:
    by_a_person(study, "R1")
    by_a_simulated_rater(study, "R2")
    logged = ratings_from_logs(*study)
    assert (logged.simulated, logged.n_from_persons) == (True, 3)
    write_ratings(logged, study[0].ratings_file)
    read = read_study_ratings(study[0].ratings_file, scale_of(study[1]))
    for table in (logged.table, read.table):
        rows = set(
            zip(table["rater"], table["grades_from"], table["device"], strict=True)
        )
        assert rows == {
            ("R1", "console", "simulated"),
            ("R2", "simulated", "simulated"),
        }
