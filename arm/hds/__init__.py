"""The automaton language and its runtime; knows nothing of arms."""

from arm.hds.check import ProgramError, check_text, load
from arm.hds.finding import Finding, render
from arm.hds.nodetype import Event, NodeType, Parameter, ParameterValue, Registry, registry
from arm.hds.program import END, Node, Program
from arm.hds.runtime import Automaton, AutomatonError, Step, UnhandledEvent, UnknownNode
from arm.hds.units import Unit, UnitError, unit

__all__ = [
    "END",
    "Automaton",
    "AutomatonError",
    "Event",
    "Finding",
    "Node",
    "NodeType",
    "Parameter",
    "ParameterValue",
    "Program",
    "ProgramError",
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
