"""Scripts of completion, run by the shells that are here."""

import shutil
import subprocess

import programs
import pytest

SHELLS = ("bash", "zsh", "fish")
# A line up to the cursor, the words that bash makes of it, and some of the words that it may become.
LINES = {
    "arc-suite tra": ("tra", {"train", "transfer"}),
    "arc-suite help eva": ("help eva", {"evaluate"}),
    "arc-suite completion f": ("completion f", {"fish"}),
    "arc-suite evaluate --epi": ("evaluate --epi", {"--episodes="}),
    "arc-suite build_model --js": ("build_model --js", {"--json"}),
    "arc-suite train --robot=qu": ("train --robot = qu", {"queen"}),
    "arc-suite train --robot qu": ("train --robot qu", {"queen"}),
    "arc-suite render --task ste": ("render --task ste", {"steer"}),
    "arc-suite design --policy x": ("design --policy x", set()),
    "arc-suite train --algorithm drq": ("train --algorithm drq", set()),
    "arc-suite train --algorithm dro": ("train --algorithm dro", {"droq"}),
    "arc-suite evaluate --preset ref": ("evaluate --preset ref", {"refined"}),
    "arc-suite animate --clips att": ("animate --clips att", {"attack"}),
    "arc-suite animate --rig no": ("animate --rig no", {"nodes"}),
    "arc-suite render --camera por": ("render --camera por", {"portrait"}),
    "arc-suite render --palette mo": ("render --palette mo", {"moss"}),
    "arc-suite check sp": ("check sp", {"spider"}),
    "arc-suite render --output sp": ("render --output sp", set()),
}


@pytest.fixture(scope="module")
def scripts(tmp_path_factory):
    """The path of each shell's script."""
    folder = tmp_path_factory.mktemp("completion")
    for shell in SHELLS:
        (folder / shell).write_text(programs.passed(programs.arc_suite("completion", shell)))
    return folder


def shell_output(shell, code):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    done = subprocess.run([shell, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("shell", SHELLS)
def test_a_script_has_no_errors(scripts, shell):
    shell_output(shell, f"{shell} -n {scripts / shell}")


@pytest.mark.parametrize(("words", "completions"), LINES.values(), ids=LINES)
def test_bash(scripts, words, completions):
    count = len(words.split())
    code = f"source {scripts / 'bash'}; compopt() {{ :; }}; COMP_WORDS=(arc-suite {words}); COMP_CWORD={count}; "
    assert set(shell_output("bash", f"{code} _arc_suite; echo ${{COMPREPLY[*]}}").split()) == completions


def test_fish(scripts):
    for line, (_, completions) in LINES.items():
        if completions:
            output = shell_output("fish", f"source {scripts / 'fish'}; complete -C '{line}'")
            words = {text.split("\t")[0].removeprefix("--robot=") for text in output.splitlines()}
            assert words == {word.removesuffix("=") for word in completions}, line


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ((), "expected a shell: bash, zsh, fish; see --help\n"),
        (("fsh",), "unknown shell 'fsh'; did you mean 'fish'? (there are: bash, zsh, fish)\n"),
        (("powershell",), "unknown shell 'powershell' (there are: bash, zsh, fish)\n"),
    ],
)
def test_without_a_shell_that_there_is(arguments, line):
    programs.refused(programs.arc_suite("completion", *arguments), f"arc-suite completion: {line}")
