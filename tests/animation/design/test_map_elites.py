"""MAP-Elites fills its cells with better and better bodies, and depends on nothing but its seed."""

import functools
import json

import pytest

from arc_suite.animation.design import gallery
from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.genes import Budget, ProportionGenes
from arc_suite.animation.design.search import BATCH_SIZE, RANDOM_BODIES, Candidates, Search
from arc_suite.animation.design.trials import GOALS, Outcome, Round, Trial, WalkMeans
from arc_suite.robots import ROBOTS

ROUND = Round({}, (0,), 10)
TRIAL = Trial("walk", "transport", Budget(12.0, 1.5), ROUND, ROUND)


def fake(body):
    """A walk whose cost of transport follows from proportions alone: thin, high torsos are cheap."""
    length, width, thickness = body.torso.solids[0].size
    cost = 1.0 + (thickness + width) / length + 0.3 / body.torso.standing_height
    return WalkMeans(1.0, 1.0, 1.0, cost, 5.0, 0.0)


def evaluated(jobs):
    found = []
    for _, body, elite in jobs:
        walk = fake(body)
        found.append(Outcome("", walk, walk if -walk.cost_of_transport > elite else None))
    return found


@pytest.mark.parametrize(
    ("axes", "cell", "goal", "text"),
    [
        (["legs", "links"], (6, 3), "transport", "6 legs, 3 links: cost of transport 1.5"),
        (["height", "width"], (2, 5), "speed", "height 2 of 5, width 5 of 5: speed 0.25 m/s"),
        (["links"], (4,), "robustness", "4 links: tracking 0.75"),
    ],
)
def test_a_picture_names_cell_and_metric(axes, cell, goal, text):
    walk = WalkMeans(speed=0.25, achieved=1.0, tracking=0.75, cost_of_transport=1.5, power=5.0, falls=0.0)
    elite = gallery.Elite("label", cell, 0, ROBOTS["tick"], walk, walk)
    assert gallery.caption(elite, Map.of(axes), GOALS[goal]) == text


@functools.cache
def finished_search(**arguments):
    """A search that no test goes on with."""
    return search(**arguments)


def search(seed=3, goes=10, random=RANDOM_BODIES):
    course = Search(ProportionGenes(), Map.of(["legs", "links"]), TRIAL, seed, "body", random)
    return course, [course.evaluate_batch(evaluated) for _ in range(goes)]


def costs(course):
    return [course.candidates[index].outcome.second.cost_of_transport for index in course.elites.values()]


def test_a_search_is_a_function_of_its_seed():
    (first, _), (second, _), (other, _) = finished_search(), search(), search(4)
    assert first.candidates == second.candidates and first.elites == second.elites
    assert first.candidates != other.candidates
    assert len(first.candidates) == 10 * BATCH_SIZE


def test_a_search_restored_from_json_goes_on_as_if_nothing_had_happened():
    straight, batches = finished_search()
    again = Search(ProportionGenes(), Map.of(["legs", "links"]), TRIAL, 3, "body")
    for batch in batches[:6]:
        again.add(Candidates.from_json(**json.loads(json.dumps(batch._asdict()))))
    for _ in range(4):
        again.evaluate_batch(evaluated)
    assert again.candidates == straight.candidates and again.elites == straight.elites


def test_elites_are_the_best_of_their_cells():
    course, _ = finished_search()
    for cell, index in course.elites.items():
        inside = [one for one in course.candidates if one.cell == cell]
        best = min(one.outcome.first.cost_of_transport for one in inside)
        assert course.candidates[index].outcome.second.cost_of_transport == best
    assert set(course.elites) == {one.cell for one in course.candidates}


@pytest.mark.long
def test_a_search_beats_as_many_random_bodies():
    (course, _), (control, _) = search(goes=15), search(goes=15, random=15 * BATCH_SIZE)
    assert course.candidates[:RANDOM_BODIES] == control.candidates[:RANDOM_BODIES]
    assert len(course.candidates) == len(control.candidates) > RANDOM_BODIES
    assert min(costs(course)) < 0.97 * min(costs(control))


def test_one_that_is_excluded_the_second_time_takes_no_cell():
    course = Search(ProportionGenes(), Map.of(["legs"]), TRIAL, 0, "body")
    course.evaluate_batch(
        lambda jobs: [Outcome("evaluated again: fell", fake(body), fake(body)) for _, body, _ in jobs]
    )
    assert not course.elites and len(course.candidates) == BATCH_SIZE


def test_an_elite_is_challenged_by_the_second_metric():
    """A body of a better first walk and a worse second one leaves the elite where it is."""
    course = Search(ProportionGenes(), Map.of(["legs"]), TRIAL, 0, "body")
    course.evaluate_batch(evaluated)
    before = dict(course.elites)

    def lucky(jobs):
        worse = WalkMeans(1.0, 1.0, 1.0, 9.0, 5.0, 0.0)
        return [Outcome("", worse._replace(cost_of_transport=0.1), worse) for _ in jobs]

    course.evaluate_batch(lucky)
    assert {cell: course.elites[cell] for cell in before} == before
