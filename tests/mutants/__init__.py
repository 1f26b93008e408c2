"""Deliberate faults of the package, each with the tests that must fail.

``statistics.toml`` and ``safety.toml`` are arrays of tables ``[[fault]]``: ``name``,
``file`` (in ``masrel/``), ``old`` (its text, which stands there once), ``new``, and
``tests``, a folder of the quick tier.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A text of the package, what takes its place, and the tests that must fail."""

    name: str
    file: str
    old: str
    new: str
    tests: str

    def misfit(self, root: Path = ROOT) -> str | None:
        """Say why the fault cannot be put in, if it cannot."""
        file = root / self.file
        if not (self.file.startswith("masrel/") and file.is_file()):
            return f"no file {self.file} in masrel/"
        if (n := file.read_text(encoding="utf-8").count(self.old)) != 1:
            return f"the old text occurs {n} times in {self.file}"
        if self.new == self.old:
            return "the new text is the old text"
        if not (self.tests.startswith("tests/") and (root / self.tests).exists()):
            return f"no tests {self.tests}"
        return None


def faults() -> list[Fault]:
    """Read every table of faults beside this file."""
    tables = sorted(Path(__file__).parent.glob("*.toml"))
    return [
        Fault(**fault)
        for table in tables
        for fault in tomllib.loads(table.read_text(encoding="utf-8"))["fault"]
    ]
