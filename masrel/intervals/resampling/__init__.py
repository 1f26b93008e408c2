"""The parts of a bootstrap: pools, every resample or draws of them, and their ends."""
