"""What ``masrel trace`` shows on the screen: one scene in full, or one a line."""

from collections.abc import Sequence
from typing import Any

__all__ = ["summary", "table"]

Document = dict[str, Any]

_LINES = {
    "residual_torque_nm": ("residual torque", "N·m"),
    "work_j": ("work", "J"),
    "impulse_nms": ("impulse", "N·m·s"),
}


def summary(made: Document, title: str) -> str:
    """Write the document of one scene for a person."""
    lines = [title, _columns(["phase", "start s", "end s", "start deg", "end deg"])]
    for span in made["phases"]:
        times = [_number(span[key], 3) for key in ("start_s", "end_s")]
        angles = [_number(span[key], 2) for key in ("start_deg", "end_deg")]
        lines.append(_columns([span["name"], *times, *angles]))
    lines.append(f"peak torque {_number(made['peak_torque_nm'], 3)} N·m")
    for key, (name, unit) in _LINES.items():
        if key not in made:
            continue
        if made[key] is None:
            lines.append(f"{name} none: the stretch has no catch")
        else:
            lines.append(f"{name} {_number(made[key], 3)} {unit}")
    lines += [
        f"torque at {place} {_number(value, 3)} N·m" for place, value in _places(made)
    ]
    return "\n".join(lines)


def _columns(cells: Sequence[str]) -> str:
    # as wide as an ordinary stretch needs; a long number keeps its distance
    name, *numbers = cells
    widths = (9, 9, 11, 9)
    parts = [
        text.rjust(max(width, len(text) + 2))
        for text, width in zip(numbers, widths, strict=True)
    ]
    return f"{name:<11}" + "".join(parts)


def _places(made: Document) -> list[tuple[str, float]]:
    # where torque was asked for, and what it is
    at_times = made.get("torque_at_s", [])
    at_angles = made.get("torque_at_deg", [])
    return [
        *((f"{row['time_s']:g} s", row["torque_nm"]) for row in at_times),
        *((f"{row['angle_deg']:g} deg", row["torque_nm"]) for row in at_angles),
    ]


def table(documents: Sequence[Document]) -> str:
    """Write many scenes for a person, one a line."""
    keys = ["speed_deg_s", "catch_angle_deg", "mean_speed_deg_s", "peak_torque_nm"]
    keys += [key for key in _LINES if key in documents[0]]
    places = [f"torque_nm at {place}" for place, _ in _places(documents[0])]
    rows = [["model", *keys, *places]]
    for made in documents:
        torques = [value for _, value in _places(made)]
        cells = [*(made[key] for key in keys), *torques]
        rows.append(
            [made["model"], *("–" if c is None else _number(c, 3) for c in cells)]
        )
    return _aligned(rows)


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) + 2 for column in zip(*rows, strict=True)]
    widths[0] = max(8, widths[0])
    return "\n".join(
        row[0].ljust(widths[0])
        + "".join(
            cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)
        )
        for row in rows
    )


def _number(value: float, decimals: int) -> str:
    # fixed decimals where they show the number, else four digits of it
    if value == 0.0 or 10.0 ** (1 - decimals) <= abs(value) < 1e7:
        return f"{value:.{decimals}f}"
    return f"{value:.4g}"
