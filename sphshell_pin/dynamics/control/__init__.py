"""Controllers: joint torques from the state, and the paths that they follow."""
