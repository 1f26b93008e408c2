"""Schedules of earlier versions: drawn the same without a secret, and still good.

``drawn_before_kinds/`` holds the bundled protocols of that time, and the SHA-256 of
every schedule and sheet that the code of that time drew from them.
"""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.schedule.presentation import draw_schedule
from masrel.lab.schedule.sheets import (
    concealment_notes,
    schedule_problems,
    write_schedules,
)

BEFORE = Path(__file__).parent / "drawn_before_kinds"
DRAWN = json.loads((BEFORE / "sha256.json").read_text(encoding="utf-8"))

HEAD = ("study", "rater", "session", "seed", "scheme")
HEAD += ("protocol_sha256", "presented_sha256")  # no file named its format then


def drawn_then(paths: StudyPaths, name: str) -> Protocol:
    """Make the study of that time, its schedules drawn from the seed alone."""
    shutil.copyfile(BEFORE / f"{name}.toml", paths.protocol)
    protocol = read_protocol(paths.protocol)
    paths.schedules.mkdir()
    for rater, session in protocol.rater_sessions:
        drawn = draw_schedule(protocol, rater, session)
        rows = [(s.position, s.code, s.model, s.repeat) for s in drawn.presentations]
        schedule = [
            *(f"# {key}: {getattr(drawn, key)}" for key in HEAD),
            "# masrel_version: 0.1.0",
            "position,code,model,repeat",
            *(",".join(map(str, row)) for row in rows),
        ]
        sheet = ["position,code,grade", *(f"{p},{code}," for p, code, _, _ in rows)]
        file = paths.schedule_file(rater, session)
        file.write_text("\n".join(schedule) + "\n")
        paths.sheet_file(rater, session).write_text("\n".join(sheet) + "\n")
    return protocol


@pytest.mark.parametrize("study", sorted(DRAWN))
def test_what_was_drawn_then_is_drawn_now(study: str, tmp_path: Path) -> None:
    paths = StudyPaths(tmp_path)
    drawn_then(paths, study)
    drawn = {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in paths.schedules.iterdir()
    }
    assert drawn == DRAWN[study]


def test_they_are_kept_and_a_rater_who_comes_later_has_a_concealed_order(
    tmp_path: Path,
) -> None:
    paths = StudyPaths(tmp_path)
    protocol = drawn_then(paths, "small")
    assert write_schedules(protocol, paths) == ()
    assert schedule_problems(protocol, paths) == ()
    assert not paths.secret_file.exists()  # nothing was drawn, nothing needed it
    note, *_ = concealment_notes(protocol, paths)
    assert "2 of 2 schedules were drawn from the protocol's seed alone" in note
    text = paths.protocol.read_text(encoding="utf-8")
    later = '\n[[raters]]\nid = "R3"\n\n[[sessions]]\n'
    text = text.replace("\n[[sessions]]\n", later)
    text = text.replace('\nraters = ["R1", "R2"]', '\nraters = ["R1", "R2", "R3"]')
    paths.protocol.write_text(text, encoding="utf-8")
    changed = read_protocol(paths.protocol)
    written = write_schedules(changed, paths)
    _, sheet, schedule = written
    assert (sheet.name, schedule.name) == ("test_R3_sheet.csv", "test_R3.csv")
    assert "# commitment: " in schedule.read_text(encoding="utf-8")
    assert schedule_problems(changed, paths) == ()
