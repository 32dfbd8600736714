"""Print a script by which a shell completes programs, flags and names.

The script is text alone: no program starts when the shell completes a word. It has flags and names of today: write it
anew for those of a later version.

  arc-suite completion bash > ~/.local/share/bash-completion/completions/arc-suite
  arc-suite completion zsh > ~/.zfunc/_arc-suite
  arc-suite completion fish > ~/.config/fish/completions/arc-suite.fish

zsh needs `fpath+=~/.zfunc` before `compinit` in ~/.zshrc.
"""

import contextlib
import pkgutil
from collections.abc import Callable, Mapping

from arc_suite import checks, policies, versions
from arc_suite.arenas import ARENAS
from arc_suite.cli.flag_names import flag_names
from arc_suite.cli.programs import (
    NAMES_OF_ARGUMENTS,
    NAMES_OF_FLAGS,
    PROGRAMS,
    WORDS,
    installed_programs,
    program_summary,
)
from arc_suite.models.builder import CAMERAS
from arc_suite.robots import ROBOTS, palettes
from arc_suite.robots.spec_files import EXAMPLES
from arc_suite.tasks import TASKS

_SHELLS = ("bash", "zsh", "fish")

# Names that flags take, by flag, in addition to those of `NAMES_OF_FLAGS`. Other values may be files.
_ROBOTS = (*ROBOTS, *EXAMPLES)
_NAMES_OF_FLAGS = {
    "robot": _ROBOTS,
    "spec": tuple(EXAMPLES),
    "task": tuple(TASKS),
    "policy": tuple(policies.POLICIES),
    "arena": tuple(ARENAS),
    "camera": CAMERAS,
    "palette": tuple(palettes.PALETTES),
    "preset": policies.preset_names(),
}
# Names that programs take without a flag, by program, in addition to those of `NAMES_OF_ARGUMENTS`.
_NAMES_OF_ARGUMENTS = {"check": _ROBOTS, "completion": _SHELLS, "help": tuple(PROGRAMS)}

_BASH = """\
_arc_suite() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} flag= words=
    # bash takes --robot=queen for three words.
    if [ "$word" = = ]; then
        flag=$before word=
    elif [ "$before" = = ]; then
        flag=${{COMP_WORDS[COMP_CWORD-2]}}
    else
        flag=$before
    fi
    if [ "$COMP_CWORD" = 1 ]; then
        words="{programs}"
    elif [ "${{word#-}}" != "$word" ]; then
        case ${{COMP_WORDS[1]}} in
{flags}
        esac
    else
        case $flag in
{names}
        -*) ;;
        *) case ${{COMP_WORDS[1]}} in
{arguments}
        esac ;;
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    [ "${{COMPREPLY[0]%=}}" = "${{COMPREPLY[0]}}" ] || compopt -o nospace
}}
complete -o default -F _arc_suite arc-suite
"""

_ZSH = """\
#compdef arc-suite
_arc_suite() {{
    local word=$words[CURRENT] flag=$words[CURRENT-1]
    if (( CURRENT == 2 )); then
        compadd -- {programs}
    elif [[ $word == -* && $word != *=* ]]; then
        case $words[2] in
{flags}
        esac
    else
        if [[ $word == *=* ]]; then
            flag=${{word%%=*}}
            compset -P '*='
        fi
        case $flag in
{names}
        -*) _files ;;
        *) case $words[2] in
{arguments}
        *) _files ;;
        esac ;;
        esac
    fi
}}
if [ "$funcstack[1]" = _arc_suite ] || [ "$funcstack[1]" = _arc-suite ]; then
    _arc_suite "$@"
else
    compdef _arc_suite arc-suite
fi
"""


def main(shell: str | None = None) -> None:
    """Print the script of a shell."""
    if shell is None:
        raise ValueError(f"expected a shell: {', '.join(_SHELLS)}; see --help")
    print(_SCRIPTS[checks.name(shell, _SHELLS, "shell")](), end="")


def _bash_script() -> str:
    def complete_flags(program):
        typed_flags = [f"--{flag.name}{'=' if flag.takes_value else ''}" for flag in flag_names(program)]
        return f'words="{" ".join(typed_flags)}"'

    def complete_names(names):
        return f'words="{" ".join(names)}"'

    return _fill(_BASH, complete_flags, complete_names)


def _zsh_script() -> str:
    def complete_flags(program):
        program_flags = flag_names(program)
        with_value = [f"--{flag.name}" for flag in program_flags if flag.takes_value]
        without_value = [f"--{flag.name}" for flag in program_flags if not flag.takes_value]
        return f"compadd -S = -- {' '.join(with_value)}; compadd -- {' '.join(without_value)}"

    def complete_names(names):
        return f"compadd -- {' '.join(names)}"

    return _fill(_ZSH, complete_flags, complete_names)


def _fill(template: str, complete_flags: Callable[[str], str], complete_names: Callable[[tuple], str]) -> str:
    """Return a script with a case for each program and for each flag that takes names."""
    cases_of_programs = {program: complete_flags(program) for program in PROGRAMS}
    cases_of_flags = {f"--{flag}": complete_names(names) for flag, names in _names_of_flags().items()}
    cases_of_arguments = {program: complete_names(names) for program, names in _names_of_arguments().items()}
    return template.format(
        programs=" ".join(_first_words()),
        flags=_case_lines(cases_of_programs),
        names=_case_lines(cases_of_flags),
        arguments=_case_lines(cases_of_arguments),
    )


def _names_of_flags() -> dict[str, tuple[str, ...]]:
    return _NAMES_OF_FLAGS | _import_names(NAMES_OF_FLAGS)


def _names_of_arguments() -> dict[str, tuple[str, ...]]:
    return _NAMES_OF_ARGUMENTS | _import_names(NAMES_OF_ARGUMENTS)


def _import_names(paths: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return names by the key of the `module:attribute` that holds them, except those of extras not installed."""
    names = {}
    for key, path in paths.items():
        with contextlib.suppress(versions.MissingExtra):
            names[key] = tuple(pkgutil.resolve_name(path))
    return names


def _case_lines(commands: Mapping[str, str]) -> str:
    return "\n".join(f"        {word}) {command} ;;" for word, command in commands.items())


def _fish_script() -> str:
    lines = []
    for word, summary in _first_words().items():
        lines.append(f"complete -c arc-suite -f -n __fish_use_subcommand -a {word} -d {_quote(summary)}")
    names_of_flags = _names_of_flags()
    for word, names in _names_of_arguments().items():
        lines.append(f"complete -c arc-suite -f -n '__fish_seen_subcommand_from {word}' -a '{' '.join(names)}'")
    for program in PROGRAMS:
        condition = f"-n '__fish_seen_subcommand_from {program}'"
        for flag in flag_names(program):
            short_name = f" -s {flag.short_name}" if flag.short_name else ""
            value = " -r" if flag.takes_value else ""
            names = names_of_flags.get(flag.name, ())
            names_of_flag = f" -a '{' '.join(names)}'" if names else ""
            lines.append(f"complete -c arc-suite {condition} -l {flag.name}{short_name}{value}{names_of_flag}")
    return "\n".join([*lines, ""])


def _first_words() -> dict[str, str]:
    """Return what may follow `arc-suite`, with a summary each."""
    summaries = {program: program_summary(program) for program in PROGRAMS}
    programs_of_packages = {
        name: f"of the package {entry_point.dist.name}" for name, entry_point in installed_programs().items()
    }
    return summaries | programs_of_packages | WORDS


def _quote(text: str) -> str:
    escaped_text = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped_text}'"


_SCRIPTS = {"bash": _bash_script, "zsh": _zsh_script, "fish": _fish_script}
