"""A communication step that an FMU discards, repeated in smaller steps."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .instance import FmuInstance

_DEPTH = 20  # the smallest step is 2^-20 of the one that was asked for
_ATTEMPTS = 4096  # an FMU that goes on discarding ends the run, never the patience
_DISCARD = 2


def repeat(instance: "FmuInstance", state: Any, t: float, h: float) -> None:
    """Step from t to t + h (s) in pieces, from the state saved before; raise FmuError if none go.

    A discarded piece is halved, and after one that went well the next is twice as long. Inputs
    with a slope start each piece where the line has come to.
    """
    whole = 1 << _DEPTH
    place, level = 0, 1
    inputs = _Inputs(instance)
    instance.restore(state)
    for _ in range(_ATTEMPTS):
        span = whole >> level
        inputs.put(h * place / whole)
        state = instance.save(state)
        status = instance.try_step(t + h * place / whole, h * span / whole)
        if status == _DISCARD and level < _DEPTH:
            instance.restore(state)
            level += 1
            continue
        if status > 1:
            remedy = f"; a step of {h * span / whole:.3g} s was the smallest tried"
            instance.fail("fmi2DoStep", status, t + h * place / whole, remedy)
        place += span
        if place == whole:
            inputs.write(0.0)
            return
        if level > 1 and place % (2 * span) == 0:
            level -= 1
    remedy = f"; {_ATTEMPTS} smaller steps between {t:.9g} and {t + h:.9g} s did not do"
    instance.fail("fmi2DoStep", _DISCARD, t + h * place / whole, remedy)


class _Inputs:
    """The inputs at the step's start and their slopes."""

    def __init__(self, instance: "FmuInstance") -> None:
        self.instance = instance
        self.start = [array[i] for array, i, _ in instance.input_slots]
        slopes = instance.slope_values if instance.sloped else None
        self.slopes = [
            0.0 if slopes is None or i is None else slopes[i] for i in instance.slope_slots
        ]

    def write(self, after: float) -> None:
        """Write the inputs as they are some time (s) after the step's start."""
        slots = self.instance.input_slots
        for (array, i, _), value, slope in zip(slots, self.start, self.slopes, strict=True):
            array[i] = value + slope * after if slope else value

    def put(self, after: float) -> None:
        """Give the FMU the inputs as they are some time (s) after the step's start."""
        self.write(after)
        self.instance.put()
        if self.instance.sloped:
            self.instance.put_slopes()
