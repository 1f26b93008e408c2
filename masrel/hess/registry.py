"""Devices by name."""

import math
from collections.abc import Callable

from masrel.errors import DeviceError
from masrel.hess.clock import Clock
from masrel.hess.device import Device
from masrel.hess.hand import Hand

__all__ = ["device_names", "open_device"]


def _simulated(clock: Clock, hand: Hand | None, range_end: float) -> Device:
    from masrel.hess.simulated import SimulatedDevice  # only when chosen

    if hand is None:
        raise DeviceError("simulated: needs a hand, there is nobody to move the arm")
    return SimulatedDevice(clock=clock, hand=hand, range_end=range_end)


_BACKENDS: dict[str, Callable[[Clock, Hand | None, float], Device]] = {
    "simulated": _simulated,
}


def device_names() -> tuple[str, ...]:
    """Return the names that `open_device` knows.

    Returns
    -------
    tuple of str
        Names in alphabetical order.

    Examples
    --------
    >>> device_names()
    ('simulated',)
    """
    return tuple(sorted(_BACKENDS))


def open_device(
    name: str,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
) -> Device:
    """Open a device by name.

    Parameters
    ----------
    name : str
        One of `device_names`.
    clock : Clock
        The clock of the loop that will use it.
    hand : Hand or None, optional
        The hand that moves a simulated arm; one stretch per device.
    range_end : float, optional
        Where a simulated arm meets its end stop, rad.

    Returns
    -------
    Device
        Open; close it, or use it in a ``with`` block.

    Raises
    ------
    DeviceError
        If there is no device of that name, a simulated one has no hand, or it
        cannot be opened.
    ParameterError
        If `range_end` does not fit the hand.

    Examples
    --------
    >>> from masrel.hess import SimulatedClock, SimulatedHand
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> with open_device("simulated", clock=SimulatedClock(), hand=hand) as device:
    ...     round(device.read().angle, 3)
    0.5
    """
    backend = _BACKENDS.get(name)
    if backend is None:
        raise DeviceError(
            f"device: needs one of {', '.join(device_names())}, got {name!r}"
        )
    device = backend(clock, hand, range_end)
    device.open()
    return device
