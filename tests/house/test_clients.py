"""The page of clients; `make check-clients` runs every block of it in an environment of its own."""

import re

import check_clients

PAGE = check_clients.PAGE.read_text()
CLIENTS = {client.name: client for client in check_clients.clients(PAGE)}


def test_every_section_is_a_client_that_is_run():
    assert list(CLIENTS) == re.findall(r"^## (.*)$", PAGE, re.MULTILINE)
    assert sum(len(client.blocks) for client in CLIENTS.values()) == PAGE.count("```python")


def test_every_client_of_the_table_has_lines_that_run():
    assert set(re.findall(r"^\| \[([^\]]*)\]", PAGE, re.MULTILINE)) == set(CLIENTS)
    for client in CLIENTS.values():
        assert client.packages and client.blocks
        for block in client.blocks:
            compile(block, client.name, "exec")


def test_versions_that_were_tried_are_those_that_are_installed():
    for name, version in re.findall(r"^\| \[([^\]]*)\]\([^)]*\) (\S+) \|", PAGE, re.MULTILINE):
        if name != "Minari":  # that of the extra `data`
            assert any(package.endswith(f"=={version}") for package in CLIENTS[name].packages), name


def test_lines_that_need_nothing_more_run():
    exec(compile(CLIENTS["Gymnasium"].blocks[0], "docs/clients.md", "exec"), {})
