"""How `lightshaft farm up` runs other programs, and reads what engines answer."""

import json
import os
import pathlib
import signal
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT, bin_dir

sys.path.insert(0, str(ROOT / "python" / "src"))
from lightshaft_command.farm_up import child, docker, kubernetes, report, slurm, ssh  # noqa: E402
from lightshaft_command.farm_up.costs import Ledger, Spending  # noqa: E402
from lightshaft_command.farm_up.engine import Unreadable, Worker  # noqa: E402
from lightshaft_command.files import write_file  # noqa: E402
from lightshaft_command.programs import Problem, Usage  # noqa: E402


def test_squeue_tells_workers_that_wait_run_and_never_will():
    assert slurm.parse_squeue("12_1|RUNNING|3:07|4|None\n"
                              "12_2|PENDING|0:00|4|Resources\n"
                              "13_1|PENDING|0:00|2|launch failed requeued held\n"
                              "14_1|RUNNING|1-02:00:05|1|None\n"
                              "15_1|PENDING|0:00|1|BeginTime\n"
                              "16_1|COMPLETING|0:09|1|None\n"
                              "17_1|REQUEUE_HOLD|0:00|1|None\n") == [
        Worker("12_1", "running", 187, 4), Worker("12_2", "waiting", 0, 4), Worker("13_1", "stuck", 0, 2), Worker("14_1", "running", 93605, 1),
        Worker("15_1", "stuck", 0, 1), Worker("16_1", "running", 9, 1), Worker("17_1", "stuck", 0, 1)]


@pytest.mark.parametrize("line", ["slurm_load_jobs error", "1|RUNNING", "1|RUNNING|soon|1|None", "1|RUNNING|1:00|x|None", "1|RUNNING|1:00|0|None"])
def test_an_answer_of_squeue_that_is_not_understood_is_not_taken_for_no_workers(line):
    with pytest.raises(Unreadable):
        slurm.parse_squeue(line + "\n")


def test_docker_ps_tells_containers_that_run_from_those_that_ended_and_those_that_never_started():
    workers, ended = docker.parse_docker_ps("aa|running|1000|4\nbb|exited|900|4\ncc|created|990|2\ndd|paused|1100|1\n", 1060)

    # A clock that was set back gives no time back.
    assert workers == [Worker("aa", "running", 60, 4), Worker("cc", "stuck", 0, 2), Worker("dd", "running", 0, 1)]
    assert ended == ["bb"]


@pytest.mark.parametrize("line", ["error", "aa|running", "aa|running|soon|1", "|running|1|1", "aa|running|1|0", "aa|running|nan|1"])
def test_an_answer_of_docker_ps_that_is_not_understood_is_not_taken_for_no_workers(line):
    with pytest.raises(Unreadable):
        docker.parse_docker_ps(line + "\n", 0)


DEPLOYMENT = {"kind": "Deployment", "spec": {"replicas": 0, "template": {
    "metadata": {"labels": {"app": "lightshaft"}},
    "spec": {"securityContext": {"runAsUser": 10001},
             "containers": [{"name": "worker", "image": "i", "args": ["--coordinator", "c:1"], "resources": {"requests": {"cpu": "3500m"}}}]}}}}


def test_a_pod_is_the_deployments_with_its_own_name_and_an_end():
    before = json.dumps(DEPLOYMENT)

    pod = kubernetes.pod_like(DEPLOYMENT, kubernetes.Options("f", threads=4, drain_seconds=30, minutes=2, worker_options=["--x"]), "1a")

    assert pod["kind"] == "Pod" and pod["apiVersion"] == "v1"
    assert pod["metadata"] == {"name": "lightshaft-worker-1a", "labels": {"app": "lightshaft", "lightshaft.io/farm": "f", "lightshaft.io/worker": "1a"},
                               "annotations": {"cluster-autoscaler.kubernetes.io/safe-to-evict": "true"}}
    assert pod["spec"]["containers"][0]["args"] == ["--coordinator", "c:1", "--x", "--name", "f-1a"]
    assert pod["spec"]["securityContext"] == {"runAsUser": 10001}
    assert [pod["spec"][key] for key in ("terminationGracePeriodSeconds", "activeDeadlineSeconds", "restartPolicy")] == [30, 120, "Never"]
    assert json.dumps(DEPLOYMENT) == before, "the next pod begins with the same template"


def test_a_pod_must_ask_for_as_many_cores_as_the_worker_has_threads():
    with pytest.raises(Usage, match="say --threads 4"):
        kubernetes.pod_like(DEPLOYMENT, kubernetes.Options("f", threads=1), "1")


@pytest.mark.parametrize("none", [None, {}, {"spec": 1}, {"spec": {"template": {"spec": 2}}}, {"spec": {"template": {"spec": {"containers": []}}}}])
def test_what_has_no_template_of_a_pod_is_refused(none):
    with pytest.raises(Usage, match="no template of a pod"):
        kubernetes.pod_like(none, kubernetes.Options("f"), "1")


def pod(id, phase, **status):
    return {"metadata": {"labels": {"lightshaft.io/worker": id}}, "spec": {"containers": [{"resources": {"requests": {"cpu": "2"}}}]}, "status": {"phase": phase, **status}}


def test_pods_are_read_from_the_answer_of_kubectl():
    pulls = [{"state": {"waiting": {"reason": "ImagePullBackOff"}}}]
    pods = [pod("a", "Pending"), pod("b", "Running", startTime="1970-01-02T00:00:05Z"), pod("c", "Failed"), pod("d", "Succeeded"), pod("e", "Pending", containerStatuses=pulls)]

    workers, ended = kubernetes.parse_pods({"items": pods}, 86465)

    assert workers == [Worker("a", "waiting", 0, 2), Worker("b", "running", 60, 2), Worker("e", "stuck", 0, 2)]
    assert ended == ["c", "d"]


@pytest.mark.parametrize("answer", [None, {}, {"items": 3}, {"items": [1]}, {"items": [{"metadata": {"labels": {"lightshaft.io/worker": 7}}}]}])
def test_an_answer_of_kubectl_that_is_no_list_of_pods_is_not_taken_for_no_workers(answer):
    with pytest.raises(Unreadable):
        kubernetes.parse_pods(answer, 0)


def test_a_list_of_machines_names_one_a_line(tmp_path):
    (tmp_path / "machines").write_text("# the lab\nnode1\n  user@node2.example.org  # by the window\n\n")

    assert ssh.read_machines(tmp_path / "machines") == ["node1", "user@node2.example.org"]


@pytest.mark.parametrize("lines, words", [*((f"node1\n{name}\n", "machines:2: error:") for name in ("-oProxyCommand=x", "node 1", "node;x", "$(x)", "../x")),
                                          ("a\na\n", "'a' is named twice"), ("# none\n", "names no machines")])
def test_a_list_of_machines_holds_nothing_that_ssh_takes_for_an_option_or_a_shell(tmp_path, lines, words):
    (tmp_path / "machines").write_text(lines)

    with pytest.raises(Usage, match=words.replace("(", r"\(")):
        ssh.read_machines(tmp_path / "machines")


# ---- other programs ----


def test_a_program_gets_its_input_and_its_output_and_code_are_returned():
    assert child.run(["sh", "-c", "cat; echo trouble >&2; exit 3"], "words") == child.Output(3, "words", "trouble\n")


def test_a_program_that_a_signal_ends_has_a_code_above_128():
    assert child.run(["sh", "-c", "kill -TERM $$"]).code == 128 + signal.SIGTERM


def test_other_programs_do_not_get_our_variables(monkeypatch):
    monkeypatch.setenv("LIGHTSHAFT_TOKEN", "secret")

    assert "PATH=" in child.run(["env"]).out and "LIGHTSHAFT_TOKEN" not in child.run(["env"]).out
    assert "LIGHTSHAFT_TOKEN=secret" in child.run(["env"], ours=True).out


def test_more_is_exchanged_than_a_pipe_holds():
    much = "x" * (1 << 20)

    assert child.run(["cat"], much).out == much


def test_a_program_need_not_read_its_input():
    assert child.run(["true"], "x" * (1 << 20)).code == 0



def test_what_a_program_leaves_running_does_not_keep_its_reader():
    left = child.run(["sh", "-c", "tail -f /dev/null & echo $!"]).out

    os.kill(int(left), signal.SIGKILL)


def test_a_program_that_takes_too_long_is_ended(tmp_path):
    with pytest.raises(Problem, match="sh did not end within 2 s"):
        child.run(["sh", "-c", f"echo $$ > {tmp_path}/pid; exec tail -f /dev/null"], most_seconds=2)

    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_a_program_that_prints_too_much_is_ended():
    with pytest.raises(Problem, match="cat printed more than 64 MiB"):
        child.run(["cat", "/dev/zero"], most_seconds=600)


def test_a_program_that_is_not_there_is_named():
    with pytest.raises(Problem, match="cannot start no-such-program-here: No such file"):
        child.run(["no-such-program-here"])


# ---- the report ----


def test_a_report_of_something_else_is_not_continued(tmp_path):
    file = tmp_path / "report.json"
    for text, words in (("[]", "is no report of"), ("{", "is no report of"), ("[" * 100_000, "is no report of"),
                        ('{"name": "farm", "ledger": {"ended_core_seconds": %s, "running": {}}}' % ("9" * 400), "no sum of core seconds"), ('{"name": "other"}', "is the report of 'other'"), ('{"name": "farm", "ledger": {}}', "no sum of core seconds")):
        file.write_text(text)
        with pytest.raises(Usage, match=words):
            report.go_on_from(file, "farm", Spending())

    assert report.go_on_from(tmp_path / "none", "farm", Spending()).to_json() == Ledger().to_json()


def test_files_are_replaced_whole_also_behind_links(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    for text in ("one", "two"):
        write_file(tmp_path / "link", text)
        assert (tmp_path / "file").read_text() == text and (tmp_path / "link").is_symlink()
    write_file(pathlib.Path("/dev/null"), "text")
    with pytest.raises(Problem, match="nowhere/file cannot be written: No such file"):
        write_file(tmp_path / "nowhere" / "file", "text")
    assert {file.name for file in tmp_path.iterdir()} == {"file", "link"}


@pytest.mark.parametrize("flags, words", [
    (["--workers", "0"], "--workers '0': it must be a whole number from 1 to 10000"),
    (["--threads", "1e3"], "--threads '1e3': it must be a whole number from 1 to 1024"),
    (["--poll", "inf"], "--poll 'inf': it must be a number above 0, at most 10000000"),
    (["--user-budget", "ann="], "--user-budget '': it must be a number above 0"),
    (["--logs", "/nowhere"], "--logs: no file can be made in the folder /nowhere"),
    (["--name", "a-b"], "--name 'a-b': letters, digits and _"),
])
def test_wrong_values_are_named_with_their_option(flags, words):
    assert words in lightshaft("farm", "up", "--on", "kubernetes", "--to", "http://127.0.0.1:9", *flags, code=2).stderr


def test_modules_of_the_user_have_no_part_in_the_command(tmp_path):
    (tmp_path / "json.py").write_text("raise SystemExit('this is the json.py of the user')")
    done = lightshaft("farm", "up", "--on", "ssh", env={**os.environ, "PYTHONPATH": str(tmp_path)}, code=2)

    assert "--join-token FILE is needed" in done.stderr


@pytest.mark.parametrize("command", [["farm", "up", "--on", "ssh"], ["compare", "scene.xml", "--time", "1", "--report", "out"]])
def test_without_python_the_command_says_what_it_needs(command, tmp_path):
    done = subprocess.run([bin_dir() / "lightshaft", *command], env={"PATH": str(tmp_path)}, cwd=tmp_path, capture_output=True, text=True)

    name = " ".join(word for word in command[:2] if word in ("farm", "up", "compare"))
    assert done.returncode == 1 and f"`lightshaft {name}` needs Python 3.11 or later" in done.stderr
