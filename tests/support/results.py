#!/usr/bin/env python3
"""Adds up the JUnit files of a test run.

    results.py pytest FILE            what `pytest --junitxml=FILE` wrote
    results.py ctest FILE FOLDER      what `ctest --output-junit FILE` wrote, with the file FOLDER/NAME.xml of each GoogleTest
                                      program (`GTEST_OUTPUT=xml:FOLDER/`)

Prints each failed and each skipped test with its reason; the last line is "PASSED FAILED SKIPPED". A missing or broken file is a
failure: the program ended before it could write it. A ctest test whose name does not end with `_test` is a script: it counts as
one test and writes no file.
"""

import pathlib
import sys
import xml.etree.ElementTree as xml

LINES_OF_A_FAILURE = 8


def first_lines(text):
    return "".join(f"    {line}\n" for line in (text or "").strip().splitlines()[:LINES_OF_A_FAILURE])


class Sums:
    def __init__(self):
        self.passed = self.failed = self.skipped = 0
        self.text = ""

    def fail(self, name, reason):
        self.failed += 1
        self.text += f"FAILED {name}\n{first_lines(reason)}"

    def add_file(self, path, program):
        """Adds the cases of a file of pytest or GoogleTest. Returns how many of them failed, or None if the file is unreadable."""
        try:
            cases = list(xml.parse(path).iter("testcase"))
        except (OSError, xml.ParseError) as error:
            self.fail(program, f"wrote no results: {error}")
            return None
        before = self.failed
        for case in cases:
            name = f"{case.get('classname')}.{case.get('name')}"
            problems = case.findall("failure") + case.findall("error")
            skipped = case.find("skipped")
            if problems:
                self.fail(name, "\n".join(problem.get("message") or problem.text or "" for problem in problems))
            elif skipped is not None or case.get("status") == "notrun":
                self.skipped += 1
                self.text += f"SKIPPED {name}\n{first_lines('' if skipped is None else skipped.get('message') or skipped.text)}"
            else:
                self.passed += 1
        return self.failed - before


def of_pytest(path):
    sums = Sums()
    sums.add_file(path, "pytest")
    return sums


def of_ctest(path, folder):
    sums = Sums()
    try:
        programs = list(xml.parse(path).iter("testcase"))
    except (OSError, xml.ParseError) as error:
        sums.fail("ctest", f"wrote no results: {error}")
        return sums
    for program in programs:
        name, passes = program.get("name"), program.get("status") == "run"
        if not name.endswith("_test"):
            if passes:
                sums.passed += 1
            else:
                sums.fail(name, program.findtext("system-out"))
            continue
        failed = sums.add_file(pathlib.Path(folder) / f"{name}.xml", name)
        if failed == 0 and not passes:
            # A sanitizer's report after the last case, or a crash on the way out.
            sums.fail(name, "every case passes, but the program ends with an error: see the log")
    return sums


def main():
    sums = of_pytest(sys.argv[2]) if sys.argv[1] == "pytest" else of_ctest(sys.argv[2], sys.argv[3])
    print(f"{sums.text}{sums.passed} {sums.failed} {sums.skipped}")


if __name__ == "__main__":
    main()
