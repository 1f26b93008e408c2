"""Schedules that were drawn before models had kinds are drawn the same, byte for byte.

``drawn_before_kinds/`` holds the bundled protocols of that time, and the SHA-256 of
every schedule and sheet that the code of that time drew from them.
"""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from masrel.protocol import StudyPaths, read_protocol
from masrel.schedule import write_schedules

BEFORE = Path(__file__).parent / "drawn_before_kinds"
DRAWN = json.loads((BEFORE / "sha256.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("study", sorted(DRAWN))
def test_what_was_drawn_then_is_drawn_now(study: str, tmp_path: Path) -> None:
    paths = StudyPaths(tmp_path)
    shutil.copyfile(BEFORE / f"{study}.toml", paths.protocol)
    write_schedules(read_protocol(paths.protocol), paths)
    drawn = {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in paths.schedules.iterdir()
    }
    assert drawn == DRAWN[study]
