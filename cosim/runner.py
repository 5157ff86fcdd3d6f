"""Many runs of one diagram, each with other values: what a run can leave to the next is kept."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from ..base.errors import DiagramError, RailcosimError
from .kit import KeptKit
from .options import Options
from .simulation import Simulation

if TYPE_CHECKING:
    from .diagram import Diagram
    from .results.result import Run
    from .scenario import Scenario

_TRIAL = 1000  # ticks


class Runner:
    """Runs a diagram again and again; see Diagram.runner. Close it, or use it in a `with`.

    It keeps the plan, the generated program, the compiled engine's table and the FMUs' instances.
    These are brought back by fmi2Reset; one that cannot be, or whose run failed, is made anew.
    FMUs that railcosim did not make are first tried: over the diagram's first 1000 ticks a reset
    instance must run to the same bits as a fresh one, or each run has fresh ones.
    """

    def __init__(self, diagram: "Diagram", options: Options, ticks: int) -> None:
        self._diagram, self._options, self._ticks = diagram, options, ticks
        self._kit = KeptKit()
        self._state = "new"  # then "ready", "at work" within a run, and "closed"

    def run(
        self, values: Mapping[str, Any] | None = None, scenario: "Scenario | None" = None
    ) -> "Run":
        """Return what `diagram.with_values(values).run(stop, scenario=scenario)` does, bit for bit.

        `values` are parameters by "block.parameter"; those not named are the diagram's, whatever
        the run before had. Errors are those of with_values and run, and leave the runner usable.
        Raise DiagramError if the runner is closed, or at work.
        """
        if self._state in ("at work", "closed"):
            remedy = "; each thread needs one of its own" if self._state == "at work" else ""
            raise DiagramError(f"the runner of '{self._diagram.name}' is {self._state}{remedy}")
        diagram = self._diagram.with_values(values) if values else self._diagram
        is_new, self._state = self._state == "new", "at work"
        try:
            if is_new:
                self._try()
            return self._run(diagram, replace(self._options, scenario=scenario), self._ticks)
        finally:
            self._state = "ready"

    def _run(self, diagram: "Diagram", options: Options, ticks: int) -> "Run":
        simulation = Simulation(diagram, options, ticks=ticks, kit=self._kit)
        with simulation:
            while simulation.tick < ticks and not simulation.ended:
                simulation.advance_ticks(ticks)
            simulation.finish()
        return simulation.result()

    def _try(self) -> None:
        """Find out whether FMUs of others can be reset."""
        from .blocks.fmu import Fmu
        from .fmu.file import is_ours, read_description

        blocks = [b for b in self._diagram.blocks.values() if isinstance(b, Fmu)]
        if all(is_ours(read_description(block.path)) for block in blocks):
            return
        options = replace(self._options, record=None, observers=())
        ticks = min(self._ticks, _TRIAL)
        instances = self._kit.instances
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                fresh = self._run(self._diagram, options, ticks)
                instances.trusts_others = True
                made = instances.made
                again = self._run(self._diagram, options, ticks)
            except RailcosimError:
                instances.trusts_others = False
                return
        same = fresh.values.tobytes() == again.values.tobytes()
        instances.trusts_others = same and instances.made == made

    def close(self) -> None:
        """Free the FMUs; a second call does nothing."""
        self._state = "closed"
        self._kit.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
