"""`arc-suite motion`: a motion of any file for any body, and a line for each thing that was changed."""

import drawn_motions
import programs
import pytest

from arc_suite import motions, registry

QUEEN = registry.body_of("queen")
SPIDER = registry.body_of("spider")


def run(folder, *arguments):
    return programs.arc_suite("motion", *map(str, arguments), cwd=folder)


@pytest.fixture
def folder(tmp_path):
    motions.save(drawn_motions.raise_leg(QUEEN, 0), tmp_path / "raise.npz")
    return tmp_path


@pytest.mark.slow
def test_motion_of_another_body(folder):
    lines = programs.passed(run(folder, "raise.npz", "--robot", "spider", "-o", "spider.npz")).splitlines()
    assert lines == [
        "raise.npz: raise of queen, 41 frames, lasts 2.000 s",
        "  now of spider, lasts 1.155 s",
        "  without a partner, planted: l3, r3",
        "  feet miss their paths by up to 0.000 standing heights",
        "wrote spider.npz",
    ]
    motion = motions.load(folder / "spider.npz")
    expected, _ = motions.retarget(motions.load(folder / "raise.npz"), SPIDER)
    assert motions.digest(motion) == motions.digest(expected)
    checked = programs.passed(run(folder, "spider.npz")).splitlines()
    assert checked == ["spider.npz: raise of spider, 41 frames, lasts 1.155 s"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "expected a file of a motion; see --help"),
        (("raise.fbx",), "unknown extension '.fbx' (there are: .npz, .glb, .bvh, .csv)"),
        (("none.npz",), "cannot read none.npz: no such file or directory"),
        (("raise.npz", "--fps=30"), "--fps: goes with a table, and raise.npz is a motion"),
        (("raise.npz", "--clip=walk"), "--clip: it is for .glb, not for .npz"),
        (("raise.npz", "-o", "a.glb"), "unknown extension '.glb' (there are: .npz)"),
        (("raise.npz", "--of=tick"), "--of: goes with files of other tools, and raise.npz names its body"),
    ],
)
def test_errors_are_one_line(folder, arguments, message):
    programs.refused(run(folder, *arguments), f"arc-suite motion: {message}")
    assert [path.name for path in folder.iterdir()] == ["raise.npz"]
