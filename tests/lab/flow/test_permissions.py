"""What is private in a study is its owner's alone, after every command."""

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.files import edit
from tests.lab.flow.conftest import run

pytestmark = pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")

# Folders and files that are private, and those that a study has to show
PRIVATE = (
    r"\w+/(\.key|schedules|sessions|sheets|training|rehearsals|conduct)(/.*)?",
    r"\w+/(ratings|\.masrel_cache)(/.*)?",
    # copies of the protocol have what is known of raters
    r"(north|south|both)/(conduct\.jsonl|protocol\.toml)",
    r"(status|raters|orders)\.json",
    r"crate/.+\.\w+",  # with logs
)
WHILE_IT_GOES_ON = r"both/(report(/.*)?|analysis\.json)"
OPEN = (
    r"whole(/(protocol\.toml|README\.md))?|north|south|both|sheet\.csv",
    r"bids(/.*)?|crate(/.*)?|register\.json|list\.md|anchors",
    WHILE_IT_GOES_ON,
)

TRAINING = """
[training]
kappa_insufficient = 0.1
kappa_sufficient = 0.95
false_pass = 0.45
window = 6
max_presentations = 6
"""

COMMANDS = """
schedule copy whole --site north -o north
schedule copy whole --site south -o south
schedule north
schedule south
check north
train north --rater R1 --grades simulated
run north --rater R1 --session test --grades simulated --rehearse
run north --rater R1 --session test --grades simulated
record note north tired --who MK
record adverse-event south fell --who MK --rater R2
paper print south
ratings north
merge north south -o both
ratings both
analyze both
report both --only flow
status both --json status.json
run both --rater R2 --session test --grades simulated; ratings both; analyze both; \
report both --only flow
status raters both --json raters.json
schedule show both --json orders.json
record register both -o register.json
checklist both --guideline grras -o list.md
verify both --anchor anchors
export both --as bids -o bids
export both --as ro-crate --include logs -o crate
"""


def wrong_modes(root: Path, umask: int, *, goes_on: bool) -> Iterator[str]:
    """Files and folders that have not the permissions that they are to have."""
    private = (*PRIVATE, WHILE_IT_GOES_ON) if goes_on else PRIVATE
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        is_private = any(re.fullmatch(each, name) for each in private)
        if not is_private and not any(re.fullmatch(each, name) for each in OPEN):
            yield f"{name} is in no list"
        usual = 0o777 if path.is_dir() else 0o666
        mode = usual & (0o700 if is_private else ~umask)
        if path.stat().st_mode & 0o777 != mode:
            yield f"{name} is {path.stat().st_mode & 0o777:o}, needed {mode:o}"


@pytest.mark.slow
@pytest.mark.parametrize(
    "umask", [0o000, pytest.param(0o022, marks=pytest.mark.long, id="usual")]
)
def test_nothing_private_can_be_read_by_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, umask: int
) -> None:
    monkeypatch.chdir(tmp_path)
    before = os.umask(umask)
    try:
        run("init", "whole")
        protocol = Path("whole/protocol.toml")
        edit(protocol, "[schedule]", '[schedule]\nstrata = "site"')
        for rater, site in (("R1", "north"), ("R2", "south")):
            edit(protocol, f'id = "{rater}"', f'id = "{rater}"\nsite = "{site}"')
        edit(protocol, "[report]", f"{TRAINING}\n[report]")
        goes_on = True
        for line in COMMANDS.strip().splitlines():
            for command in line.split(";"):
                run(*command.split())
            goes_on &= not line.startswith("run both")
            assert [*wrong_modes(tmp_path, umask, goes_on=goes_on)] == [], line
    finally:
        os.umask(before)


@pytest.mark.slow
def test_what_a_demo_has_of_ratings_is_private_too(small_demo: Path) -> None:
    for name in ("ratings", "sessions", "schedules", "conduct.jsonl"):
        place = small_demo / "study" / name
        paths = [place, *place.rglob("*")]
        assert {path.stat().st_mode & 0o077 for path in paths} == {0}
