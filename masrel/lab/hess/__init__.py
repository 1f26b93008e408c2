"""The driver of the simulator: devices, the controller of Fig. 7, the 1 kHz loop."""

from masrel.lab.hess._clock import Clock, RealClock, SimulatedClock
from masrel.lab.hess._course import PresentationStatus, StretchRules
from masrel.lab.hess._recorder import Fault, Presented, cut_off
from masrel.lab.hess._replay import ReplayOptions
from masrel.lab.hess._simulated import (
    PlantParameters,
    SimulatedOptions,
    TorqueSensor,
)
from masrel.lab.hess._stop import EmergencyStop
from masrel.lab.hess.controller import Controller, Friction, FrictionCompensation
from masrel.lab.hess.device import (
    BackendOptions,
    Device,
    DeviceSetup,
    IdleCommand,
    Reading,
    build_device,
    device_names,
    open_device,
)
from masrel.lab.hess.hand import Hand, HandTraits, HumanHand, SimulatedHand
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.hess.loop import run_presentation
from masrel.lab.hess.rendering import MotionHand, Rendering, render

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
    "HandTraits",
    "HumanHand",
    "IdleCommand",
    "MotionHand",
    "PlantParameters",
    "PresentationStatus",
    "Presented",
    "Reading",
    "RealClock",
    "Rendering",
    "ReplayOptions",
    "SimulatedClock",
    "SimulatedHand",
    "SimulatedOptions",
    "StretchRules",
    "TorqueSensor",
    "build_device",
    "cut_off",
    "device_names",
    "open_device",
    "render",
    "run_presentation",
]
