"""The plants that come with railcosim, by name, and how to reach one: ours or a user's own."""

import importlib.util
import sys
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ..base.errors import FileError, ParameterError, RailcosimError, listing, suggest

if TYPE_CHECKING:
    from .plant import Plant

# name -> (module, one line)
PLANTS = {
    "second_order_train": (
        "second_order",
        "train speed as an identified second-order system (gain, wn, damping)",
    ),
    "second_order_train_on_line": (
        "second_order_on_line",
        "the same with a position, a friction brake and a standstill",
    ),
    "dc_drive_train": (
        "dc_drive",
        "separately excited DC motors and their train, the physics of the above",
    ),
    "stopping_train": (
        "stopping",
        "train before a stopping mark: lagged brake and traction, emergency brake",
    ),
    "metro_train": (
        "metro_precise",
        "metro train on a line: electric brake, blending, air brake, standstill",
    ),
    "coarse_metro_train": (
        "metro_coarse",
        "the same train whose braking is one first-order lag",
    ),
    "heavy_haul_train": (
        "heavy_haul",
        "2 locomotives and 100 coal wagons: draft gears with hysteresis, air brake wave",
    ),
}


def catalogue() -> dict[str, str]:
    """Return the plants' names, each with one line of description."""
    return {name: text for name, (_, text) in PLANTS.items()}


def plant_named(name: str) -> "Plant":
    """Return a plant by its name, or from a user's file as "path/to/file.py:function".

    The function takes no arguments and returns a finished `Plant` or a `casadi.DaeBuilder`.
    Raise ParameterError for an unknown name, FileError for a file that cannot be read or has no
    such function.
    """
    file, colon, function = name.rpartition(":")
    if colon and file.endswith(".py"):
        return _from_file(Path(file), function)
    key = name.replace("-", "_")
    if key not in PLANTS:
        raise ParameterError(
            f"no model '{name}'; models: {listing(PLANTS)}, or FILE.py:FUNCTION"
            f"{'' if name.endswith('.py') else suggest(key, PLANTS)}"
        )
    return getattr(import_module(f".{PLANTS[key][0]}", __package__), key)()


def _from_file(file: Path, function: str) -> "Plant":
    import casadi as ca

    from .dae_builder import plant_of
    from .plant import Plant

    if not file.is_file():
        raise FileError(f"no file {file}")
    file = file.absolute()  # as it stands in tracebacks
    spec = importlib.util.spec_from_file_location(f"railcosim_user_{file.stem}", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
        plant = getattr(module, function)()
    except RailcosimError as error:
        raise type(error)(f"{file}{_line(error, file)}: {error}") from error
    except AttributeError as error:
        if hasattr(module, function):
            line = _line(error, file)
            raise FileError(f"{file}{line}: {function}() failed: {error}") from error
        names = [n for n, v in vars(module).items() if _is_own_function(v, module)]
        raise FileError(f"{file} has no function '{function}'; it has {listing(names)}") from error
    except SyntaxError as error:
        raise FileError(f"{file}{_line(error, file)}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        words = _explained(error)
        raise FileError(f"{file}{_line(error, file)}: {words}") from error
    if isinstance(plant, ca.DaeBuilder):
        return plant_of(plant)
    if not isinstance(plant, Plant):
        kind = type(plant).__name__
        raise FileError(f"{file}: {function}() returns {kind}, not a Plant or casadi.DaeBuilder")
    return plant


def _is_own_function(value: object, module: ModuleType) -> bool:
    return isfunction(value) and value.__module__ == module.__name__ and value.__name__[0] != "_"


def _explained(error: BaseException) -> str:
    """Return an error's words; CasADi's about symbols in Python's own terms get a remedy."""
    words = str(error)
    if "truth value" in words:
        return (
            "a CasADi symbol has no truth value: write ca.if_else, ca.logic_and, ca.logic_or, "
            "ca.fmin and ca.fmax instead of if, and, or, min and max"
        )
    if "to_double" in words or "__float__" in words:
        return "Python's math and float() know no CasADi symbols: write ca.sin and so on"
    return f"{type(error).__name__}: {words}"


def _line(error: BaseException, file: Path) -> str:
    """Return ", line N" for the last line of the file that the error came through."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f", line {error.lineno}"
    trace, line = error.__traceback__, ""
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(file):
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line
