"""Benchmarks that write pages; what only measures is in ``tests/benchmarks``."""
