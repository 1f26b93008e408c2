"""Designs whose orders are rows: Williams designs and Latin squares."""

from masrel.lab.protocol import Protocol
from masrel.lab.schedule._stream import Stream

WITH_ROWS = ("williams", "latin-square")
"""Schemes whose orders are rows of a design, dealt to raters one after the other."""


def design_order(
    protocol: Protocol,
    session: str,
    site: str | None,
    row: int,
    secret: bytes | None,
) -> list[str]:
    """Return the models of a row, from 1: a line of its square for every repeat."""
    rules = protocol.schedule
    n_lines = len(square(rules.scheme, len(protocol.models)))
    replicate, place = divmod(row - 1, n_lines)
    purpose = ("design", session, site or "", str(replicate + 1))
    stream = Stream(rules.seed, *purpose, secret=secret)
    return _replicate(protocol, stream)[place]


def _replicate(protocol: Protocol, stream: Stream) -> list[list[str]]:
    # every row of a replicate, whose repeats have squares of their own
    rules = protocol.schedule
    rows = _lines(protocol, stream)
    for _ in range(1, rules.repeats):
        lines = _lines(protocol, stream)
        # Drawn until no row goes on with the model that it ended with. Of k rows that
        # end with a model k lines begin with it, k = 1 or 2: at worst, of 3 models, one
        # draw in 9 is such, and of many one in 2.7 (k = 1) or 7.4 (k = 2).
        while (
            any(row[-1] == line[0] for row, line in zip(rows, lines, strict=True))
            and len(protocol.models) > 1
        ):
            stream.shuffle(lines)
        rows = [row + line for row, line in zip(rows, lines, strict=True)]
    return rows


def _lines(protocol: Protocol, stream: Stream) -> list[list[str]]:
    # which model a symbol stands for, of a Latin square which column comes when, and
    # which line: each by a permutation of its own
    models = [model.id for model in protocol.models]
    lines = square(protocol.schedule.scheme, len(models))
    columns = list(range(len(models)))
    stream.shuffle(models)
    if protocol.schedule.scheme == "latin-square":
        stream.shuffle(columns)
    stream.shuffle(lines)
    return [[models[line[column]] for column in columns] for line in lines]


def square(scheme: str, n: int) -> list[list[int]]:
    """Return the lines of a design of n symbols, from 0, before anything is drawn."""
    if scheme == "latin-square":
        return [[(i + j) % n for j in range(n)] for i in range(n)]
    # Williams (1949), https://doi.org/10.1071/CH9490149: 0, 1, n - 1, 2, n - 2, ... and
    # its shifts; of an odd number the same in the mirror, too
    first = [(j + 1) // 2 if j % 2 else (n - j // 2) % n for j in range(n)]
    lines = [[(i + symbol) % n for symbol in first] for i in range(n)]
    return lines + [line[::-1] for line in lines] if n % 2 and n > 1 else lines
