"""Sites of one study put together into one folder.

In: folders of a study that was run at several sites. Out: a new folder with all raters,
schedules, logs and recordings, verified before and after.
"""

from masrel.lab.merging._folders import MergedStudy, merge_studies

__all__ = ["MergedStudy", "merge_studies"]
