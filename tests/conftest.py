"""Settings of property tests: the same examples in every run, no time limit."""

from hypothesis import settings

# derandomize: a failure repeats; 100 examples a property; a slow machine is no failure.
settings.register_profile("masrel", derandomize=True, deadline=None, max_examples=100)
settings.load_profile("masrel")
