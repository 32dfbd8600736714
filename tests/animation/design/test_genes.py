"""Genes make bodies that keep their budgets."""

import math

import imports
import numpy as np
import pytest
import sprung_robots
from refusals import refused

from arc_suite.animation.design import axes
from arc_suite.animation.design.axes import AXES, Axis, Map
from arc_suite.animation.design.genes import Budget, ProportionGenes, VariantGenes, body_within_budget, extent
from arc_suite.bodies.generator import list_deformations, mutated, random_body
from arc_suite.importing import import_robot
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import measure_standing
from arc_suite.robots import ROBOTS

BUDGET = Budget(mass=12.0, span=1.5)


def bodies(space, budget, count, seed=0):
    random = np.random.default_rng(seed)
    return [body_within_budget(budget, space, random.uniform(size=len(space.names)), f"body_{i}") for i in range(count)]


def test_bodies_weigh_the_same_and_keep_the_span():
    spans = []
    for body in bodies(ProportionGenes(), BUDGET, 40):
        assert math.isclose(measure_standing(body).mass, 12.0, rel_tol=1e-9)
        assert all("overlap" in flaw.text for flaw in flaws(body)), body.name
        spans.append(extent(body).max())
    assert max(spans) <= 1.5 + 1e-9 and min(spans) >= 0.75 - 1e-9 and np.ptp(spans) > 0.3


def test_genes_reach_all_numbers_of_legs_and_links():
    made, many = ProportionGenes(), bodies(ProportionGenes(), BUDGET, 300)
    assert {len(body.legs) for body in many} == set(range(4, 13))
    assert {len(body.legs[0].links) for body in many} == {2, 3, 4}
    for genes in (np.zeros(len(made.names)), np.ones(len(made.names))):
        assert not flaws(body_within_budget(BUDGET, made, genes, "edge"))


def test_legs_change_evenly_along_the_body():
    genes = np.full(len(ProportionGenes.names), 0.5)
    genes[ProportionGenes.names.index("reach_front")], genes[ProportionGenes.names.index("reach_rear")] = 1.0, 0.0
    genes[ProportionGenes.names.index("layout")] = 0.0
    left = [
        leg for leg in body_within_budget(BUDGET, ProportionGenes(), genes, "body").legs if leg.name.startswith("l")
    ]
    reaches = [math.dist(leg.mount[:2], leg.foot_position[:2]) for leg in left]
    assert reaches == sorted(reaches, reverse=True) and reaches[0] > 1.4 * reaches[-1]


def test_a_bound_on_the_height_is_kept():
    heights = [body.torso.standing_height for body in bodies(ProportionGenes(), BUDGET._replace(height=0.2), 20)]
    assert 0.15 < max(heights) <= 0.2 + 1e-12


def test_variants_differ_are_no_larger_and_in_the_middle_are_the_creature():
    tick = ROBOTS["tick"]
    budget = Budget(measure_standing(tick).mass, float(extent(tick).max()))
    body = body_within_budget(budget, VariantGenes(tick, 0.1), np.full(len(list_deformations(tick)), 0.5), "tick_0")
    plain = mutated(tick, 0, amount=0.0)
    assert body.replace(name=plain.name, density=plain.density) == plain
    assert math.isclose(body.density, tick.density, rel_tol=1e-9)
    many = bodies(VariantGenes(tick, 0.2), budget, 20)
    assert max(extent(body).max() for body in many) <= budget.span + 1e-9
    assert len({body.legs for body in many}) == 20


def test_variants_of_an_imported_robot_keep_its_scale_and_are_no_larger_than_the_budget():
    body = imports.quadruped()
    space = VariantGenes(body, 0.2)
    middle = np.full(len(space.names), 0.5)
    assert body_within_budget(Budget(None), space, middle, "dog_0") == body.replace(name="dog_0")
    variants = bodies(space, Budget(None), 8)
    heights = {variant.torso.standing_height for variant in variants}
    assert len(heights) == 8 and {variant.torso.solids for variant in variants} == {body.torso.solids}
    with pytest.raises(ValueError, match=r"^height: 0\.\d+ m, more than 0\.1$"):
        body_within_budget(Budget(None, height=0.1), space, middle, "dog_0")
    with pytest.raises(ValueError, match=r"^span: 0\.\d+ m, more than 0\.2$"):
        body_within_budget(Budget(None, span=0.2), space, middle, "dog_0")


def test_a_robot_whose_links_all_stand_in_loops_has_no_variants(tmp_path):
    path = sprung_robots.write(tmp_path, **sprung_robots.CASES["rods that connections close"])
    with pytest.raises(ValueError, match="no link has a length that can change"):
        VariantGenes(import_robot(path).body, 0.1)


def test_a_budget_that_no_body_keeps_is_one_line():
    with pytest.raises(ValueError, match="expected") as error:
        body_within_budget(
            Budget(mass=1e12, span=1e-3), ProportionGenes(), np.full(len(ProportionGenes.names), 0.5), "body"
        )
    assert "\n" not in str(error.value)


def test_cells():
    body = random_body(7)
    cells = Map.of(["legs", "links"])
    cell = cells.cell(body)
    assert cell == (len(body.legs), len(body.legs[0].links))
    assert cells.label((6, 3)) == "legs6_links3"
    assert {Map.of(["height"]).cell(random_body(seed)) for seed in range(60)} == {(i,) for i in range(1, 6)}
    tick = ROBOTS["tick"]  # which lies in the middle of bins about it
    assert Map.of(["height", "width"], tick, 0.1).cell(tick) == (3, 3)


@pytest.mark.parametrize("names", [["legs", "legs"], ["legs", "links", "width"], [], ["leg"]])
def test_axes_that_do_not_fit_are_one_line(names):
    with pytest.raises(ValueError, match=", ".join(AXES)) as error:
        Map.of(names)
    assert "\n" not in str(error.value)


NEGATIVE = Axis(lambda body: -1.0, edges=(0.0,))


def test_axes_of_one_name_are_refused(monkeypatch):
    monkeypatch.setattr(axes, "axis_of", {"legs": AXES["legs"], "there:legs": AXES["legs"]}.get)
    with refused("map: expected one or two different axes of legs, links, height, width, ", begins=True):
        Map.of(["legs", "there:legs"], ROBOTS["tick"], 0.1)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("negative", "axis negative: expected a value above 0 of tick, got -1"),
        ("unknown", "unknown axis 'unknown' "),
        ("number", "axis 'number': expected an Axis, got 7"),
    ],
)
def test_axes_of_others_are_checked(monkeypatch, name, message):
    monkeypatch.setitem(AXES, "negative", NEGATIVE)
    monkeypatch.setitem(AXES, "number", 7)
    with refused(message, begins=True):
        Map.of([name], ROBOTS["tick"], 0.1)


def test_an_axis_without_a_finite_value_is_one_line(monkeypatch):
    monkeypatch.setitem(AXES, "nothing", Axis(lambda body: math.nan, edges=(0.0,)))
    with refused("axis nothing: expected a finite number, got nan", begins=True):
        Map.of(["nothing"]).cell(ROBOTS["tick"])
