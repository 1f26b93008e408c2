"""Files and folders as tests look at them and change them."""

import csv
from pathlib import Path

from masrel.lab.protocol import copy_template


def contents(folder: Path) -> dict[str, bytes]:
    """The bytes of every file of a folder, by its path in it."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def table_of(file: Path) -> list[dict[str, str]]:
    """The rows of a table, without lines that say what it is."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if line[:1] != "#"))


def edit(file: Path, old: str, new: str, times: int = -1) -> None:
    """Put a text in the place of another one, which must be there."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, times), encoding="utf-8")


def small_study(root: Path) -> Path:
    """The template "small", whose raters stretch the arm once, which is soon done."""
    copy_template("small", root)
    edit(root / "protocol.toml", 'stretches = "free"', "stretches = 1")
    return root


def published_study(root: Path, plan: str) -> Path:
    """The published study, of which somebody else has planned the analysis."""
    copy_template("hess2012", root)  # nothing that somebody left in the clone
    replan(root, plan)
    return root


def replan(root: Path, plan: str) -> None:
    """Put estimates and report in the place of those of a protocol."""
    protocol = root / "protocol.toml"
    head = protocol.read_text(encoding="utf-8").partition("[[analysis.estimates]]")[0]
    protocol.write_text(head + plan, encoding="utf-8")
