"""A block on floats against the same block traced on symbols."""

from typing import Any

import casadi as ca
import numpy as np

from railcosim import Block
from railcosim.fmus import trace
from railcosim.fmus.tracing import flat


def largest_difference(block: Block, states: list[Any], inputs: list[tuple[float, ...]]) -> float:
    """Return the largest difference of outputs and next states over all points."""
    traced = trace(block)
    x = np.array([flat(s) for s in states]).reshape(len(states), -1).T
    u = np.array(inputs).T
    mapped = traced.map(len(states))
    y, x_next = mapped(ca.DM(x), ca.DM(u), ca.DM(0, len(states)))
    found = np.vstack([np.array(ca.densify(y)), np.array(ca.densify(x_next))]).T
    worst = 0.0
    for row, state, values in zip(found, states, inputs, strict=True):
        outputs, following = block.step(state, *values)
        expected = [*(outputs if isinstance(outputs, tuple) else (outputs,)), *flat(following)]
        for a, b in zip(row.tolist(), expected, strict=True):
            scale = max(1.0, abs(b))  # the neuron's weights grow without bound
            worst = max(worst, abs(a - b) / scale)
    return worst
