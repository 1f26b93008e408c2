"""The Barrett Puck, a motor amplifier on a CAN bus: codec, device, emulator.

The names here need no python-can: what speaks on a bus is imported when it is used.
"""

from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.faults import InjectedFault
from masrel.hess.puck.options import PuckOptions

__all__ = ["EmulatorOptions", "InjectedFault", "PuckOptions"]
