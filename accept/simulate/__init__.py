"""Simulated units: whole unit folders from a model, for training, tests and the demo."""

from accept.simulate.faults import FAULTS
from accept.simulate.unit import SimulatedUnit, simulate, write
from accept.simulate.unit_request import UnitRequest, UnitRequestError

__all__ = ["FAULTS", "SimulatedUnit", "UnitRequest", "UnitRequestError", "simulate", "write"]
