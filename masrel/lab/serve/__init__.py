"""A study in the browser: the rater's tablet and the coordinator's screen.

In: a study. Out: pages on this computer's own address; sessions run as at the console,
each in a process of its own, into the same logs.
"""
