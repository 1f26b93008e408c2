"""Other kinds of joints than the elbow's own, and the angles of Tardieu."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from masrel.cli._options import OutputOptions, write_output
from masrel.errors import ParameterError
from masrel.lab.report._traced_scenes import tardieu_document, tardieu_text

if TYPE_CHECKING:
    from masrel.lab.elbow import JointModel


START_DEG, END_DEG = 30.0, 146.0
"""Where a stretch starts and ends unless it is said, deg."""


def joint_of_kind(kind: str, settings: Sequence[str]) -> "JointModel":
    """Return a joint of a kind with numbers, each KEY=VALUE."""
    from masrel.lab.protocol._kinds import (
        DEFAULT_KIND,
        kind_problem,
        model_of_kind,
        value_problems,
    )

    if (problem := kind_problem(kind)) is not None:
        raise ParameterError(f"--kind: {problem}")
    if kind == DEFAULT_KIND:
        raise ParameterError(
            f"--kind: needs another kind than {kind}, whose models --model names"
        )
    values: dict[str, float] = {}
    for setting in settings:
        key, _, text = setting.partition("=")
        if key in values:
            raise ParameterError(f"--parameter {key}: needs one value, got two")
        try:
            values[key] = float(text)
        except ValueError as error:
            raise ParameterError(
                f"--parameter: needs KEY=VALUE with a number, got {setting!r}"
            ) from error
    for key, problem in value_problems(kind, values):
        raise ParameterError(f"--parameter {key}: {problem}")
    return model_of_kind(kind, values)


def end_within(joint: "JointModel", end_deg: float | None) -> float:
    """Return where a stretch ends, deg: at most where the range of the joint does."""
    limit = math.degrees(joint.range_end)
    if end_deg is None:
        return min(END_DEG, limit)
    if end_deg > limit + 1e-9:
        raise ParameterError(
            f"--to-deg: needs at most the end of range of every model, {limit:g} deg, "
            f"got {end_deg:g}"
        )
    return end_deg


def write_tardieu(
    joints: "Mapping[str, JointModel]",
    start_deg: float,
    speeds: Sequence[float],
    output: OutputOptions,
) -> None:
    """Write R2, R1 and the catches of joints."""
    documents = [
        tardieu_document(name, joint, start_deg, speeds)
        for name, joint in joints.items()
    ]
    write_output(
        output,
        document=lambda: (
            documents[0] if len(documents) == 1 else {"tardieu": documents}
        ),
        text=lambda: tardieu_text(documents),
    )
