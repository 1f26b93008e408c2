"""Every scene its joint and its motion."""

from collections.abc import Sequence

import numpy as np

from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError

__all__ = ["check_starts", "paired"]


def paired(
    parameters: ElbowParameters | Sequence[ElbowParameters],
    motions: Motion | Sequence[Motion],
) -> tuple[Sequence[ElbowParameters], Sequence[Motion]]:
    """Give every scene its joint and its motion.

    Parameters
    ----------
    parameters : ElbowParameters or sequence of ElbowParameters
        The joints, one a scene; or one for all.
    motions : Motion or sequence of Motion
        The motions, one a scene; or one for all.

    Returns
    -------
    tuple of two sequences, each of length n_scenes
        Joints and motions.

    Raises
    ------
    ParameterError
        If their numbers do not fit.
    """
    joints = [parameters] if isinstance(parameters, ElbowParameters) else parameters
    moves = motions if isinstance(motions, Sequence) else [motions]
    n = max(len(joints), len(moves)) if joints and moves else 0
    if len(joints) not in (1, n) or len(moves) not in (1, n) or n == 0:
        raise ParameterError(
            "parameters, motions: need as many joints as motions, or one of either, "
            f"got {len(joints)} and {len(moves)}"
        )
    return (
        joints if len(joints) == n else [joints[0]] * n,
        moves if len(moves) == n else [moves[0]] * n,
    )


def check_starts(
    joints: Sequence[ElbowParameters], moves: Sequence[Motion], rows: np.ndarray
) -> None:
    """Check that no motion starts at or beyond the end of range.

    Parameters
    ----------
    joints : sequence of ElbowParameters
        The joints.
    moves : sequence of Motion
        The motions.
    rows : ndarray of int
        What number each has among those asked for.

    Raises
    ------
    ParameterError
        If one does; the message says which.
    """
    for i, joint, motion in zip(rows.tolist(), joints, moves, strict=True):
        if motion.start >= joint.range_end:
            raise ParameterError(
                f"motions[{i}].start: needs less than the end of range, "
                f"{np.degrees(joint.range_end):g} degrees, got "
                f"{np.degrees(motion.start):g} degrees"
            )
