"""A study in forms that archives and other programs read.

In: a study with ratings. Out: a folder in the form of BIDS or RO-Crate, without what is
private.
"""

from masrel.lab.export._exporting import EXPORT_FORMS, export_study

__all__ = ["EXPORT_FORMS", "export_study"]
