"""What editors are told of data and model is there, and of the type that they are told."""

import typing

import mujoco
import pytest

import arc_suite
from arc_suite.simulation import annotations


@pytest.mark.parametrize(("kind", "attribute"), [(annotations.Data, "data"), (annotations.Model, "model")])
def test_fields_have_their_types(kind, attribute):
    physics = arc_suite.load("bastion", "navigate").physics
    fields = typing.get_type_hints(kind)
    assert fields["ptr"] in (mujoco.MjData, mujoco.MjModel) and len(fields) >= 25
    for name, field_type in fields.items():
        assert isinstance(getattr(getattr(physics, attribute), name), field_type), name
