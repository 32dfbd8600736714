"""Masses: of all parts, of a payload, and where the torso's mass lies."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.models.outline import torso_box
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.inertia import Inertia
from arc_suite.tasks.modifiers.draws import Episode, interpolate
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Scalar, Vector
from arc_suite.tasks.scene import Scene

_MASS_FIELDS = ("body_mass", "body_inertia")  # fields of the model that the setting `mass` multiplies
_INERTIA_FIELDS = ("body_mass", "body_ipos", "body_inertia", "body_iquat")  # in the order of the fields of `Inertia`


class MassesState(NamedTuple):
    """What an episode draws of masses.

    Attributes:
        mass: (..., 1) multiple of mass and inertia of all parts.
        payload: (..., 4) mass of the payload, a share of the body's, and its place in the torso's frame, h.
        center_of_mass: (..., 3) displacement of the torso's center of mass in the torso's frame, h.
    """

    mass: np.ndarray
    payload: np.ndarray
    center_of_mass: np.ndarray


class _MassesFields(NamedTuple):
    mass: tuple[float, float]
    payload: tuple[float, float]
    center_of_mass: float


class Masses(_MassesFields, Modifier):
    """Masses of the body.

    Attributes:
        mass: range of the multiple of mass and inertia of all parts.
        payload: range of the mass of a load, as a share of the body's. The place of the load is uniform in the box
            around the torso.
        center_of_mass: the greatest displacement of the torso's center of mass along each axis, h.
    """

    __slots__ = ()

    defaults = {"mass": (1.0, 1.0), "payload": (0.0, 0.0), "center_of_mass": 0.0}
    bounds = {"mass": (0.01, 100.0), "payload": (0.0, 10.0), "center_of_mass": (0.0, 1.0)}
    read_back_fields = ("body_mass", "body_ipos")

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        mass = cls.check_span("mass", settings)
        payload = cls.check_span("payload", settings)
        return cls(mass, payload, cls.check_number("center_of_mass", settings))

    @property
    def is_active(self) -> bool:
        """Whether steps have to call it: never, as the simulation itself has the masses."""
        return False

    def draw(self, episode: Episode) -> MassesState:
        """Return the masses of the episode."""
        body = episode.scene.body
        keyed = episode.keyed
        low_corner, high_corner = torso_box(body)  # m
        height = body.torso.standing_height
        payload_share = interpolate(self.payload, keyed.payload)
        payload_place = interpolate((low_corner / height, high_corner / height), keyed.payload_place)
        return MassesState(
            mass=np.array([interpolate(self.mass, episode.stream.mass)]),
            payload=np.array([payload_share, *payload_place]),
            center_of_mass=self.center_of_mass * (2.0 * keyed.center_of_mass - 1.0),
        )

    def fields(self, scene: Scene, model: Mapping[str, Any], state: MassesState) -> dict[str, Any]:
        """Return the masses and inertias of the model."""
        fields = {}
        if self.mass != (1.0, 1.0):
            fields = {name: state.mass[0] * model[name] for name in _MASS_FIELDS}
        if self.payload != (0.0, 0.0) or self.center_of_mass != 0.0:
            fields |= _change_torso(scene, state, {**model, **fields})
        return fields

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks `mass`, `payload` and `center_of_mass`."""
        return {
            "mass": Block((Scalar("multiple of the mass"),)),
            "payload": Block((Scalar("mass of the payload", "body's mass"), Vector("place of the payload", "h"))),
            "center_of_mass": Block((Vector("displacement of the center of mass", "h"),)),
        }

    def privileged(self, state: MassesState, elapsed, heading) -> dict[str, Any]:
        """Return the masses that the episode has drawn."""
        return state._asdict()

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the blocks for masses that a user has changed; nothing where they are as compiled.

        `mass` is then the multiple of the mass of the legs. The additional mass of the torso counts as the payload.
        Its place is the torso's center of mass, whose displacement is `center_of_mass`.
        """
        if not any(name in fields for name in self.read_back_fields):
            return {}
        xp = blocks["mass"].__array_namespace__()
        height = scene.body.torso.standing_height
        body_mass = measure_standing(scene.body).mass
        torso = scene.layout.torso
        compiled_masses = scene.model["body_mass"]
        parts = np.arange(len(compiled_masses))[scene.layout.parts]
        leg_parts = parts[1:]  # without the torso
        torso_mass = compiled_masses[torso]
        torso_center = scene.model["body_ipos"][torso]
        torso_place = scene.layout.place_in_torso
        # The masses that the episode has drawn; of changed fields, those of the user.
        multiple = blocks["mass"]
        payload = body_mass * blocks["payload"][:1]  # kg
        moment = torso_mass * (torso_center + height * blocks["center_of_mass"])
        payload_place = torso_place + height * blocks["payload"][1:]
        center = (moment + payload * payload_place) / (torso_mass + payload)
        if "body_mass" in fields:
            multiple = fields["body_mass"][leg_parts].sum(keepdims=True) / compiled_masses[leg_parts].sum()
            payload = fields["body_mass"][[torso]] / multiple - torso_mass
        if "body_ipos" in fields:
            center = fields["body_ipos"][torso]
        return {
            "mass": multiple,
            "payload": xp.concatenate([payload / body_mass, (center - torso_place) / height]),
            "center_of_mass": (center - torso_center) / height,
        }


def _change_torso(scene: Scene, state: MassesState, model: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the inertia fields, in which the torso's center of mass is displaced and the torso has a payload."""
    index = scene.layout.torso
    height = scene.body.torso.standing_height
    torso = Inertia(*(model[name][index] for name in _INERTIA_FIELDS))
    torso = torso._replace(center=torso.center + height * state.center_of_mass)
    payload_share = state.payload[0]
    if payload_share > 0.0:
        payload = payload_share * state.mass[0] * measure_standing(scene.body).mass  # kg
        torso = torso.with_point(payload, scene.layout.place_in_torso + height * state.payload[1:])
    fields = {name: model[name].copy() for name in _INERTIA_FIELDS}
    for name, value in zip(_INERTIA_FIELDS, torso, strict=True):
        fields[name][index] = value
    return fields
