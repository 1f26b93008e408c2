"""A bundled study is copied whole into an empty place, and nothing is overwritten."""

from pathlib import Path

import pytest

import masrel
from masrel.errors import ParameterError
from masrel.lab.protocol import copy_template, read_protocol, template_names
from tests.files import contents

STUDIES = Path(__file__).parents[3] / "studies"


def test_the_published_study_brings_its_ratings(tmp_path: Path) -> None:
    copy_template("hess2012", tmp_path)
    found = contents(tmp_path)
    assert sorted(found) == [
        "README.md",
        "protocol.toml",
        "published_secret.txt",
        "ratings/in_person.csv",
        "ratings/published.csv",
        "ratings/published_answers.csv",
    ]
    assert all(
        found[name] == (STUDIES / "hess2012" / name).read_bytes() for name in found
    )


@pytest.mark.parametrize("name", template_names())
def test_every_bundled_study_has_a_usable_protocol_of_its_name(name: str) -> None:
    assert read_protocol(STUDIES / name / "protocol.toml").study.id == name


def test_what_was_drawn_or_run_in_a_bundled_study_stays_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # An installed package carries the studies inside; this one has been used.
    package = tmp_path / "masrel"
    used = package / "studies" / "mine"
    (used / "schedules").mkdir(parents=True)
    (used / "protocol.toml").write_text("x")
    (used / "schedules" / "test_R1.csv").write_text("x")
    monkeypatch.setattr(masrel, "__file__", str(package / "__init__.py"))
    assert template_names() == ("mine",)
    copy_template("mine", tmp_path / "new")
    assert sorted(contents(tmp_path / "new")) == ["protocol.toml"]


def test_a_folder_that_holds_anything_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / ".hidden").write_text("mine")
    with pytest.raises(ParameterError, match=r"got one that holds \.hidden"):
        copy_template("small", tmp_path)
    assert contents(tmp_path) == {".hidden": b"mine"}
    for name in ("huge", "", "../studies/small", "."):
        with pytest.raises(ParameterError, match="needed one of hess2012, small"):
            copy_template(name, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_copy_that_was_killed_is_completed(tmp_path: Path) -> None:
    copy_template("hess2012", tmp_path / "whole")
    whole = contents(tmp_path / "whole")
    half = tmp_path / "half"
    (half / "ratings").mkdir(parents=True)
    (half / "README.md").write_bytes(whole["README.md"])
    (half / "ratings" / ".masrel-0123456789abcdef.part").write_text("half of it")
    copy_template("hess2012", half)
    (half / "ratings" / ".masrel-0123456789abcdef.part").unlink()
    assert contents(half) == whole
    with pytest.raises(ParameterError, match=r"got one that holds README\.md and"):
        copy_template("hess2012", half)
