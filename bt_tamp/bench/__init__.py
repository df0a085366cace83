"""Benchmarks: measured figures beside what they should be."""
