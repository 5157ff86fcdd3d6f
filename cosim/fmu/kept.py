"""FMU instances that outlive a run, reset for the next one instead of made anew."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ...base.errors import FmuError
from .file import read_description

if TYPE_CHECKING:
    from ..blocks.fmu import Fmu


@dataclass
class KeptInstances:
    """The instances of one diagram's FMUs between its runs, by block.

    Those of railcosim's own FMUs are reset. Others are too if `trusts_others`: whoever sets that
    has seen that they run on to the same bits. Even then one is made anew where a variable that was
    set is not to be set again, for its reset may have forgotten that, and so is what refuses a
    reset. `forget` is called before an instance is freed.
    """

    forget: Callable[[], None]
    trusts_others: bool = False
    made: int = 0  # how many were instantiated
    _idle: dict[str, tuple["Fmu", Any]] = field(default_factory=dict)

    def take(self, name: str, block: "Fmu") -> Any:
        """Return an instance as `block.instance(name)` does: with its values set, before a run."""
        former, instance = self._idle.pop(name, (block, None))
        if instance is not None and self._may_reset(former, block, instance):
            with contextlib.suppress(FmuError):
                instance.renew()
                for variable, value in block.values.items():
                    instance.set(variable, value)
                return instance
        if instance is not None:
            self._close(instance)
        self.made += 1
        return block.instance(name)

    def give(self, name: str, block: "Fmu", instance: Any, *, is_whole: bool) -> str | None:
        """Take an instance back; return what went wrong in ending its run, if anything.

        After a run that failed (not `is_whole`) it is freed.
        """
        if not is_whole:
            return self._close(instance)
        trouble = instance.finish()
        if trouble is None:
            self._idle[name] = (block, instance)
        else:
            self._close(instance)
        return trouble

    def close(self) -> None:
        """Free all instances."""
        while self._idle:
            _, (_, instance) = self._idle.popitem()
            self._close(instance)

    def others(self) -> bool:
        """Return whether there are instances of FMUs that railcosim did not make."""
        return any(not instance.is_ours for _, instance in self._idle.values())

    def _close(self, instance: Any) -> str | None:
        self.forget()
        return instance.close()

    def _may_reset(self, former: "Fmu", block: "Fmu", instance: Any) -> bool:
        same = former.form() == block.form()
        if not same or read_description(block.path) is not instance.description:
            return False
        return instance.is_ours or (self.trusts_others and instance.given <= block.values.keys())
