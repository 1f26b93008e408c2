"""Every file of a study names its format; an unknown one is refused in one sentence."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.conduct import record_standing
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.verification import (
    anchors_of,
    read_anchors,
    verify_study,
    write_anchors,
)
from tests.lab.cli.test_train import new_study, train_simulated
from tests.lab.flow.conftest import run
from tests.lab.flow.test_verify import chained_anew, events, logs, recording

DOCUMENTED = Path(__file__).parents[3] / "docs" / "record.md"


@pytest.fixture(scope="module")
def once(small_demo: Path, tmp_path_factory: pytest.TempPathFactory) -> StudyPaths:
    """A study that has every file."""
    trained = new_study(tmp_path_factory.mktemp("trained") / "study")
    train_simulated(trained)
    root = tmp_path_factory.mktemp("formats") / "study"
    study = StudyPaths(shutil.copytree(small_demo / "study", root))
    shutil.copytree(trained / "training", study.training)
    record_standing(
        study, read_protocol(study.protocol), "R1", "withdrawn", who="A", why="b"
    )
    run("report", str(root), "--quiet")
    return study


@pytest.fixture
def study(once: StudyPaths, tmp_path: Path) -> StudyPaths:
    return StudyPaths(shutil.copytree(once.root, tmp_path / "study"))


def schedule(study: StudyPaths) -> Path:
    return study.schedule_file("R1", "test")


def sheet(study: StudyPaths) -> Path:
    return study.sheet_file("R1", "test")


def facts(study: StudyPaths) -> Path:
    return recording(study).with_suffix(".json")


def session_log(study: StudyPaths) -> Path:
    return logs(study)[0]


def training_log(study: StudyPaths) -> Path:
    return study.training_log_file("R1")


def manifest(study: StudyPaths) -> Path:
    return study.report / "manifest.json"


FILES: dict[str, Callable[[StudyPaths], Path]] = {
    "protocol": lambda study: study.protocol,
    "schedule": schedule,
    "sheet": sheet,
    "session log": session_log,
    "facts of a recording": facts,
    "training log": training_log,
    "conduct log": lambda study: study.conduct_file,
    "ratings": lambda study: study.ratings_file,
    "analysis": lambda study: study.analysis_file,
    "manifest": manifest,
    "secret": lambda study: study.published_secret_file,
}


def of_format(path: Path, version: object) -> None:
    """Give a file another version; None takes it away."""
    if path.suffix == ".jsonl":
        documents = events(path)
        documents[0]["fields"]["format"] = version
        chained_anew(path, documents)
    elif path.suffix == ".json":
        document = json.loads(path.read_text(encoding="utf-8"))
        assert "format" in document
        document = {**document, "format": version}
        if version is None:
            del document["format"]
        text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
        path.write_text(text, encoding="utf-8")
    else:
        text = path.read_text(encoding="utf-8")
        new = "" if version is None else rf"\g<1>{version}\n"
        text, n = re.subn(r"^((?:# )?format ?[:=] )\d+.*\n", new, text, flags=re.M)
        assert n == 1
        path.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("name", FILES)
def test_a_format_that_is_not_known_is_refused(study: StudyPaths, name: str) -> None:
    path = FILES[name](study)
    of_format(path, 99)
    said = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    needed = rf"{re.escape(str(path))}: (line 1: (\w+: )?)?needed [^\n]*format"
    assert any(re.match(needed, text) for text in said), said


@pytest.mark.parametrize("name", ["protocol", "sheet", "analysis"])
def test_a_file_that_names_none_is_of_version_1(study: StudyPaths, name: str) -> None:
    path = FILES[name](study)
    of_format(path, None)
    assert verify_study(study).is_whole


def test_anchors_name_theirs(study: StudyPaths, tmp_path: Path) -> None:
    file = tmp_path / "anchors.txt"
    write_anchors(anchors_of(study), file)
    of_format(file, None)
    assert read_anchors(file) == anchors_of(study)
    file.write_text(f"# format: 2\n{file.read_text()}")
    with pytest.raises(ValueError, match="line 1: needed format 1, got 2"):
        read_anchors(file)
