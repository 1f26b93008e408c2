"""Many scenes at once, in columns."""

from masrel.elbow.scenes.batch import EFFORTS, EVENTS, SceneTable, evaluate
from masrel.elbow.scenes.traces import torque_traces

__all__ = ["EFFORTS", "EVENTS", "SceneTable", "evaluate", "torque_traces"]
