"""Completion scripts and manual pages, which the programs write of themselves, and where `cmake --install` puts them."""

import gzip
import shutil
import subprocess

import pytest
from cli_kit import lightshaft
from local_farm import PATIENCE, bin_dir

PROGRAMS = ["lightshaft", "lightshaft-coordinator", "lightshaft-worker"]
BASH = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_lightshaft
printf '%s\\n' "${COMPREPLY[@]}"
"""


# A zsh at a terminal of its own: presses Tab after each line and waits for the word that must then stand there.
ZSH = """
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell "autoload -U compinit; compinit -D -u; source '$1'; print lo''aded"
zpty -r shell seen '*loaded*' || exit 1
shift
while (($#)); do
  zpty -w -n shell $'\\x15'"$1"$'\\t'
  zpty -r shell seen "*$2*" || exit 1
  shift 2
done
zpty -d shell
"""


def script(tmp_path, shell):
    path = tmp_path / f"lightshaft.{shell}"
    path.write_text(lightshaft("completion", shell).stdout)
    return path


def run(*command, cwd=None):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=cwd, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def need(program):
    if not shutil.which(program):
        pytest.skip(f"{program} is not installed")


def complete(tmp_path, *words):
    return run("bash", "-c", BASH, "bash", script(tmp_path, "bash"), "lightshaft", *words, cwd=tmp_path).split("\n")[:-1]


def commands():
    """The commands that --help lists."""
    lines = lightshaft("--help").stdout.split("Subcommands:")[1].splitlines()
    return {line.split()[0] for line in lines if line.startswith("  ") and line[2] != " "}


def test_bash_completes_commands_options_values_and_files(tmp_path):
    (tmp_path / "my scene.xml").write_text("")
    (tmp_path / "token").write_text("")

    assert commands() <= set(complete(tmp_path, ""))
    assert complete(tmp_path, "docto") == ["doctor"]
    assert {"add", "list", "revoke"} <= set(complete(tmp_path, "token", ""))
    assert complete(tmp_path, "token", "add", "--ro") == ["--role"]
    assert complete(tmp_path, "token", "add", "--role", "a") == ["admin"]
    assert complete(tmp_path, "token", "add", "--role", "=", "r") == ["read"]
    assert complete(tmp_path, "token", "add", "--role", "=") == ["submit", "read", "join", "admin"]
    assert complete(tmp_path, "completion", "z") == ["zsh"]
    assert complete(tmp_path, "up", "--l") == ["--lan"] and complete(tmp_path, "join", "--c") == ["--code"]
    assert complete(tmp_path, "farm", "up", "--on", "s") == ["slurm", "ssh"] and complete(tmp_path, "farm", "up", "--bud") == ["--budget"]
    assert complete(tmp_path, "compare", "--clock", "c") == ["cpu"] and complete(tmp_path, "compare", "my") == ["my scene.xml"]
    assert complete(tmp_path, "render", "my") == ["my scene.xml"]
    assert complete(tmp_path, "jobs", "--token-file", "to") == ["token"]
    assert complete(tmp_path, "jobs", "to") == [""], "this command takes no file"
    assert complete(tmp_path, "render", "--spp", "") == [""], "nobody knows the number"


def test_each_shell_takes_its_script_and_knows_every_command(tmp_path):
    run("bash", "-n", script(tmp_path, "bash"))
    for shell in ("bash", "zsh", "fish"):
        text = script(tmp_path, shell).read_text()
        assert [name for name in commands() if name not in text] == []


def test_zsh_completes_commands_options_and_values(tmp_path):
    need("zsh")

    run("zsh", "-n", script(tmp_path, "zsh"))
    run("zsh", "-f", "-c", ZSH, "zsh", script(tmp_path, "zsh"), "lightshaft docto", "doctor", "lightshaft token rev", "revoke",
        "lightshaft token add --ro", "--role", "lightshaft token add --role ad", "admin")


def test_fish_completes_commands_and_values(tmp_path):
    need("fish")

    def offered(line):
        text = run("fish", "--no-config", "-c", f"source '{script(tmp_path, 'fish')}'; complete -C '{line}'")
        return [each.split("\t")[0] for each in text.splitlines()]

    assert offered("lightshaft docto") == ["doctor"]
    assert set(offered("lightshaft token add --role ")) == {"submit", "read", "join", "admin"}
    assert offered("lightshaft token add --ro") == ["--role"]


def page(program):
    return run(bin_dir() / program, "--man-page", "2026-01-31")


@pytest.mark.parametrize("program", PROGRAMS)
def test_manual_pages_are_right_and_name_every_option(program, tmp_path):
    path = tmp_path / f"{program}.1"
    path.write_text(page(program))
    options = {word.strip(",") for line in run(bin_dir() / program, "--help").splitlines() for word in line.split()[:1] if word.startswith("-")}

    text = path.read_text().replace("\\-", "-")

    assert text.startswith(f".TH \"{program.upper()}\" 1 2026-01-31 ") and options
    assert [name for option in options for name in option.split(",") if name not in text] == []
    for lint in (["mandoc", "-T", "lint", "-W", "warning"], ["man", "--warnings", "-l", "-Tutf8", "-Z"]):
        if shutil.which(lint[0]):
            done = subprocess.run([*lint, str(path)], capture_output=True, text=True, timeout=PATIENCE)
            assert (done.returncode, done.stderr) == (0, ""), f"{lint[0]}: {done.stdout[:2000]}{done.stderr[:2000]}"


def test_the_page_of_the_command_has_all_commands():
    text = page("lightshaft").replace("\\-", "-")

    assert [name for name in commands() if f".SS \"lightshaft {name} [OPTIONS]" not in text] == []
    assert ".SS \"lightshaft token add [OPTIONS]\"" in text and "(submit, read, join, admin)" in text


def test_installation_writes_pages_and_scripts(tmp_path):
    build = bin_dir().parent
    if not (build / "cmake_install.cmake").exists() or not shutil.which("cmake"):
        pytest.skip("the programs are of no build folder")
    for component in ("cli", "worker", "coordinator"):
        run("cmake", "--install", build, "--prefix", tmp_path, "--component", component)

    for program in PROGRAMS:
        installed = gzip.decompress((tmp_path / "share/man/man1" / f"{program}.1.gz").read_bytes()).decode()
        assert installed.splitlines()[1:] == page(program).splitlines()[1:]
    for shell, file in (("bash", "bash-completion/completions/lightshaft"), ("zsh", "zsh/vendor-completions/_lightshaft"),
                        ("fish", "fish/vendor_completions.d/lightshaft.fish")):
        assert (tmp_path / "share" / file).read_text() == lightshaft("completion", shell).stdout
