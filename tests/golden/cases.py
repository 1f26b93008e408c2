"""Every golden case, by group, and the few of them that every test run compares."""

import zlib

from tests.golden import scenes, studies, tables
from tests.golden.call import Case

__all__ = ["GROUPS", "is_quick"]

GROUPS: dict[str, list[Case]] = {}
for _case in [*tables.cases(), *studies.cases(), *scenes.cases()]:
    GROUPS.setdefault(_case.group, []).append(_case)


def is_quick(case: Case) -> bool:
    """Whether it is of the twentieth drawn from the names, of one kind, or text."""
    drawn = zlib.crc32(f"{case.group} {case.name}".encode()) % 20 == 0
    is_whole = case.group == "transcripts" or case.name in ("published", "HM3")
    return not case.slow and (drawn or is_whole)
