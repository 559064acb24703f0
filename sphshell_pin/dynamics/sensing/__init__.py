"""Sensors: what a robot's computer knows of a run, and the log of their readings."""
