"""Design a creature while it walks, on a local web page.

  arc-suite studio
  arc-suite studio --legs 6 --links 2 --task rough
  arc-suite studio --robot queen --policy runs/queen-steer-ppo-0
  arc-suite studio --spec spider --port 9000

Sliders change body, gait, speed, task and ground; the creature changes in about a second and walks on. Buttons save
spec, MJCF, clips, page, picture and film. All visitors see one creature. Closing the page ends nothing; Ctrl-C does.
The page listens on this machine alone, unless --host says otherwise; over SSH, forward the port:
ssh -L 8080:localhost:8080 MACHINE. Without --task a demonstrator acts in directed, where sliders pose it.
"""

import dataclasses
import json
import re

from absl import flags

from arc_suite import checks, versions
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import DEFAULT_CHOICE, Sketch, open_body, sources
from arc_suite.arenas import ground_text
from arc_suite.cli.flags import (
    check_policy,
    define_walk,
    named_values,
    only_setup,
    policy_name,
    preset_from_flags,
    task_from_flags,
)

FLAGS = flags.FLAGS
define_walk()
flags.DEFINE_string("host", "127.0.0.1", "Address to listen on; 0.0.0.0 lets in everyone who can reach this machine.")
flags.DEFINE_integer(
    "port", 8080, "Port to listen on; the next free one if it is taken.", lower_bound=1, upper_bound=65535
)


_ADDRESS = re.compile(r"(?:https?://)?(\[[^\]/]*\]|[^/:]*)(?::(\d{1,5}))?/?")  # [...] is of IPv6
_PORT_ALONE = re.compile(r"[1-9]\d{1,4}")


def main() -> None:
    """Open the page and step until Ctrl-C."""
    _check_host(FLAGS.host)
    sketch = _sketch_from_flags()
    with versions.require_extra("the studio needs viser", "animate"):
        from arc_suite.animation.studio.page import serve
    serve(Session(sketch), FLAGS.host, FLAGS.port, _print_address)


def _check_host(text: str) -> None:
    """Raise ValueError for a text that is more than a host, such as one with a port."""
    match = _ADDRESS.fullmatch(text)
    host, port = match.groups() if match else (text, None)
    if _PORT_ALONE.fullmatch(host):
        port = host
        host = ""
    host = host.strip("[]")
    if host == "*":  # of servers that listen everywhere
        host = "0.0.0.0"
    if host == text:
        return
    cures = [f"--{flag}={value}" for flag, value in (("host", host), ("port", port)) if value]
    hint = f"; did you mean {' '.join(cures)}?" if cures else ""
    raise ValueError(f"--host={checks.quote(text)}: expected a host alone{hint}")


def _print_address(url: str) -> None:
    print(f"the studio is at {url}", flush=True)


def _sketch_from_flags() -> Sketch:
    """Return the sketch of the body, task and policy that flags name."""
    setup = only_setup()
    policy = policy_name(FLAGS.policy)
    preset = preset_from_flags()
    check_policy(policy, preset, setup.body)
    settings = setup.task_kwargs
    ground = settings.pop("arena", "flat")
    ground_file = ""
    if ground_text.is_text(ground):
        ground_file = ground
        ground = task_from_flags()[1]["arena"]  # the file
    kicks = settings.pop("kicks", 0.0)
    has_default_task = policy == "cpg" and not FLAGS["task"].present
    sketch = Sketch(
        task=Sketch.task if has_default_task else setup.task,
        ground=ground,
        ground_file=ground_file,
        kicks=kicks,
        settings=json.dumps(settings),
        policy=policy,
        preset=preset or DEFAULT_CHOICE,
        lengths=tuple(named_values("length", FLAGS.length).items()),
        palette=FLAGS.palette or DEFAULT_CHOICE,
    )
    if FLAGS.legs is not None:
        return dataclasses.replace(sketch, legs=FLAGS.legs, links=FLAGS.links or 3)
    source = FLAGS.spec or (FLAGS.robot if FLAGS["robot"].present else setup.robot)
    if source in sources():
        return dataclasses.replace(sketch, source=source)
    return open_body(sketch, setup.body)  # which has the lengths and colors that flags ask for
