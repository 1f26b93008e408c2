"""The driver of the simulator: devices, the controller of Fig. 7, the 1 kHz loop."""

from masrel.hess._presented import Fault, Presented, cut_off
from masrel.hess._replay import ReplayOptions
from masrel.hess._simulated import SimulatedOptions, TorqueSensor
from masrel.hess._stop import EmergencyStop
from masrel.hess.backends import device_names, open_device
from masrel.hess.clock import Clock, RealClock, SimulatedClock
from masrel.hess.controller import Controller
from masrel.hess.device import (
    BackendOptions,
    Device,
    DeviceSetup,
    IdleCommand,
    Reading,
)
from masrel.hess.friction import Friction, FrictionCompensation
from masrel.hess.hand import Hand, SimulatedHand, YieldingHand
from masrel.hess.human_hand import HandDistribution, HandTraits, HumanHand
from masrel.hess.limits import DeviceLimits
from masrel.hess.loop import run_presentation
from masrel.hess.rendering import MotionHand, Rendering, render
from masrel.hess.stretching import PresentationStatus, StretchRules

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
    "HandDistribution",
    "HandTraits",
    "HumanHand",
    "IdleCommand",
    "MotionHand",
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
    "YieldingHand",
    "cut_off",
    "device_names",
    "open_device",
    "render",
    "run_presentation",
]
