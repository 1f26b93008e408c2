"""What the package computes and prints is what is stored, or says where it is not."""

import zlib

import pytest

from tests.golden.call import Case
from tests.golden.compare import changes
from tests.golden.store import GROUPS, differing, load

EXACT = dict.fromkeys(GROUPS, True)
"""Whether a group is compared bit for bit; to the bars of `compare` otherwise."""

MOST_SAID = 15


def is_quick(case: Case) -> bool:
    """Whether it is of the twentieth drawn from the names, of one kind, or text."""
    drawn = zlib.crc32(f"{case.group} {case.name}".encode()) % 20 == 0
    is_whole = case.group == "transcripts" or case.name in ("published", "HM3")
    return not case.slow and (drawn or is_whole)


def _mark(case: Case) -> pytest.MarkDecorator:
    """Of tables that the group "numbers" has more of, .ci/run compares an eighth.

    It leaves out other chains of a latent trait, too.
    """
    is_of_tables = case.group in ("agreement", "intervals")
    is_left = is_of_tables and zlib.crc32(case.name.encode()) % 8 != 0
    is_long = is_left or case.name == "random"
    return pytest.mark.long if is_long else pytest.mark.slow


def _parameters() -> list[object]:
    return [
        pytest.param(
            case,
            id=f"{case.group}/{case.name}",
            marks=() if is_quick(case) else _mark(case),
        )
        for cases in GROUPS.values()
        for case in cases
    ]


@pytest.fixture(scope="module")
def stored() -> dict[str, dict[str, object]]:
    return {group: load(group) for group in GROUPS}


@pytest.mark.parametrize("case", _parameters())
def test_nothing_changed(case: Case, stored: dict[str, dict[str, object]]) -> None:
    exact = EXACT[case.group] and not differing()
    differences = changes(case.group, stored[case.group][case.name], case.make())
    wrong = [str(change) for change in differences if exact or not change.within]
    if wrong:
        head = f"{case.group}/{case.name}: {len(wrong)} differences"
        pytest.fail("\n".join([head, *wrong[:MOST_SAID]]), pytrace=False)


@pytest.mark.parametrize("group", GROUPS)
def test_every_case_is_stored(group: str, stored: dict[str, dict[str, object]]) -> None:
    assert sorted(stored[group]) == sorted(case.name for case in GROUPS[group])


def test_the_environment_is_that_of_the_data() -> None:
    if difference := differing():
        pytest.skip(f"compared to bars, not bit for bit: {difference}")
