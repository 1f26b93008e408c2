"""masrel grading: odds ratios as a table or JSON, and undefined ones with a reason."""

from pathlib import Path

from tests.cli.process import Caller

STUDY = Path(__file__).parents[3] / "studies/hess2012"


def test_only_the_ratings_asked_for_are_regressed(masrel: Caller) -> None:
    done = masrel("grading", STUDY, "--models", "dummy", "--on", "H,speed")
    assert done.code == 2
    assert "needs two grades and two raters or more, got 0 and 0" in done.err
    done = masrel("grading", STUDY, "--session", "third")
    assert done.code == 2
    assert done.err.startswith("masrel: --session: needs one of ")
