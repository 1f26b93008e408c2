"""A small complete study, run once through the command line for all flow tests."""

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.conduct import record_standing
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from tests.files import edit
from tests.lab.cli.test_train import new_study, train_simulated
from tests.lab.schedule.studies import with_secret


def run(*arguments: str, code: int = 0) -> str:
    """Run the command line in this process; its output, when it ends with `code`."""
    result = CliRunner().invoke(cli, list(arguments), catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture(scope="session")
def small_demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that ``masrel demo --study small`` left."""
    out = tmp_path_factory.mktemp("demo") / "out"
    run("demo", str(out), "--study", "small", "--quiet")
    return out


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with every file that a study can have; only read."""
    study = StudyPaths(new_study(tmp_path_factory.mktemp("whole") / "study"))
    with_secret(study)
    study.secret_file.parent.mkdir(mode=0o700)
    shutil.copy(study.published_secret_file, study.secret_file)
    shown = '[report]\nsections = ["agreement", "grades"]'
    edit(study.protocol, "[report]", shown)
    run("schedule", str(study.root))
    train_simulated(study.root)
    protocol, who = read_protocol(study.protocol), {"who": "A", "why": "b"}
    grades = SimulatedGrades(protocol)
    for rater in ("R1", "R2"):
        run_session(study, protocol, rater, "test", grades=grades, clock="simulated")
    run_session(
        study, protocol, "R1", "test", grades=grades, clock="simulated", rehearsal=True
    )
    record_standing(study, protocol, "R1", "withdrawn", **who)
    for verb in ("ratings", "analyze", "report"):
        run(verb, str(study.root))
    return study.root


@pytest.fixture
def study(whole: Path, tmp_path: Path) -> StudyPaths:
    """A copy of it."""
    return StudyPaths(shutil.copytree(whole, tmp_path / "study"))
