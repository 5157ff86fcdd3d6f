"""Claims on the plant, on the adapted factors (Fig. 6), and on the table of γ."""

import numpy as np

from ...controllers.adaptive_rules import GAMMA_RULES
from ...cosim import Run
from ..ledger import Entry, every, less, number, verdict
from ..results import Results


def plant(r: Results) -> Entry:
    """The physical plant against the identified one."""
    largest, where = None, ""
    for (experiment, controller), run in r.runs.items():
        twin = r.runs.get((f"{experiment}_dc", controller))
        if twin is None or len(twin.time) != len(run.time):
            continue
        apart = float(np.max(np.abs(run["train.speed"] - twin["train.speed"])))
        if largest is None or apart > largest:
            largest, where = apart, f" (in {experiment}, {controller})"
    return Entry(
        "A train on separately excited DC motors is a second-order system from notch to speed",
        "section 1, eq. 1 to 5",
        "largest difference of speed between the physical plant and the transfer function, over "
        f"all experiments and controllers: {_tiny(largest, 'm/s')}{where}",
        verdict(less(largest, 1e-9)),
        "equations (4) and (5) are lost and reconstructed; the physical parameters are ours, "
        "chosen to give the identified plant; the armature's 2.5 H are far above a real one",
    )


def ke(r: Results) -> Entry:
    """How ke follows the error on the way from 0 to 10 m/s."""
    run = _adapted(r)
    if run is None:
        outside = inside = jump = None
    else:
        error = np.abs(run["reference.y"] - run["train.speed"])
        factor = run["controller.ke"]
        far = error > 3.0
        outside = float(np.max(np.abs(factor[far] * error[far] - 3.0), initial=0.0))
        near = ~far
        order = np.argsort(error[near])
        inside = bool(np.all(np.diff(factor[near][order]) <= 1e-12))
        jump = float(np.max(np.abs(np.diff(factor))))
    final = None if run is None else float(run["controller.ke"][-1])
    return Entry(
        "ke shrinks for large errors, so that they are known as large, grows for small ones, and "
        "moves without jumps",
        "section 2.2, Fig. 6",
        f"largest |ke·|e| − 3| outside the universe {_tiny(outside, '')}, ke at the end "
        f"{number(final, '')}, largest change between samples {number(jump, '')}",
        verdict(every(less(outside, 1e-12), inside, less(jump, 0.1))),
        "from 0 to 10 m/s: ke·|e| = 3 while |e| > 3 m/s, ke falls with |e| inside, and no change "
        "in 0.02 s exceeds 0.1; kec does jump, from 4 to 5, as the paper has it",
    )


def gamma_table(r: Results) -> Entry:
    """Whether table 2 says what section 2.3 says. Nothing of the run is needed."""
    table = np.array(GAMMA_RULES.rules)  # rows EC, columns E, 0 (VS) to 4 (VB)
    opposite = [(i, j) for i in range(7) for j in range(7) if (i - 3) * (j - 3) <= 0]
    ends = [int(table[i, j]) for i, j in opposite if j in (0, 6)]
    inward = [table[i, j] >= table[i, j + (1 if j < 3 else -1)] for i, j in opposite if j != 3]
    same = [
        table[i, j] >= table[6 - i, j] for i in range(7) for j in range(7) if (i - 3) * (j - 3) > 0
    ]
    broken = [(i, j) for i in range(7) for j in range(7) if table[i, j] != table[6 - i, 6 - j]]
    labels = GAMMA_RULES.rows.labels
    pairs = ", ".join(
        f"({labels[i]}, {labels[j]}) = {GAMMA_RULES.output.labels[table[i, j]]} against "
        f"{GAMMA_RULES.output.labels[table[6 - i, 6 - j]]}"
        for i, j in broken[: len(broken) // 2]
    )
    return Entry(
        "γ is large where e·ec ≤ 0 and e lies outside the universe, falls towards e = 0, and is "
        "larger where e·ec > 0",
        "section 2.3, table 2",
        f"e·ec ≤ 0 at the universe's ends: smallest γ {GAMMA_RULES.output.labels[min(ends)]}; "
        f"towards e = 0 it does not grow in {sum(inward)} of {len(inward)} cells; for e·ec > 0 "
        f"it is not smaller than for −ec in {sum(same)} of {len(same)} cells; cells that are not "
        f"their opposite's mirror: {pairs or 'none'}",
        verdict(
            {
                "outside the universe": min(ends) >= 3,
                "towards e = 0": all(inward),
                "e·ec > 0": all(same),
            }
        ),
        "read cell by cell, rows EC, columns E (the paper heads both with Ec); large is B or VB",
    )


def gamma_on_the_way(r: Results) -> Entry:
    """γ·ku on the way from 0 to 10 m/s."""
    run = _adapted(r)
    far = near = None
    if run is not None:
        error, scale = run["reference.y"] - run["train.speed"], run["controller.scale"]
        outside = np.abs(error) > 3.0
        far = float(np.min(scale[outside])) if np.any(outside) else None
        near = float(scale[-1])
    return Entry(
        "On the way to 10 m/s γ·ku is large at first and falls as the error does",
        "section 3, Fig. 6",
        f"smallest γ·ku while |e| > 3 m/s {number(far, '')}, at the end {number(near, '')}",
        verdict(less(near, far, margin=0.5)),
        "with ku = 10: at the end below half of what it is outside the universe",
    )


def _adapted(r: Results) -> Run | None:
    """Return the adaptive run from rest, if it has the signals that only that controller has."""
    run = r.runs.get(("start", "adaptive"))
    signals = {"controller.ke", "controller.scale"}
    return run if run is not None and signals <= set(run.columns) else None


def _tiny(value: float | None, unit: str) -> str:
    return "not measured" if value is None else f"{value:.1e} {unit}".rstrip()
