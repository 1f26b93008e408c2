"""``masrel device``: bring an amplifier up on its CAN bus and see what it says."""

import csv
import dataclasses
import functools
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import click
import msgspec
import numpy as np
from tqdm import tqdm

import masrel
from masrel.cli._commands import Commands
from masrel.cli._options import (
    STDOUT,
    OutputOptions,
    floats,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.errors import DeviceError
from masrel.lab._event_log import utc_now
from masrel.lab.cli._study_options import several
from masrel.lab.conduct._calibrations import (
    Calibration,
    last_calibration,
    write_calibration,
)
from masrel.lab.conduct._study_log import stated
from masrel.lab.hess import (
    BackendOptions,
    Clock,
    Device,
    EmergencyStop,
    RealClock,
    SimulatedClock,
    SimulatedHand,
    SimulatedOptions,
    TorqueSensor,
    moteus,
    open_device,
    puck,
    run_presentation,
)
from masrel.lab.hess._calibration import (
    N_STEPS,
    GainPoint,
    carry,
    compare_models,
    fit_gain,
    lateness_ms,
    measure_free_arm,
    rendered,
)
from masrel.lab.hess._can import Link
from masrel.lab.hess._free_arm import LIMITS, SPEEDS, fit_friction, steady_runs
from masrel.lab.hess._stop import stop_on_key, stop_on_signals, watched
from masrel.lab.hess.device import _BACKENDS as _OWN
from masrel.lab.hess.device import _GROUP
from masrel.lab.hess.moteus import MoteusOptions
from masrel.lab.hess.puck import PuckOptions, read_property_table
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.protocol.study import _home
from masrel.lab.recording import MEASURED_TORQUE, Recording
from masrel.lab.run._settings import (
    backend_options,
    calibrated,
    device_limits,
    has_simulated_hand,
    model_controller,
    use_calibration,
)

_N_NODES = {"puck": 31, "moteus": 127}
_BACKENDS: dict[str, ModuleType] = {"puck": puck, "moteus": moteus}
_SIMULATED = "simulated"
_GRAVITY = 9.80665  # m/s²
_UNITS = {"puck": "counts", "moteus": "turns"}  # of a position
_RANGE_END = math.radians(146.0)  # where an emulated arm meets its end stop
_EMULATED_START = math.radians(60.0)
_START = math.radians(30.0)  # of a stretch

_device_options = several(
    click.option(
        "--device",
        "name",
        type=click.Choice([*_BACKENDS, _SIMULATED]),
        default="puck",
        show_default=True,
        help="Type of amplifier; the simulated device has no bus.",
    ),
    click.option(
        "--interface",
        help="Bus adapter, as python-can names it; default: socketcan, or virtual with "
        "--emulate.",
    ),
    click.option(
        "--channel", default="can0", show_default=True, help="Channel of the adapter."
    ),
    click.option(
        "--node",
        "--puck",
        type=int,
        default=1,
        show_default=True,
        help="Number of the amplifier on the bus.",
    ),
    click.option(
        "--direction",
        type=click.Choice(["1", "-1"]),
        default="1",
        show_default=True,
        help="-1 if the encoder counts decrease as the arm extends.",
    ),
    click.option(
        "--gear-ratio",
        type=float,
        help="Turns of the motor per turn of the elbow, or turns of the output for a "
        "moteus; default: 18.8 for a puck, 1 for a moteus.",
    ),
    click.option(
        "--properties",
        type=InputFile(path_type=Path),
        help="TOML file with property numbers, for a puck whose firmware masrel does "
        "not know.",
    ),
    click.option(
        "--emulate", is_flag=True, help="Emulate the amplifier; no hardware is needed."
    ),
    output_options(
        json='Write JSON to this file; "-" writes it to standard output and prints '
        "nothing else.",
        quiet="Show no progress bar.",
    ),
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Session:
    """An amplifier, and the screen or file that its results go to."""

    name: str  # of its backend
    options: Any  # of the backend: bus, node and how to treat it
    clock: Clock  # simulated for an emulated one
    # what holds the arm of an emulated one: a hand that has let go
    hand: SimulatedHand | None
    output: OutputOptions  # where its results go

    @property
    def backend(self) -> ModuleType:
        """What brings it up."""
        if self.name not in _BACKENDS:
            raise click.UsageError(
                f"--device {self.name}: has no bus that can be asked"
            )
        return _BACKENDS[self.name]

    def link(self, *, all_nodes: bool = False) -> Link:
        """Join the bus, for a ``with`` block."""
        link: Link = self.backend.connected(
            self.options,
            clock=self.clock,
            hand=self.hand,
            range_end=_RANGE_END,
            all_nodes=all_nodes,
        )
        return link

    @contextmanager
    def moving(self) -> Iterator[tuple[Device, dict[str, Any]]]:
        """Open it to be moved -> the device, what watches it, and what stops it."""
        stop = EmergencyStop()
        keys = None if self.hand is not None else sys.stdin  # an emulator is quick
        with (
            stop_on_signals(stop),
            stop_on_key(stop, keys),
            open_device(
                self.name,
                clock=self.clock,
                hand=self.hand,
                range_end=_RANGE_END,
                options=self.options,
            ) as device,
            watched(device, LIMITS.watchdog_time) or nullcontext() as watchdog,
        ):
            yield device, {"watchdog": watchdog, "stop": stop}

    def progress(self, total: int) -> "tqdm[NoReturn]":
        """Make a bar of steps on a terminal, for a ``with`` block."""
        hidden = self.output.json_file == STDOUT or self.output.quiet or None
        return tqdm(total=total, unit="", leave=False, disable=hidden)

    def write_output(self, lines: list[str], document: dict[str, object]) -> None:
        """Print lines, or write the document as JSON; both say whether it is real."""
        simulated = not self.options.moves_hardware
        note = ["(simulated: there is no hardware on this bus)"] if simulated else []
        write_output(
            self.output,
            document=lambda: {**document, "simulated": simulated},
            text=lambda: "\n".join([*lines, *note]),
        )


def _device_command(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say which amplifier it is for, as a session."""

    @functools.wraps(function)
    def command(
        *,
        name: str,
        interface: str | None,
        channel: str,
        node: int,
        direction: str,
        gear_ratio: float | None,
        properties: Path | None,
        emulate: bool,
        output: OutputOptions,
        **kwargs: Any,
    ) -> None:
        settings: dict[str, Any] = {
            "interface": interface or ("virtual" if emulate else "socketcan"),
            "channel": channel,
            "direction": 1 if direction == "1" else -1,
            **({} if gear_ratio is None else {"gear_ratio": gear_ratio}),
        }
        options: BackendOptions
        if name == _SIMULATED:
            emulate = True
            options = SimulatedOptions(torque_sensor=TorqueSensor())
        elif name == "moteus":
            if properties is not None:
                raise click.UsageError("--properties is for a puck")
            options = MoteusOptions(servo=node, **settings)
        else:
            table = None if properties is None else read_property_table(properties)
            options = PuckOptions(puck=node, properties=table, **settings)
        session = _Session(
            name=name,
            options=options.emulated(_EMULATED_START) if emulate else options,
            clock=SimulatedClock() if emulate else RealClock(),
            hand=_free_hand() if emulate else None,
            output=output,
        )
        function(session, **kwargs)

    return _device_options(command)


def _free_hand() -> SimulatedHand:
    return SimulatedHand(
        start=_EMULATED_START, end=_RANGE_END, mean_speed=1.0, slip_time=0.0
    )


@click.group("device", cls=Commands)
def device() -> None:
    """Bring up a Barrett Puck or a moteus on its CAN bus.

    Run these in order: probe lists the nodes on the bus, check tests whether the
    amplifier can be driven, zero sets the position of the arm, and friction turns the
    free arm. docs/howto/laboratory/hardware.md explains the results. To try the
    commands without hardware, add --emulate.
    """


@device.command("probe")
@_device_command
def _probe(session: _Session) -> None:
    """Ask every node to identify itself; nothing is set and no node is woken."""
    backend, n_nodes = session.backend, _N_NODES.get(session.name, 0)
    with session.link(all_nodes=True) as link, session.progress(n_nodes) as bar:
        reports = backend.probe(
            link, session.clock, session.options, progress=bar.update
        )
    session.write_output(
        [str(report) for report in reports] or ["nobody answers"],
        {"found": [dataclasses.asdict(report) for report in reports]},
    )
    if not reports:
        sys.exit(1)


@device.command("check")
@_device_command
def _check(session: _Session) -> None:
    """Check whether an amplifier can be driven. The arm must be at rest.

    A puck is woken, given its groups and torque limit, and put into torque mode for a
    few milliseconds with at most 0.007 N·m. A moteus is commanded zero torque and then
    sent nothing, so that its watchdog must let go. Both are idle afterwards.
    """
    with session.link() as link:
        checks = session.backend.check(link, session.clock, session.options)
    holds = all(one.holds for one in checks)
    session.write_output(
        [
            f"{'ok  ' if one.holds else 'NOT '} {one.name}: {one.result}"
            for one in checks
        ],
        {
            "holds": holds,
            "checks": [
                {"name": one.name, "holds": one.holds, "found": one.result}
                for one in checks
            ],
        },
    )
    if not holds:
        sys.exit(1)


@device.command("zero")
@click.option(
    "--angle-deg",
    type=click.FloatRange(0.0, 180.0),
    required=True,
    help="Current angle of the arm; 0 is full flexion.",
)
@_device_command
def _zero(session: _Session, angle_deg: float) -> None:
    """Set the position of the arm, which is lost when the power is switched off."""
    with session.link() as link:
        position = session.backend.zero(
            link, session.clock, session.options, angle=math.radians(angle_deg)
        )
    unit = _UNITS[session.name]
    session.write_output(
        [f"the arm is at {angle_deg:g} deg: {position:.8g} {unit}"],
        {"angle_deg": angle_deg, unit: position},
    )


@device.command("emulate")
@_device_command
def _emulate(session: _Session) -> None:
    """Emulate an amplifier for other processes until Ctrl-C is pressed.

    The bus must be one that processes on this machine can share: udp_multicast, or a
    vcan of SocketCAN. The arm is free and starts at 60 deg.
    """
    options, stop = session.options, EmergencyStop()
    if options.moves_hardware or not options.is_shared:
        raise click.UsageError("needs --interface udp_multicast, or a channel vcan0")
    with (
        session.backend.connected(
            options, clock=RealClock(), hand=_free_hand(), range_end=_RANGE_END
        ) as link,
        stop_on_signals(stop),
    ):
        click.echo(f"an emulated {session.name} is on {options.channel}")
        link.peer.run(lambda: stop.reason is not None)


def _check_free(
    _context: click.Context, _option: click.Parameter, is_free: bool
) -> None:
    if not is_free:
        raise click.UsageError(
            "the motor will move the arm; when the arm is free, add --arm-is-free"
        )


_free_arm_option = click.option(
    "--arm-is-free",
    is_flag=True,
    expose_value=False,
    callback=_check_free,
    help="Confirm that nobody holds the arm and nothing is in its way: IT WILL MOVE.",
)


@device.command("friction")
@_free_arm_option
@_device_command
def _friction(session: _Session) -> None:
    """Turn the free arm at steady speeds and fit B and β of equation (7).

    The motor moves the arm between 40 and 115 deg, at up to 80 deg/s and with at most
    2 N·m, for about 20 s.
    """
    with (
        session.moving() as (device, watching),
        session.progress(2 * len(SPEEDS)) as bar,
    ):
        runs = steady_runs(device, session.clock, progress=bar.update, **watching)
        estimate = fit_friction(runs)
    session.write_output(
        [
            *(
                f"{math.degrees(run.speed):7.1f} deg/s {run.torque:8.4f} N·m"
                for run in runs
            ),
            f"B = {estimate.viscous:.4f} ± {estimate.viscous_error:.4f} N·m·s/rad",
            f"β = {estimate.coulomb:.4f} ± {estimate.coulomb_error:.4f} N·m",
            f"offset = {estimate.offset:.4f} ± {estimate.offset_error:.4f} N·m",
        ],
        dataclasses.asdict(estimate),
    )


_study_option = click.option(
    "--study",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="Study whose [device] is meant, instead of the options for a bus.",
)


def _of_study(session: _Session, protocol: Protocol) -> _Session:
    # the device that a study has, with the hand that moves it if it is simulated
    is_emulated = has_simulated_hand(protocol.device)
    hand = _free_hand() if is_emulated else None
    return dataclasses.replace(
        session,
        name=protocol.device.backend,
        options=backend_options(protocol.device, hand),
        clock=SimulatedClock() if is_emulated else RealClock(),
        hand=hand,
    )


@device.command("calibrate")
@click.option(
    "--who", required=True, help="Name or initials of the person who calibrates."
)
@_study_option
@_free_arm_option
@click.option(
    "--mass-kg",
    callback=lambda _context, _option, text: floats(text) if text else [],
    help="Masses to hang on the arm one after the other, each way, such as 0.5,1,2.",
)
@click.option(
    "--radius-m",
    type=click.FloatRange(0.0, 1.0, min_open=True),
    help="Distance from the axis to the point where the masses pull.",
)
@_device_command
def _calibrate(
    session: _Session,
    who: str,
    study: Path | None,
    mass_kg: list[float],
    radius_m: float | None,
) -> None:
    """Measure a device's noise, delay, inertia, friction and torque gain.

    The free arm first rests for 2 s. Then the motor moves it between 40 and 115 deg for
    about a minute, with at most 2 N·m. Weights that it carries between 70 and 85 deg
    give the gain. If the device has a torque sensor, its readings are used instead of
    the masses. With --study the result is written to STUDY/calibrations, and sessions
    use it.
    """
    who = stated(who=who)["who"]
    if mass_kg and radius_m is None:
        raise click.UsageError("--mass-kg: needs --radius-m")
    if mass_kg and (min(mass_kg) <= 0.0 or len({*mass_kg}) < 2):
        raise click.UsageError(
            "--mass-kg: needs two different masses or more, each above 0, got "
            f"{', '.join(f'{mass:g}' for mass in mass_kg)}"
        )
    if study is not None:
        paths = StudyPaths(study)
        session = _of_study(session, read_protocol(paths.protocol))
    with session.moving() as (device, watching), session.progress(N_STEPS) as bar:
        values = measure_free_arm(
            device, session.clock, progress=bar.update, **watching
        )
        has_sensor = MEASURED_TORQUE in device.channels
    loads = [
        sign * mass * _GRAVITY * (radius_m or 0.0)
        for sign in (1.0, -1.0)
        for mass in mass_kg
    ]
    points = [point for load in loads for point in _carried(session, load)]
    against = "a torque sensor" if has_sensor else "weights"
    if points:
        gain = fit_gain(points)
        values |= {
            name: values[name].scaled(gain["torque_gain"])
            for name in ("inertia_kg_m2", "viscous_nms_rad", "coulomb_nm")
        } | gain
    calibration = Calibration(
        device=session.name,
        boards=_boards(session),
        distribution=_distribution(session.name),
        who=who,
        time_utc=utc_now(),
        simulated=not session.options.moves_hardware,
        gain_from=against if points else None,
        values={**values},
    )
    written = [] if study is None else [f"{write_calibration(paths, calibration)}"]
    session.write_output(
        [
            *calibration.lines,
            f"gain of torque from {against if points else 'nothing: see --mass-kg'}",
            *written,
        ],
        msgspec.to_builtins(calibration),
    )


def _carried(session: _Session, load: float) -> list[GainPoint]:
    # with somebody who hangs the weight, or a simulated hand, which needs no telling
    if session.hand is None:
        click.pause(
            f"hang a weight of {abs(load):.3f} N·m so that it "
            f"{'extends' if load > 0.0 else 'flexes'} the arm, and hold the arm; then "
            "press a key: the motor takes over at once"
        )
    else:
        session.hand.load = load
    with session.moving() as (device, watching):
        return carry(device, session.clock, load, **watching)


def _distribution(name: str) -> str:
    # What drives a device, with its version
    declared = () if name in _OWN else entry_points(group=_GROUP, name=name)
    of = next((each.dist for each in declared if each.dist), None)
    return f"{of.name} {of.version}" if of else f"masrel {masrel.__version__}"


def _boards(session: _Session) -> list[dict[str, Any]]:
    if session.name not in _BACKENDS:
        return []
    with session.link(all_nodes=True) as link:
        reports = session.backend.probe(link, session.clock, session.options)
    return [dataclasses.asdict(report) for report in reports]


@device.command("fidelity")
@_study_option
@click.option(
    "--minutes",
    type=click.FloatRange(0.01, 1440.0),
    default=0.05,
    show_default=True,
    help="Minutes for which the loop runs in real time, to see how late its ticks are.",
)
@_device_command
def _fidelity(session: _Session, study: Path | None, minutes: float) -> None:
    """Compare the torque that a device delivers with the torque of the model.

    A simulated hand, or a person who is prompted each time, makes the 32 stretches of
    HM1 to HM4 in Table V of Park, Kim and Damiano (2012). Then the loop runs in real
    time on an arm that is held still.
    """
    table_v = StudyPaths(_home() / "hess2012")
    session, protocol, calibration = _for_table_v(session, study, table_v)
    present = functools.partial(_presented, session, protocol, calibration)
    rows = [*csv.DictReader(table_v.published_file.read_text("utf-8").splitlines())]
    stretches, parts, n_parts = [], [], math.ceil(minutes)
    with session.progress(len(rows) + n_parts) as bar:
        for row in rows:
            speed = float(row["mean_speed_deg_s"])
            known = rendered(present(row["model"], speed_deg_s=speed))
            stretches.append(
                {"model": row["model"], "mean_speed_deg_s": speed, **known}
            )
            bar.update()
        for _ in range(n_parts):
            parts.append(present("HM1", still_s=60.0 * minutes / n_parts))
            bar.update()
    models, compared = compare_models(stretches)
    late, line = _lateness(parts, protocol.device.rate_hz)
    faults = [str(part.facts["fault"]) for part in parts if part.facts["fault"]]
    session.write_output(
        [*compared, line, *(f"a minute was stopped: {fault}" for fault in faults)],
        {
            "models": models,
            "stretches": stretches,
            "minutes": minutes,
            **late,
            "faults": faults,
        },
    )
    if faults:
        sys.exit(1)


def _for_table_v(
    session: _Session, study: Path | None, table_v: StudyPaths
) -> tuple[_Session, Protocol, Calibration | None]:
    # the device of STUDY, if there is one, with its calibration, and the published
    # study's protocol on it
    protocol, calibration = read_protocol(table_v.protocol), None
    if study is not None:
        paths = StudyPaths(study)
        of_study = read_protocol(paths.protocol)
        session = _of_study(session, of_study)
        is_simulated = not session.options.moves_hardware
        last = last_calibration(paths, of_study, simulated=is_simulated)
        calibration = None if last is None else last[0]
        protocol = msgspec.structs.replace(protocol, device=of_study.device)
        protocol = calibrated(protocol, calibration)
    if isinstance(session.options, MoteusOptions):
        options = dataclasses.replace(session.options, estimates_torque=True)
        session = dataclasses.replace(session, options=options)
    return session, protocol, calibration


def _lateness(parts: list[Recording], rate_hz: int) -> tuple[dict[str, object], str]:
    # how late ticks were in real time, as plain values and as a line
    late = lateness_ms(parts, rate_hz)
    late_ms = np.percentile(late, (50, 99, 99.9, 100)).tolist()
    n_missed = sum(int(part.facts["n_missed_ticks"] or 0) for part in parts)
    shares = dict(zip(("p50", "p99", "p999", "max"), late_ms, strict=True))
    line = (
        "ticks in real time, ms late: median {p50:.3f}, 99 % {p99:.3f}, "
        "99.9 % {p999:.3f}, all {max:.3f}".format(**shares)
    )
    return (
        {"late_ms": shares, "n_ticks": late.size, "n_missed_ticks": n_missed},
        f"{line}; missed {n_missed} of {n_missed + late.size}",
    )


def _presented(
    session: _Session,
    table_v: Protocol,
    calibration: Calibration | None,
    model: str,
    *,
    speed_deg_s: float = 90.0,
    still_s: float | None = None,
) -> Recording:
    # A stretch; or an arm that is held still for so long, in real time
    clock, hand = session.clock, None
    if session.hand is not None:
        clock = SimulatedClock() if still_s is None else RealClock()
        hand = SimulatedHand(
            start=_START,
            end=_RANGE_END,
            mean_speed=math.radians(speed_deg_s),
            delay=0.05 if still_s is None else 1e6,
        )
    elif still_s is None:
        click.pause(
            f"{model}: press a key, then stretch the arm from 30 deg at a mean of "
            f"{speed_deg_s:.0f} deg/s"
        )
    options = session.options.emulated(_START) if hand else session.options
    limits = device_limits(table_v.device)
    if still_s is not None:  # what is late is to be counted
        limits = dataclasses.replace(limits, missed_ticks=1_000_000)
    if still_s is not None and hand:  # and stops nothing where no hardware moves
        limits = dataclasses.replace(limits, stale_time=limits.watchdog_time)
    used = dataclasses.replace(session, clock=clock, hand=hand, options=options)
    with used.moving() as (device, watching):
        if calibration is not None:
            use_calibration(device, calibration)
        presented = run_presentation(
            device,
            model_controller(table_v, model),
            clock=clock,
            limits=limits,
            rate_hz=table_v.device.rate_hz,
            max_duration_s=still_s,
            end_angle=_RANGE_END,
            **watching,
        )
    fault = presented.fault
    # Any other fault of a minute is reported with the rest
    if fault is not None and (still_s is None or fault.kind == "emergency-stop"):
        raise DeviceError(f"{model}: {fault.message}")
    return presented.recording
