"""The program: what its flags say."""

import ground_files
import interpreters

from arc_suite import registry
from arc_suite.animation.studio.sketch import DEFAULT_CHOICE, FILE, Sketch
from arc_suite.bodies import generator
from arc_suite.robots.spec_files import body_to_json

# In an interpreter of its own: programs define flags of the same names.
SKETCHES = """
from absl import flags
from arc_suite.animation.cli import studio
from arc_suite.animation.studio.sketch import *
for arguments in {arguments}:
    for name in flags.FLAGS:
        flags.FLAGS[name].unparse()
    flags.FLAGS(["studio", *arguments])
    print(repr(studio._sketch_from_flags()))
"""


def test_flags(tmp_path):
    body = generator.generate(5, 2)
    (tmp_path / "own.json").write_text(body_to_json(body))
    hill = registry.arena_word(ground_files.write_png(tmp_path / "hill.png"))
    arguments = {
        (): Sketch(source="queen", task="directed"),
        ("--legs=6", "--links=2", "--task=steer", "--preset=surefooted"): Sketch(
            legs=6, links=2, task="steer", preset="surefooted"
        ),
        ("--legs=4", "--length=lower=1.5", "--palette=7"): Sketch(
            legs=4, lengths=(("lower", 1.5),), palette="7", task="directed"
        ),
        ("--spec=spider", "--palette=#3a5f2b,#d8c48a"): Sketch(
            source="spider", palette="#3a5f2b,#d8c48a", task="directed"
        ),
        ("--spec=spider", "--set=arena=bumps", "--set=kicks=0.5", "--set=friction=0.7"): Sketch(
            source="spider", task="directed", ground="bumps", kicks=0.5, settings='{"friction": 0.7}'
        ),
        ("--spec=spider", f"--arena=hill.png:{ground_files.SCALE}"): Sketch(
            source="spider", task="directed", ground=f"hill.png:{ground_files.SCALE}", ground_file=hill
        ),
        ("--robot=tick", "--arena=bumps"): Sketch(source="tick", task="directed", ground="bumps"),
        ("--spec=own.json", "--policy=zero"): Sketch(
            source=FILE, file=body_to_json(body), task="walk", policy="zero", preset=DEFAULT_CHOICE
        ),
    }
    code = SKETCHES.format(arguments=[list(each) for each in arguments])
    assert [eval(line) for line in interpreters.printed(code, folder=tmp_path)] == list(arguments.values())
