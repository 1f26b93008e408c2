"""One session of one rater: present every model, ask for the grade, log both.

In: a protocol and a drawn schedule. Out: an append-only session log and one
recording a presentation.
"""
