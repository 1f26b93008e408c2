"""The table of what has changed since another analysis."""

from collections.abc import Sequence

from masrel.lab.analysis._number_changes import Change
from masrel.tables._tables import Column, Table, Value

_COLUMNS = (
    Column(key="of", heading="Of", align="left"),
    Column(key="field", heading="What", align="left"),
    Column(key="old", heading="Before", digits=4),
    Column(key="new", heading="Now", digits=4),
    Column(key="difference", heading="Difference", digits=4),
)


_LONGEST = 40  # of a text in a cell


def changes_table(
    changes: Sequence[Change], inputs: Sequence[str], since: str, *, simulated: bool
) -> Table:
    """Return the table of changes, with the inputs that changed below it."""
    return Table(
        name="changes",
        caption=f"What has changed since {since}",
        columns=_COLUMNS,
        rows=tuple(
            (c.of, c.field, _short(c.old), _short(c.new), c.difference) for c in changes
        ),
        in_units=tuple(range(len(changes))),
        notes=tuple(inputs),
        data="simulated" if simulated else "",
    )


def _short(value: Value) -> Value:
    # a reason is a sentence; JSON has the whole of it
    if isinstance(value, str) and len(value) > _LONGEST:
        return f"{value[: _LONGEST - 1]}…"
    return value
