"""How a presentation ends: with zero torque, and after a fault with a closed device."""

from contextlib import suppress

from masrel.errors import DeviceError
from masrel.lab.hess._presented import Fault
from masrel.lab.hess._ticks import Ticks
from masrel.lab.hess.device import Device


def run_to_the_end(ticks: Ticks) -> tuple[str, Fault | None]:
    """Run ticks -> how they ended, and the fault; the torque is zero afterwards."""
    try:
        return _run(ticks)
    except BaseException as error:
        unsafe = _close(ticks.device)  # before anything else, whatever came
        if unsafe is not None:
            error.add_note(f"closing the device: {unsafe}")
        raise


def _run(ticks: Ticks) -> tuple[str, Fault | None]:
    try:
        ended = ticks.run()
        ticks.finish()
    except DeviceError as error:
        time_s, torque = ticks.time_s(), ticks.sent
        messages = [str(error), *_ramp_down_and_close(ticks)]
        ticks.mark(ticks.clock.now_ns(), 0.0)
        fault = Fault(
            kind=error.kind,
            message="; ".join(messages),
            time_s=time_s,
            torque_nm=torque,
        )
        return "fault", fault
    return ended, None


def _ramp_down_and_close(ticks: Ticks) -> list[str]:
    # -> what went wrong with that, in sentences
    wrong = []
    try:
        _ramp_down(ticks)
        ticks.finish()
    except DeviceError as error:
        wrong.append(f"ramping down: {error}")
    unsafe = _close(ticks.device)
    return wrong if unsafe is None else [*wrong, f"closing it: {unsafe}"]


def _ramp_down(ticks: Ticks) -> None:
    # In a straight line to zero, and recorded. Nothing is read any more, because
    # reading may be what failed.
    clock, ramp_ns, torque = ticks.clock, ticks.ramp_ns, ticks.sent
    begun_ns = now_ns = clock.now_ns()
    ticks.mark(begun_ns, torque)
    while torque != 0.0 and ramp_ns:
        n_elapsed = (now_ns - begun_ns) // ticks.period_ns  # late ones are skipped
        next_ns = min((n_elapsed + 1) * ticks.period_ns, ramp_ns)
        clock.sleep_until_ns(begun_ns + next_ns)
        now_ns = clock.now_ns()
        share = 1.0 - (now_ns - begun_ns) / ramp_ns
        if share <= 0.0:
            break
        ticks.device.command(torque * share)
        ticks.sent = torque * share
        with suppress(DeviceError):  # `finish` says so; the ramp has to go on
            ticks.watchdog.beat()
        ticks.mark(now_ns, ticks.sent)


def _close(device: Device) -> str | None:
    # Zero torque, then let go; -> what went wrong with that, or None
    try:
        device.close()
    except DeviceError as error:
        return str(error)
    return None
