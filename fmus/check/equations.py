"""The equations that an FMU of ours carries, evaluated and integrated independently.

They travel in the FMU as a serialized CasADi function; nothing of the generated C, the wrapper or
its solver takes part here.
"""

import json
import zipfile
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import start_of
from ..building import EQUATIONS, VARIABLES
from .excitation import Excitation
from .subject import Subject

RTOL, ATOL = 2.3e-14, 1e-15  # the tightest that scipy's DOP853 takes


class OwnEquations:
    """The function (t, x, u, p, d) -> (dx, y), with start values from the description.

    Raise FmuError if the FMU's files are not what they should be.
    """

    def __init__(self, subject: Subject) -> None:
        import casadi as ca

        path = subject.path
        with zipfile.ZipFile(path) as archive:
            text = archive.read(EQUATIONS).decode()
            names = _names(archive.read(VARIABLES))
        if names is None:
            raise FmuError(f"{path}: {VARIABLES} does not list states, inputs and so on")
        known = {name for kind in names.values() for name in kind}
        if unknown := sorted(known - subject.variables.keys()):
            raise FmuError(f"{path}: {VARIABLES} names {unknown[0]}, which is no variable")
        self.names = names
        try:
            self.function = ca.Function.deserialize(text)
        except RuntimeError as error:
            raise FmuError(
                f"{path}: this CasADi ({ca.CasadiMeta.version()}) cannot read its equations"
            ) from error
        if self.function.name_in() != ["t", "x", "u", "p", "d"]:
            raise FmuError(f"{path}: its equations are no function of (t, x, u, p, d)")
        values = {name: start_of(v) for name, v in subject.variables.items()}
        for name in (*self.names["states"], *self.names["parameters"], *self.names["discrete"]):
            if values.get(name) is None:
                raise FmuError(f"{path}: its equations need '{name}', which has no value")
        self.x0 = np.array([float(values[name]) for name in self.names["states"]])
        self.p = np.array([float(values[name]) for name in self.names["parameters"]])
        self.d = np.array([float(values[name]) for name in self.names["discrete"]])

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
        result = self.function(t=t, x=x, u=u, p=self.p, d=self.d)[what]
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
        t, x, u, p, d = (ca.SX.sym(f"s{i}", *function.size_in(i)) for i in range(5))
        dx = function(t, x, u, p, d)[0]
        jacobian = ca.jacobian(dx, ca.vertcat(x, u))
        if ca.depends_on(jacobian, ca.vertcat(t, x, u)) or ca.depends_on(dx, t):
            return None
        n, m = x.numel(), u.numel()
        matrix = np.zeros((n + m + 1, n + m + 1))
        value = ca.Function("jacobian", [p, d], [ca.densify(jacobian)])(self.p, self.d)
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
        lists = [names[kind] for kind in ("states", "inputs", "parameters", "discrete", "outputs")]
    except (ValueError, KeyError, TypeError):
        return None
    good = all(isinstance(part, list) and all(isinstance(n, str) for n in part) for part in lists)
    return names if good else None
