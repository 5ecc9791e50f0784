"""Requests made from the OpenAPI document: what it allows, what it nearly allows, and what has nothing to do with it."""

import string

from hypothesis import strategies as st

ANY_TEXT = st.text(max_size=40)
ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | ANY_TEXT,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(ANY_TEXT, inner, max_size=4), max_leaves=12)
HEX = st.text("0123456789abcdef", min_size=64, max_size=64)


class Generator:
    def __init__(self, document, known):
        """`known`: values that exist, by the name of a path parameter."""
        self.document, self.known = document, known

    def resolve(self, node):
        while "$ref" in node:
            target = self.document
            for part in node["$ref"][2:].split("/"):
                target = target[part]
            node = target
        return node

    def operations(self):
        for path, item in self.document["paths"].items():
            shared = [self.resolve(p) for p in item.get("parameters", [])]
            for method, operation in item.items():
                if method != "parameters":
                    parameters = shared + [self.resolve(p) for p in operation.get("parameters", [])]
                    yield method, path, operation, parameters

    # ---- values ----
    def value(self, schema):
        """Mostly of the schema; one in eight of anything at all."""
        return st.integers(0, 7).flatmap(lambda n: ANY_JSON if n == 0 else self.valid(schema))

    def valid(self, schema):
        schema = self.resolve(schema)
        if "enum" in schema:
            return st.sampled_from(schema["enum"])
        kinds = schema.get("type", "any")
        if isinstance(kinds, list):
            return st.one_of([self.valid(schema | {"type": kind}) for kind in kinds])
        if kinds == "string":
            return self.text(schema)
        if kinds == "integer":
            low, high = schema.get("minimum", -(2**40)), schema.get("maximum", 2**40)
            return st.integers(low, high) | st.sampled_from([low, high])
        if kinds == "number":
            return st.floats(allow_nan=False, allow_infinity=False) | st.floats(1e-3, 10)
        if kinds == "boolean":
            return st.booleans()
        if kinds == "null":
            return st.none()
        if kinds == "array":
            return st.lists(self.value(schema.get("items", {})), max_size=5)
        if kinds == "object":
            return self.object(schema)
        return ANY_JSON

    def text(self, schema):
        pattern = schema.get("pattern", "")
        if "64" in pattern and "f" in pattern:
            return HEX | st.sampled_from(self.known.get("sha256", ["0" * 64])) | ANY_TEXT
        if pattern:
            return st.from_regex(pattern, fullmatch=True).filter(lambda t: len(t) < 100) | ANY_TEXT
        return ANY_TEXT

    def object(self, schema):
        properties = schema.get("properties", {})
        required = set(schema.get("required", []))
        fixed = {name: self.value(p) for name, p in properties.items() if name in required}
        optional = {name: self.value(p) for name, p in properties.items() if name not in required}
        whole = st.fixed_dictionaries(fixed, optional=optional)
        extra = schema.get("additionalProperties", False)
        if isinstance(extra, dict):
            return st.dictionaries(ANY_TEXT, self.value(extra), max_size=3)
        return whole

    # ---- requests ----
    def path_value(self, parameter):
        strange = ANY_TEXT.filter(lambda t: t not in ("", ".", ".."))  # those are addresses of other routes
        known = st.sampled_from(self.known[parameter["name"]]) if self.known.get(parameter["name"]) else strange
        return st.integers(0, 4).flatmap(lambda n: strange if n == 0 else known)

    def query_value(self, parameter):
        plain = self.value(parameter.get("schema", {}))
        return plain.map(lambda v: v if isinstance(v, str) else str(v).lower() if isinstance(v, bool) else str(v))

    def request(self, operation, parameters):
        """{path: {name: text}, query: {...}, headers: {...}, body: (type, value) or None}"""
        place = {kind: {p["name"]: p for p in parameters if p["in"] == kind} for kind in ("path", "query", "header")}
        header_text = st.text(string.ascii_letters + string.digits + "-/ ", max_size=20)
        bodies = st.none()
        if "requestBody" in operation:
            content = operation["requestBody"]["content"]
            bodies = st.one_of([st.tuples(st.just(kind), self.body(kind, item.get("schema", {}))) for kind, item in content.items()] +
                               [st.tuples(header_text, st.binary(max_size=100)), st.none()])
        return st.fixed_dictionaries({
            "path": st.fixed_dictionaries({name: self.path_value(p) for name, p in place["path"].items()}),
            "query": st.fixed_dictionaries({}, optional={name: self.query_value(p) for name, p in place["query"].items()}),
            "headers": st.fixed_dictionaries({}, optional={name: self.query_value(p).map(printable) for name, p in place["header"].items()}),
            "stray": st.dictionaries(ANY_TEXT, ANY_TEXT, max_size=1),
            "body": bodies,
        })

    def body(self, kind, schema):
        if "json" in kind:
            return self.value(schema)
        return st.binary(max_size=300) | st.sampled_from(self.known.get(kind, [b""]))


def printable(text):
    return "".join(c for c in text if " " <= c <= "~")
