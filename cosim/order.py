"""Order in graphs of blocks: what comes first, and what goes round in a circle."""

from collections.abc import Collection, Iterable, Mapping
from graphlib import CycleError, TopologicalSorter


def ordered(needs: Mapping[str, set[str]]) -> list[tuple[str, ...]]:
    """Return the names in groups such that each comes after what it needs.

    A group of several is a circle, its members in the order of `needs`.
    """
    names = list(needs)
    place = {name: i for i, name in enumerate(names)}
    try:
        graph = {n: sorted(needs[n] - {n}, key=place.__getitem__) for n in names}
        return [(name,) for name in TopologicalSorter(graph).static_order()]
    except CycleError:
        pass
    import networkx as nx

    graph = nx.DiGraph((need, name) for name in names for need in needs[name])
    graph.add_nodes_from(names)
    components = nx.strongly_connected_components(graph)
    groups = [tuple(sorted(group, key=place.__getitem__)) for group in components]
    groups.sort(key=lambda group: place[group[0]])
    group_of = {name: group for group in groups for name in group}
    between = {}
    for group in groups:
        needed = {group_of[need] for name in group for need in needs[name]} - {group}
        between[group] = sorted(needed, key=lambda g: place[g[0]])
    return list(TopologicalSorter(between).static_order())


def loop_chain(
    arrows: Iterable[tuple[str, str, str]], through: Collection[str] | None = None
) -> list[str]:
    """Return the labels along one circle of arrows (from, to, label); none if there is none.

    `through` are names of which the circle's neighbourhood must hold one.
    """
    import networkx as nx

    graph = nx.DiGraph()
    for source, target, label in arrows:
        graph.add_edge(source, target, label=label)
    if through is not None:
        for group in list(nx.strongly_connected_components(graph)):
            if group.isdisjoint(through):
                graph.remove_nodes_from(group)
    try:
        return [graph.edges[a, b]["label"] for a, b in nx.find_cycle(graph)]
    except nx.NetworkXNoCycle:
        return []
