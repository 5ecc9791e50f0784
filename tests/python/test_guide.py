"""docs/guide/python.md: its Python blocks run as they stand; venv.sh does what its shell block does."""

import re

import numpy as np
from local_farm import ROOT

PAGE = (ROOT / "docs/guide/python.md").read_text()
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_every_block_is_marked():
    assert PAGE.count("\n```") == 2 * len(BLOCKS) and {kind for kind, _ in BLOCKS} == {"sh", "python"}


def test_the_wheel_is_built_as_the_page_says():
    (shell,) = (text for kind, text in BLOCKS if kind == "sh")
    command = re.search(r"pip (wheel --no-deps) -w \S+ (\./python)", shell)
    script = (ROOT / "tests/venv.sh").read_text()
    assert command and all(part in script for part in command.groups())
    assert "./python[notebook]" in shell and "[notebook,usd]" in script


def test_the_blocks_run_as_they_stand(local_farm, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIGHTSHAFT_URL", local_farm.url())
    monkeypatch.setenv("LIGHTSHAFT_TOKEN", local_farm.token)
    names = {}

    for kind, text in BLOCKS:
        if kind == "python":
            exec(compile(text, "docs/guide/python.md", "exec"), names)

    assert names["pixels"].shape == (120, 160, 3) and names["pixels"].max() > 0
    assert (tmp_path / "ball.exr").stat().st_size > 0
    assert not np.array_equal(names["one"], names["two"])
    printed = capsys.readouterr().out
    assert (
        "\nscene.xml 3 " in printed
        and "did you mean 'sigma_t'?" in printed
        and "\nball.radius\n" in printed
    )
    names["farm"].close()
