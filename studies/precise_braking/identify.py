"""Experiments 1 and 2: how true the models are to logs, and how to identify them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from ...base.railway import KILOMETRES_PER_HOUR
from ...cosim import Delay, Diagram, Fmu, Hold, Profile
from ...fmus import build
from ...models import coarse_metro_train, metro_train
from ..identification.braking import Braking, brakings
from ..identification.braking_model import CENTIMETRES
from ..identification.braking_model import STEP as LONGEST_STEP
from ..identification.equations import K1K2
from ..identification.fit import EVALUATIONS, METHODS, SEARCHES, Fit, fit
from ..identification.identify import SEARCH_STEP, identify
from ..identification.precise_model import PreciseModel
from ..identification.report import Report
from .logs import SEED, SyntheticLog, synthetic_logs
from .loop import PERIOD, STEP
from .stations import FIDELITY
from .truth import Truth

if TYPE_CHECKING:
    import pandas as pd

LOW_SPEED = 12.0 / KILOMETRES_PER_HOUR  # m/s; below, the air brake takes over
MODELS: tuple[str, ...] = ("precise", "coarse", "coarse_fitted")


@dataclass(frozen=True, kw_only=True, eq=False)
class Fidelity:
    """Experiment 1: the models' speed errors (cm/s) on synthetic logs (figures 5, 6, table 2).

    `coarse` is the existing model with the paper's parameters, `coarse_fitted` the same fitted to
    the logs. `by_log` has a row for each log; `fast` and `slow` are the errors over the samples
    above and below 12 km/h. `paper` is table 2's.
    """

    report: Report
    rmse: dict[str, float]
    fast: dict[str, float]
    slow: dict[str, float]
    by_log: "pd.DataFrame"
    paper: dict[str, float]

    @property
    def ratio(self) -> float:
        """The existing model's error over the precise one's; the paper's is 4.5."""
        return self.rmse["coarse"] / self.rmse["precise"]


def fidelity(logs: Sequence[SyntheticLog] | None = None, *, seed: int = SEED) -> Fidelity:
    """Return experiment 1 on given logs, or on the synthetic ones of a seed."""
    import pandas as pd

    made = synthetic_logs(seed=seed) if logs is None else logs
    report = identify([m.log for m in made])
    fits = dict(zip(MODELS, (report.precise, report.published, report.coarse), strict=True))
    known = {name: found for name, found in fits.items() if found is not None}
    slow = report.best.model.measured < LOW_SPEED
    parts = {
        name: [_rms(found.model.errors(found.free)[rows]) for rows in (~slow, slow)]
        for name, found in known.items()
    }
    names = [b.name for b in report.best.model.brakings]
    return Fidelity(
        report=report,
        rmse={name: found.rmse for name, found in known.items()},
        fast={name: fast for name, (fast, _) in parts.items()},
        slow={name: low for name, (_, low) in parts.items()},
        by_log=pd.DataFrame({n: f.rmse_by_log for n, f in known.items()}, index=names),
        paper={name: error for name, (error, _) in FIDELITY.items()},
    )


@dataclass(frozen=True, kw_only=True)
class Target:
    """What identification should find: the mean of the trains that the logs were made with.

    `coefficient` is the mean of P1/μ and `gain` that of K/μ, which act; times in s.
    """

    electric_delay: float
    electric_lag: float
    coefficient: float
    air_delay: float
    air_lag: float
    gain: float

    @property
    def delays(self) -> float:
        """T1 + T2 in s."""
        return self.electric_delay + self.electric_lag


def target(logs: Sequence[SyntheticLog]) -> Target:
    """Return what the logs' trains have on average."""

    def mean(value: Callable[[Truth], float]) -> float:
        return float(np.mean([value(m.truth) for m in logs]))

    return Target(
        electric_delay=mean(lambda t: t.electric_delay),
        electric_lag=mean(lambda t: t.electric_lag),
        coefficient=mean(lambda t: t.electric_coefficient / t.mass_ratio),
        air_delay=mean(lambda t: t.air_delay),
        air_lag=mean(lambda t: t.air_lag),
        gain=mean(lambda t: t.air_gain / t.mass_ratio),
    )


def methods(
    logs: Sequence[SyntheticLog] | None = None,
    *,
    seed: int = SEED,
    evaluations: int = EVALUATIONS,
    search_seeds: Sequence[int] = (0,),
) -> "pd.DataFrame":
    """Return experiment 2: the precise model identified by each method, a row for each fit.

    Columns: the six parameters by symbol, T1+T2 (s), `coefficient_error` (of P1, in %) and
    `delay_error` (of T1+T2, in s) from the trains' mean, `rmse` (cm/s), `evaluations`, `seconds`,
    `search_seed`. Searches without derivatives have the same evaluations; each evaluation of the
    two least-squares methods has its sensitivities.
    """
    import pandas as pd

    made = synthetic_logs(seed=seed) if logs is None else logs
    wanted = target(made)
    found_brakings = brakings([m.log for m in made])
    rows = []
    for method in METHODS:
        searching = method in SEARCHES
        model = PreciseModel(found_brakings, step=SEARCH_STEP if searching else LONGEST_STEP)
        for search_seed in search_seeds if searching else (0,):
            found = fit(model, method=method, evaluations=evaluations, seed=search_seed)
            rows.append(_row(found, wanted, search_seed if searching else None))
    return pd.DataFrame(rows).set_index("method")


def _row(found: Fit, wanted: Target, search_seed: int | None) -> dict[str, object]:
    values = found.values
    delays = values["electric_delay"] + values["electric_lag"]
    share = values["electric_coefficient"] / wanted.coefficient - 1.0
    return {
        "method": found.method,
        **{p.symbol: values[p.name] for p in found.model.free},
        "T1+T2": delays,
        "coefficient_error": 100.0 * share,
        "delay_error": delays - wanted.delays,
        "rmse": found.rmse,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "search_seed": search_seed,
    }


@dataclass(frozen=True, kw_only=True)
class ComputingTime:
    """Times in s, the least of several: of the models alone, and of the FMUs in a co-simulation.

    `precise` and `coarse` run all logs once; `precise_loop` and `coarse_loop` one log's command
    through delays into the FMU, by steps of 0.01 s. The paper's are for its own logs.
    """

    precise: float
    coarse: float
    precise_loop: float
    coarse_loop: float
    paper_precise: float
    paper_coarse: float


def computing_time(report: Report, *, repeats: int = 20) -> ComputingTime:
    """Return how long the two models take, on the logs of a report on both (table 2)."""
    found = {"precise": report.precise, "coarse": report.published}
    alone, loops = {}, {}
    for name, known in found.items():
        assert known is not None
        alone[name] = _least_time(partial(known.model.speeds, known.free), repeats)
        braking = known.model.brakings[0]
        loop, stop = command_loop(known, braking), round(float(braking.time[-1]), 2)
        loops[name] = _least_time(partial(loop.run, stop, record=[], progress=False), repeats // 4)
    return ComputingTime(
        precise=alone["precise"], coarse=alone["coarse"],
        precise_loop=loops["precise"], coarse_loop=loops["coarse"],
        paper_precise=FIDELITY["precise"][1], paper_coarse=FIDELITY["coarse"][1],
    )  # fmt: skip


def command_loop(found: Fit, braking: Braking) -> Diagram:
    """Return a fitted model as a co-simulation: a braking's command, the delays, the FMU.

    The gradient stays the first, and the delays are whole steps: for times alone.
    """
    values = {name: float(v[0]) for name, v in found.model.values(found.free).items()}
    if found.model.name == "precise":
        delays = {"electric_command": "electric_delay", "air_command": "air_delay"}
        plant, brake = metro_train(gradients=1), "motors"
        shared = ("electric_coefficient", "electric_lag", "air_delay", "air_lag", *K1K2)
        start = values["electric_coefficient"]
    else:
        delays = {"command": "delay"}
        plant, brake, shared, start = coarse_metro_train(gradients=1), "effort", ("lag",), 1.0
    points = list(zip(braking.command_time.tolist(), braking.command.tolist(), strict=True))
    after = tuple(point for point in points if point[0] >= 0.0)

    def history(t: float) -> float:
        before = np.searchsorted(braking.command_time, t + 1e-9, side="right") - 1
        return float(braking.command[max(before, 0)])

    loop = Diagram(f"{found.model.name}_command", step=STEP)
    loop.add("command", Profile(after, unit="m/s2"))
    loop.add("hold", Hold(period=PERIOD))
    loop.connect("command.y", "hold.u")
    known = {name: values[name] for name in shared}
    known |= {"gradient[1]": float(braking.gradient[0]), "speed": braking.start_speed}
    known |= {brake: start * after[0][1]}
    loop.add("train", Fmu.with_values(build(plant), known))
    for port, name in delays.items():
        whole = round(values[name], 2)  # of the step of 0.01 s
        loop.add(name, Delay(whole, initial=history, interpolation="hold"))
        loop.connect("hold.y", f"{name}.u")
        loop.connect(f"{name}.y", f"train.{port}")
    return loop


def _least_time(run: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats + 1):
        began = perf_counter()
        run()
        times.append(perf_counter() - began)
    return min(times[1:])


def _rms(errors: np.ndarray) -> float:
    return CENTIMETRES * float(np.sqrt(np.mean(errors**2)))
