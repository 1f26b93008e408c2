"""Faults injected and survived: ``python -m tests.faults`` runs and counts all.

The counts go into ``docs/evidence/long_tests.md``, with date and commit.
"""

import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from docs.make.long_tests import write_faults

ROOT = Path(__file__).parents[1]


class Faults:
    """Counts faults by kind: those that were injected, and those survived."""

    def __init__(self) -> None:
        self.injected: Counter[str] = Counter()
        self.survived: Counter[str] = Counter()

    @contextmanager
    def __call__(self, kind: str) -> Iterator[None]:
        """Count one, and whether all that is checked of it holds."""
        self.injected[kind] += 1
        yield
        self.survived[kind] += 1

    def rows(self) -> Iterator[str]:
        """Yield what a test records of each kind."""
        for kind, n_injected in self.injected.items():
            yield f"{kind}|{n_injected}|{self.survived[kind]}"


def main(options: list[str]) -> int:
    """Run every test that injects faults at its full count, and write the counts."""
    junit = ROOT / "out" / "faults.xml"
    junit.parent.mkdir(exist_ok=True)
    selected = ["-m", "faults", "--junitxml", str(junit), *options]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *selected, "tests"], cwd=ROOT
    )
    sys.stdout.write(write_faults(junit))
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
