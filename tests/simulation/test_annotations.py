"""What editors are told of data and model is there, and of the type that they are told."""

import typing

import mujoco
import pytest

import arc_suite
from arc_suite.simulation import annotations, mujoco_types


@pytest.mark.parametrize(("kind", "attribute"), [(annotations.Data, "data"), (annotations.Model, "model")])
def test_fields_have_their_types(kind, attribute):
    physics = arc_suite.load("bastion", "navigate").physics
    fields = typing.get_type_hints(kind)
    assert fields["ptr"] in (mujoco.MjData, mujoco.MjModel) and len(fields) >= 25
    for name, field_type in fields.items():
        assert isinstance(getattr(getattr(physics, attribute), name), field_type), name


@pytest.mark.parametrize(
    ("kind", "further", "original"),
    [
        (annotations.MjData, mujoco_types.FurtherDataFields, mujoco.MjData),
        (annotations.MjModel, mujoco_types.FurtherModelFields, mujoco.MjModel),
    ],
)
def test_every_field_of_mujoco_is_there(kind, further, original):
    """For checkers, names that are not there are typos."""
    further_names = {name for name in vars(further) if name[0] != "_"} | typing.get_type_hints(further).keys()
    names = typing.get_type_hints(kind).keys() | further_names
    assert names == {name for name in dir(original) if name[0] != "_"}
