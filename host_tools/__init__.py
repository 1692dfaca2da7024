"""People's tools around the core: hil, monitor, budget, param, homes, robot-drawing."""

__version__ = "0.1.0"
