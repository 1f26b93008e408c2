"""Settings of property tests: the same examples in every run, no time limit."""

from hypothesis import settings

# derandomize: a failure repeats; 50 examples a property; a slow machine is no failure.
settings.register_profile("masrel", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("masrel")
