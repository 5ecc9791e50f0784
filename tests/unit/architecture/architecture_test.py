"""The tree keeps its rules (architecture.py), every rule catches what it is for, and the binaries link what they should.

Run by ctest, or by hand: python3 tests/unit/architecture/architecture_test.py [folder of the executables]
"""
import pathlib
import subprocess
import sys
import unittest

import architecture
import draw_folders

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = None  # folder of the built executables

HEADER = "#pragma once\n"


class Tree(unittest.TestCase):
    def test_keeps_every_rule(self):
        tree = architecture.read_tree(ROOT)
        self.assertGreater(len(tree), 100, f"this is not the tree: {ROOT}")
        for rule in architecture.RULES:
            with self.subTest(rule=rule.__name__):
                violations = sorted(set(rule(tree)))
                self.assertEqual(violations, [], "\n  " + "\n  ".join(violations))

    def test_the_drawing_of_its_folders_is_of_today(self):
        drawn = draw_folders.drawing(draw_folders.graph_of(architecture.read_tree(ROOT)))
        self.assertTrue(draw_folders.OUT.read_text(encoding="utf-8") == drawn, "run tests/unit/architecture/draw_folders.py")


class Rules(unittest.TestCase):
    """Each rule on small made-up trees: what it must find, and what it must leave alone."""

    def assert_finds(self, rule, tree, *fragments):
        found = list(rule(tree))
        self.assertEqual(len(found), len(fragments), found)
        for fragment in fragments:
            self.assertTrue(any(fragment in text for text in found), f"{fragment!r} not in {found}")

    def test_layering(self):
        self.assert_finds(architecture.layering, {
            "core/a.cpp": '#include "worker/agent/link.h"\n',
            "worker/agent/a.cpp": '#include "coordinator/service/coordinator.h"\n',
            "coordinator/a.cpp": '  #  include "worker/agent/link.h"\n#include "coordinator/http/net/http_server.h"\n',
            "coordinator/service/a.cpp": '#include "coordinator/http/net/http_server.h"\n',
            "coordinator/domain/a.cpp": '#include "coordinator/store/jobs/job_store.h"\n',
            "coordinator/store/a.cpp": '#include "coordinator/rpc/rpc_server.h"\n#include "coordinator/service/coordinator.h"\n',
            "worker/render/a.cpp": '#include "worker/agent/link.h"\n',
            "worker/agent/b.cpp": '#include "proto/farm.pb.h"\n',
        }, "core/a.cpp", "worker/agent/a.cpp", "worker/agent/link.h", "coordinator/http/net/http_server.h", "coordinator/domain/a.cpp",
            "coordinator/rpc/rpc_server.h", "includes coordinator/service/coordinator.h", "worker/render/a.cpp", "worker/agent/b.cpp")

    def test_layering_allows_what_is_drawn(self):
        self.assert_finds(architecture.layering, {
            "worker/agent/a.cpp": '#include "core/base/id.h"\n#include "worker/render/render.h"\n#include "worker/agent/link.h"\n// #include "coordinator/service/coordinator.h"\n',
            "coordinator/http/a.cpp": '#include "coordinator/service/coordinator.h"\n#include "coordinator/domain/farm/farm.h"\n#include "coordinator/views/views.h"\n',
            "coordinator/main.cpp": '#include "coordinator/http/net/http_server.h"\n#include "coordinator/rpc/rpc_server.h"\n',
            "cli/render.cpp": '#include "coordinator/service/coordinator.h"\n#include "worker/agent/agent.h"\n#include "coordinator/assemble/merge.h"\n',
            "coordinator/rpc/a.cpp": '#include "proto/farm.pb.h"\n',
            "tests/unit/a_test.cpp": '#include "coordinator/http/net/http_server.h"\n#include "worker/agent/link.h"\n',
        })

    def test_clashing_names(self):
        self.assert_finds(architecture.names_of_a_library_do_not_clash, {
            "core/a/CMakeLists.txt": "", "core/b/CMakeLists.txt": "",
            "core/a/x.cpp": "constexpr float kTwice = 1;\nconstexpr Row kRows[] = {1};\nstruct Pair : Base {\n};\nvoid f() {\n  constexpr int kLocal = 1;\n}\n",
            "core/a/in/y.cpp": "constexpr int kTwice = 2;  // not kRows\nclass Pair final {\n};\nenum class Kind : char { kRows };\nvoid g() {\n  constexpr int kLocal = 1;\n}\n",
            "core/a/z.cpp": "constexpr std::array kRows{1};\nclass Kind;\nstruct Pair::Inner {\n};\n",
            "core/a/other.cpp": "namespace ls::other {\nconstexpr float kTwice = 1;\n",
            "core/b/x.cpp": "constexpr float kTwice = 1;\nstruct Pair {\n};\n",
        }, "kTwice is defined in core/a/in/y.cpp and core/a/x.cpp", "Pair is defined", "kRows is defined in core/a/x.cpp and core/a/z.cpp")

    def test_quoted_includes(self):
        self.assert_finds(architecture.quoted_includes_exist, {
            "core/a.cpp": '#include "core/b.h"\n#include "a.h"\n#include "proto/farm.pb.h"\n', "core/b.h": HEADER}, '"a.h"')

    def test_cycles(self):
        self.assert_finds(architecture.include_cycles, {
            "core/a.h": '#include "core/b.h"\n', "core/b.h": '#include "core/c.h"\n', "core/c.h": '#include "core/a.h"\n'},
            "core/a.h -> core/b.h -> core/c.h -> core/a.h")

    def test_folder_cycles(self):
        self.assert_finds(architecture.folder_cycles, {
            "core/a/x.h": '#include "core/b/x.h"\n', "core/b/x.h": "", "core/b/y.h": '#include "core/c/x.h"\n',
            "core/c/x.h": '#include "core/a/z.h"\n', "core/a/z.h": "", "core/d/x.h": '#include "core/a/x.h"\n#include "core/d/y.h"\n', "core/d/y.h": ""},
            "core/a/x.h includes core/b/x.h", "core/b/y.h includes core/c/x.h", "core/c/x.h includes core/a/z.h")

    def test_drawing_leaves_out_what_follows(self):
        self.assertEqual(draw_folders.reduced({"a": ["b", "c"], "b": ["c"], "c": []}), {"a": ["b"], "b": ["c"], "c": []})
        self.assertEqual(draw_folders.rows_of({"a": ["b", "c"], "b": ["c"], "c": []}), [["c"], ["b"], ["a"]])

    def test_small_folders(self):
        self.assert_finds(architecture.small_folders, {f"{folder}/{i}.h": "" for folder, many in (("core/a", 31), ("core/b", 30)) for i in range(many)}, "core/a has 31 files")

    def test_libraries(self):
        self.assert_finds(architecture.libraries_are_included_in_one_place, {
            "worker/render/world.cpp": "#include <embree3/rtcore.h>\n",
            "worker/render/integrator/a.h": "#include <boost/container/static_vector.hpp>\n",
            "worker/render/media/a.h": "#include <boost/container/static_vector.hpp>\n",
            "worker/render/geometry/embree.h": "#include <embree3/rtcore.h>\n#include <embree4/rtcore.h>\n",
            "coordinator/rpc/a.cpp": "#include <boost/asio.hpp>\n#include <grpcpp/grpcpp.h>\n",
            "coordinator/http/net/a.cpp": "#include <boost/asio.hpp>\n",
            "coordinator/http/a.cpp": "#include <sqlite3.h>\n",
            "validation/measure/hypothesis_tests.cpp": "#include <boost/math/distributions/students_t.hpp>\n",
            "validation/measure/judge.cpp": "#include <boost/math/distributions/normal.hpp>\n",
            "validation/nori_test_run.cpp": "#include <boost/asio.hpp>\n",
            "coordinator/http/bundle/bundle.cpp": '#include "coordinator/http/bundle/archive.h"\n#include <archive_entry.h>\n',
            "formats/xml/a.cpp": "#include <ImfHeader.h>\n#include <pugixml.hpp>\n#include <Imath/ImathVec.h>\n",
            "coordinator/store/redis.cpp": "#include <hiredis/hiredis.h>\n",
            "core/base/error.cpp": "#include <spdlog/spdlog.h>\n",
            "tests/unit/x_test.cpp": "#include <ImfHeader.h>\n",
        }, "worker/render/world.cpp", "worker/render/media/a.h", "boost/asio.hpp", "validation/measure/judge.cpp", "validation/nori_test_run.cpp", "sqlite3.h", "archive_entry.h", "ImfHeader.h", "hiredis", "spdlog")

    def test_library_types(self):
        self.assert_finds(architecture.library_types_stay_in_their_module, {
            "coordinator/http/json.h": HEADER + "#include <nlohmann/json.hpp>\n",
            "coordinator/http/api/a.cpp": '#include "coordinator/http/json.h"\n',
            "coordinator/main.cpp": '#include "coordinator/http/json.h"\n#include "coordinator/http/open.h"\n',
            "coordinator/http/open.h": HEADER + '#include "coordinator/http/json.h"\n',
        }, "coordinator/main.cpp includes coordinator/http/json.h", "coordinator/main.cpp includes coordinator/http/open.h")

    def test_guards(self):
        self.assert_finds(architecture.headers_are_guarded, {"core/a.h": "int x;\n", "core/b.h": HEADER}, "core/a.h")

    def test_lengths(self):
        self.assert_finds(architecture.short_files, {"web/a.js": "\n" * 801, "web/b.js": "\n" * 800}, "web/a.js has 801")

    def test_classes_in_many_sources(self):
        parts = {f"cli/a/{name}.cpp": "void Wide::f() {\n  other(1);\n}\nResult<void> Wide::g(int x) const {}\n" for name in "xyz"}
        spread = {f"{place}/{name}.cpp": f"void {cls}::f() {{}}\n" for place, cls in architecture.SPREAD_CLASSES for name in "xyz"}
        self.assert_finds(architecture.classes_are_whole, {**parts, **spread, "cli/b/x.cpp": "void Wide::h() {}\n", "tests/t.cpp": "int Wide::f() {}\n"}, "Wide is defined in 3 sources")
        place, cls = next(iter(architecture.SPREAD_CLASSES))
        self.assert_finds(architecture.classes_are_whole, {path: text for path, text in spread.items() if path != f"{place}/x.cpp"}, f"{cls} is whole")

    def test_wide_classes(self):
        def header(name, methods):
            return f"struct {name} : Base {{\n  struct Part {{ void f(); void g(); }};\n" + "  int f(int x = g(1)) const { return h(x); }\n" * methods + "  int member = f(3);\n};\n"
        listed = {path: header(name, 41) for path, name in architecture.WIDE_CLASSES}
        self.assert_finds(architecture.narrow_classes, {**listed, "cli/a.h": header("A", 41), "cli/b.h": header("B", 40)}, "A has 41 member functions")
        path, name = next(iter(architecture.WIDE_CLASSES))
        self.assert_finds(architecture.narrow_classes, {**listed, path: header(name, 40)}, f"{name} is narrow")

    def test_interfaces(self):
        def interface(name):
            return f"class {name} {{\n public:\n  virtual ~{name}() = default;\n  virtual int f() const = 0;\n}};\n"
        lone = {f"cli/lone_{name}.h": interface(name) for name in architecture.LONE_INTERFACES}
        self.assert_finds(architecture.interfaces_have_two_implementations, {
            **lone, "cli/one.h": interface("One"), "cli/two.h": interface("Two"),
            "cli/a.cpp": "class A final : public One {};\nclass B : public Two {};\nstruct C final : cli::Two {};\n",
            "tests/t.cpp": "class FakeOne : public One {};\n"}, "One has 1 implementations")

    def test_locked_names(self):
        self.assert_finds(architecture.the_type_says_who_holds_the_lock, {
            "coordinator/a.h": "void send_locked();  // not for drop_locked\n", "coordinator/b.h": "bool locked; int unlocked;", "tests/c.cpp": "send_locked();"},
            "coordinator/a.h: send_locked")

    def test_unfinished(self):
        word = "TO" + "DO"
        self.assert_finds(architecture.nothing_unfinished, {"cli/a.cpp": f"\n// {word}: later\n", "cli/b.cpp": "f(\"tmp.XX" + "XXXX\")"}, "cli/a.cpp:2")

    def test_clock(self):
        reading = "auto t = std::chrono::steady_clock::now();"
        tree = {path: reading for path in ("coordinator/domain/a.cpp", "tests/unit/domain/a_test.cpp", "core/base/clock.h", "cli/main.cpp", *architecture.CLOCK_EXCEPTIONS)}
        self.assert_finds(architecture.clock_is_injected, {**tree, "cli/b.cpp": "// steady_clock::now() is not for us"}, "coordinator/domain/a.cpp", "tests/unit/domain/a_test.cpp")

    def test_clock_exception_that_is_not_needed(self):
        self.assert_finds(architecture.clock_is_injected, {next(iter(architecture.CLOCK_EXCEPTIONS)): "int x;"}, "off the exceptions")

    def test_sleeps(self):
        self.assert_finds(architecture.tests_do_not_sleep, {
            "tests/a_test.cpp": "std::this_thread::sleep_for(1ms);", "tests/b.py": "time.sleep(1)", "tests/c.sh": "run & sleep 3\n",
            "tests/d.py": "# no time.sleep here\n", "deploy/demo.sh": "sleep 1\n"}, "tests/a_test.cpp", "tests/b.py", "tests/c.sh")

    def test_times(self):
        self.assert_finds(architecture.tests_assert_no_times, {
            "tests/a.py": "began = time.monotonic()\nrun()\nassert time.monotonic() - began < 30\n",
            "tests/b.py": "seconds = time.monotonic() - began\nprint(seconds)\nassert seconds < 10\n",
            "tests/c_test.cpp": "  const auto took = std::chrono::steady_clock::now() - start;\n  EXPECT_LT(took, 5s);\n",
            "tests/d.py": "end = time.monotonic() + 5\nassert job.seconds < 3\n",
            "bench/e.py": "assert time.monotonic() - began < 30\n",
            "tests/support/local_farm.py": "assert time.monotonic() < deadline\n"},
            "tests/a.py:3", "tests/b.py:3", "tests/c_test.cpp:2")

    def test_exits(self):
        self.assert_finds(architecture.nobody_exits, {
            "cli/a.cpp": "if (bad) std::exit(1);", "worker/b.cpp": "  abort();", "coordinator/c.cpp": "::_exit(3);",
            "cli/main.cpp": "std::exit(2);", "worker/d.cpp": "job.abort(); stream->terminate(); on_exit(); // exit()\n"}, "cli/a.cpp", "worker/b.cpp", "coordinator/c.cpp")

    def test_constants(self):
        page = "| `a.h` `b.h` | `kDepth` `1e-7` | why |\n| `gone.h` | `kOld` | why |\n"
        self.assert_finds(architecture.constants_are_listed, {
            "docs/reference/constants.md": page, "worker/render/vdb/c.cpp": "constexpr int kMany = 5;", "worker/agent/d.cpp": "x = 1e-9;",
            "worker/render/a.h": "inline constexpr float kDepth = 4;  // 1e-3\nif (x < 1e-7f) y = .5f;",
            "worker/render/b.h": "constexpr double kNew = 1e-30;\nstatic constexpr std::size_t kDepth = 1;\nx += 0x1p-20f; y = 1e-7;\n"
                                 "z = std::max(.001f, x) + .02 + .25f + 0.0 + .05;  // .002\nfmt(\"0.003\");"},
            "b.h: kNew decides", "b.h: 0x1p-20 decides", "b.h: .001 decides", "row for kOld in worker/render/gone.h")

    def test_exceptions_for_files_that_went(self):
        excepted = {**architecture.LONG_FILES, **architecture.CLOCK_EXCEPTIONS, **architecture.EXIT_EXCEPTIONS, **architecture.SLEEP_EXCEPTIONS,
                    **architecture.TIMED_EXCEPTIONS}
        self.assert_finds(architecture.exceptions_are_files, {path: "" for path in list(excepted)[1:]}, next(iter(excepted)))


class Binaries(unittest.TestCase):
    def libraries(self, name):
        path = BIN / name if BIN else None
        if path is None or not path.exists():
            self.skipTest(f"{name} is not built here")
        return subprocess.run(["ldd", path], capture_output=True, text=True, check=True).stdout

    def test_coordinator_links_no_renderer(self):
        self.assertNotRegex(self.libraries("lightshaft-coordinator"), "libembree|libopenvdb")

    def test_worker_maps_openvdb_only_on_demand(self):
        self.assertNotRegex(self.libraries("lightshaft-worker"), "libopenvdb")


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        BIN = pathlib.Path(sys.argv.pop(1))
    unittest.main()
