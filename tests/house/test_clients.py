"""The pages of clients and first steps; `make check-clients` runs every section in an environment of its own."""

import re

import check_clients
import programs
import pytest

PAGE, FIRST_STEPS = (page.read_text() for page in check_clients.PAGES)
CLIENTS, STEPS = ({client.name: client for client in check_clients.clients(page)} for page in (PAGE, FIRST_STEPS))


@pytest.mark.parametrize(("page", "sections"), [(PAGE, CLIENTS), (FIRST_STEPS, STEPS)], ids=["clients", "first_steps"])
def test_every_section_is_run(page, sections):
    assert list(sections) == re.findall(r"^## (.*)$", page, re.MULTILINE)
    blocks = [block for section in sections.values() for block in section.blocks]
    assert len(blocks) + len(sections) == len(re.findall(r"^```\w+$", page, re.MULTILINE))


def test_every_client_of_the_table_has_lines_that_run():
    assert set(re.findall(r"^\| \[([^\]]*)\]", PAGE, re.MULTILINE)) == set(CLIENTS)
    for client in CLIENTS.values():
        assert client.packages and client.blocks
        for block in client.blocks:
            compile(block.text, client.name, "exec")


def test_versions_that_were_tried_are_those_that_are_installed():
    for name, version in re.findall(r"^\| \[([^\]]*)\]\([^)]*\) (\S+) \|", PAGE, re.MULTILINE):
        if name != "Minari":  # that of the extra `data`
            assert any(package.endswith(f"=={version}") for package in CLIENTS[name].packages), name


def test_lines_that_need_nothing_more_run():
    exec(compile(CLIENTS["Gymnasium"].blocks[0].text, "docs/clients.md", "exec"), {})


def test_a_block_that_is_saved_is_not_run():
    saved = [block for step in STEPS.values() for block in step.blocks if block.file]
    assert [(block.kind, block.file) for block in saved] == [("python", "ice.py")]


def test_the_task_of_the_first_steps(tmp_path):
    module, commands = STEPS["A task of your own"].blocks
    (tmp_path / module.file).write_text(module.text)
    (evaluate,) = re.findall("^arc-suite (evaluate .*)$", commands.text, re.MULTILINE)
    short = ["--policy=zero", "--episodes=1", "--set=time_limit=1"]
    programs.passed(programs.arc_suite(*evaluate.split(), *short, cwd=tmp_path))
    assert '"task": "ice:ice"' in (tmp_path / "ice.json").read_text()


@pytest.mark.slow
def test_the_spider_of_the_first_steps(tmp_path):
    short = {"evaluate": ["--set=time_limit=1"], "render": ["--steps=2"], "animate": ["--clips=idle"]}
    for command in STEPS["A spider as animation clips"].blocks[0].text.splitlines():
        programs.passed(programs.run(*command.split(), *short.get(command.split()[1], ()), cwd=tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {"spider.mp4", "clips.glb", "clips.clips.json"}


@pytest.mark.slow
@pytest.mark.release
def test_the_notebook_of_the_first_steps(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    exec(compile(STEPS["A notebook"].blocks[0].text, "docs/first_steps.md", "exec"), {})
