"""Whether printed agreement can be true: which tables give the numbers of a paper.

In: how many items, categories and raters, and the numbers as they are printed. Out:
how many integer tables give them, under which reading of what was printed.
"""

from masrel.audit._consistency import ConsistentTables, Reading, consistent_tables

__all__ = ["ConsistentTables", "Reading", "consistent_tables"]
