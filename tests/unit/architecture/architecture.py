"""The rules of the tree, as data and pure functions: {path: text} -> violations in words.

Who may include whom, the only files that include a library, and a few habits that review forgets. Every exception stands here with its
reason; an exception that is no longer needed is a violation too.
"""
import dataclasses
import pathlib
import re

CODE = (".h", ".cpp")
CHECKED = (".h", ".cpp", ".proto", ".cmake", ".py", ".js", ".css", ".html", ".sh")
FOLDERS = ("core", "formats", "util", "proto", "worker", "coordinator", "validation", "compare", "cli", "web", "cmake", "deploy", "scenes", "tests", "bench")

# ---- who may include whom ----
# The longest prefix that fits a file names its area; an area may include itself, and the areas (or single files) listed.
# "worker/*" are all areas under worker.
# What all of the coordinator knows; what talks to its facade, and no further.
COORDINATOR_BASE = ["core", "util", "coordinator/base", "coordinator/domain", "coordinator/views"]
FACADE = COORDINATOR_BASE + ["coordinator/store/blobs/blob_store.h", "coordinator/service/coordinator.h", "coordinator/service/pages/report_page.h"]
AREAS = {
    # It decides the bits of an image together with worker/render; both are what the build id covers.
    "core": [],
    # Foreign scene languages; workers do not link it.
    "formats": ["core"],
    # Reads them in a sandbox.
    "formats/program": ["core", "util", "formats"],
    "util": ["core"],
    "proto": ["core", "util"],
    "worker/render": ["core"],
    # A program of its own, which renders nothing.
    "worker/render/vdb": ["core", "util/sandbox/call_filter.h", "worker/render"],
    "worker": ["core", "util", "worker/*"],
    "worker/client": ["core", "util", "worker", "proto"],
    "coordinator/base": ["core", "util"],
    "coordinator/domain": ["core", "util", "coordinator/base"],
    "coordinator/views": ["core", "util", "coordinator/base", "coordinator/domain"],
    "coordinator/store": COORDINATOR_BASE,
    # It folds partials out of the store's log.
    "coordinator/assemble": COORDINATOR_BASE + ["coordinator/store"],
    "coordinator/admission": COORDINATOR_BASE + ["coordinator/store"],
    # It wires domain, store and assembler together, and knows no network.
    "coordinator/service": COORDINATOR_BASE + ["coordinator/store", "coordinator/assemble", "coordinator/admission"],
    "coordinator/rpc": FACADE + ["proto"],
    "coordinator/tls": ["core"],
    "coordinator/http": FACADE,
    # It keeps what it must still send in files.
    "coordinator/webhooks": FACADE + ["coordinator/store"],
    "coordinator": ["core", "util", "coordinator/*"],
    # `lightshaft render` is coordinator and worker in one process.
    "cli": ["core", "formats", "util", "worker/*", "coordinator/*", "validation", "compare"],
    # The validation cases see no more than the renderer; the program asks how many cores it may use.
    "validation": ["core", "formats", "util", "worker", "worker/render"],
    "compare": ["core", "formats", "util", "worker/render"],
}
# Made by the build.
GENERATED = re.compile(r"^proto/\w+(\.grpc)?\.pb\.h$")


@dataclasses.dataclass(frozen=True)
class Library:
    name: str
    headers: str  # regular expression of what is included
    files: str  # regular expression of the paths that may include it
    why: str


EVERYWHERE = r"^(core|formats|util|worker|coordinator|validation|compare|cli)/"

LIBRARIES = [
    Library("Embree", r"^embree\d?/", r"^worker/render/geometry/embree\.h$", "what differs between its versions"),
    Library("OpenVDB", r"^(openvdb|nanovdb)/", r"^worker/render/vdb/", "a program of its own"),
    Library("Blosc", r"^blosc\.h$", r"^worker/render/vdb/", "the same program"),
    Library("OpenEXR", r"^(OpenEXR/|Imf\w*\.h|Iex\w*\.h|half\.h)", r"^core/image/exr/", "core/image/exr"),
    Library("OpenColorIO", r"^OpenColorIO/", r"^util/display/display_views\.cpp$", "the views of a display"),
    Library("gRPC", r"^(grpc|grpcpp|grpc\+\+)/|^proto/\w+\.grpc\.pb\.h$", r"^(coordinator/rpc|worker/client)/", "the two ends of the stream"),
    Library("protobuf", r"^google/protobuf/|^proto/\w+\.pb\.h$", r"^(coordinator/rpc|worker/client|proto)/", "proto and the two ends of the stream"),
    Library("Boost", r"^boost/(?!math/|container/)", r"^coordinator/http/(net/|message/message\.cpp$)", "the HTTP server"),
    Library("Boost.Math", r"^boost/math/", r"^validation/measure/hypothesis_tests\.cpp$", "the statistics of tests"),
    Library("Boost.Container", r"^boost/container/", r"^worker/render/integrator/", "arrays of fixed capacity of the integrator"),
    Library("libarchive", r"^archive(_entry)?\.h$", r"^coordinator/http/bundle/archive\.(h|cpp)$", "one file pair of the HTTP server"),
    Library("SQLite", r"^sqlite3\.h$", r"^coordinator/store/", "the store"),
    Library("hiredis", r"^hiredis/", r"^coordinator/store/redis/redis_link\.cpp$", "the link to Redis"),
    Library("pugixml", r"^pugixml\.hpp$", r"^formats/", "the scene readers"),
    Library("spdlog", r"^spdlog/", r"^core/base/log\.cpp$", "the log"),
    Library("libpng", r"^png\.h$", r"^core/(assets/png_\w+|image/exr/preview)\.cpp$", "its decoder, and the preview"),
    Library("libjpeg", r"^(jpeglib|turbojpeg)\.h$", r"^core/assets/jpeg_\w+\.cpp$", "its decoder"),
    Library("stb", r"^(stb/)?stb_", r"^core/assets/hdr_\w+\.cpp$", "the HDR decoder"),
    Library("OpenSSL", r"^openssl/", r"^(core/base/(digest|secret)|util/report/html|coordinator/http/(auth/token_registry|net/byte_stream)|coordinator/tls/tls_files)\.cpp$", "digests, tokens, TLS, Base64"),
    Library("TBB", r"^(tbb|oneapi)/", r"^worker/render/", "the renderer"),
    Library("CLI11", r"^CLI/", r"^cli/|/(main|options)\.cpp$|^util/command_line/(command|parse)\.cpp$", "the executables, and what describes their command lines"),
    Library("libcurl", r"^curl/", r"^cli/|^coordinator/store/blobs/s3_link\.cpp$|^util/http/post\.cpp$", "the command line's client, the link to S3, and what posts webhooks and traces"),
    Library("nlohmann-json", r"^nlohmann/(?!json_fwd)", EVERYWHERE, "our own code"),
]
# In tests a library may be needed as an oracle or to make broken files; these rows bind the product.

MAX_FILES = 30  # of C++ in a folder
MAX_LINES = 800
LONG_FILES = {}  # path: reason

MAX_SOURCES = 2  # of a class
MAX_METHODS = 40  # of a class, nested ones apart
STATE_MACHINE = "one state machine behind a narrow interface, whose reactions to events are grouped by subject"
ONE_MEMO = "one memo of objects that are read once, for readers of many kinds"
SPREAD_CLASSES = {
    ("coordinator/domain/farm", "Farm::State"): STATE_MACHINE,
    ("formats/reader", "Reader"): ONE_MEMO,
    ("worker/agent", "Agent::Impl"): "one file for each of its threads",
}
WIDE_CLASSES = {
    ("coordinator/domain/farm/farm_state.h", "Farm::State"): STATE_MACHINE,
    ("formats/reader/reader.h", "Reader"): ONE_MEMO,
    ("coordinator/service/coordinator.h", "Coordinator"): "the facade: a function for each request of users, workers and operators",
    ("worker/render/integrator/path_tracer.h", "PathTracer"): "one path, in steps of a few lines that share its state",
    ("formats/reader/params.h", "Params"): "one convert() for each type of parameter",
    ("worker/render/lights/lights.h", "Lights"): "choosing, sampling and hitting lights, whose densities must agree",
}
# Interfaces of which the product has one implementation.
LONE_INTERFACES = {
    "Clock": "tests say what time it is",
    "Racer": "tests of a race's order render nothing",
    "WorkerSession": "hides the service from the two transports that hold one",
}

# Tests of real threads and sockets may bound their patience by a clock; those of the state machine have a fake one.
CLOCK_READERS = re.compile(r"^core/base/clock\.(h|cpp)$|(^|/)main\.cpp$|^tests/(?!unit/domain/)|^bench/")
CLOCK_EXCEPTIONS = {
    "coordinator/http/net/connection.cpp": "deadlines of sockets, which Asio takes as points in time",
    "coordinator/rpc/rpc_server.cpp": "gRPC's Shutdown takes a point in time",
    "worker/fake/fake.cpp": "plays a slow renderer",
}

EXIT_CALLERS = re.compile(r"(^|/)main\.cpp$|^core/base/check\.cpp$")
EXIT_EXCEPTIONS = {
    "worker/child/serve.cpp": "the render child when its agent is gone, with threads deep in a sample",
}

SLEEP_EXCEPTIONS = {
    "tests/support/local_farm.py": "looks again every 20 ms whether another process has come so far, until a deadline",
}

TIMED_EXCEPTIONS = {
    "tests/support/local_farm.py": "the deadline of every wait for an event",
    "tests/unit/agent/scripted_coordinator.h": "likewise",
}
TEST_CLOCK = re.compile(r"\b(monotonic|perf_counter|process_time)\(\)|\btime\.time\(\)|_clock::now\(\)")
ASSERTION = re.compile(r"^\s*(?:assert\b|(?:EXPECT|ASSERT)_\w+\()(.*)")
ASSIGNMENT = re.compile(r"^\s*(?:const |auto |double |float )*(\w+) = (.*)")

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"]', re.M)
LOCKED_NAME = re.compile(r"\b\w+_locked\b")
NOW = re.compile(r"::now\s*\(\s*\)")
SLEEP = re.compile(r"\bsleep_(for|until)\b|(?<![\w.])(u|nano)?sleep\s*\(|\b(time|asyncio)\.sleep\b")
SHELL_SLEEP = re.compile(r"^\s*sleep\s|[;&|]\s*sleep\s", re.M)
EXIT = re.compile(r"(?<![\w.>:~])(?:std::|::)?(?:_exit|_Exit|exit|abort|quick_exit|terminate)\s*\(")
UNFINISHED = re.compile(r"\b(" + "|".join(["TO" "DO", "FIX" "ME", "X" "XX"]) + r")\b")
COMMENT_OR_TEXT = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|//[^\n]*|/\*.*?\*/', re.S)


def read_tree(root):
    """All files that the rules look at."""
    root = pathlib.Path(root)
    paths = [path for folder in FOLDERS if (root / folder).is_dir() for path in (root / folder).rglob("*")]
    paths += [root / CONSTANTS_PAGE]
    return {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8", errors="replace")
            for path in paths if path == root / CONSTANTS_PAGE or path.is_file() and (path.suffix in CHECKED or path.name == "CMakeLists.txt")}


def without_comments(text):
    return COMMENT_OR_TEXT.sub(lambda match: " " if match[0].startswith("/") else match[0], text)


def without_texts(text):
    return COMMENT_OR_TEXT.sub(lambda match: " " if match[0].startswith("/") else '""', text)


def includes(text):
    """[(name, quoted)]"""
    return [(name, mark == '"') for mark, name in INCLUDE.findall(without_comments(text))]


def code(tree):
    return {path: text for path, text in tree.items() if path.endswith(CODE)}


def product(tree):
    return {path: text for path, text in code(tree).items() if not path.startswith(("tests/", "bench/"))}


def within(path, prefix):
    return path == prefix or path.startswith(prefix + "/")


def folder(path):
    return path.rpartition("/")[0]


def module(path):
    """A folder with all its subfolders: "core/scene", "cli"."""
    parts = folder(path).split("/")
    return parts[0] if parts[0] in ("cli", "validation", "compare") else "/".join(parts[:2])


def library_of(name):
    return next((library for library in LIBRARIES if re.search(library.headers, name)), None)


def area_of(path):
    fitting = [area for area in AREAS if within(path, area)]
    return max(fitting, key=len, default=None)


# ---- rules ----

def layering(tree):
    for path, text in product(tree).items():
        area = area_of(path)
        for name, quoted in includes(text):
            target = area_of(name) if quoted else None
            if target is None or target == area:
                continue
            allowed = AREAS.get(area, [])
            if not any(entry in (target, name) or entry.endswith("/*") and within(name, entry[:-2]) for entry in allowed):
                yield f"{path} includes {name}: {area} may include only {', '.join([area, *allowed])}"


def quoted_includes_exist(tree):
    for path, text in code(tree).items():
        for name, quoted in includes(text):
            if quoted and name not in tree and not GENERATED.match(name) and not name.endswith(".inc"):
                yield f'{path} includes "{name}", which is no file seen from the root'


def include_cycles(tree):
    graph = {path: [name for name, quoted in includes(text) if quoted and name in tree] for path, text in code(tree).items()}
    done, cycles = set(), []

    def visit(path, trail):
        if path in trail:
            cycles.append(" -> ".join(trail[trail.index(path):] + [path]))
        elif path not in done:
            for name in graph.get(path, []):
                visit(name, trail + [path])
            done.add(path)

    for path in graph:
        visit(path, [])
    yield from (f"headers include each other: {cycle}" for cycle in cycles)


def folder_graph(tree):
    """{folder: {folder it includes: [(file, included file)]}} of the product."""
    graph = {}
    for path, text in product(tree).items():
        for name, quoted in includes(text):
            if quoted and name in tree and folder(name) != folder(path):
                graph.setdefault(folder(path), {}).setdefault(folder(name), []).append((path, name))
    return graph


def folder_cycles(tree):
    """No two folders include each other, by whatever way."""
    graph = folder_graph(tree)

    def reached(start):
        seen, todo = set(), [start]
        while todo:
            for to in graph.get(todo.pop(), {}):
                if to not in seen:
                    seen.add(to)
                    todo.append(to)
        return seen

    reach = {name: reached(name) for name in graph}
    for name, edges in graph.items():
        for to, files in edges.items():
            if name in reach.get(to, set()):
                yield f"{files[0][0]} includes {files[0][1]}: {name} and {to} include each other"


def small_folders(tree):
    counts = {}
    for path in product(tree):
        counts[folder(path)] = counts.get(folder(path), 0) + 1
    for name, count in counts.items():
        if count > MAX_FILES:
            yield f"{name} has {count} files; split it by subject into folders of at most {MAX_FILES}"


def libraries_are_included_in_one_place(tree):
    for path, text in product(tree).items():
        for name, _ in includes(text):
            for library in LIBRARIES:
                if re.search(library.headers, name) and not re.search(library.files, path):
                    yield f"{path} includes {name}: only {library.files} may include {library.name} ({library.why})"


def library_types_stay_in_their_module(tree):
    """A header that includes a library is private: only .cpp files of its own module may include it, or files that may include the library."""
    files = product(tree)
    names = {path: [name for name, _ in includes(text)] for path, text in files.items()}
    heavy = {}  # header -> the library that it includes, itself or through another
    while True:
        found = {path: library for path in names if path.endswith(".h") and path not in heavy
                 for name in names[path] for library in [heavy.get(name) or library_of(name)] if library}
        if not found:
            break
        heavy.update(found)
    for path, name in ((path, name) for path in names for name in names[path] if name in heavy):
        library = heavy[name]
        at_home = module(path) == module(name) or (library.files != EVERYWHERE and re.search(library.files, path))
        if not at_home:
            yield f"{path} includes {name}, which brings {library.name} along"


def headers_are_guarded(tree):
    for path, text in code(tree).items():
        if path.endswith(".h") and "#pragma once" not in text:
            yield f"{path} has no #pragma once"


def short_files(tree):
    for path, text in tree.items():
        lines = text.count("\n")
        if lines > MAX_LINES and path not in LONG_FILES:
            yield f"{path} has {lines} lines; split it by subject below {MAX_LINES}, or list it with a reason"
        if path in LONG_FILES and lines <= MAX_LINES:
            yield f"{path} is short enough now: take it off the list of long files"


MEMBER_DEFINITION = re.compile(r"^(?!\s)[^\n;{}()]*?\b((?:[A-Z]\w*(?:<[^<>]*>)?::)+)(?:~?\w+|operator[^\s(]*)\(", re.M)
CLASS_HEAD = re.compile(r"\b(?:class|struct)\s+((?:\w+::)*\w+)(?:\s+final)?\s*(?::[^;{()]*)?\{")
METHOD = re.compile(r"(?:\b~?[A-Za-z_]\w*|\boperator\s*\S+?)\s*\(")
BASES = re.compile(r"\b(?:class|struct)\s+[\w:]+(?:\s+final)?\s*:([^;{()]*)\{")


def classes_are_whole(tree):
    """A class is defined in at most two sources."""
    sources = {}
    for path, text in product(tree).items():
        if path.endswith(".cpp"):
            for match in MEMBER_DEFINITION.finditer(without_texts(text)):
                sources.setdefault((folder(path), match[1].removesuffix("::")), set()).add(path)
    for key, found in sources.items():
        if len(found) > MAX_SOURCES and key not in SPREAD_CLASSES:
            yield f"{key[0]}: {key[1]} is defined in {len(found)} sources: make classes by subject of it, or list it with a reason"
    for key in SPREAD_CLASSES:
        if len(sources.get(key, ())) <= MAX_SOURCES:
            yield f"{key[0]}: {key[1]} is whole: take it off the list of spread classes"


def members(text, at):
    """The declarations of the class whose brace is before `at`, without what is in braces within."""
    depth, out = 1, []
    while depth and at < len(text):
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        if depth == 1:
            out.append(";" if text[at] == "}" else text[at])
        at += 1
    return re.split(r";|\b(?:public|private|protected):", "".join(out))


def classes(tree):
    """(path, name, number of member functions, number of pure virtual ones) of every class in a header."""
    for path, text in product(tree).items():
        seen = without_texts(text) if path.endswith(".h") else ""
        for match in CLASS_HEAD.finditer(seen):
            declared = [" ".join(part.split()) for part in members(seen, match.end())]
            methods = [part for part in declared if METHOD.search(part.split(" = ")[0]) and not part.startswith(("using ", "static_assert", "friend "))]
            yield path, match[1], len(methods), sum(part.endswith("= 0") for part in methods)


def narrow_classes(tree):
    counts = {(path, name): methods for path, name, methods, _ in classes(tree)}
    for (path, name), methods in counts.items():
        if methods > MAX_METHODS and (path, name) not in WIDE_CLASSES:
            yield f"{path}: {name} has {methods} member functions: split it by subject, or list it with a reason"
    for key in WIDE_CLASSES:
        if counts.get(key, 0) <= MAX_METHODS:
            yield f"{key[0]}: {key[1]} is narrow: take it off the list of wide classes"


def interfaces_have_two_implementations(tree):
    bases = [set(re.findall(r"\w+", listed)) for text in product(tree).values() for listed in BASES.findall(without_texts(text))]
    found = {name.split("::")[-1] for _, name, _, pure in classes(tree) if pure}
    for name in sorted(found):
        many = sum(name in names for names in bases)
        if many < 2 and name not in LONE_INTERFACES:
            yield f"{name} has {many} implementations in the product: make it a class, or list it with a reason"
        if many >= 2 and name in LONE_INTERFACES:
            yield f"{name} has several implementations: take it off the list of lone interfaces"
    for name in sorted(set(LONE_INTERFACES) - found):
        yield f"{name} is no interface: take it off the list of lone interfaces"


def the_type_says_who_holds_the_lock(tree):
    """A name that asks its callers to hold a lock is checked by nobody; Guarded<> (core/base/guarded.h) is."""
    for path, text in product(tree).items():
        for name in sorted(set(LOCKED_NAME.findall(without_texts(text)))):
            yield f"{path}: {name}: take a reference to the state of a Guarded<> instead of asking callers to hold a lock"


FILE_SCOPE_NAME = re.compile(r"^(?:constexpr\s[^=({]*?\b(k[A-Z]\w*)\s*(?:\[[^\]]*\]\s*)?[={]|(?:struct|class|enum class)\s+(\w+)[^;:{]*(?::[^;{]*)?\{)", re.M)


NAMED_NAMESPACE = re.compile(r"^namespace\s+([\w:]+)\s*\{", re.M)


def names_of_a_library_do_not_clash(tree):
    """Presets with CMAKE_UNITY_BUILD compile all files of a library as one (cmake/flags.cmake)."""
    libraries = {folder(path) for path in tree if path.endswith("CMakeLists.txt")}
    seen = {}
    for path, text in product(tree).items():
        library = next((up for up in map(str, pathlib.PurePosixPath(path).parents) if up in libraries), None)
        if library and path.endswith(".cpp"):
            namespace = NAMED_NAMESPACE.findall(text)[:1]
            for names in FILE_SCOPE_NAME.findall(without_texts(text)):
                seen.setdefault((library, *namespace, "".join(names)), set()).add(path)
    for (library, *_, name), paths in seen.items():
        if len(paths) > 1:
            yield f"{name} is defined in {' and '.join(sorted(paths))}: define it once, or give it two names, as all files of {library} may be compiled as one"


def nothing_unfinished(tree):
    for path, text in tree.items():
        for match in UNFINISHED.finditer(text):
            yield f"{path}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]}: finish it, or open an issue"


def clock_is_injected(tree):
    for path, text in code(tree).items():
        reads = NOW.search(without_texts(text)) is not None
        if reads and not CLOCK_READERS.search(path) and path not in CLOCK_EXCEPTIONS:
            yield f"{path} reads a clock; take a Clock or a time point instead"
        if path in CLOCK_EXCEPTIONS and not reads:
            yield f"{path} reads no clock any more: take it off the exceptions"


def tests_do_not_sleep(tree):
    for path, text in tree.items():
        if not path.startswith("tests/"):
            continue
        pattern = SHELL_SLEEP if path.endswith(".sh") else SLEEP
        seen = without_texts(text) if path.endswith(CODE) else re.sub(r"#[^\n]*", "", text) if path.endswith(".py") else text
        if path not in SLEEP_EXCEPTIONS and not path.startswith("tests/unit/architecture/") and pattern.search(seen):
            yield f"{path} sleeps; wait for what it waits for"


def tests_assert_no_times(tree):
    """No test fails because the machine was slow: neither a clock nor the difference of two readings is asserted about."""
    for path, text in tree.items():
        if not path.startswith("tests/") or path.startswith("tests/unit/architecture/") or path in TIMED_EXCEPTIONS:
            continue
        timed = set()
        for number, line in enumerate(text.splitlines(), 1):
            assigned, asserted = ASSIGNMENT.match(line), ASSERTION.match(line)
            read = TEST_CLOCK.search(line)
            if assigned and read and "-" in assigned[2]:
                timed.add(assigned[1])
            elif assigned:
                timed.discard(assigned[1])
            if asserted and (read or timed & set(re.findall(r"\w+", asserted[1].split(", \"")[0]))):
                yield f"{path}:{number} asserts how long something took; wait for an event, or ask for an order or a state"


def nobody_exits(tree):
    for path, text in product(tree).items():
        ends = EXIT.search(without_texts(text)) is not None
        if ends and not EXIT_CALLERS.search(path) and path not in EXIT_EXCEPTIONS:
            yield f"{path} ends the process; return an Error, or CHECK for a bug"
        if path in EXIT_EXCEPTIONS and not ends:
            yield f"{path} ends no process any more: take it off the exceptions"


def exceptions_are_files(tree):
    for path in [*LONG_FILES, *CLOCK_EXCEPTIONS, *EXIT_EXCEPTIONS, *SLEEP_EXCEPTIONS, *TIMED_EXCEPTIONS]:
        if path not in tree:
            yield f"the exception for {path} is for a file that is not there"


# Numbers that decide pixels: named constants of the renderer, and literals that have no name and either an exponent or a
# value of .01 or less. (Larger ones, such as .5, are nearly always arithmetic.) Grids' file formats are not pixels.
CONSTANTS_PAGE = "docs/reference/constants.md"
DECIDES_PIXELS = re.compile(r"^worker/render/(?!vdb/|media/vdb_)")
NAMED_NUMBER = re.compile(r"\bconstexpr\s+(?:static\s+)?(?:float|double|int|std::\w+)\s+(k[A-Z]\w*)\s*(?:\[|=)")
BARE_NUMBER = re.compile(r"(?<![\w.])(?:0x[0-9a-fA-F.]+p[+-]?\d+|(?:\d+\.?\d*|\.\d+)e[+-]?\d+|0?\.0(?:10*|0\d*[1-9]\d*))f?\b")


def numbers_that_decide(text):
    seen = without_texts(text)
    lines = [line for line in seen.split("\n") if not NAMED_NUMBER.search(line)]
    return set(NAMED_NUMBER.findall(seen)) | {match[0].rstrip("f") for line in lines for match in BARE_NUMBER.finditer(line)}


def constants_listed(page):
    """{path: names and numbers} of the page's table rows: | `path` | `kName` `1e-7` | ..."""
    listed = {}
    for line in page.split("\n"):
        cells = [re.findall(r"`([^`]+)`", cell) for cell in line.split("|")[1:3]] if line.startswith("| `") else []
        for path in cells[0] if cells else []:
            listed.setdefault("worker/render/" + path, set()).update(cells[1])
    return listed


def constants_are_listed(tree):
    found = {path: numbers_that_decide(text) for path, text in product(tree).items() if DECIDES_PIXELS.search(path)}
    listed = constants_listed(tree.get(CONSTANTS_PAGE, ""))
    for path, numbers in found.items():
        for number in sorted(numbers - listed.get(path, set())):
            yield f"{path}: {number} decides pixels and has no row in {CONSTANTS_PAGE}: say there what it is for and what it does"
    for path, numbers in listed.items():
        for number in sorted(numbers - found.get(path, set())):
            yield f"{CONSTANTS_PAGE} has a row for {number} in {path}, where it is not"


RULES = [layering, quoted_includes_exist, include_cycles, folder_cycles, small_folders, libraries_are_included_in_one_place, library_types_stay_in_their_module, headers_are_guarded,
         short_files, classes_are_whole, narrow_classes, interfaces_have_two_implementations, the_type_says_who_holds_the_lock, names_of_a_library_do_not_clash, nothing_unfinished, clock_is_injected, tests_do_not_sleep, tests_assert_no_times, nobody_exits,
         exceptions_are_files, constants_are_listed]
