"""The page of the last run by hand of every slow and long test.

``python -m docs.make.long_tests JUNIT_XML`` writes ``docs/long_tests.md``.
"""

import subprocess
import sys
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

PAGE = Path(__file__).parents[1] / "long_tests.md"


def page(junit: Path) -> str:
    """Return the page: when, of which commit, and a row a file of tests."""
    # The file is pytest's own, written a moment ago.
    rows: dict[str, list[float]] = defaultdict(lambda: [0, 0, 0.0])
    for case in ElementTree.parse(junit).iter("testcase"):
        row = rows[case.attrib["classname"]]
        failed = case.find("failure") is not None or case.find("error") is not None
        row[0 if not failed else 1] += case.find("skipped") is None
        row[2] += float(case.attrib["time"])
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    lines = [
        "# The last run of the long tests",
        "",
        f"`.ci/long` on {datetime.now(UTC):%Y-%m-%d}, at commit {commit}. Of a count "
        "that the docs name `.ci/run` holds a seeded part; here it is whole.",
        "",
        "| tests | passed | failed | seconds |",
        "|---|---|---|---|",
    ]
    for name, (passed, failed, seconds) in sorted(rows.items()):
        lines.append(f"| `{name}` | {passed:g} | {failed:g} | {seconds:.0f} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(Path(sys.argv[1])), encoding="utf-8")
