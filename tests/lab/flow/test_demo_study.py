"""Protocol to report on the simulated device, as a user gets it.

`tests/golden` has the hashes of every file that a demo writes.
"""

import json
from pathlib import Path


def test_the_report_and_every_table_say_simulated(small_demo: Path) -> None:
    report = small_demo / "report-simulated"
    tables = sorted(report.rglob("*.csv"))
    assert tables
    for path in [*report.glob("*.html"), *report.glob("*.md"), *tables]:
        assert "simulated" in path.read_text(encoding="utf-8").lower(), path
    analysis = json.loads((small_demo / "study" / "analysis.json").read_text())
    assert analysis["simulated"] is True
    _, conduct = (report / "report.md").read_text().split("## Conduct\n")
    assert "| 2012-01-01 | adverse-event | R1 | test | simulated: sore " in conduct
    assert "**Simulated data.** Other events of the study" in conduct
