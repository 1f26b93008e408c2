"""``masrel schedule``: what it draws, shows and copies."""

import itertools
import json
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths
from masrel.lab.schedule.presentation import read_schedule
from tests.cli.process import Caller
from tests.files import edit
from tests.lab.protocol.documents import VALID, changed, write


def study_of(folder: Path, scheme: str = "williams", **rules: object) -> StudyPaths:
    """A study of two sites, four models and six raters in one session."""
    document = changed("schedule", to={"seed": 5, "scheme": scheme, **rules})
    first, second = VALID["models"]
    document["models"] = [
        first,
        second,
        {**second, "id": "D2"},
        {**first, "id": "HM2", "intended_grade": "2"},
    ]
    document["raters"] = [
        {"id": f"R{n}", "site": "north" if n < 5 else "south"} for n in range(1, 7)
    ]
    document["sessions"] = [{"id": "test", "raters": [f"R{n}" for n in range(1, 7)]}]
    document["analysis"] = {}
    folder.mkdir()
    return StudyPaths(write(document, folder).parent)


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return study_of(tmp_path / "study", strata="site")


def test_a_site_is_drawn_and_the_other_later(masrel: Caller, study: StudyPaths) -> None:
    assert "4 drawn, 0 kept" in masrel("schedule", study.root, "--site", "north").out
    assert "2 drawn, 4 kept" in masrel("schedule", study.root).out
    assert "0 drawn, 2 kept" in masrel("schedule", study.root, "--site", "south").out


def test_every_count_is_that_of_the_files(masrel: Caller, study: StudyPaths) -> None:
    assert masrel("schedule", "show", study.root).code != 0
    assert not study.schedules.exists()
    masrel("schedule", study.root)
    figures = [study.root / f"{name}.svg" for name in "ab"]
    for file in figures:
        assert masrel("schedule", "show", study.root, "--figure", file).code == 0
    assert figures[0].read_bytes() == figures[1].read_bytes()
    document = json.loads(masrel("schedule", "show", study.root, "--json", "-").out)
    assert [of["site"] for of in document["sessions"]] == ["north", "south"]
    south = document["sessions"][1]
    models = south["models"]
    places = [[0] * 4 for _ in models]
    pairs = [[0] * 4 for _ in models]
    for rater in ("R5", "R6"):
        schedule = read_schedule(study.schedule_file(rater, "test"))
        order = [models.index(shown.model) for shown in schedule.presentations]
        for place, model in enumerate(order):
            places[model][place] += 1
        for model, following in itertools.pairwise(order):
            pairs[model][following] += 1
    assert (south["places"], south["pairs"]) == (places, pairs)
    assert south["model_runs"] == [1, 1]


def test_a_row_that_was_forged_is_broken(masrel: Caller, study: StudyPaths) -> None:
    masrel("schedule", study.root)
    file = study.schedule_file("R1", "test")
    edit(file, "# row: 1", "# row: 4")
    verified = masrel("verify", study.root)
    assert verified.code == 2
    assert f"broken: {file}: needed row 1, by {study.conduct_file}, got row 4" in (
        verified.err
    )


def test_the_copy_of_a_site_is_about_that_site_alone(
    masrel: Caller, study: StudyPaths, tmp_path: Path
) -> None:
    copy = tmp_path / "south"
    masrel("schedule", "copy", study.root, "--site", "south", "-o", copy)
    before = json.loads(masrel("status", copy, "--json", "-").out)
    assert [session["rater"] for session in before["sessions"]] == ["R5", "R6"]
    assert before["next"]["command"] == f"masrel schedule {copy}"
    done = masrel("schedule", copy)
    assert done.code == 0
    assert "2 drawn, 0 kept" in done.out
    after = json.loads(masrel("status", copy, "--json", "-").out)
    assert after["next"]["command"].startswith(f"masrel run {copy} --rater ")
