"""The driver of the simulator: devices, the controller of Fig. 7, the 1 kHz loop."""

from masrel.hess.clock import Clock, RealClock, SimulatedClock
from masrel.hess.controller import Controller
from masrel.hess.device import Device, Reading
from masrel.hess.friction import Friction, FrictionCompensation
from masrel.hess.hand import Hand, SimulatedHand
from masrel.hess.limits import DeviceLimits
from masrel.hess.loop import Presented, run_presentation
from masrel.hess.registry import device_names, open_device
from masrel.hess.setup import BackendOptions, DeviceSetup

__all__ = [
    "BackendOptions",
    "Clock",
    "Controller",
    "Device",
    "DeviceLimits",
    "DeviceSetup",
    "Friction",
    "FrictionCompensation",
    "Hand",
    "Presented",
    "Reading",
    "RealClock",
    "SimulatedClock",
    "SimulatedHand",
    "device_names",
    "open_device",
    "run_presentation",
]
