"""The figures of a report, drawn at a time by as many processes as there are cores.

Processes are forked, so that none loads matplotlib again. Each takes the next figure
that nobody has taken; what a process that failed leaves, the first one draws.
"""

import os
import threading
import warnings
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import msgspec

from masrel.plots import draw
from masrel.plots._drawn_values import Form

if TYPE_CHECKING:
    from masrel.pages._sections import Drawing

_Drawn = dict[int, dict[Form, bytes]]

_PLACE = 4  # bytes of a figure's place, which a pipe hands to one process as a whole
_MOST = 1000  # figures of which the places fit into a pipe


def draw_all(
    drawings: "Sequence[Drawing]", *, processes: int | None = None
) -> list[dict[Form, bytes]]:
    """Draw the figures of a report.

    Parameters
    ----------
    drawings : sequence of Drawing
        What is drawn, and the line below which it stands.
    processes : int, optional
        How many processes draw, at most; without it as many as there are cores. There
        is one where other threads run, or the system cannot fork.

    Returns
    -------
    list of dict of str to bytes
        The files of each drawing: its PNG and its SVG; the same ones however many
        processes there are.
    """
    # a process pays if it has two figures to draw
    n = min(_cores() if processes is None else processes, (len(drawings) + 1) // 2)
    if n < 2 or len(drawings) > _MOST or not _can_fork():
        drawn: _Drawn = {}
    else:
        drawn = _drawn_by(n, drawings)
    return [
        drawn[place] if place in drawn else _drawn(drawing)
        for place, drawing in enumerate(drawings)
    ]


def _drawn(drawing: "Drawing") -> dict[Form, bytes]:
    return draw(drawing.content, stamp=drawing.stamp)


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):  # not everywhere
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _can_fork() -> bool:
    # another thread may hold a lock that nobody would ever release in the fork
    return hasattr(os, "fork") and threading.active_count() == 1


def _drawn_by(n: int, drawings: "Sequence[Drawing]") -> _Drawn:
    """Return what n processes have drawn, this one among them, by place."""
    places, entry = os.pipe()
    with os.fdopen(entry, "wb") as pipe:
        for place in range(len(drawings)):
            pipe.write(place.to_bytes(_PLACE, "big"))
    children = [_fork(places, drawings) for _ in range(n - 1)]
    drawn = {place: _drawn(drawings[place]) for place in _taken(places)}
    os.close(places)
    for child, results in children:
        with os.fdopen(results, "rb") as pipe:
            data = pipe.read()
        _, status = os.waitpid(child, 0)
        if status == 0:
            drawn |= msgspec.msgpack.decode(data, type=_Drawn)
    return drawn


def _taken(places: int) -> Iterator[int]:
    """Yield figures that no other process has taken, until none is left."""
    while place := os.read(places, _PLACE):
        yield int.from_bytes(place, "big")


def _fork(places: int, drawings: "Sequence[Drawing]") -> tuple[int, int]:
    """Return the id of a process that draws, and the pipe that its figures come by."""
    results, entry = os.pipe()
    with warnings.catch_warnings():
        # threads that only compute, such as those of numpy's library, are waiting
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child:
        os.close(entry)
        return child, results
    status = 1
    try:
        os.close(results)
        drawn = {place: _drawn(drawings[place]) for place in _taken(places)}
        with os.fdopen(entry, "wb") as pipe:
            pipe.write(msgspec.msgpack.encode(drawn))
        status = 0
    finally:
        # without a word: what failed is tried again by the first process
        os._exit(status)
