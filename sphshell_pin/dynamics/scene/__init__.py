"""Scenes: a Pinocchio model, its contact pairs and joints, and their forces at a state."""
