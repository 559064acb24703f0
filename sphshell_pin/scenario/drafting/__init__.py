"""Drafting of new scenarios: fingertips, postures, places to touch, grasps, and the text."""
