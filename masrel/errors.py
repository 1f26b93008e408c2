"""Every error and warning that masrel raises on purpose.

The tree::

    MasrelError
    ├── ProtocolError (ValueError)       a study's protocol is not usable
    ├── ScheduleError (ValueError)       a schedule file is missing, foreign or stale
    ├── RatingsError (ValueError)        a table of ratings is not usable
    ├── CountsError (ValueError)         a table of counts is not usable
    ├── ParameterError (ValueError)      an argument is outside its range
    ├── RecordingError (ValueError)      a recording is damaged or not one
    ├── SessionLogError (ValueError)     a session log is damaged or not one
    │   └── SessionLogInUseError         another process has it open
    ├── ConvergenceError (RuntimeError)  a sampler has not converged
    ├── SessionStoppedError (RuntimeError)  a person stopped a session before its end
    └── DeviceError (RuntimeError)       the device cannot go on
        ├── DeviceTimeoutError (TimeoutError)
        ├── BusError                     the device's bus failed
        ├── FrameError (ValueError)      bytes on a bus mean nothing
        ├── IdledError                   the device takes no more torques
        ├── EmergencyStopError           somebody, or the device, stopped it at once
        ├── ControllerError              the controller failed
        └── LimitExceededError

    MasrelWarning (UserWarning)
    ├── UndefinedStatisticWarning  a statistic is 0/0; its value is nan, with a reason
    ├── SmallSampleWarning         an interval rests on too little to hold what it says
    ├── RatingsWarning             labels look as if they stood for missing ratings
    ├── MissingLettersWarning      a figure has letters for which no font is there
    ├── RecordingWarning           part of a recording is not used, or is suspect
    └── OverrunWarning             the control loop missed deadlines
"""

from collections.abc import Iterable

__all__ = [
    "BusError",
    "ControllerError",
    "ConvergenceError",
    "CountsError",
    "DeviceError",
    "DeviceTimeoutError",
    "EmergencyStopError",
    "FrameError",
    "IdledError",
    "LimitExceededError",
    "MasrelError",
    "MasrelWarning",
    "MissingLettersWarning",
    "OverrunWarning",
    "ParameterError",
    "ProtocolError",
    "RatingsError",
    "RatingsWarning",
    "RecordingError",
    "RecordingWarning",
    "ScheduleError",
    "SessionLogError",
    "SessionLogInUseError",
    "SessionStoppedError",
    "SmallSampleWarning",
    "UndefinedStatisticWarning",
]


class MasrelError(Exception):
    """Anything masrel raises on purpose."""


class ProtocolError(MasrelError, ValueError):
    """A study's protocol is not usable.

    Parameters
    ----------
    *problems : str
        Every problem, each with file and key.

    Attributes
    ----------
    problems : tuple of str
        The same.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class ScheduleError(MasrelError, ValueError):
    """A schedule file is missing, foreign, or was drawn from another protocol."""


class RatingsError(MasrelError, ValueError):
    """A table of ratings is not usable."""


class CountsError(MasrelError, ValueError):
    """A table of counts is not usable."""


class ParameterError(MasrelError, ValueError):
    """An argument is outside its range or not among its options."""


class RecordingError(MasrelError, ValueError):
    """A recording is damaged, incomplete, or not a recording."""


class SessionLogError(MasrelError, ValueError):
    """A session log is damaged or not a session log."""


class SessionLogInUseError(SessionLogError):
    """Another process has a session log open."""


class ConvergenceError(MasrelError, RuntimeError):
    """A sampler has not converged; the message says how many more steps it needs."""


class SessionStoppedError(MasrelError, RuntimeError):
    """A person stopped a session before its end; it can be resumed."""


class DeviceError(MasrelError, RuntimeError):
    """The device cannot continue.

    Attributes
    ----------
    kind : str
        What kind of fault it is, in one word, for logs and tables.
    """

    kind: str = "device"


class _KindError(DeviceError):
    """One that is of several kinds."""

    def __init__(self, message: str, kind: str | None = None) -> None:
        super().__init__(message)
        self.kind = kind or self.kind


class DeviceTimeoutError(DeviceError, TimeoutError):
    """The device did not answer in time."""

    kind = "no-answer"


class EmergencyStopError(DeviceError):
    """A person, a signal or the device itself asked for an emergency stop."""

    kind = "emergency-stop"


class ControllerError(DeviceError):
    """The controller failed while it decided a torque."""

    kind = "controller"


class BusError(_KindError):
    """The bus between host and device failed.

    Parameters
    ----------
    message : str
        What happened.
    kind : str, optional
        How it failed.
    """

    kind = "bus"


class FrameError(DeviceError, ValueError):
    """Bytes on a device's bus are not a valid frame, or a value does not fit in one."""

    kind = "bad-frame"


class IdledError(_KindError):
    """The device takes no more torques: somebody idled it, or it stopped itself.

    Parameters
    ----------
    message : str
        What happened.
    kind : str, optional
        Why it is idle.
    """

    kind = "idled"


class LimitExceededError(_KindError):
    """A safety limit was exceeded and the presentation was stopped.

    Parameters
    ----------
    message : str
        What was needed and what came.
    kind : str, optional
        Which limit.
    """

    kind = "limit"


class MasrelWarning(UserWarning):
    """Anything masrel warns of."""


class UndefinedStatisticWarning(MasrelWarning):
    """A statistic is undefined; its value is ``nan`` and its result says why."""


class SmallSampleWarning(MasrelWarning):
    """An interval is based on too little data for its stated coverage."""


class RatingsWarning(MasrelWarning):
    """Labels of ratings look like missing ratings."""


class MissingLettersWarning(MasrelWarning):
    """No font has some letters of a figure; the warning says how to name one.

    Parameters
    ----------
    letters : iterable of str
        The letters.
    """

    def __init__(self, letters: Iterable[str]) -> None:
        self.letters = frozenset(letters)
        listed = sorted(self.letters)
        more = " …" if len(listed) > _MAX_LETTERS else ""
        super().__init__(
            f"no font here has {' '.join(listed[:_MAX_LETTERS])}{more}: such letters "
            "are drawn as boxes; set MASREL_FONT to the file or the name of a font "
            "that has them"
        )


_MAX_LETTERS = 40


class RecordingWarning(MasrelWarning):
    """Part of a recording is not used, or does not look like what it says."""


class OverrunWarning(MasrelWarning):
    """The control loop missed deadlines; the ticks were skipped and counted."""
