"""The driver of the simulator: devices, the controller of Fig. 7, the 1 kHz loop."""

from masrel.hess.clock import Clock, RealClock, SimulatedClock
from masrel.hess.controller import Controller
from masrel.hess.device import Device, IdleCommand, Reading
from masrel.hess.fault import Fault
from masrel.hess.friction import Friction, FrictionCompensation
from masrel.hess.hand import Hand
from masrel.hess.limits import DeviceLimits
from masrel.hess.loop import run_presentation
from masrel.hess.presented import Presented, cut_off
from masrel.hess.registry import device_names, open_device
from masrel.hess.setup import BackendOptions, DeviceSetup
from masrel.hess.simulated_hand import SimulatedHand
from masrel.hess.stop import EmergencyStop
from masrel.hess.yielding_hand import YieldingHand

__all__ = [
    "BackendOptions",
    "Clock",
    "Controller",
    "Device",
    "DeviceLimits",
    "DeviceSetup",
    "EmergencyStop",
    "Fault",
    "Friction",
    "FrictionCompensation",
    "Hand",
    "IdleCommand",
    "Presented",
    "Reading",
    "RealClock",
    "SimulatedClock",
    "SimulatedHand",
    "YieldingHand",
    "cut_off",
    "device_names",
    "open_device",
    "run_presentation",
]
