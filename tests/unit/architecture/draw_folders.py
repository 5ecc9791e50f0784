#!/usr/bin/env python3
"""Draws which folder includes which, as read from the #include lines: docs/design/folders.svg.

usage: draw_folders.py [OUT.svg]

A folder stands above all that it includes. Arrows that follow from others are left out: if a includes b and b includes c, there
is no arrow from a to c.
"""
import html
import pathlib
import sys

import architecture

ROOT = pathlib.Path(__file__).resolve().parents[3]
OUT = ROOT / "docs" / "design" / "folders.svg"
WIDTH, HEIGHT, GAP, RISE = 168, 30, 14, 74  # of a box; between boxes of a row; between rows
COLOURS = {"core": "#dce9f5", "formats": "#e4ecf5", "util": "#eef2f6", "worker": "#e3f1dd", "coordinator": "#fbe9d3", "validation": "#eee3f4", "compare": "#eee3f4", "cli": "#f7dfe3", "proto": "#e8e8e8"}


def reduced(graph):
    """The graph without edges that follow from others. It has no cycles (architecture.folder_cycles)."""
    reach = {}

    def reached(node):
        if node not in reach:
            reach[node] = set()
            for to in graph.get(node, ()):
                reach[node] |= {to} | reached(to)
        return reach[node]

    return {node: sorted(to for to in targets if not any(to in reached(other) for other in targets if other != to)) for node, targets in graph.items()}


def rows_of(graph):
    """Folders by how many steps they are above one that includes nothing, the lowest row first."""
    height = {}

    def up(node):
        if node not in height:
            height[node] = 1 + max((up(to) for to in graph.get(node, ())), default=-1)
        return height[node]

    for node in sorted(graph):
        up(node)
    rows = [[] for _ in range(max(height.values()) + 1)]
    for node in sorted(height):
        rows[height[node]].append(node)
    return rows


def ordered(rows, edges):
    """Boxes of a row beside those that they are connected with: a few sweeps by barycentre."""
    users = {}
    for node, targets in edges.items():
        for to in targets:
            users.setdefault(to, []).append(node)
    for sweep in range(12):
        place = {node: (i + .5) / len(row) for row in rows for i, node in enumerate(row)}
        for row in rows:
            near = edges if sweep % 2 == 0 else users
            row.sort(key=lambda node: (sum(place[n] for n in near.get(node, ())) / len(near[node]) if near.get(node) else place[node], node))
    return rows


def drawing(graph):
    edges = reduced(graph)
    rows = ordered(rows_of(graph), edges)
    widest = max(map(len, rows))
    width = widest * (WIDTH + GAP) + GAP
    at = {}
    for level, row in enumerate(rows):
        left = (width - len(row) * (WIDTH + GAP) + GAP) / 2
        for i, node in enumerate(row):
            at[node] = (left + i * (WIDTH + GAP), (len(rows) - 1 - level) * RISE + GAP)
    height = len(rows) * RISE + GAP - (RISE - HEIGHT)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif" font-size="11">',
           '<title>Which folder includes which</title>', f'<rect width="{width:g}" height="{height:g}" fill="#fff"/>']
    for node in sorted(edges):
        for to in edges[node]:
            (x0, y0), (x1, y1) = at[node], at[to]
            x0, x1, y0 = x0 + WIDTH / 2, x1 + WIDTH / 2, y0 + HEIGHT
            bend = (y1 - y0) / 2
            out.append(f'<path d="M{x0:g} {y0:g}C{x0:g} {y0 + bend:g} {x1:g} {y1 - bend:g} {x1:g} {y1:g}" fill="none" stroke="#8a8a8a" stroke-width=".8"/>')
    for node in sorted(at):
        x, y = at[node]
        out.append(f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="4" fill="{COLOURS.get(node.split("/")[0], "#eee")}" stroke="#777"/>')
        out.append(f'<text x="{x + WIDTH / 2:g}" y="{y + HEIGHT / 2 + 4:g}" text-anchor="middle">{html.escape(node)}</text>')
    return "\n".join([*out, "</svg>", ""])


def graph_of(tree):
    graph = {node: sorted(targets) for node, targets in architecture.folder_graph(tree).items()}
    for targets in list(graph.values()):
        for to in targets:
            graph.setdefault(to, [])
    return graph


def main():
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else OUT
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(drawing(graph_of(architecture.read_tree(ROOT))), encoding="utf-8")


if __name__ == "__main__":
    main()
