"""The laboratory: studies on a haptic simulator of elbow spasticity.

The flow, each stage handing the next a file that a person can open::

    protocol -> schedule -> run -> ratings -> analysis -> report

and two libraries that know nothing of studies::

    elbow       the spastic joint: events, torque, traces
    hess        the driver of the simulator, on a simulated device by default

Its interface is the command line, the files, these two libraries, recordings, and what
is exported here. Names of the other packages serve its commands, and may change.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

if TYPE_CHECKING:
    from masrel.lab.analysis import analyze
    from masrel.lab.protocol import StudyPaths, read_protocol
    from masrel.lab.ratings import read_study_data
    from masrel.lab.report._document import write_report
    from masrel.lab.run._simulated_raters import SimulatedGrades
    from masrel.lab.run.session import run_session

_HOMES = {
    "SimulatedGrades": "run._simulated_raters",
    "StudyPaths": "protocol",
    "analyze": "analysis",
    "read_protocol": "protocol",
    "read_study_data": "ratings",
    "run_session": "run.session",
    "write_report": "report._document",
}

__all__ = [
    "SimulatedGrades",
    "StudyPaths",
    "analyze",
    "elbow",
    "hess",
    "read_protocol",
    "read_study_data",
    "run_session",
    "write_report",
]


# All is loaded on first use: importing masrel.lab costs nothing.
__getattr__ = loaded_from(__name__, _HOMES, packages=__all__)
