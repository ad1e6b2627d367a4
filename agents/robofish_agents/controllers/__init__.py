"""Classical controllers that act on the environment's own observations."""

from robofish_agents.controllers.pid import PIDController, PIDGains

__all__ = ["PIDController", "PIDGains"]
