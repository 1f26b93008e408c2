"""Store golden results anew, and say what changed and by how much.

``python -m tests.golden.make [--dry-run] [GROUP ...]``

The group "numbers" takes 15 minutes of processor time and prints nothing before its
end; it is made only if it is named.
"""

import sys
from collections import defaultdict

from tests.golden import numbers
from tests.golden.compare import Change, changes
from tests.golden.store import GROUPS, load, save

MOST_TEXTS = 40


def main(arguments: list[str]) -> None:
    """Make the groups named, or all; with --dry-run nothing is stored."""
    dry = "--dry-run" in arguments
    names = [name for name in arguments if name != "--dry-run"] or list(GROUPS)
    if numbers.GROUP in names:
        names.remove(numbers.GROUP)
        _make_numbers(dry)
    for group in names:
        stored = load(group)
        new = {case.name: case.make() for case in GROUPS[group]}
        size = "" if dry else f", {save(group, new) / 1e3:.0f} kB"
        print(f"{group}: {len(new)} cases{size}")
        if stored:
            print("\n".join(_report(changes(group, stored, new))))


def _make_numbers(dry: bool) -> None:
    stored = numbers.load_tables()
    changed, n_drawn = numbers.compared_by_two(stored)
    print(f"{numbers.GROUP}: {len(stored)} tables, {n_drawn} drawn ends")
    print("\n".join(_report(changed)))
    if not dry:
        size = numbers.save_tables(numbers.freeze(stored))
        print(f"{numbers.GROUP}: {numbers.N_TABLES} tables, {size / 1e3:.0f} kB")


def _report(every: list[Change]) -> list[str]:
    lines, numbers = [], defaultdict(list)
    for change in every:
        if change.is_number:
            numbers[change.kind].append(change)
    for kind, of in numbers.items():
        far = max(of, key=lambda change: change.absolute)
        ratio = max(of, key=lambda change: change.relative)
        out = sum(not change.within for change in of)
        lines += [
            f"  {kind}: {len(of)} changed, {out} beyond the bar",
            f"    by at most {far.absolute:.3g}: {far}",
            f"    by at most {ratio.relative:.3g} of it: {ratio}",
        ]
    others = [change for change in every if not change.is_number]
    lines += [f"  {change}" for change in others[:MOST_TEXTS]]
    if len(others) > MOST_TEXTS:
        lines.append(f"  and {len(others) - MOST_TEXTS} more")
    return lines or ["  nothing changed"]


if __name__ == "__main__":
    main(sys.argv[1:])
