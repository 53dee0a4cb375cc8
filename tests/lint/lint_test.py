#!/usr/bin/env python3
"""Tests of the rules: each is given a small tree with one violation and must find it, and a tree without any."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import lint
import tables
import text_rules
from tree import Tree

ROOT = pathlib.Path(lint.__file__).resolve().parents[2]

CLEAN = {
    "README.md": "[map](docs/architecture.md#where-to-start)\n",
    "common/core/result.h": "#pragma once\n",
    "common/wire/messages.h": 'struct Hello {\n  static constexpr auto kName = "hello";\n};\n',
    "services/data/data_service.cpp": '#include "common/core/result.h"\nconst Row kRows[] = {{.flag = "--up"}};\n',
    "client/viewer/viewer_worker.cpp": "const Column<Row> kColumns[] = {\n"
    '    {"t_s", [](const Row& r) { return r.t; }},\n    {"wait_ms", &Row::wait}};\n',
    "docs/architecture.md": "# Map\n## Where to start\nRead `common/core/result.h`, give `--up`.\n",
    "common/wire/limits.h": "inline constexpr uint64_t kProtocolVersion = 9;\n",
    "docs/protocol.md": "Version 9.\n**hello** - first.\n`v` is 9.\n",
    "docs/metrics.md": "## frames.csv\n| column | unit |\n|---|---|\n| viewer, t_s | s |\n| wait_ms | ms |\n"
    "## Others\n",
    "tests/unit/core/result_test.cpp": '#include "common/core/result.h"\n#include "tests/support/near.h"\n',
    "tests/support/near.h": "#pragma once\n",
    "CMakeLists.txt": "project(small)\n",
}

LONG = "int f(int a) {\n" + "  a += g{1}.value;\n" * 60 + "}\n"

# Twenty-one data members, beside functions, types and constants.
MEMBERS = "  static int s;\n  using A = int;\n  int f() const { return 1; }\n"
MEMBERS += "  int a = 1, b{2};\n  std::map<int, A> c;\n" * 7

# rule, file, its text, line of the finding, part of what is said
VIOLATIONS = [
    ("english", "common/core/x.h", "int x;  ///< of a frame\n", 1, 'begins with "of"'),
    ("english", "docs/x.md", "# What\n\nPages name nobody.\n", 3, "name the process or the person"),
    (
        "directions", "common/core/up.cpp",
        '\n#include "services/data/data.h"\n', 2, "common/ must not include services/",
    ),
    (
        "widgets", "client/displays/window/panel/gui/x.cpp",
        'int a;\nbool b = ImGui::Button("b");\n', 2, "ImGui::Button(",
    ),
    (
        "widgets", "client/displays/window/panel/gui/x.cpp",
        'bool b = ImGui::SliderInt("b", &i);\n', 1, "seen() is not told",
    ),
    ("clamps", "client/displays/window/x.cpp", "int a;\nint b = std::clamp(a, lo, hi);\n", 2, "within()"),
    ("directions", "common/core/up.cpp", '#include "tools/telesplat/run.h"\n', 1, "common/ must not include tools/"),
    ("directions", "services/data/up.cpp", '#include "tests/support/near.h"\n', 1, "services/ must not include tests/"),
    ("directions", "client/viewer/up.cpp", '#include "tools/telesplat/run.h"\n', 1, "client/ must not include tools/"),
    (
        "directions", "services/data/x.cpp",
        '#include "services/sampler/work.h"\n', 1, "must not include services/sampler",
    ),
    ("directions", "client/viewer/x.cpp", '#include "services/data/data.h"\n', 1, "client/ must not include services/"),
    (
        "directions", "tools/telesplat/x.cpp",
        '#include "client/displays/window/window.h"\n', 1, "only client/displays and tests include it",
    ),
    (
        "directions", "client/viewer/x.cpp",
        '#include "client/displays/xr/hands.h"\n', 1, "only client/displays and tests include it",
    ),
    ("directions", "tests/golden/x_test.cpp", '#include "tests/unit/core/x.h"\n', 1, "tests share only tests/support"),
    ("circles", "common/core/result.h", '#pragma once\n#include "common/core/result.h"\n', 2, "which includes it"),
    ("floors", "common/core/high.h", '#include "common/wire/messages.h"\n', 1, "stands above common/core"),
    (
        "floors", "services/sampler/mesh/x.h",
        '#include "services/sampler/julia/y.h"\n', 1, "stands beside services/sampler/mesh",
    ),
    ("floors", "services/master/slabs/x.h", '#include "services/master/master_core.h"\n', 1, "stands above"),
    ("floors", "services/master/views.h", '#include "services/master/slabs/x.h"\n', 1, "stands above services/master"),
    ("floors", "common/strange/x.h", "\n", 1, "has no row"),
    (
        "directions", "tools/telesplat/x.cpp",
        '#include "tools/lab/commands.h"\n', 1, "only tools/lab and tests include it",
    ),
    ("outside_headers", "common/core/x.cpp", "#include <msgpack.hpp>\n", 1, "<msgpack.hpp>"),
    ("outside_headers", "common/core/x.cpp", "#include <zmq.hpp>\n", 1, "<zmq.hpp>"),
    ("outside_headers", "services/data/mesh/x.cpp", "#include <lzma.h>\n", 1, "<lzma.h>"),
    ("outside_headers", "services/data/mesh/x.cpp", "#include <gdal.h>\n", 1, "<gdal.h>"),
    ("outside_headers", "services/data/mesh/x.cpp", "#include <ogr_srs_api.h>\n", 1, "<ogr_srs_api.h>"),
    ("outside_headers", "services/data/mesh/x.cpp", "#include <embree3/rtcore.h>\n", 1, "<embree3/rtcore.h>"),
    ("outside_headers", "common/core/x.cpp", "#include <OpenImageIO/imageio.h>\n", 1, "<OpenImageIO/imageio.h>"),
    ("outside_headers", "common/core/x.cpp", "#include <epoxy/gl.h>\n", 1, "<epoxy/gl.h>"),
    ("outside_headers", "common/core/x.cpp", "#include <EGL/egl.h>\n", 1, "<EGL/egl.h>"),
    ("outside_headers", "common/core/x.cpp", "#include <GLFW/glfw3.h>\n", 1, "<GLFW/glfw3.h>"),
    ("cmake", "CMakeLists.txt", "project(small)\ntarget_sources(a PRIVATE b.cpp)\n", 2, "target_sources"),
    ("widths", "common/core/x.cpp", "\nint a;  // " + "word " * 30 + "\n", 2, "more than 120"),
    ("widths", "common/core/x.h", "/* short\n" + "word " * 30 + "*/\n", 2, "more than 120"),
    ("widths", "CMakeLists.txt", "project(" + "x" * 120 + ")\n", 1, "more than 120"),
    ("references", "common/core/x.h", "// See DESIGN section 3.\n", 1, "DESIGN"),
    ("references", "common/core/x.h", "// As in issue 4.\n", 1, "issue 4"),
    ("functions", "common/core/x.cpp", "namespace a {\n" + LONG + "}\n", 2, "f: 62 lines"),
    ("members", "common/core/x.h", "namespace a {\nclass Wide {\n" + MEMBERS + "};\n}\n", 2, "Wide: 21, more than 20"),
    (
        "members", "common/core/x.h",
        "class Outer {\n struct Inner {\n" + MEMBERS + " } ;\n void f();\n Inner inner_;\n};\n", 1, "Outer: 21",
    ),
    (
        "parameters", "common/core/x.h",
        "\nvoid f(int a, int b, const A<int, 2>& c, int d, int, int e, B* g = {});\n", 2, "f: 7, more than 6",
    ),
    ("functions", "common/core/x.cpp", "class A {\n public:\n  A() : b_{1} {}\n" + LONG + "};\n", 4, "f: 62 lines"),
    (
        "messages", "common/wire/more_messages.h",
        'struct New {\n  static constexpr auto kName = "new";\n};\n', 2, '"new" has no paragraph',
    ),
    (
        "messages", "common/wire/messages.h",
        'struct Hello {\n  static constexpr auto kName = "hello";\n  void fields(F& f) { f("gone", gone); }\n};\n',
        3, '"gone" of "hello" does not stand',
    ),
    ("messages", "docs/protocol.md", "**hello** - first.\n\n**gone** - was once.\n", 3, "**gone** is no message"),
    ("version", "docs/protocol.md", "Version 9.\n**hello** - first.\n`v` is 8.\n", 3, "says version 8; common/wire"),
    ("version", "docs/protocol.md", "Version 10.\n**hello** - first.\n", 1, "says version 10; common/wire"),
    ("version", "docs/protocol.md", "**hello** - first.\n", 1, "says no version"),
    ("flags", "docs/quality.md", "Give `--up` and\n`--down`.\n", 2, "no program has --down"),
    (
        "columns", "client/viewer/x.cpp",
        'const Column<Row> kColumns[] = {\n    {"new_ms", &Row::n}};\n', 2, "new_ms stands in no table",
    ),
    ("columns", "tools/telesplat/x.cpp", 'csv << "t_s,wait_ms,depth_m\\n";\n', 1, "depth_m stands in no table"),
    (
        "columns", "docs/metrics.md",
        "## frames.csv\n| viewer, t_s |\n| wait_ms |\n| gone_ms |\n", 4, "no table of columns has gone_ms",
    ),
    ("links", "README.md", "\n[map](docs/gone.md)\n", 2, "there is no docs/gone.md"),
    ("links", "README.md", "[map](docs/architecture.md#gone)\n", 1, "has no heading #gone"),
    (
        "links", "docs/metrics.md",
        "![picture](images/gone.png)\n## a.csv\n| t_s |\n| wait_ms |\n", 1, "there is no docs/images/gone.png",
    ),
    ("sentences", "docs/architecture.md", "## Where to start\n\n- **Here.** One (a. B) at `x. Y`. Two.\n", 3, "Y`."),
    ("paths", "README.md", "Read `services/data/gone`.\n", 1, "there is no services/data/gone"),
    ("paths", "common/core/x.h", "// As gone.h does.\n", 1, "there is no gone.h"),
]


class RulesTest(unittest.TestCase):
    def tree(self, **changes):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for path, text in {**CLEAN, **changes}.items():
            file = pathlib.Path(folder.name) / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        return Tree(folder.name)

    def findings(self, tree):
        return [finding for rule in lint.RULES.values() for finding in rule(tree)]

    def test_a_clean_tree_has_no_findings(self):
        self.assertEqual([str(f) for f in self.findings(self.tree())], [])

    def test_each_violation_is_found_with_file_line_and_rule(self):
        for rule, path, text, line, said in VIOLATIONS:
            with self.subTest(rule=rule, path=path, said=said):
                found = [f for f in self.findings(self.tree(**{path: text})) if f.rule == rule]
                self.assertEqual([(f.path, f.line) for f in found][:1], [(path, line)], [str(f) for f in found])
                self.assertIn(said, found[0].text)

    def test_every_rule_has_a_violation(self):
        tried = {rule for rule, *_ in VIOLATIONS} | {"folders"}  # below
        self.assertEqual(tried, set(lint.RULES))

    def test_a_folder_with_too_many_files_is_found_and_data_are_not(self):
        many = {f"common/core/f{i}.h": "" for i in range(tables.MOST_FILES)}  # beside result.h
        data = {f"tests/fuzz/corpus/wire/{i}": "" for i in range(2 * tables.MOST_FILES)}
        found = [f for f in self.findings(self.tree(**many, **data)) if f.rule == "folders"]
        self.assertEqual([f.path for f in found], ["common/core"])

    def test_a_circle_of_files_is_found_in_each_of_them(self):
        ring = {"common/core/a.h": '#include "common/core/b.h"\n', "common/core/b.h": '#include "common/core/a.h"\n'}
        found = [f for f in self.findings(self.tree(**ring)) if f.rule == "circles"]
        self.assertEqual([(f.path, f.line) for f in found], [("common/core/a.h", 1), ("common/core/b.h", 1)])

    def test_what_stands_in_comments_and_strings_is_no_include_and_no_brace(self):
        text = '/*\n#include "services/data/data"\n*/\nconst char* s = R"x(\n#include "tools/x.h"\n{)x";\n'
        self.assertEqual([str(f) for f in self.findings(self.tree(**{"common/core/x.cpp": text}))], [])

    def test_functions_are_measured_from_their_first_line_to_their_last(self):
        text = (
            "struct A {\n  explicit A(int b)\n      : b_{b}, c_(b) {\n    call();\n  }\n  int b_{0};\n};\n"
            'const Row kRows[] = {{"a", [](int x) { return x; }}};\n'
            "template <class T>\nT twice(T t) {\n  if (t > '{') {\n    return t;\n  }\n  return 2'000 * t;\n}\n"
        )
        file = self.tree(**{"common/core/x.cpp": text}).file("common/core/x.cpp")
        self.assertEqual(list(text_rules.function_extents(file)), [("A", 2, 5), ("twice", 9, 15)])

    def test_public_parts_and_calls_count_as_one(self):
        text = "struct Outer {\n struct Inner {\n" + MEMBERS + " };\n Inner inner;\n int a;\n};\n"
        text += "int b = g(1, 2, 3, 4, 5, 6, 7);\nA c{h(1, 2, 3, 4, 5, 6, 7)};\n"
        tree = self.tree(**{"common/core/x.h": text})
        found = [f for f in self.findings(tree) if f.rule in ("members", "parameters")]
        self.assertEqual([f.text for f in found], ["Inner: 21, more than 20"])

    def test_the_program_prints_findings_and_exits_with_1(self):
        program = [sys.executable, lint.__file__, "--root"]
        wrong = self.tree(**{"common/core/x.h": "// As in issue 4.\n"})
        done = subprocess.run([*program, wrong.root, "references"], capture_output=True, text=True, check=False)
        self.assertEqual(done.stdout, 'common/core/x.h:1: references: "issue 4" cannot be followed\n')
        self.assertEqual(done.returncode, 1)
        clean = subprocess.run([*program, self.tree().root], capture_output=True, text=True, check=False)
        self.assertEqual((clean.returncode, clean.stdout), (0, ""))
        strange = subprocess.run([*program, wrong.root, "gone"], capture_output=True, text=True, check=False)
        self.assertEqual(strange.returncode, 2)

    def test_every_place_in_the_tables_is_there(self):
        """A row about a folder that has gone would hold nothing."""
        places = [place for _, allowed in tables.OUTSIDE_HEADERS for place in allowed]
        for rows in tables.FLOORS.values():
            for room in (room for floor in rows for room in floor):
                places += [room] if isinstance(room, str) else list(room)
        self.assertEqual([place for place in places if not list(ROOT.glob(place))], [])


if __name__ == "__main__":
    unittest.main()
