"""The simulated model does what the written one does, bit by bit, with other contacts and another integrator."""

import sys

import interpreters
import mujoco
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from obstacles import Obstacle
from saved_models import saved
from tiers import tiers, turn

import arc_suite
from arc_suite import models, registry
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.bodies.generator import random_body
from arc_suite.cpg import Demonstrator
from arc_suite.models import direct
from arc_suite.models.sizing import size_body
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import EXAMPLES, load_body
from arc_suite.simulation.model import compile_model, euler_suffices, list_contacts

BODIES = ROBOTS | {f"random {seed}": random_body(seed) for seed in range(4)}
EULER, IMPLICITFAST = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
AFFINE, AFFINE_BIAS = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtBias.mjBIAS_AFFINE
UNDAMPED = mujoco.mjtDisableBit.mjDSBL_EULERDAMP
STATE = ("time", "qpos", "qvel", "qacc_warmstart", "cfrc_ext", "xpos", "sensordata")
CONTACT = ("geom", "pos", "frame", "dist", "includemargin", "dim", "friction", "solref", "solimp")


def written(body, arena=FLAT):
    return mujoco.MjModel.from_xml_string(models.assemble(body, arena).to_xml_string())


@pytest.mark.parametrize("body", [*ROBOTS, *EXAMPLES, "random:0", "random:1", *(f"varied:{seed}" for seed in range(8))])
def test_the_model_on_flat_ground_is_that_of_the_builder_byte_for_byte(body):
    body = load_body(body) if body in EXAMPLES else registry.body_of(body)
    spec = mujoco.MjSpec.from_string(models.assemble(body).to_xml_string())
    model = spec.compile()
    assert saved(direct.on_flat_ground(size_body(body)).compile()) == saved(model)
    list_contacts(spec, model)
    listed = spec.compile()
    listed.opt.integrator = compile_model(body).opt.integrator
    assert saved(compile_model(body)) == saved(listed)


@pytest.mark.skipif(sys.platform != "linux", reason="the heap of glibc")
def test_the_ground_of_an_arena_compiles_where_the_heap_cannot_grow():
    """MuJoCo's parser takes the errno of an allocation that succeeded elsewhere for a fault of a long list."""
    script = """if True:
        import ctypes
        from arc_suite.envs.prepare import prepare_task
        libc = ctypes.CDLL(None)
        libc.sbrk.restype, libc.mmap.restype = ctypes.c_void_p, ctypes.c_void_p
        libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [ctypes.c_long]
        page = -(-libc.sbrk(0) // 4096) * 4096
        fixed_anonymous_private = 0x100022
        assert libc.mmap(page, 4096, 0, fixed_anonymous_private, -1, 0) == page
        assert prepare_task("tick", "course", {"curriculum": True})[1].nhfielddata > 200_000
    """
    assert interpreters.printed(script) == []


def walk(body):
    """Start and actions of a demonstrator's walk."""
    environment, demonstrator = arc_suite.load(body, "walk", {"random": 0}), Demonstrator(body, "medium")
    timestep, start, actions = environment.reset(), environment.physics.get_state(), []
    for _ in range(40):
        actions.append(demonstrator(timestep))
        timestep = environment.step(actions[-1])
    return start, actions


def fall(body):
    """Start, in the air and turned anyhow, and actions at random."""
    model, random = written(body), np.random.RandomState(1)
    qpos = model.qpos0.copy()
    qpos[2] *= 1.5
    qpos[3:7] = random.standard_normal(4)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    return np.concatenate([qpos, np.zeros(model.nv)]), random.uniform(-1.0, 1.0, (40, model.nu))


FAST = (("flat", walk), ("bumps", fall))  # the others are of the same kinds of geoms, or slow
_CASES = [(body, arena, course) for body in BODIES for arena in ARENAS for course in (walk, fall)]


@pytest.mark.parametrize(
    ("body", "arena", "course"),
    tiers(
        _CASES,
        check=lambda body, arena, course: body in ROBOTS and (arena, course) == FAST[list(ROBOTS).index(body) % 2],
        test=lambda body, arena, course: turn(arena, ARENAS, list(BODIES).index(body)),
    ),
)
def test_same_bits_as_the_written_model(body, arena, course):
    start, actions = course(BODIES[body])
    arena = ARENAS[arena](BODIES[body])
    plain, fast = written(BODIES[body], arena), compile_model(BODIES[body], arena)
    assert (plain.npair, plain.opt.integrator) == (0, IMPLICITFAST)
    assert fast.opt.integrator == EULER
    large = np.isin(plain.geom_type, (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD))
    assert (fast.npair > 0) == (arena.lists_contacts or large.any())
    assert fast.geom_contype.any() == fast.geom_conaffinity.any() == (not arena.lists_contacts)
    runs = [(model, mujoco.MjData(model)) for model in (plain, fast)]
    for model, data in runs:
        data.qpos[:], data.qvel[:] = np.split(start, [model.nq])
    contacts = 0
    for action in actions:
        for model, data in runs:
            data.ctrl[:] = action.clip(-1.0, 1.0)
            mujoco.mj_step(model, data, 25)
        (_, one), (_, other) = runs
        contacts += one.ncon
        assert one.ncon == other.ncon
        for names, first, second in ((STATE, one, other), (CONTACT, one.contact, other.contact)):
            for name in names:
                assert np.array(getattr(first, name)).tobytes() == np.array(getattr(second, name)).tobytes(), name
    assert contacts > 0


def test_contacts_are_mixed_as_mujoco_mixes_them():
    random, geoms = np.random.RandomState(0), []
    for index in range(40):
        place = 'type="plane" size="9 9 1"' if index < 2 else 'size="0.1"'
        solref = random.choice(["0.02 1", "0.05 0.7", "-900 -20"])
        friction = " ".join(map(str, random.uniform(0.1, 1.0, 3)))
        geoms.append(
            f'<geom name="g{index}" {place} contype="{int(index > 1)}" conaffinity="{int(index < 2)}" '
            f'priority="{random.choice([0, 0, 1])}" solmix="{random.choice([0.5, 1.0, 2.0])}" '
            f'condim="{random.choice([1, 3, 4, 6])}" friction="{friction}" solref="{solref}" '
            f'solimp="0.9 {random.uniform(0.91, 0.99)} 0.001" '
            f'margin="{random.uniform(0.0, 0.01)}" gap="{random.uniform(0.0, 0.001)}"/>'
        )
    bodies = [f'<body pos="{index} 0 0.099"><freejoint/>{geom}</body>' for index, geom in enumerate(geoms[2:])]
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{''.join(geoms[:2] + bodies)}</worldbody></mujoco>")
    plain = spec.compile()
    list_contacts(spec, plain)
    paired = spec.compile()
    assert paired.npair == 2 * 38
    found = []
    for model in (plain, paired):
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        found.append(data.contact)
    assert len(found[0].geom) == 2 * 38
    for name in CONTACT:
        assert_array_equal(getattr(found[1], name), getattr(found[0], name), err_msg=name)


def test_an_arena_may_keep_the_masks_of_what_is_small():
    model, plain = compile_model(ROBOTS["tick"], Obstacle()), written(ROBOTS["tick"], Obstacle())
    plane = model.geom("floor").id
    assert model.npair > 0 and ((model.pair_geom1 == plane) | (model.pair_geom2 == plane)).all()
    for masks in ("geom_contype", "geom_conaffinity"):
        assert getattr(model, masks)[plane] == 0
        assert_array_equal(np.delete(getattr(model, masks), plane), np.delete(getattr(plain, masks), plane))


def test_models_are_the_callers_own():
    one = compile_model(ROBOTS["tick"])
    one.pair_friction[:] = 0.0
    assert compile_model(ROBOTS["tick"]).pair_friction.all()


def final_state(model, integrator):
    """Of a short fall with strong actions."""
    model.opt.integrator = integrator
    data = mujoco.MjData(model)
    for action in np.random.RandomState(0).uniform(-1.0, 1.0, (5, model.nu)):
        data.ctrl[:] = action
        mujoco.mj_step(model, data, 25)
    return data.qvel.tobytes()


# Where Euler is another integrator.
CHANGES = {
    "undamped": lambda model: model.dof_damping.fill(0.0),
    "in water": lambda model: setattr(model.opt, "density", 1000.0),
    "in syrup": lambda model: setattr(model.opt, "viscosity", 1.0),
    "no damping in Euler": lambda model: setattr(model.opt, "disableflags", model.opt.disableflags | UNDAMPED),
    "servos": lambda model: (model.actuator_biastype.fill(AFFINE_BIAS), model.actuator_biasprm[:, 2].fill(-5.0)),
    "motors that weaken": lambda model: (model.actuator_gaintype.fill(AFFINE), model.actuator_gainprm[:, 2].fill(-0.1)),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_where_euler_is_another_integrator_it_is_not_taken(change):
    model = written(ROBOTS["queen"])
    assert euler_suffices(model)
    assert final_state(model, EULER) == final_state(model, IMPLICITFAST)
    change(model)
    assert not euler_suffices(model)
    assert final_state(model, EULER) != final_state(model, IMPLICITFAST)


def test_a_body_without_damping_keeps_its_integrator():
    body = ROBOTS["tick"]
    legs = tuple(
        leg.replace(links=tuple(k.replace(joint=k.joint and k.joint.replace(damping=0.0)) for k in leg.links))
        for leg in body.legs
    )
    assert compile_model(body).opt.integrator == EULER
    assert compile_model(body.replace(name="loose", legs=legs)).opt.integrator == IMPLICITFAST
