"""Scenes in the optimizers of others: `adapters.crocoddyl`, `adapters.casadi`.

Each module imports its package, which the extra of the same name installs.
"""
