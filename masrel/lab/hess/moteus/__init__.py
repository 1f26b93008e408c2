"""The mjbots moteus, a motor controller on a CAN-FD bus: bring it up, or emulate it.

`open_device("moteus", ...)` of `masrel.lab.hess` drives it. In: where it is, as
`MoteusOptions`. Opening a bus loads python-can.
"""

from masrel.lab.hess.moteus._moteus_commissioning import (
    ServoReport,
    check,
    probe,
    zero,
)
from masrel.lab.hess.moteus._moteus_emulator import connected
from masrel.lab.hess.moteus._moteus_options import (
    MoteusEmulatorOptions,
    MoteusOptions,
)

__all__ = [
    "MoteusEmulatorOptions",
    "MoteusOptions",
    "ServoReport",
    "check",
    "connected",
    "probe",
    "zero",
]
