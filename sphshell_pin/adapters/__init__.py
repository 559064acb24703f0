"""Scenes in the programs of others: `adapters.crocoddyl`, `adapters.casadi`, `adapters.mujoco`.

Each module imports its package, which the extra of the same name installs.
"""
