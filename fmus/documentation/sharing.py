"""What elements of a column have in common: a sum over all of them, for example."""

import casadi as ca

_LARGEST = 10_000  # operations looked at


def without_shared(element: ca.SX, other: ca.SX) -> tuple[ca.SX, dict[str, ca.SX]]:
    """Return an element with symbols for what it shares with another, and what they stand for.

    Shared is what CasADi holds once. Without anything shared, or with operations that cannot be
    rebuilt, the element itself and nothing.
    """
    operations = _operations(other)
    shared: dict[str, ca.SX] = {}
    rebuilt: dict[int, ca.SX] = {}  # by identity
    stack = [(element, False)]
    while stack and len(rebuilt) < _LARGEST:
        expression, finished = stack.pop()
        identity = expression.element_hash()
        args = [expression.dep(i) for i in range(expression.n_dep())]
        if identity in rebuilt:
            continue
        if not args:
            rebuilt[identity] = expression
        elif identity in operations:
            name = f"shared {identity}"  # never shown, and unlike those around this column
            shared[name] = expression
            rebuilt[identity] = ca.SX.sym(name)
        elif not finished:
            if expression.is_call() or expression.is_output():
                return element, {}
            stack.append((expression, True))
            stack.extend((a, False) for a in args)
        else:
            make = ca.SX.unary if len(args) == 1 else ca.SX.binary
            rebuilt[identity] = make(expression.op(), *(rebuilt[a.element_hash()] for a in args))
    if stack or not shared:
        return element, {}
    return rebuilt[element.element_hash()], shared


def _operations(root: ca.SX) -> set[int]:
    """Return the identities of an expression's operations."""
    found: set[int] = set()
    stack = [root]
    while stack and len(found) < _LARGEST:
        expression = stack.pop()
        identity = expression.element_hash()
        if expression.n_dep() and identity not in found:
            found.add(identity)
            stack.extend(expression.dep(i) for i in range(expression.n_dep()))
    return found
