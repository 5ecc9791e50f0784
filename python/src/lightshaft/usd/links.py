"""Light linking: the collections lightLink and shadowLink of lights, as link sets of what is in them."""

from __future__ import annotations

import re
from typing import Any

from pxr import Sdf, Usd, UsdLux

from .problems import Problems

LISTS = {"receivers": "lightLink", "blockers": "shadowLink"}
NONE = "none"
"""The link set that nothing is in."""
Rules = tuple[tuple[str, str], ...]


class _Linked:
    """A collection of lights. Its link set has what is in it or, if it has the root of the stage, what is not."""

    def __init__(self, name: str, query: Usd.CollectionMembershipQuery) -> None:
        self.name, self._query = name, query
        self.inverse = Sdf.Path.absoluteRootPath in query.GetAsPathExpansionRuleMap()
        self.used = False

    def _has(self, path: Sdf.Path) -> bool:
        found = self._query.IsPathIncluded(path)
        return bool(found[0] if isinstance(found, tuple) else found)

    def marks(self, path: Sdf.Path) -> bool:
        """Returns whether what is at the path is in the link set."""
        return self._has(path) != self.inverse

    def key(self, path: Sdf.Path) -> Any:
        """Prims of equal structure whose keys are equal have the same sets, and so has all below them."""
        rules = self._query.GetAsPathExpansionRuleMap()
        below = sorted((str(p.MakeRelativePath(path)), str(rule)) for p, rule in rules.items() if p.HasPrefix(path))
        return (self.marks(path), tuple(below))


class Links:
    def __init__(self, stage: Usd.Stage, problems: Problems) -> None:
        self._problems = problems
        self._by_rules: dict[Rules, _Linked] = {}
        for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
            if prim.HasAPI(UsdLux.LightAPI):
                for name in LISTS:
                    self._linked(prim, name)

    def of_light(self, prim: Usd.Prim) -> dict[str, str]:
        """Returns the parameters `receivers` and `blockers` of a light."""
        found = {name: self._linked(prim, name) for name in LISTS}
        return {name: f"-{one.name}" if one.inverse else one.name for name, one in found.items() if one}

    def of_object(self, prim: Usd.Prim) -> dict[str, str]:
        """Returns the parameter `link_sets` of the shapes or the medium of a prim."""
        found = [linked for linked in self._by_rules.values() if linked.marks(prim.GetPath())]
        for linked in found:
            linked.used = True
        return {"link_sets": ", ".join(linked.name for linked in found)} if found else {}

    def key(self, prim: Usd.Prim) -> Any:
        """Instances whose keys are equal have the same link sets."""
        return tuple(linked.key(prim.GetPath()) for linked in self._by_rules.values())

    def finish(self, scene: dict[str, Any]) -> None:
        """Replaces the link sets that nothing in the scene is in."""
        idle = {linked.name for linked in self._by_rules.values() if not linked.used}
        for value in scene.values():
            if not isinstance(value, dict):
                continue
            for light in (value, value.get("emitter", {})):
                for name in LISTS:
                    if str(light.get(name, "")).lstrip("-") not in idle:
                        continue
                    if light[name].startswith("-"):
                        del light[name]
                    else:
                        light[name] = NONE

    def _linked(self, prim: Usd.Prim, parameter: str) -> _Linked | None:
        """Returns the collection of a light; None if it has the whole stage."""
        collection = Usd.CollectionAPI(prim, LISTS[parameter])
        if not collection:
            return None
        query = collection.ComputeMembershipQuery()
        if not query.UsesPathExpansionRuleMap():
            self._problems.warn(prim, f"its collection {LISTS[parameter]} has no effect: it has a membershipExpression")
            return None
        rules = query.GetAsPathExpansionRuleMap()
        known = tuple(sorted((str(path), str(rule)) for path, rule in rules.items()))
        if known == (("/", "expandPrims"),):
            return None
        if known not in self._by_rules:
            base = re.sub(r"[^A-Za-z0-9_]", "_", prim.GetName())[:40]
            name = f"{base}_{parameter}"
            names = {linked.name for linked in self._by_rules.values()}
            count = 1
            while name in names:
                count += 1
                name = f"{base}_{parameter}_{count}"
            self._by_rules[known] = _Linked(name, query)
        return self._by_rules[known]
