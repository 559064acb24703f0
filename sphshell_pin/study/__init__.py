"""Many runs, and what they say: sweeps, speed against error, checks of whole robots."""
