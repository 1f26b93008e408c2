"""The plan that was drawn is kept, and what changes in it is named ever after."""

import hashlib
import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.lab._event_log import read_log
from masrel.lab.conduct import allot_schedules, plan_changes, record_amendment
from masrel.lab.progress import rater_progress, session_progress
from masrel.lab.protocol import (
    StudyPaths,
    copy_template,
    protocol_hash,
    read_protocol,
)
from masrel.lab.ratings import study_remarks
from masrel.lab.verification import verify_study
from tests.files import edit, small_study
from tests.lab.flow.conftest import run

KAPPA = "analysis.estimates.kappa.coefficient"


def draw(study: StudyPaths) -> None:
    allot_schedules(study, read_protocol(study.protocol))


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    """The small template, its schedules drawn."""
    small_study(tmp_path / "study")
    paths = StudyPaths(tmp_path / "study")
    draw(paths)
    return paths


def changed(study: StudyPaths) -> list[tuple[str, object, object, bool]]:
    return [
        (each.key, each.before, each.after, each.time_utc is not None)
        for each in plan_changes(study, read_protocol(study.protocol))
    ]


def add_raters(study: StudyPaths, *raters: str) -> None:
    entries = "".join(f'\n[[raters]]\nid = "{rater}"\n' for rater in raters)
    names = "".join(f', "{rater}"' for rater in raters)
    edit(study.protocol, 'raters = ["R1", "R2"]', f'raters = ["R1", "R2"{names}]')
    with study.protocol.open("a", encoding="utf-8") as file:
        file.write(entries)


def test_a_draw_keeps_the_protocol_whose_hash_the_schedules_have(
    study: StudyPaths,
) -> None:
    lines = study.conduct_file.read_text(encoding="utf-8").splitlines()
    (drawn,) = (e["fields"] for e in map(json.loads, lines) if e["event"] == "drawn")
    sha256 = hashlib.sha256(drawn["protocol"].encode()).hexdigest()
    assert drawn["protocol_sha256"] == sha256
    assert sha256 == protocol_hash(read_protocol(study.protocol))
    assert changed(study) == []
    draw(study)  # everything is there: nothing is drawn, and nothing logged
    assert len(study.conduct_file.read_text(encoding="utf-8").splitlines()) == 2


@pytest.mark.parametrize(
    ("old", "new", "change"),
    [
        ('"fleiss_kappa"', '"gwet_ac"', (KAPPA, '"fleiss_kappa"', '"gwet_ac"')),
        (
            'id = "kappa"',
            'id = "main"',
            (
                "analysis.estimates",
                '["kappa", "percent"]',
                '["main", "percent"]',
            ),
        ),
        ('"A small study', '"Another small study', None),  # a title is no plan
        (
            "[report]",
            '[[report.gates]]\nrequire = "kappa.low >= 0.4"\n[report]',
            ("report.gates", None, '[{"require": "kappa.low >= 0.4", "why": ""}]'),
        ),
    ],
)
def test_what_changes_after_the_draw_is_named_until_and_after_it_is_recorded(
    study: StudyPaths, old: str, new: str, change: tuple[str, str, str] | None
) -> None:
    edit(study.protocol, old, new)
    named = [] if change is None else [change]
    assert changed(study) == [(*each, False) for each in named]
    protocol = read_protocol(study.protocol)
    when = datetime(2026, 5, 1, tzinfo=UTC)
    with study.conduct_file.open("ab") as log:
        log.write(b'{"event": "amen')  # by a process that died
    recorded = record_amendment(
        study, protocol, who="MK", why="a reviewer asked", now=lambda: when
    )
    assert changed(study) == [(*each, True) for each in named]
    for each in recorded:
        assert (each.who, each.why) == ("MK", "a reviewer asked")
        assert str(each) in " ".join(study_remarks(study, protocol))
    doubts = [f.message for f in verify_study(study).findings if f.weight == "doubt"]
    assert sum(each[0] in doubt for doubt in doubts for each in named) == len(named)


def test_changes_are_in_the_analysis_the_checklist_and_the_export(
    study: StudyPaths, tmp_path: Path
) -> None:
    root, out = str(study.root), tmp_path / "out"
    run("run", root, *("--rater", "R1", "--session", "test", "--grades", "simulated"))
    edit(study.protocol, '"fleiss_kappa"', '"gwet_ac"')
    run("record", "amend", root, "--who", "MK", "--why", "a private reason")
    (change,) = plan_changes(study, read_protocol(study.protocol))
    run("analyze", root)
    kept = json.loads(study.analysis_file.read_bytes())["plan_changes"]
    at = {"before": '"fleiss_kappa"', "after": '"gwet_ac"', "time_utc": change.time_utc}
    assert kept == [{"key": KAPPA, **at}]
    run("checklist", root, "--guideline", "grras", "-o", f"{out}.md")
    run("export", root, "--as", "bids", "-o", str(out), "--quiet")
    drawn = next(e for e in read_log(study.conduct_file) if e.kind == "drawn")
    for text in (Path(f"{out}.md").read_text(), (out / "README.md").read_text()):
        assert text.replace("\\", "").count(f"{change}.") >= 1
    page = Path(f"{out}.md").read_text()
    assert f"at the first draw of schedules on {drawn.time_utc[:10]}" in page
    assert str(drawn.fields["protocol_sha256"]) in page


def test_an_amendment_needs_a_draw_and_a_change(tmp_path: Path) -> None:
    copy_template("small", tmp_path)
    study = StudyPaths(tmp_path)
    protocol = read_protocol(study.protocol)
    with pytest.raises(ParameterError, match="drawn schedules, got none"):
        record_amendment(study, protocol, who="MK", why="b")
    draw(study)
    with pytest.raises(ParameterError, match="says the same"):
        record_amendment(study, protocol, who="MK", why="b")


def test_who_joins_after_the_first_draw_is_late_however_many_join(
    study: StudyPaths,
) -> None:
    edit(study.protocol, "seed = 20240", "seed = 20241")  # who is drawn anew is not
    allot_schedules(study, read_protocol(study.protocol), redraw=True)
    add_raters(study, "R3", "R4", "R5")
    draw(study)
    protocol = read_protocol(study.protocol)
    raters = rater_progress(study, protocol, session_progress(study, protocol))
    assert [r.rater for r in raters if r.is_late] == ["R3", "R4", "R5"]
    assert changed(study) == []  # who takes part is told elsewhere


def test_another_protocol_in_the_place_of_the_one_that_was_drawn_is_found(
    study: StudyPaths,
) -> None:
    lines = study.conduct_file.read_text(encoding="utf-8").splitlines()
    forged = lines[-1].replace("fleiss_kappa", "gwet_ac")
    assert forged != lines[-1]
    study.conduct_file.write_text("\n".join([*lines[:-1], forged, ""]))
    broken = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    assert any("needed the protocol with SHA-256" in message for message in broken)
    text = json.loads(forged)["fields"]["protocol"]  # and its hash, too
    before = json.loads(forged)["fields"]["protocol_sha256"]
    forged = forged.replace(before, hashlib.sha256(text.encode()).hexdigest())
    study.conduct_file.write_text("\n".join([*lines[:-1], forged, ""]))
    doubted = {f.path for f in verify_study(study).findings if f.weight == "doubt"}
    assert doubted == {*study.schedules.glob("*_R?.csv"), study.protocol}
