"""The FMU that fails on purpose: what it can do, and where (see faulty.c)."""

from enum import IntEnum
from pathlib import Path

from . import foreign_fmu


class Fault(IntEnum):
    HONEST = 0
    ERROR = 1
    DISCARD_LONG = 2
    DISCARD_ALL = 3
    FATAL = 4
    NO_NUMBER = 5
    SEGV = 6
    ABORT = 7
    EXIT = 8
    LOOP = 9
    MANY_LOGS = 10
    HUGE_LOG = 11
    SLOW = 12
    PRINT = 13
    READ = 14
    WARN = 15
    LEAVE_CHILD = 16


class Phase(IntEnum):
    STEP = 0
    GET = 1
    SETUP = 2
    ENTER = 3
    EXIT = 4
    TERMINATE = 5
    FREE = 6
    SAVE = 7


FUNCTIONS = {
    Phase.STEP: "fmi2DoStep",
    Phase.GET: "fmi2GetReal",
    Phase.SETUP: "fmi2SetupExperiment",
    Phase.ENTER: "fmi2EnterInitializationMode",
    Phase.EXIT: "fmi2ExitInitializationMode",
    Phase.TERMINATE: "fmi2Terminate",
    Phase.FREE: "fmi2FreeInstance",
    Phase.SAVE: "fmi2GetFMUstate",
}


def faulty_fmu(folder: Path, *, declares: tuple[str, ...] = (), instantiate: str = "") -> Path:
    """Compile it; `instantiate` is what it does there: "none" (no instance), "abort" or "loop"."""
    return foreign_fmu("faulty", folder, declares=declares, lie=instantiate)
