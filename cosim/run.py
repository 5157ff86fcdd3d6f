"""Running a diagram from start to stop."""

from fractions import Fraction
from typing import TYPE_CHECKING

from ..base.errors import DiagramError
from .clock import Clock, is_time, rational
from .options import Options
from .results.result import Run
from .simulation import Simulation

if TYPE_CHECKING:
    from .diagram import Diagram


def run(diagram: "Diagram", stop: float | Fraction, options: Options, *, progress: bool) -> Run:
    """Run a diagram to `stop` (s); see Diagram.run."""
    from tqdm import tqdm

    ticks = run_ticks(diagram, stop, options)
    simulation = Simulation(diagram, options, ticks=ticks)
    with simulation:
        # disable=None: no bar where standard error is not a terminal.
        with tqdm(
            total=ticks,
            initial=simulation.tick,
            desc=diagram.name,
            unit=" steps",
            delay=2.0,
            disable=None if progress else True,
            leave=False,
        ) as bar:
            while simulation.tick < ticks and not simulation.ended:
                before = simulation.tick
                simulation.advance_ticks(ticks)
                bar.update(simulation.tick - before)
        simulation.finish()
    return simulation.result()


def run_ticks(diagram: "Diagram", stop: float | Fraction, options: Options) -> int:
    """Return the run's length; raise DiagramError for a stop that is none."""
    if not is_time(stop):
        raise DiagramError(f"stop must be a time in s, not {stop!r}")
    clock = Clock(diagram.step, rational(options.start))
    if not rational(stop) > clock.start:
        start = float(clock.start)
        raise DiagramError(f"stop = {float(stop):g} s must lie after start = {start:g} s")
    what = "stop − start" if clock.start else "stop"
    ticks = clock.ticks(rational(stop) - clock.start, what)
    if options.resume is not None and options.resume.tick >= ticks:
        raise DiagramError(
            f"stop = {float(stop):g} s must lie after the checkpoint's "
            f"{clock.time(options.resume.tick):g} s"
        )
    return ticks
