"""Devices by name."""

import importlib
import math
from typing import Protocol, cast

from masrel.errors import DeviceError
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.device import BackendOptions, Device, DeviceSetup
from masrel.lab.hess.hand import Hand

_BACKENDS = {
    "puck": "masrel.lab.hess.puck._puck_device",
    "replay": "masrel.lab.hess._replay",
    "simulated": "masrel.lab.hess._simulated",
}
"""Name to the module whose `build` makes the device; imported when it is chosen."""


class _Backend(Protocol):
    def build(self, setup: DeviceSetup) -> Device:
        """Make a device, not yet open; `DeviceError` when the setup does not fit."""
        ...


def device_names() -> tuple[str, ...]:
    """Return the names that `open_device` knows.

    Returns
    -------
    tuple of str
        Names in alphabetical order.

    Examples
    --------
    >>> "simulated" in device_names()
    True
    """
    return tuple(sorted(_BACKENDS))


def open_device(
    name: str,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
    options: BackendOptions | None = None,
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
    options : BackendOptions or None, optional
        What this backend alone can be told; None for its defaults.

    Returns
    -------
    Device
        Open; close it, or use it in a ``with`` block.

    Raises
    ------
    DeviceError
        If there is no device of that name, a simulated one has no hand, the
        options are another backend's, or it cannot be opened.
    ParameterError
        If `range_end` does not fit the hand.

    Examples
    --------
    >>> from masrel.lab.hess import SimulatedClock, SimulatedHand
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> with open_device("simulated", clock=SimulatedClock(), hand=hand) as device:
    ...     round(device.read().angle, 3)
    0.5
    """
    module = _BACKENDS.get(name)
    if module is None:
        raise DeviceError(
            f"device: needs one of {', '.join(device_names())}, got {name!r}"
        )
    backend = cast(_Backend, importlib.import_module(module))
    device = backend.build(
        DeviceSetup(clock=clock, hand=hand, range_end=range_end, options=options)
    )
    device.open()
    return device
