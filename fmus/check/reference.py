"""References for an FMU's run: its own equations integrated independently, or a file.

The equations travel in the FMU as a serialized CasADi function; nothing of the generated C, the
wrapper or its solver takes part in the reference.
"""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import FileError, FmuError
from ...cosim import Fmu
from ...cosim.fmu_file import start_of
from ..building import EQUATIONS, VARIABLES
from ..tables import Table, read_table
from .behaviour import signal_size
from .excitation import Excitation
from .report import Comparison

RTOL, ATOL = 2.3e-14, 1e-15  # the tightest that scipy's DOP853 takes


class OwnEquations:
    """The equations that an FMU of ours carries, with the values its block sets."""

    def __init__(self, block: Fmu, description: Any) -> None:
        import casadi as ca

        with zipfile.ZipFile(block.path) as archive:
            text = archive.read(EQUATIONS).decode()
            names = _names(archive.read(VARIABLES))
        if names is None:
            raise FmuError(f"{block.path}: {VARIABLES} does not list states, inputs and so on")
        self.names = names
        try:
            self.function = ca.Function.deserialize(text)
        except RuntimeError as error:
            raise FmuError(
                f"{block.path}: this CasADi ({ca.CasadiMeta.version()}) cannot read its equations"
            ) from error
        values = {v.name: start_of(v) for v in description.modelVariables} | block.values
        for name in (*self.names["states"], *self.names["parameters"]):
            if values.get(name) is None:
                raise FmuError(f"{block.path}: its equations need '{name}', which has no value")
        self.x0 = np.array([float(values[name]) for name in self.names["states"]])
        self.p = np.array([float(values[name]) for name in self.names["parameters"]])

    def run(self, excitation: Excitation) -> tuple[dict[str, np.ndarray], str]:
        """Return states and outputs at the excitation's points, and by what method."""
        linear = self._linear_part()
        if linear is None:
            states, method = self._integrate(excitation), "DOP853 (rtol 2.3e-14, atol 1e-15)"
        else:
            states, method = self._propagate(excitation, linear), "the matrix exponential"
        found = {name: states[:, i] for i, name in enumerate(self.names["states"])}
        if self.names["outputs"]:
            rows = [
                self._evaluate("y", t, x, self._row(excitation, k))
                for k, (t, x) in enumerate(zip(excitation.times, states, strict=True))
            ]
            outputs = np.array(rows)
            found |= {name: outputs[:, i] for i, name in enumerate(self.names["outputs"])}
        return found, method

    def _row(self, excitation: Excitation, k: int) -> np.ndarray:
        # An output row shows the inputs of the step that led to it, as in the FMU.
        k = max(k - 1, 0)
        return np.array(excitation.row(k, self.names["inputs"]))

    def _evaluate(self, what: str, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        result = self.function(t=t, x=x, u=u, p=self.p)[what]
        return np.array(result).ravel()

    def _linear_part(self) -> Any:
        """Return the constant matrix M of d(x, u, 1)/dt = M (x, u, 1); None if there is none."""
        import casadi as ca

        try:
            function = self.function.expand()  # as scalars, so that constants show as such
        except RuntimeError:
            return None
        if _branches(function):
            return None  # constant pieces have zero derivatives, too
        t, x, u, p = (ca.SX.sym(f"s{i}", *function.size_in(i)) for i in range(4))
        dx = function(t, x, u, p)[0]
        jacobian = ca.jacobian(dx, ca.vertcat(x, u))
        if ca.depends_on(jacobian, ca.vertcat(t, x, u)) or ca.depends_on(dx, t):
            return None
        n, m = x.numel(), u.numel()
        matrix = np.zeros((n + m + 1, n + m + 1))
        value = ca.Function("jacobian", [p], [ca.densify(jacobian)])(self.p)
        matrix[:n, : n + m] = np.array(value)
        matrix[:n, -1] = self._evaluate("dx", 0.0, np.zeros(n), np.zeros(m))
        return matrix

    def _propagate(self, excitation: Excitation, matrix: np.ndarray) -> np.ndarray:
        from scipy.linalg import expm

        times, n = excitation.times, len(self.x0)
        x, rows = self.x0, [self.x0]
        steps: dict[float, np.ndarray] = {}
        for k in range(len(times) - 1):
            h = round(float(times[k + 1] - times[k]), 12)
            if h not in steps:
                steps[h] = expm(matrix * h)
            u = excitation.row(k, self.names["inputs"])
            x = (steps[h] @ np.concatenate([x, u, [1.0]]))[:n]
            rows.append(x)
        return np.array(rows)

    def _integrate(self, excitation: Excitation) -> np.ndarray:
        """Integrate from each change of an input to the next."""
        from scipy.integrate import solve_ivp

        times, names = excitation.times, self.names["inputs"]
        inputs = np.array([excitation.row(k, names) for k in range(len(times))])
        changes = [0, *(k for k in range(1, len(times) - 1) if (inputs[k] != inputs[k - 1]).any())]
        states = np.empty((len(times), len(self.x0)))
        states[0] = self.x0
        for a, b in zip(changes, [*changes[1:], len(times) - 1], strict=True):
            u = inputs[a]
            solution = solve_ivp(
                lambda t, x, u=u: self._evaluate("dx", t, x, u),
                (times[a], times[b]),
                states[a],
                method="DOP853",
                t_eval=times[a + 1 : b + 1],
                rtol=RTOL,
                atol=ATOL,
            )
            if not solution.success:
                raise FmuError(f"the reference cannot be integrated: {solution.message}")
            states[a + 1 : b + 1] = solution.y.T
        return states


def compare(
    outputs: Mapping[str, str | None],
    times: np.ndarray,
    found: np.ndarray,
    expected: dict[str, np.ndarray],
    tolerance: float,
) -> list[Comparison]:
    """Return one comparison for each output (name -> unit) that the reference has.

    The allowed error is `tolerance` times the reference's largest magnitude (at least 1e-6).
    """
    rows = []
    for i, (name, unit) in enumerate(outputs.items()):
        if name not in expected:
            continue
        error = np.abs(found[:, i] - expected[name])
        at = int(np.argmax(np.where(np.isnan(error), np.inf, error)))
        allowed = tolerance * signal_size(expected[name])
        rows.append(Comparison(name, unit or "", float(error[at]), float(times[at]), allowed))
    return rows


def read_reference(file: str | Path, block: Fmu) -> Table:
    """Return the file's table; its columns are outputs of the FMU, or inputs to apply."""
    table = read_table(file, [*block.outputs, *block.inputs], "output or input")
    if not set(block.outputs) & set(table.columns):
        raise FileError(f"{file} has no output of the FMU to compare with")
    return table


def _branches(function: Any) -> bool:
    """Return whether an SX function compares, rounds or takes signs anywhere."""
    import casadi as ca

    names = [
        "LT",
        "LE",
        "EQ",
        "NE",
        "NOT",
        "AND",
        "OR",
        "FLOOR",
        "CEIL",
        "FMOD",
        "REMAINDER",
        "FABS",
        "SIGN",
        "COPYSIGN",
        "IF_ELSE_ZERO",
        "FMIN",
        "FMAX",
    ]
    kinds = {getattr(ca, f"OP_{name}") for name in names}
    return any(function.instruction_id(i) in kinds for i in range(function.n_instructions()))


def _names(data: bytes) -> dict[str, list[str]] | None:
    """Return the variables' names by kind; None if the file is not what it should be."""
    try:
        names = json.loads(data)
        lists = [names[kind] for kind in ("states", "inputs", "parameters", "outputs")]
    except (ValueError, KeyError, TypeError):
        return None
    good = all(isinstance(part, list) and all(isinstance(n, str) for n in part) for part in lists)
    return names if good else None
