"""tests/support/results.py counts what JUnit files say, and counts a missing file as a failure."""

import subprocess
import sys

from local_farm import ROOT

GOOGLETEST = """<testsuites><testsuite name="A">
  <testcase name="Passes" classname="A" status="run" result="completed"/>
  <testcase name="Fails" classname="A" status="run" result="completed"><failure message="a.cpp:7&#x0A;expected 1">long text</failure></testcase>
  <testcase name="Skips" classname="A" status="run" result="skipped"><skipped message="no Redis here"/></testcase>
  <testcase name="DISABLED_Later" classname="A" status="notrun" result="suppressed"/>
</testsuite></testsuites>"""
ALL_PASS = '<testsuites><testsuite name="B"><testcase name="Passes" classname="B" status="run"/></testsuite></testsuites>'
PYTEST = """<testsuites><testsuite>
  <testcase classname="test_x" name="test_a"/>
  <testcase classname="test_x" name="test_b"><error message="setup">fixture</error></testcase>
  <testcase classname="test_x" name="test_c"><skipped message="only as root">x</skipped></testcase>
</testsuite></testsuites>"""


def ctest_file(**programs):
    cases = "".join(f'<testcase name="{name}" status="{status}"><system-out>printed</system-out></testcase>' for name, status in programs.items())
    return f"<testsuite>{cases}</testsuite>"


def results(folder, kind, text, **files):
    if text is not None:
        (folder / "junit.xml").write_text(text)
    for name, content in files.items():
        (folder / f"{name}.xml").write_text(content)
    run = subprocess.run([sys.executable, "-B", ROOT / "tests/support/results.py", kind, folder / "junit.xml", folder],
                         capture_output=True, text=True, check=True)
    *report, sums = run.stdout.splitlines()
    return "\n".join(report), sums


def test_counts_each_googletest_case(tmp_path):
    report, sums = results(tmp_path, "ctest", ctest_file(a_test="fail"), a_test=GOOGLETEST)

    assert sums == "1 1 2"
    assert "FAILED A.Fails\n    a.cpp:7\n    expected 1\n" in report
    assert "SKIPPED A.Skips\n    no Redis here\n" in report


def test_a_program_without_results_is_a_failure(tmp_path):
    report, sums = results(tmp_path, "ctest", ctest_file(a_test="run", b_test="run"), b_test=ALL_PASS)

    assert sums == "1 1 0"
    assert "FAILED a_test\n    wrote no results" in report


def test_a_cut_off_result_file_is_a_failure(tmp_path):
    assert results(tmp_path, "ctest", ctest_file(a_test="run"), a_test=ALL_PASS[:60])[1] == "0 1 0"


def test_a_program_that_ends_with_an_error_after_its_last_case_is_a_failure(tmp_path):
    report, sums = results(tmp_path, "ctest", ctest_file(a_test="fail"), a_test=ALL_PASS)

    assert sums == "1 1 0"
    assert "FAILED a_test\n    every case passes" in report


def test_a_script_is_one_test(tmp_path):
    assert results(tmp_path, "ctest", ctest_file(architecture="run", build_id="fail"))[1] == "1 1 0"


def test_counts_each_case_of_pytest(tmp_path):
    report, sums = results(tmp_path, "pytest", PYTEST)

    assert sums == "1 1 1"
    assert "FAILED test_x.test_b\n    setup" in report


def test_no_file_of_ctest_or_pytest_is_a_failure(tmp_path):
    assert results(tmp_path, "ctest", None)[1] == "0 1 0"
    assert results(tmp_path, "pytest", None)[1] == "0 1 0"
