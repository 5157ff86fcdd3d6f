"""Scenarios as tables of plain values: what a TOML file holds."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

from ...base.errors import FileError, ParameterError, listing, suggest
from .bias import Bias
from .change import Change
from .drop_out import DropOut
from .freeze import Freeze
from .override import Override
from .set_delay import SetDelay
from .set_parameter import SetParameter

KINDS: dict[str, type[Change]] = {
    one.kind: one for one in (SetParameter, Override, Freeze, DropOut, Bias, SetDelay)
}


def read(path: Path) -> dict[str, Any]:
    """Return a TOML file's table; raise FileError if it cannot be read."""
    import tomllib

    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileError(f"{path} is not TOML: {error}") from error


def changes(table: Mapping[str, Any], origin: str = "") -> tuple[Change, ...]:
    """Return the changes of a table; raise ParameterError for the first mistake."""
    where = origin or "scenario"
    if not isinstance(table, Mapping):
        raise ParameterError(f"{where}: a table with a list 'change' is needed, not {table!r}")
    for key in table:
        if key != "change":
            hint = suggest(str(key), ["change"])
            raise ParameterError(f"{where}: no key '{key}'; each change is a [[change]]{hint}")
    entries = table.get("change", [])
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise ParameterError(f"{where}: each change is a [[change]], a list of tables")
    return tuple(
        _change(entry, f"{where}, change {number}") for number, entry in enumerate(entries, start=1)
    )


def _change(entry: Any, where: str) -> Change:
    if not isinstance(entry, Mapping):
        raise ParameterError(f"{where}: {entry!r} is no table with a 'kind'")
    if "kind" not in entry:
        raise ParameterError(f"{where}: 'kind' is missing; kinds: {listing(KINDS)}")
    kind = entry["kind"]
    if not isinstance(kind, str) or kind not in KINDS:
        hint = suggest(str(kind), KINDS)
        raise ParameterError(f"{where}: no kind {kind!r}; kinds: {listing(KINDS)}{hint}")
    where = f"{where} ({kind})"
    made = KINDS[kind]
    known = {f.name: f for f in fields(made) if f.init}
    values = {key: value for key, value in entry.items() if key != "kind"}
    keys = f"keys: {listing(_order(made))}"
    for key in values:
        if key not in known:
            raise ParameterError(f"{where}: no key '{key}'; {keys}{suggest(key, known)}")
    for key in _order(made):
        if known[key].default is MISSING and key not in values:
            raise ParameterError(f"{where}: '{key}' is missing; {keys}")
    try:
        return made(**values)
    except ParameterError as error:
        words = str(error).removeprefix(f"{made.__name__}: ")
        raise ParameterError(f"{where}: {words}") from None


def _order(kind: type[Change]) -> list[str]:
    """Return the keys of a kind as its constructor has them: those without a name first."""
    return sorted((f.name for f in fields(kind) if f.init), key=lambda n: n in ("at", "until"))


def table(found: Sequence[Change]) -> dict[str, Any]:
    """Return the table of changes; a time that is a fraction becomes a float."""
    entries = []
    for change in found:
        values = {name: getattr(change, name) for name in _order(type(change))}
        plain = {name: _plain(v) for name, v in values.items() if v is not None}
        entries.append({"kind": change.kind} | plain)
    return {"change": entries}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return float(value) if isinstance(value, Fraction) else value
