"""Every file of a study names its format; an unknown one is refused in one sentence."""

import json
import re
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths
from masrel.lab.verification import (
    anchors_of,
    read_anchors,
    verify_study,
    write_anchors,
)
from tests.lab.flow.test_verify import chained_anew, events

FILES = {
    "protocol": "protocol.toml",
    "schedule": "schedules/test_R1.csv",
    "sheet": "schedules/test_R1_sheet.csv",
    "session log": "sessions/test_R1.jsonl",
    "facts of a recording": "sessions/test_R1/*.json",
    "training log": "training/R1.jsonl",
    "conduct log": "conduct.jsonl",
    "ratings": "ratings/ratings.csv",
    "analysis": "analysis.json",
    "manifest": "report/manifest.json",
    "secret": "published_secret.txt",
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
    path = sorted(study.root.glob(FILES[name]))[0]
    of_format(path, 99)
    said = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    needed = rf"{re.escape(str(path))}: (line 1: (\w+: )?)?needed [^\n]*format"
    assert any(re.match(needed, text) for text in said), said


@pytest.mark.parametrize("name", ["protocol", "sheet", "analysis"])
def test_a_file_that_names_none_is_of_version_1(study: StudyPaths, name: str) -> None:
    path = sorted(study.root.glob(FILES[name]))[0]
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
