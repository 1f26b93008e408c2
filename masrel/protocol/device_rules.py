"""The rules that tie the stretch and the device's limits to each other."""

from collections.abc import Iterator
from typing import Any

__all__ = ["device_rules"]

Values = dict[str, Any]


def device_rules(values: Values) -> Iterator[str]:
    """Check the stretch against the range of motion and the device's limits."""
    device, stretch = values.get("device") or {}, values.get("stretch") or {}
    yield from _stretch(stretch, values.get("elbow") or {})
    yield from _compensation(device)
    yield from _soft_stops(device, stretch)


def _stretch(stretch: Values, elbow: Values) -> Iterator[str]:
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    limit = elbow.get("range_end_deg")
    if start is not None and end is not None and start >= end:
        yield (
            f"stretch.start_deg: needed less than stretch.end_deg ({end:g}), "
            f"got {start:g}"
        )
    if end is not None and limit is not None and end > limit:
        yield (
            f"stretch.end_deg: needed at most elbow.range_end_deg ({limit:g}), "
            f"got {end:g}"
        )


def _compensation(device: Values) -> Iterator[str]:
    dead_zone = device.get("dead_zone_deg_s")
    full_speed = device.get("full_speed_deg_s")
    if dead_zone is not None and full_speed is not None and dead_zone >= full_speed:
        yield (
            f"device.dead_zone_deg_s: needed less than device.full_speed_deg_s "
            f"({full_speed:g}), got {dead_zone:g}"
        )


def _soft_stops(device: Values, stretch: Values) -> Iterator[str]:
    width = device.get("soft_stop_deg")
    low, high = device.get("lowest_angle_deg"), device.get("highest_angle_deg")
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    if width is None:
        return
    if None not in (low, start) and start < low + width:
        yield (
            f"stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            f"stop beside it ({low:g} + {width:g}), got {start:g}"
        )
    if None not in (high, end) and end > high - width:
        yield (
            f"stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            f"stop before it ({high:g} - {width:g}), got {end:g}"
        )
