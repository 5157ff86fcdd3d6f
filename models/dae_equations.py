"""What a `casadi.DaeBuilder` computes from what, each after the things it needs."""

from collections.abc import Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import casadi as ca

from ..base.errors import DeclarationError, listing


@dataclass(frozen=True)
class Definition:
    """A variable that is computed from others: its symbol and its expression."""

    symbol: ca.MX
    expression: ca.MX


def where(dae: ca.DaeBuilder) -> str:
    """Return how messages name a DaeBuilder."""
    return f"DaeBuilder '{dae.name()}'"


def terms(expression: ca.MX) -> list[tuple[int, ca.MX]]:
    """Return the terms of a sum, each with its sign (1 or -1), in the order of writing."""
    found = []
    stack = [(1, expression)]
    while stack:
        sign, node = stack.pop()
        if node.is_op(ca.OP_NEG):
            stack.append((-sign, node.dep(0)))
        elif node.is_op(ca.OP_ADD) or node.is_op(ca.OP_SUB):
            stack.append((sign if node.is_op(ca.OP_ADD) else -sign, node.dep(1)))
            stack.append((sign, node.dep(0)))
        else:
            found.append((sign, node))
    return found


def total(parts: list[tuple[int, ca.MX]]) -> ca.MX:
    """Return the sum of signed terms, 0 for none."""
    if not parts:
        return ca.MX(0.0)
    (sign, first), *rest = parts
    value = first if sign > 0 else -first
    for sign, term in rest:
        value = value + term if sign > 0 else value - term
    return value


def definitions(dae: ca.DaeBuilder) -> dict[str, Definition]:
    """Return what is computed (d, w and explicit z), each after the ones it depends on.

    Raise DeclarationError for a variable without an equation, an implicit equation or a loop.
    """
    found = {}
    for name in dae.d():
        try:
            found[name] = Definition(dae.var(name), dae.beq(name))
        except RuntimeError:
            raise DeclarationError(
                f"{where(dae)}: the dependent parameter '{name}' has no equation; "
                "make it a local variable and give it one with dae.eq(…)"
            ) from None
    for name, expression in zip(dae.w(), dae.wdef(), strict=True):
        found[name] = Definition(dae.var(name), expression)
    found.update(_solved(dae, found))
    return {name: found[name] for name in _order(dae, found)}


def _order(dae: ca.DaeBuilder, found: Mapping[str, Definition]) -> list[str]:
    owner = {one.symbol.__hash__(): name for name, one in found.items()}
    graph = {
        name: [owner[s.__hash__()] for s in ca.symvar(one.expression) if s.__hash__() in owner]
        for name, one in found.items()
    }
    try:
        return list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        raise DeclarationError(
            f"{where(dae)}: {listing(dict.fromkeys(error.args[1]))} depend on each other, "
            "an algebraic loop; solve it and give one of them an equation without the others"
        ) from None


def _solved(dae: ca.DaeBuilder, found: Mapping[str, Definition]) -> dict[str, Definition]:
    """Return the algebraic variables, each from an equation that holds it as a bare term."""
    unknown = {dae.var(name).__hash__(): name for name in dae.z()}
    # A derivative that is used before it is defined: w = der(x), whose definition is z = der_x.
    for one in found.values():
        if one.expression.__hash__() in unknown:
            unknown[one.symbol.__hash__()] = unknown[one.expression.__hash__()]
    waiting = list(dae.outputs("alg"))
    solved: dict[str, Definition] = {}
    while waiting:
        choices = [_bare(dae, residual, unknown, solved) for residual in waiting]
        # What can be solved for one variable only goes first.
        at = min(range(len(waiting)), key=lambda i: len(choices[i]) or len(unknown) + 1)
        if not choices[at]:
            break
        solved.update([choices[at][0]])
        del waiting[at]
    missing = [name for name in dae.z() if name not in solved]
    if waiting:
        _refuse_implicit(dae, waiting[0], {h: n for h, n in unknown.items() if n in missing})
    if missing:
        _refuse_undefined(dae, missing[0])
    return solved


def _bare(
    dae: ca.DaeBuilder,
    residual: ca.MX,
    unknown: Mapping[int, str],
    solved: Mapping[str, Definition],
) -> list[tuple[str, Definition]]:
    """Return the ways in which 0 == residual gives a variable that is not yet solved."""
    parts = terms(residual)
    found = []
    for i, (sign, term) in enumerate(parts):
        name = unknown.get(term.__hash__(), "")
        if not name or name in solved or term.shape != residual.shape:
            continue
        rest = total([(-sign * s, t) for s, t in parts[:i] + parts[i + 1 :]])
        if name in {unknown.get(s.__hash__()) for s in ca.symvar(rest)}:
            continue
        if rest.shape != term.shape:
            rest = ca.repmat(rest, *term.shape)
        found.append((name, Definition(dae.var(name), rest)))
    return found


def _refuse_implicit(dae: ca.DaeBuilder, residual: ca.MX, missing: Mapping[int, str]) -> None:
    """Raise DeclarationError for an equation that is not explicit in any variable."""
    if not missing:
        raise DeclarationError(
            f"{where(dae)}: the equation 0 == {residual} is one too many, each of its variables "
            "has an equation already; remove it"
        )
    names = [missing[s.__hash__()] for s in ca.symvar(residual) if s.__hash__() in missing]
    names = names or list(dict.fromkeys(missing.values()))
    raise DeclarationError(
        f"{where(dae)}: the equation 0 == {residual} gives {listing(names)} implicitly, and "
        "plants have explicit equations only; solve it by hand and write "
        f"dae.eq({names[0]}, …) instead"
    )


def _refuse_undefined(dae: ca.DaeBuilder, name: str) -> None:
    """Raise DeclarationError for a variable that nothing determines."""
    if name.startswith("der("):
        raise DeclarationError(f"{where(dae)}: no equation for {name}; write dae.eq(dae.{name}, …)")
    raise DeclarationError(
        f"{where(dae)}: no equation for '{name}'; write dae.eq({name}, …) to compute it, "
        f"or dae.eq(dae.der({name}), …) to make it a state"
    )
