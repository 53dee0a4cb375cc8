"""Rules about includes: who may know whom."""

import re
from fnmatch import fnmatch

import tables
from tree import Finding


def _is_in(path, place):
    return path == place or path.startswith(place + "/")


def _ring_of(path):
    return next((ring for ring in tables.RINGS if _is_in(path, ring)), None)


def _process_of(path):
    return next((p for p in tables.PROCESSES if _is_in(path, p)), None)


def directions(tree):
    """Includes run down (tests, tools > services, client > common), never into another process nor an outer ring."""
    for file in tree.sources():
        part = file.path.split("/")[0]
        if part not in tables.PARTS:
            continue
        for include in file.includes:
            if not include.own or "/" not in include.target:
                continue
            target = include.target
            wrong = None
            other = target.split("/")[0]
            if other in tables.PARTS and other not in tables.PARTS[part]:
                wrong = f"{part}/ must not include {other}/"
            elif part != "tests" and _ring_of(target) not in (None, _ring_of(file.path)):
                wrong = f"only {_ring_of(target)} and tests include it"
            elif (
                part in ("services", "client")
                and not _ring_of(file.path)
                and _process_of(target) not in (None, _process_of(file.path))
            ):
                wrong = f"{_process_of(file.path) or part} must not include {_process_of(target)}"
            elif other == "tests" and not _is_in(target, tables.SHARED_TESTS) and not _is_in(target, file.folder):
                wrong = f"tests share only {tables.SHARED_TESTS}"
            if wrong:
                yield Finding(file.path, include.line, "directions", f'{wrong} ("{target}")')


def _rings(graph):
    """Circles of a graph: its strongly connected components of two nodes or more (Tarjan 1972), and loops of one."""
    index, low, stack, on_stack, rings = {}, {}, [], set(), []
    for start in graph:
        if start in index:
            continue
        work = [(start, iter(graph[start]))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, rest = work[-1]
            for other in rest:
                if other not in index:
                    index[other] = low[other] = len(index)
                    stack.append(other)
                    on_stack.add(other)
                    work.append((other, iter(graph.get(other, ()))))
                    break
                if other in on_stack:
                    low[node] = min(low[node], index[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    ring = []
                    while not ring or ring[-1] != node:
                        ring.append(stack.pop())
                        on_stack.discard(ring[-1])
                    if len(ring) > 1 or node in graph.get(node, ()):
                        rings.append(sorted(ring))
    return rings


def circles(tree):
    """No file includes itself by way of others."""
    files = {file.path: file for file in tree.sources()}
    # A Highway kernel is included by itself once a target; that goes through a macro and is not seen here.
    graph = {p: sorted({i.target for i in f.includes if i.own and i.target in files}) for p, f in files.items()}
    for ring in _rings(graph):
        members = set(ring)
        for path in ring:
            for include in files[path].includes:
                if include.own and include.target in members:
                    yield Finding(
                        path, include.line, "circles",
                        f"includes {include.target}, which includes it: " + ", ".join(ring),
                    )


class House:
    """The floors of one process: which room a file lies in, and on which floor."""

    def __init__(self, name, floors):
        self.name = name
        self.floor_of = {}
        self._places = []
        for height, floor in enumerate(floors):
            for room in floor:
                places = (room,) if isinstance(room, str) else room
                self.floor_of[places] = height
                self._places += [(place, places) for place in places]
        self._places.sort(key=lambda entry: -len(entry[0]))

    def room(self, path):
        return next((room for place, room in self._places if _is_in(path, place) or fnmatch(path, place)), None)


def floors(tree):
    """Within a process, folders include only what stands below them in tables.FLOORS."""
    houses = [House(name, rows) for name, rows in tables.FLOORS.items()]
    for file in tree.sources():
        house = next((h for h in houses if _is_in(file.path, h.name)), None)
        if house is None:
            continue
        own = house.room(file.path)
        if own is None:
            yield Finding(
                file.path, 1, "floors",
                f"its folder has no row in FLOORS[{house.name!r}] of tests/lint/tables.py",
            )
            continue
        for include in file.includes:
            other = house.room(include.target) if include.own else None
            if other is None or other == own:
                continue
            if house.floor_of[other] >= house.floor_of[own]:
                how = "beside" if house.floor_of[other] == house.floor_of[own] else "above"
                yield Finding(
                    file.path, include.line, "floors",
                    f"includes {include.target}, which stands {how} {own[0]}",
                )


def outside_headers(tree):
    """The headers of an outside library are included in its own place only."""
    rows = [(re.compile(pattern), places) for pattern, places in tables.OUTSIDE_HEADERS]
    for file in tree.sources():
        for include in file.includes:
            if include.own:
                continue
            for pattern, places in rows:
                if pattern.fullmatch(include.target) and not any(_is_in(file.path, place) for place in places):
                    allowed = ", ".join(places) or "nowhere"
                    yield Finding(
                        file.path, include.line, "outside_headers",
                        f"<{include.target}> may be included in: {allowed}",
                    )


RULES = (directions, circles, floors, outside_headers)
