"""The automaton language and its runtime; knows nothing of arms."""

from arm.hds.check import ProgramError, check_text, load
from arm.hds.finding import Finding, render
from arm.hds.nodetype import (
    TERMINAL,
    TIME,
    Event,
    NodeType,
    Parameter,
    ParameterValue,
    Quantity,
    Registry,
    registry,
)
from arm.hds.program import ABORT, END, Constant, Guard, Node, Program
from arm.hds.runtime import Automaton, AutomatonError, Step, UnhandledEvent, UnknownNode
from arm.hds.units import Unit, UnitError, unit

__all__ = [
    "ABORT",
    "END",
    "TERMINAL",
    "TIME",
    "Automaton",
    "AutomatonError",
    "Constant",
    "Event",
    "Finding",
    "Guard",
    "Node",
    "NodeType",
    "Parameter",
    "ParameterValue",
    "Program",
    "ProgramError",
    "Quantity",
    "Registry",
    "Step",
    "UnhandledEvent",
    "Unit",
    "UnitError",
    "UnknownNode",
    "check_text",
    "load",
    "registry",
    "render",
    "unit",
]
