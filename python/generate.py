#!/usr/bin/env python3
"""Writes what the package knows of the farm from the documents that state it.

    python/generate.py            writes the files
    python/generate.py --check    ends with 1 if one of them differs from what would be written

In src/lightshaft: models.py is made from coordinator/http/openapi.json, a TypedDict for each object of the
HTTP interface. _plugins.py is made from docs/reference/mitsuba.md: the XML element of each plugin of the scene
format, which dictionaries do not name. aio.py is made from farm.py beside it: the same methods, for
event loops.
"""

import json
import keyword
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[1]
DOCUMENT = ROOT / "coordinator/http/openapi.json"
PLUGIN_PAGE = ROOT / "docs/reference/mitsuba.md"
PACKAGE = ROOT / "python/src/lightshaft"

SIMPLE = {
    "string": "str",
    "integer": "int",
    "number": "float",
    "boolean": "bool",
    "null": "None",
    "object": "dict[str, Any]",
}
WIDTH = 108
MADE = "Made by python/generate.py; do not edit."


def camel(name):
    return "".join(part[:1].upper() + part[1:] for part in re.split(r"[^A-Za-z0-9]+", name))


class Models:
    """Turns schemas into the source text of classes. Nested objects get names of their own."""

    def __init__(self, document):
        self.classes = {}
        for name, schema in document["components"]["schemas"].items():
            self.add(name, schema)
        for item in document["paths"].values():
            for operation in (value for value in item.values() if isinstance(value, dict)):
                self.add_answer(operation)

    def add_answer(self, operation):
        for status, answer in operation["responses"].items():
            schema = answer.get("content", {}).get("application/json", {}).get("schema", {})
            if status.startswith("2") and "properties" in schema:
                self.add(camel(operation["operationId"]) + "Answer", schema)

    def add(self, name, schema):
        if name in self.classes:
            raise SystemExit(f"two objects of the document would be called {name}")
        self.classes[name] = ""  # keeps its place before those within it
        required = schema.get("required", [])
        lines = [f"class {name}(TypedDict):"]
        if schema.get("description"):
            lines += docstring(schema["description"])
        for key, value in schema.get("properties", {}).items():
            if not key.isidentifier() or keyword.iskeyword(key):
                raise SystemExit(f"{name}.{key} cannot be the name of a field")
            kind = self.type_of(value, f"{name}{camel(key)}")
            lines.append(f"    {key}: {kind if key in required else f'NotRequired[{kind}]'}")
            if value.get("description"):
                lines += docstring(value["description"])
        self.classes[name] = "\n".join(lines + (["    pass"] if len(lines) == 1 else []))

    def type_of(self, schema, name):
        if "$ref" in schema:
            return f'"{schema["$ref"].rpartition("/")[2]}"'
        if "enum" in schema:
            return f"Literal[{', '.join(json.dumps(value) for value in schema['enum'])}]"
        if "oneOf" in schema:
            return f"Union[{', '.join(self.type_of(part, name) for part in schema['oneOf'])}]"
        kinds = schema.get("type", "object")
        if isinstance(kinds, list):
            return f"Union[{', '.join(self.type_of({**schema, 'type': kind}, name) for kind in kinds)}]"
        if kinds == "array" and "prefixItems" in schema:
            inner = [self.type_of(part, name) for part in schema["prefixItems"]]
            return f"Union[tuple[{', '.join(inner)}], list[{inner[0]}]]"
        if kinds == "array":
            return f"list[{self.type_of(schema.get('items', {}), name)}]"
        if kinds == "object" and "properties" in schema:
            self.add(name, schema)
            return f'"{name}"'
        if kinds == "object" and isinstance(schema.get("additionalProperties"), dict):
            return f"dict[str, {self.type_of(schema['additionalProperties'], name)}]"
        return SIMPLE[kinds]


def docstring(text):
    safe = text.replace("\\", "\\\\").replace('"""', "'''").rstrip('"')
    return textwrap.wrap(
        f'"""{safe}"""',
        WIDTH,
        initial_indent="    ",
        subsequent_indent="    ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def models():
    document = json.loads(DOCUMENT.read_text(encoding="utf-8"))
    head = f'''"""The objects of the farm's HTTP interface, as they are sent. {MADE}"""

from typing import Any, Literal, NotRequired, TypedDict, Union
'''
    return head + "".join(f"\n\n{text}\n" for text in Models(document).classes.values())


def plugins():
    """{type: its elements} of the rows of the page. A texture that is a spectrum as well is a texture."""
    found = {}
    page = PLUGIN_PAGE.read_text(encoding="utf-8")
    for element, name in re.findall(r"^\| (\w+) \| `(\w+)` \|", page, re.MULTILINE):
        found.setdefault(name, []).append(element)
    lines = "".join(
        f"    {json.dumps(name)}: ({', '.join(map(json.dumps, elements))},),\n"
        for name, elements in sorted(found.items())
    )
    return (
        f'"""The XML elements of the plugins that mitsuba.md lists. {MADE}"""\n\n'
        f"ELEMENTS: dict[str, tuple[str, ...]] = {{\n{lines}}}\n"
    )


def asynchronous():
    """farm.py with every request awaited, but without what notebooks call by themselves."""
    text = (PACKAGE / "farm.py").read_text(encoding="utf-8")
    text = text.partition("\n    def _repr_html_")[0]
    text = re.sub(
        r"^\"\"\".*\n",
        f'"""AsyncFarm and AsyncJob: Farm and Job for event loops. {MADE}"""\n',
        text,
    )
    text = text.replace(
        "A job of a farm. In a notebook it shows its picture, its figures and the curve of its error.",
        "A job of a farm. In a notebook `await job.snapshot()` shows it.",
    )
    text = re.sub(r"(?<!models\.)\b(Farm|Job)\b", r"Async\1", text).replace(
        "SyncTransport", "AsyncTransport"
    )
    text = text.replace("def __enter__", "async def __aenter__").replace(
        "def __exit__", "async def __aexit__"
    )
    awaited = r"self\.(?:_transport\.(?:run|close)|refresh|_change|job|close)\("
    text = re.sub(awaited, lambda call: "await " + call[0], text)
    return re.sub(r"^    def (?!__|_keep)", "    async def ", text, flags=re.MULTILINE)


def main(arguments):
    wrong = []
    for path, text in (
        (PACKAGE / "models.py", models()),
        (PACKAGE / "_plugins.py", plugins()),
        (PACKAGE / "aio.py", asynchronous()),
    ):
        if "--check" not in arguments:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            wrong.append(path.name)
    if wrong:
        print(
            f"{', '.join(wrong)}: not what the documents say; run python/generate.py", file=sys.stderr
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
