"""The lines of Python in the documentation verify a chain, without masrel."""

import hashlib
import subprocess
import sys
from pathlib import Path

from docs.make.pages import read
from masrel.lab.run import SessionLog

PAGE = Path(__file__).parents[3] / "docs" / "session_log.md"


def verified(folder: Path) -> subprocess.CompletedProcess[str]:
    blocks = read(PAGE.read_text(encoding="utf-8"))
    (code,) = ["\n".join(block.lines) for block in blocks if block.language == "python"]
    command = [sys.executable, "-I", "-S", "-c", code]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_the_documented_lines_find_a_change(tmp_path: Path) -> None:
    path = tmp_path / "pilot" / "sessions" / "test_R1.jsonl"
    with SessionLog.open(path) as log:
        for code in "ABC":
            log.append("grade", {"code": code, "grade": "1+"})
    whole = path.read_bytes()
    last = hashlib.sha256(whole.splitlines()[-1]).hexdigest()
    assert verified(tmp_path).stdout.strip() == last
    path.write_bytes(whole.replace(b"1+", b"2 ", 1))
    changed = verified(tmp_path)
    assert changed.returncode == 1
    assert "line 2: a line before it was changed" in changed.stderr
