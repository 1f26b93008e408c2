"""One version: in the package, the changelog and the citation."""

import re
from pathlib import Path

import masrel

ROOT = Path(__file__).parents[2]


def test_the_citation_is_of_the_newest_release_of_the_changelog() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    newest = re.findall(r"^## (\d+\.\d+\.\d+)", changelog, re.M)[0]
    assert re.findall(r"^version: (.*)$", citation, re.M) == [newest]
    if "dev" not in masrel.__version__:
        assert newest == masrel.__version__
