"""Error types. Every message is written for the person who has to mend the cause."""

from collections.abc import Iterable
from difflib import get_close_matches


class RailcosimError(Exception):
    """A mistake or failure that a user can act on; the command line prints it in one line."""


class DeclarationError(RailcosimError):
    """A plant's declaration is wrong: a name, a unit, a missing or doubled equation."""


class ParameterError(RailcosimError):
    """A parameter does not exist, has the wrong type or lies outside its range."""


class DiagramError(RailcosimError):
    """A diagram is wired wrongly: unknown block or port, open or doubly driven input."""


class UnitError(RailcosimError):
    """A unit is unknown, or two connected ports have different units."""


class AlgebraicLoopError(DiagramError):
    """Blocks with direct feedthrough depend on each other within one instant."""


class ConvergenceError(RailcosimError):
    """Coupled equations were not solved: a loop of blocks, FMUs that drive each other."""


class CheckpointError(RailcosimError):
    """A simulation's state cannot be saved, or does not belong to the diagram that resumes."""


class FmuError(RailcosimError):
    """An FMU cannot be read, loaded or stepped, or reports an error."""


class BuildError(RailcosimError):
    """C code cannot be generated or compiled."""


class FileError(RailcosimError):
    """A file cannot be read or written, or does not hold what it should."""


def suggest(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" for the nearest of `known`, or an empty string."""
    near = get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{near[0]}'?" if near else ""


def listing(names: Iterable[str], limit: int = 12) -> str:
    """Return the names separated by commas, cut after `limit` of them."""
    names = list(names)
    shown = ", ".join(names[:limit])
    return f"{shown}, … ({len(names)} in all)" if len(names) > limit else shown or "none"
