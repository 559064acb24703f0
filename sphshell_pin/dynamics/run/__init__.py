"""Runs: integrators, single runs, open runs, rollouts and their sensitivities."""
