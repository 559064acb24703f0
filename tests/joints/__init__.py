"""Spheres where faces meet, judged by exact truth: `python -m tests.joints`."""
