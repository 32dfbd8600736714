"""Make a page to play in (.html): walk a creature about with keys, a gamepad or touch.

  arc-suite play --robot queen -o queen.html
  arc-suite play --robot all -o robots.html
  arc-suite play --robot walkers -o walkers.html
  arc-suite play --spec spider -o spider.html
  arc-suite play --policy runs/queen-steer-ppo-0 -o trained.html
  arc-suite play --spec spider --policy universal -o universal.html
  arc-suite play --robot tick --arena ground.png:20x20x1.5 -o ground.html

The page holds MuJoCo itself and requests nothing: open it from disk, or send it. Arrows or WASD walk and turn, Q and
E step to a side; dragging the body pulls it, B kicks it and R restarts. Bodies are chosen among those that the
command names; walkers, of 4 to 12 legs with 2 to 4 links each, by sliders. The demonstrator also takes a pose and a
gait, by keys and by sliders. A policy of a task with a command, such as steer, is given the keys' command; one of walk
keeps walking, and left and right turn its course.
"""

from absl import flags

from arc_suite import files, registry
from arc_suite.animation import pages, play_pages
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    adjust_body,
    bodies_from_flags,
    check_policy,
    choose_bodies,
    custom_body,
    define_arena,
    define_body,
    define_modules,
    define_policy,
    define_preset,
    import_modules,
    policy_name,
    policy_setup,
    preset_from_flags,
)
from arc_suite.cli.program import progress
from arc_suite.robots.spec import Body

FLAGS = flags.FLAGS
define_body(more=f", all of them to choose from, or {play_pages.WALKERS}: 27 bodies by legs and links")
define_arena()
define_policy()
define_preset()
define_modules("the policy")
flags.DEFINE_string("output", None, "File to write, .html. Required.", short_name="o")


def main() -> None:
    """Write the page."""
    if not FLAGS.output:
        raise ValueError("no file to write; say --output=FILE.html")
    outputs.check_extension(FLAGS.output, [".html"])
    import_modules()
    bodies = _bodies_from_flags()  # this imports the modules that flags name
    bodies = choose_bodies(policy_setup(importing_flags="--modules"), bodies)
    policy = policy_name(FLAGS.policy)
    preset = preset_from_flags()
    check_policy(policy, preset, next(iter(bodies.values())))
    if FLAGS.arena is not None:
        registry.arena_maker(FLAGS.arena)  # raises an error now if it has no ground
    pages.read_built_file("play.js")  # raises an error now if there is none
    with files.writing(FLAGS.output) as temporary:
        creatures = []
        for body in progress(bodies.values(), "fitting", leave=False):
            creatures.append(play_pages.creature(body, policy, preset, FLAGS.arena))
        page = play_pages.page(creatures)
        temporary.write_text(page, encoding="utf-8")
    print(f"wrote {FLAGS.output}, {len(page.encode()) / 1e6:.1f} MB")


def _bodies_from_flags() -> dict[str, Body]:
    """Return the bodies of the page by name."""
    if FLAGS.robot == play_pages.WALKERS and custom_body() is None:
        return {body.name: adjust_body(body) for body in play_pages.walkers()}
    return bodies_from_flags(suggestions=("all", play_pages.WALKERS))
