"""Many scenes at once, in columns."""

from masrel.elbow.scenes.batch import EFFORTS, EVENTS, SceneTable, evaluate

__all__ = ["EFFORTS", "EVENTS", "SceneTable", "evaluate"]
