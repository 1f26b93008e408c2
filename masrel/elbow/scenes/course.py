"""Where the events of many stretches are, in shares of their durations."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.twofold import Twofold

__all__ = ["Courses", "Flags", "nearest"]

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Courses:
    """What happens in many stretches; each column of shape (n_scenes,).

    Attributes
    ----------
    is_doubtful : ndarray of bool
        The answer hangs on less than floats show: ask `masrel.elbow.course`. The
        other columns mean nothing there.
    moves, catches, leaves : ndarray of bool
        Whether ν_th is reached, the catch begins, and the catch ends.
    slows : ndarray of bool
        Whether post-catch ends before the stretch does.
    onset, catch, catch_end, post_end, end : Twofold
        Times, s; without meaning where not reached.
    catch_angle, catch_speed, mean_speed : Twofold
        rad and rad/s.
    """

    is_doubtful: Flags
    moves: Flags
    catches: Flags
    leaves: Flags
    slows: Flags
    onset: Twofold
    catch: Twofold
    catch_end: Twofold
    post_end: Twofold
    end: Twofold
    catch_angle: Twofold
    catch_speed: Twofold
    mean_speed: Twofold

    def replaced(self, rows: NDArray[np.intp], others: "Courses") -> "Courses":
        """Return these with others in some rows.

        Parameters
        ----------
        rows : ndarray of int
            Which.
        others : Courses
            What stands there.

        Returns
        -------
        Courses
            All of them, with 32 digits where the others have them.
        """
        columns: dict[str, Any] = {}
        for name in (field.name for field in fields(self)):
            own, other = getattr(self, name), getattr(others, name)
            if isinstance(own, Twofold):
                low = np.broadcast_to(own.low, own.high.shape)
                columns[name] = Twofold(own.high.copy(), low.copy())
                columns[name].put(rows, other)
            else:
                columns[name] = own.copy()
                columns[name][rows] = other
        return Courses(**columns)


def nearest(numbers: Twofold, known: Flags) -> Floats:
    """Round to floats; ``nan`` for what is not there.

    Parameters
    ----------
    numbers : Twofold
        The numbers.
    known : ndarray of bool
        Which of them there are.

    Returns
    -------
    ndarray, shape of `known`
        The floats.
    """
    return np.where(known, numbers.high, np.nan)
