"""What lets browsers in stays in the study's hidden folder."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, copy_template
from tests.cli.process import Caller
from tests.lab.serve.pages import Site, alone

pytestmark = pytest.mark.slow

FORMS = ("bids", "ro-crate")


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    return Caller(monkeypatch, capsys)


def served(masrel: Caller, root: Path, *raters: str) -> StudyPaths:
    """Make a site whose two raters have graded, and that was served."""
    study = StudyPaths(root)
    copy_template("small", root)
    text = study.protocol.read_text()
    for old, new in zip(("R1", "R2"), raters, strict=True):
        text = text.replace(f'"{old}"', f'"{new}"')
    study.protocol.write_text(text)
    study.secret_file.parent.mkdir(mode=0o700)
    study.secret_file.write_text(f"format: 1\nsecret: {'5a' * 16}\n")
    session = ("--session", "test", "--grades", "simulated")
    runs = (("run", root, "--rater", rater, *session) for rater in raters)
    for call in (("schedule", root), *runs):
        done = masrel(*call)
        assert done.code == 0, done.err
    serve(study, raters[0])
    return study


def serve(study: StudyPaths, rater: str) -> None:
    """Let a tablet in."""
    with alone(study):
        site = Site(study.root)
        site.browser().get(site.access.new_address("rater", rater=rater))


def secrets(study: StudyPaths) -> list[bytes]:
    """What nobody else may know."""
    key = study.serve_key_file.read_text().split("key: ")[1].strip()
    tablets = study.serve_key_file.with_name("tablets").read_text()
    (tablet,) = (word for word in tablets.split('"') if len(word) == 32)
    return [key.encode(), tablet.encode()]


def holding(folder: Path, texts: list[bytes]) -> Iterator[str]:
    """Names of files that hold one of these."""
    for path in sorted(folder.rglob("*")):
        if path.is_file() and any(text in path.read_bytes() for text in texts):
            yield path.name


def test_it_is_neither_merged_nor_exported_nor_reported(
    masrel: Caller, tmp_path: Path
) -> None:
    north = served(masrel, tmp_path / "north", "R1", "R2")
    south = served(masrel, tmp_path / "south", "R3", "R4")
    merged, private = tmp_path / "merged", [*secrets(north), *secrets(south)]
    assert list(holding(north.root, private)) == ["serve.txt", "tablets"]
    done = masrel("merge", north.root, south.root, "-o", merged)
    assert done.code == 0, done.err
    assert list(holding(merged, private)) == []
    assert not [*merged.rglob("serve.*")]
    serve(StudyPaths(merged), "R1")
    private += secrets(StudyPaths(merged))
    calls = [
        ("ratings", merged),
        ("report", merged, "-o", tmp_path / "report"),
        *(("export", merged, "--as", form, "-o", tmp_path / form) for form in FORMS),
        ("verify", merged),
    ]
    for call in calls:
        done = masrel(*call)
        assert done.code == 0, done.err
        assert "serve.txt" not in done.out + done.err
    for name in ("report", *FORMS):
        assert list(holding(tmp_path / name, private)) == []
        assert not [*(tmp_path / name).rglob("serve.*")]
