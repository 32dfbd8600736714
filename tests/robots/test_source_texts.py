"""A source that a stranger wrote holds parts and numbers, or is refused in one line that begins with `source: `."""

import json
import pathlib

import pytest
from refusals import refused

from arc_suite import models
from arc_suite.importing import import_robot
from arc_suite.robots import sources
from arc_suite.robots.spec import MAX_SOURCE, SpecError
from arc_suite.robots.spec_files import MAX_BYTES, MAX_IMPORTED, body_from_json, body_to_json, load_body, save_body

ROBOT = pathlib.Path(__file__).parents[1] / "fixtures" / "robots" / "go2_like.xml"
BODY = import_robot(ROBOT).body
KNEE = 'name="l1_joint3"'

# By what is written in place of what: the line.
REFUSED = {
    ("<worldbody>", '<include file="/etc/passwd"/><worldbody>'): "expected no element 'include' in 'mujoco'",
    ("<worldbody>", "<extension/><worldbody>"): "expected no element 'extension' in 'mujoco'",
    ("<worldbody>", '<asset><texture file="a.png"/></asset><worldbody>'): "expected no element 'texture' in 'asset'",
    ("<worldbody>", '<asset><mesh name="a" file="/a.stl"/></asset><worldbody>'): (
        "mesh 'a': expected no attribute 'file'"
    ),
    ("<worldbody>", "<worldbody><geom/>"): "expected no element 'geom' in 'worldbody'",
    ("<worldbody>", '<worldbody><body name="box"/>'): (
        "expected one body in the world, named 'torso', whose first joint 'root' is the one that is free"
    ),
    ('name="root" type="free"', 'name="root" type="ball"'): (
        "joint 'root': type: expected one of free, hinge, slide, got 'ball'"
    ),
    ('name="l1_link3"', 'name="l1_link3" plugin="a"'): "body 'l1_link3': expected no attribute 'plugin'",
    ('name="l1_link3"', 'name="l1_link3" pos="0 0 nan"'): None,
    (KNEE, 'name="l1_knee"'): "expected a joint 'l1_joint3'",
    (KNEE, 'name="l1_joint2"'): "the joint 'l1_joint2' occurs twice",
    ('name="l1_foot" size', 'name="l1_toe" size'): "expected a site 'l1_foot'",
    ('contype="1"', 'contype="3"'): "geom 'torso_geom0': contype: expected one of 0, 1, got '3'",
    ('cone="elliptic"', 'cone="elliptic" iterations="1000000000"'): (
        "option '': iterations: expected an integer up to 10000, got '1000000000'"
    ),
    ('impratio="100.0"', 'impratio="1e300"'): "option '': impratio: expected numbers from -1e+15 to 1e+15, got '1e300'",
    ('name="home" qpos="0.0', 'name="home" qpos="0.0 0.0'): "expected a keyframe 'home' of 19 numbers",
    ('key name="home"', 'key name="other"'): "key 'other': name: expected one of home, got 'other'",
    ("<mujoco>", '<!DOCTYPE a [<!ENTITY b "c">]><mujoco>'): "expected XML without a document type and entities",
    ("<keyframe>", '<equality><weld body1="torso" body2="world"/></equality><keyframe>'): (
        "weld '': expected no attribute 'body1'"
    ),
    ("<keyframe>", "<equality><flex/></equality><keyframe>"): "expected no element 'flex' in 'equality'",
    ('<site name="torso"', '<site pos="0 0 1e9" name="torso"'): (
        "site 'torso': pos: expected numbers from -100 to 100, got '0 0 1e9'"
    ),
    ("</mujoco>", ""): None,
}


# What MuJoCo refuses, as parts of names that the source has not.
LOOPS = {
    '<connect site1="a" site2="b"/>': "Error: unknown element 'a' in equality constraint",
    '<joint joint1="l1_joint1" joint2="l1_knee"/>': "Error: unknown element 'l1_knee' in equality constraint",
    "<joint/>": "XML Error: required attribute missing: 'joint1'",
}


def changed(old, new):
    assert old in BODY.source, old
    return json.dumps(json.loads(body_to_json(BODY)) | {"source": BODY.source.replace(old, new, 1)})


@pytest.mark.parametrize("edit", REFUSED, ids="-".join)
def test_it_is_refused_in_one_line(edit):
    line = REFUSED[edit]
    with refused("source: " + (line or ""), SpecError, begins=line is None):
        body_from_json(changed(*edit))


def test_too_many_and_too_deep_are_counted():
    geom = '<geom name="torso_geom0"'
    with refused("source: expected at most 4096 elements 'geom', at most 200 within each other", SpecError):
        body_from_json(changed(geom, "<geom/>" * 4097 + geom))
    deep = "<body>" * 300 + "</body>" * 300
    with refused("source: expected at most 2048 elements 'body', at most 200 within each other", SpecError):
        body_from_json(changed(geom, deep + geom))
    with refused("source: expected a text of 1 to 2097152 characters, got '", SpecError, begins=True):
        body_from_json(changed("</mujoco>", "</mujoco>" + " " * MAX_SOURCE))


def test_files_with_a_source_may_be_longer(tmp_path):
    path = tmp_path / "long.json"
    long = BODY.replace(source=BODY.source + "\n" * MAX_BYTES)
    save_body(long, path)
    assert load_body(path) == long
    path.write_text(json.dumps({"source": " " * MAX_IMPORTED}))
    with refused(f"{path}: expected at most {MAX_IMPORTED} bytes", SpecError):
        load_body(path)


def test_bodies_without_a_source_are_not_looked_at():
    plain = load_body("spider")
    assert sources.check(plain) is plain


@pytest.mark.parametrize("loop", LOOPS)
def test_a_loop_of_parts_that_are_not_there_is_refused_in_one_line(loop):
    body = body_from_json(changed("<keyframe>", f"<equality>{loop}</equality><keyframe>"))
    with refused(f"Body(quadruped_15_kg).source: {LOOPS[loop]}", SpecError, begins=True):
        models.model_spec(body)
