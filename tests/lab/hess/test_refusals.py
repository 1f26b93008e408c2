"""What a limit, a controller, a hand and a puck cannot be is refused by its name."""

import math
from dataclasses import replace
from functools import partial

import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import (
    DeviceLimits,
    Friction,
    HandTraits,
    SimulatedHand,
    StretchRules,
    TorqueSensor,
)
from masrel.lab.hess.puck import EmulatorOptions, InjectedFault, PuckOptions

from .puck.rig import PUCK
from .rig import controls

transmitted = partial(replace, PUCK)  # what lies between elbow and bus


def clamp(**change: object) -> SimulatedHand:
    return SimulatedHand(**{"start": 0.5, "end": 2.5, "mean_speed": 1.5, **change})


@pytest.mark.parametrize(
    ("make", "change", "words"),
    [
        (
            DeviceLimits,
            {"torque": 0.0},
            "torque: needs more than 0 and finite, got 0.0",
        ),
        (DeviceLimits, {"torque": math.inf}, "torque: needs"),
        (DeviceLimits, {"speed": math.nan}, "speed: needs"),
        *(
            (DeviceLimits, {name: -1}, f"{name}: needs 0 or more, got -1")
            for name in ("missed_ticks", "missed_replies", "missed_replies_per_100")
        ),
        (
            DeviceLimits,
            {"soft_stop_torque": math.nan},
            "soft_stop_torque: needs 0 or more",
        ),
        (
            DeviceLimits,
            {"soft_stop_width": 2.0},
            "soft_stop_width: needs at most half of the range",
        ),
        (DeviceLimits, {"ramp_time": 0.101}, "ramp_time: needs 0 to 0.1 s, got 0.101"),
        (DeviceLimits, {"ramp_time": math.nan}, "ramp_time: needs"),
        *(
            (
                DeviceLimits,
                {name: -1.0},
                f"{name}: needs more than 0 and finite, got -1.0",
            )
            for name in (
                *("torque_rate", "stale_time", "frozen_time", "jump_angle"),
                *("standing_time", "standing_torque", "watchdog_time"),
            )
        ),
        (DeviceLimits, {"lowest_angle": 3.3}, "lowest_angle, highest_angle: need"),
        (
            DeviceLimits,
            {"highest_angle": math.inf},
            "lowest_angle, highest_angle: need",
        ),
        (StretchRules, {"n": 0}, "n: needs 1 stretch or more, got 0"),
        (
            StretchRules,
            {"time_limit": 0.0},
            "time_limit: needs more than 0 and finite, got 0.0",
        ),
        (
            StretchRules,
            {"stretch_limit": math.inf},
            "stretch_limit: needs more than 0 and finite, got inf",
        ),
        (controls, {"slip_speed_drop": 0.0}, "slip_speed_drop: needs more than 0"),
        (controls, {"slip_speed_drop": math.nan}, "slip_speed_drop: needs more than 0"),
        (controls, {"loose_inertia": 0.0}, "loose_inertia: needs more than 0"),
        (controls, {"rate_hz": 0}, "rate_hz: needs 1 or more, got 0"),
        (
            controls,
            {"post_catch_ramp": 1.1},
            "post_catch_ramp: needs 0 to 1 s, got 1.1",
        ),
        (controls, {"compensation": 1.1}, r"share: needs \[0, 1\], got 1.1"),
        (controls, {"compensation": -0.1}, r"share: needs \[0, 1\]"),
        (controls, {"compensation": math.nan}, r"share: needs \[0, 1\]"),
        (controls, {"dead_zone": -0.1}, "dead_zone, full_speed"),
        (controls, {"dead_zone": 0.2, "full_speed": 0.1}, "dead_zone, full_speed"),
        (controls, {"dead_zone": 0.1, "full_speed": 0.1}, "dead_zone, full_speed"),
        (Friction, {"inertia": 0.0}, "inertia"),
        (Friction, {"viscous": -1.0}, "viscous"),
        (Friction, {"coulomb": math.inf}, "coulomb"),
        (clamp, {"mean_speed": 0.0}, "mean_speed: needs more than 0"),
        (clamp, {"mean_speed": math.nan}, "mean_speed"),
        (clamp, {"mean_speed": 40.0}, "ramps shorter than the stretch"),
        (clamp, {"stiffness": -1.0}, "stiffness"),
        (clamp, {"damping": math.inf}, "damping"),
        (clamp, {"ramp_up": 0.0}, "ramp_up"),
        (clamp, {"ramp_down": 0.0}, "ramp_down"),
        (clamp, {"delay": -0.1}, "delay"),
        (clamp, {"follow_through": -0.1}, "follow_through"),
        (clamp, {"slip_time": -0.1}, "slip_time"),
        (clamp, {"end": 0.4}, "start, end"),
        (clamp, {"end": 3.2}, "start, end"),
        (clamp, {"start": -0.1}, "start, end"),
        (clamp, {"again": (0.0,)}, r"again\[0\]: needs more than 0"),
        (clamp, {"again": (1.0, math.nan)}, r"again\[1\]: needs more than 0"),
        (clamp, {"again": (1.0, 60.0)}, "ramps shorter than the stretch"),
        (
            HandTraits,
            {"stiffness": 0.0},
            "stiffness: needs more than 0 and finite, got 0.0",
        ),
        (HandTraits, {"damping": math.inf}, "damping: needs more than 0"),
        (HandTraits, {"inertia": -1.0}, "inertia: needs more than 0"),
        (HandTraits, {"tremor": -0.1}, "tremor: needs 0 or more"),
        (HandTraits, {"tremor_hz": math.nan}, "tremor_hz: needs more than 0"),
        (HandTraits, {"tremor_phase": math.inf}, "tremor_phase: needs 0 or more"),
        (HandTraits, {"reaction_delay": -0.1}, "reaction_delay: needs 0 or more"),
        (HandTraits, {"correction_time": 0.0}, "correction_time: needs more than 0"),
        (PuckOptions, {"puck": 8}, "puck: needs a motor's node, 1 to 7, got 8"),
        (PuckOptions, {"gear_ratio": 0.0}, "gear_ratio: needs more than 0"),
        (PuckOptions, {"patience_s": -1.0}, "patience_s: needs more than 0"),
        (
            PuckOptions,
            {"largest_torque": float("nan")},
            "largest_torque: needs more than 0",
        ),
        (PuckOptions, {"direction": 0}, "direction: needs 1 or -1, got 0"),
        (
            PuckOptions,
            {"angle_after_reset": 4.0},
            "angle_after_reset: needs 0 to 180 degrees",
        ),
        (PuckOptions, {"emulator": EmulatorOptions()}, "interface: needs 'virtual'"),
        (EmulatorOptions, {"wake_s": -1.0}, "wake_s: needs 0 or more, got -1.0"),
        (
            InjectedFault,
            {"kind": "fire", "start_s": 0.0},
            "kind: needs one of dropped-requests, .* got fire",
        ),
        (
            InjectedFault,
            {"kind": "idled", "start_s": 2.0, "end_s": 1.0},
            "start_s, end_s: need 0 <= start_s < end_s, got 2.0 and 1.0",
        ),
        (
            InjectedFault,
            {"kind": "idled", "start_s": 0.0, "every": 0},
            "every: needs 1 or more, got 0",
        ),
        (
            transmitted,
            {"counts_per_turn": 0},
            "counts_per_turn: needs more than 0 and finite, got 0",
        ),
        (
            transmitted,
            {"units_per_nm": -1},
            "units_per_nm: needs more than 0 and finite, got -1",
        ),
        (
            transmitted,
            {"gear_ratio": math.nan},
            "gear_ratio: needs more than 0 and finite, got nan",
        ),
        (transmitted, {"direction": 2}, "direction: needs 1 or -1, got 2"),
        (TorqueSensor, {"noise": -0.1}, "noise: needs 0 or more, got"),
        (TorqueSensor, {"lag_time": math.nan}, "lag_time: needs 0 or more, got"),
        (TorqueSensor, {"step": math.inf}, "step: needs 0 or more, got"),
    ],
)
def test_what_cannot_be_is_refused(make, change: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        make(**change)
