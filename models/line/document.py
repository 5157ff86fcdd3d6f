"""A JSON or YAML file with the place of everything in it, for errors that name file and line."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from ...base.errors import FileError, listing, suggest
from .profile import Misfit, place

_Model = TypeVar("_Model", bound=BaseModel)
LARGEST = 20_000_000  # bytes; a line of thousands of sections has less than one million


class _Loader(yaml.SafeLoader):
    """YAML 1.2's core schema: 1e3 is a number; `no`, 1:30 and dates are strings.

    A key given twice is an error, of which the standard loader says nothing.
    """

    yaml_implicit_resolvers = {}

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        lines: dict[str, int] = {}
        for key, _ in node.value:
            name, line = str(key.value), key.start_mark.line + 1
            if name in lines:
                raise yaml.constructor.ConstructorError(
                    None, None, f"'{name}' is given twice, first in line {lines[name]}",
                    key.start_mark,
                )  # fmt: skip
            lines[name] = line
        return super().construct_mapping(node, deep)


for _tag, _pattern, _first in (
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    ("int", r"[-+]?(0|[1-9][0-9]*)", list("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        list("-+.0123456789"),
    ),
):
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), _first
    )


@dataclass(frozen=True)
class Document:
    """What a file holds, and its text, in which a thing's line is found when it is wanted."""

    path: Path
    data: Any
    text: str

    def fail(self, where: tuple[int | str, ...], text: str) -> NoReturn:
        """Raise FileError for the place `where` (keys and indices from the root): text."""
        spot = f"{place(*where)}: " if where else ""
        raise FileError(f"{self.path}:{self.line(where)}: {spot}{text}")

    def line(self, where: tuple[int | str, ...]) -> int:
        """Return the line (from 1) of a place, or of what encloses it if it is not there."""
        node: Any = yaml.compose(self.text, Loader=_Loader)
        mark = node.start_mark if node else None
        for key in where:
            if isinstance(node, yaml.SequenceNode) and isinstance(key, int):
                if key >= len(node.value):
                    break
                node = node.value[key]
                mark = node.start_mark
            elif isinstance(node, yaml.MappingNode):
                pair = next((pair for pair in node.value if pair[0].value == str(key)), None)
                if pair is None:
                    break
                mark, node = pair[0].start_mark, pair[1]
        return mark.line + 1 if mark else 1

    def validated(self, model: type[_Model]) -> _Model:
        """Return the data as a pydantic model; raise FileError for the first thing wrong.

        Unknown keys come first: what a misspelt one should have been is missing then, too.
        """
        try:
            return model.model_validate(self.data)
        except ValidationError as error:
            problems = error.errors(include_url=False)
            problems = [p for p in problems if p["type"] in _UNKNOWN] or problems
            first = problems[0]
            where = tuple(key for key in first["loc"] if not _is_variant(key))
            more = f" (and {len(problems) - 1} more like this)" if len(problems) > 1 else ""
            self.fail(where, _said(first, model) + more)

    def within(self, where: tuple[int | str, ...], error: Misfit) -> NoReturn:
        """Raise FileError for a misfit found in what lies at `where`."""
        self.fail((*where, *error.path), error.args[0])


def read_document(path: str | Path) -> Document:
    """Read a JSON or YAML file; raise FileError if it is neither, or has a key twice."""
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST:
            raise FileError(f"{path}: larger than {LARGEST / 1e6:g} MB; no line or train is")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: not a text file in UTF-8 (byte {error.start})") from None
    is_json = text.lstrip().startswith("{")
    if is_json:
        text = text.replace("\t", " ")  # within JSON's strings none may be, and YAML takes none
    try:
        data = _json(text) if is_json else yaml.load(text, Loader=_Loader)
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}:{error.lineno}: not valid JSON: {error.msg} (column {error.colno})"
        ) from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        if mark and ("'\\t'" in problem or _indents_with_tab(text, mark.line)):
            problem = "a tab where YAML takes none: use spaces, not tabs"
        raise FileError(f"{path}{line}: {problem}") from None
    except (RecursionError, ValueError) as error:
        raise FileError(f"{path}: cannot be read: {str(error).splitlines()[0]}") from None
    return Document(path, data, text)


def _json(text: str) -> Any:
    doubled = False

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal doubled
        mapping = dict(items)
        doubled = doubled or len(mapping) < len(items)
        return mapping

    data = json.loads(text, object_pairs_hook=pairs)
    if doubled:
        yaml.load(text, Loader=_Loader)  # which says where
    return data


def _indents_with_tab(text: str, line: int) -> bool:
    """Whether a tab indents a line (from 0) or the one before, as YAML may notice it late."""
    near = text.split("\n")[max(line - 1, 0) : line + 1]
    return any("\t" in each[: len(each) - len(each.lstrip())] for each in near)


def _is_variant(key: int | str) -> bool:
    """Whether pydantic put in the name of a union's variant, which is not in the file."""
    return isinstance(key, str) and ("[" in key or key in _VARIANTS)


_VARIANTS = {"float", "int", "str", "constrained-str"}


def _said(problem: Any, model: type[BaseModel]) -> str:
    kind, key = problem["type"], problem["loc"][-1] if problem["loc"] else ""
    if kind == "invalid_key":  # {slack: 9,5} is slack 9 and a key 5
        return f"unknown key {key}; decimals have a point, not a comma"
    if kind == "extra_forbidden":
        known = _names(model, problem["loc"][:-1])
        return f"unknown key '{key}'; known: {listing(known, 20)}{suggest(str(key), known)}"
    if kind == "missing":
        return f"'{key}' is missing" if isinstance(key, str) else "one item too few"
    found = problem["input"]
    text = problem["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    if kind in _PLAIN:
        text = _PLAIN[kind].format(**problem.get("ctx", {}))
    if kind == "float_type" and isinstance(found, str):
        text = "a number without a unit is needed, its decimals after a point"
    if isinstance(found, dict | list | tuple):
        return f"{text} (found {'a mapping' if isinstance(found, dict) else 'a list'})"
    shown = "nothing" if found is None else json.dumps(found, ensure_ascii=False, default=str)
    return f"{text} (found {shown})"


_UNKNOWN = {"extra_forbidden", "invalid_key"}
# What pydantic finds, in plain words; the names in braces are its own.
_PLAIN = {
    "bool_type": "true or false is needed",
    "dict_type": "a mapping with keys is needed",
    "finite_number": "a finite number is needed",
    "float_type": "a number is needed",
    "greater_than": "must be more than {gt:g}",
    "greater_than_equal": "must be {ge:g} or more",
    "int_from_float": "a whole number is needed",
    "int_type": "a whole number is needed",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be {le:g} or less",
    "list_type": "a list is needed",
    "model_type": "a mapping with keys is needed",
    "string_type": "a text is needed, in quotes if it looks like something else",
    "too_long": "no more than {max_length} may stand here",
    "too_short": "no fewer than {min_length} may stand here",
    "tuple_type": "a list is needed",
}


def _names(model: type[BaseModel], where: tuple[int | str, ...]) -> list[str]:
    """Return the keys that may stand in the mapping at `where`."""
    whole = model.model_json_schema()

    def resolved(schema: dict[str, Any]) -> dict[str, Any]:
        while "$ref" in schema or "anyOf" in schema:
            if "$ref" in schema:
                schema = whole["$defs"][schema["$ref"].rpartition("/")[2]]
            else:
                schema = schema["anyOf"][0]
        return schema

    schema = resolved(whole)
    for key in where:
        named = schema.get("properties", {}).get(key) or schema.get("additionalProperties")
        schema = resolved((schema.get("items") if isinstance(key, int) else named) or {})
    return list(schema.get("properties", {}))
