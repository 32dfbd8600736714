"""Each sentence of docs/guarantees.md has a test that holds it, and this table names the test."""

import ast
import json
import pathlib
import re
import sys
import threading
import tomllib

import gymnasium
import numpy as np
import pytest

import arc_suite
from arc_suite import checks, data, policies, seed_ranges, style
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import provenance
from arc_suite.policies import network

ROOT = pathlib.Path(__file__).parents[2]
PAGE = ROOT / "docs" / "guarantees.md"
OPENGL, FORKS = "simulation/test_opengl.py", "simulation/test_forks.py"
STORAGE, HERE = "data/test_storage.py", "house/test_guarantees.py"
# Sentence -> tests, as file::function, that fail where it does not hold.
TESTS = {
    "Imports open no context.": [f"{OPENGL}::test_import_opens_nothing"],
    "`MUJOCO_GL` becomes `egl` if it is unset, there is no display, and libEGL loads.": [
        f"{OPENGL}::test_egl_where_no_display_answers_and_what_is_missing"
    ],
    "Renderers of dm_control and MuJoCo read it at their import: import arc_suite before them, or export it.": [
        f"{OPENGL}::test_renderers_of_others_work_where_this_import_comes_first"
    ],
    "The first picture opens one OpenGL context for the process, in a thread of its own.": [
        f"{OPENGL}::test_import_opens_nothing",
        f"{OPENGL}::test_a_further_rendering_environment_costs_little",
    ],
    "Any thread can request pictures.": [f"{OPENGL}::test_threads_draw_what_one_thread_draws"],
    "Without OpenGL, `arc_suite.simulation.opengl.RenderingUnavailable` states reason and remedy; all else works.": [
        f"{OPENGL}::test_egl_where_no_display_answers_and_what_is_missing"
    ],
    "Environments made before a fork raise `arc_suite.simulation.forks.ForkError` in the child, whatever is called "
    "but `close`.": [f"{FORKS}::test_what_was_made_before_a_fork"],
    "Copies and pickles that the child makes of them work there.": [f"{FORKS}::test_a_copy_made_in_the_child_works"],
    "Make environments in the child, as Gymnasium's `AsyncVectorEnv` does; fork, spawn and forkserver all work.": [
        f"{FORKS}::test_async_vector_environments_work"
    ],
    "Pictures in a forked child require that the parent made none before the fork; otherwise use spawn.": [
        f"{FORKS}::test_what_was_made_before_a_fork",
        f"{FORKS}::test_pictures_in_forked_children_of_a_process_that_made_none",
    ],
    "Each thread can have environments of its own.": ["house/test_threads.py::test_an_environment_for_each_thread"],
    "An environment in use by one thread refuses calls of another.": [
        "house/test_threads.py::test_two_threads_cannot_use_one_environment"
    ],
    "dm_env's `physics` is not guarded; let one thread alone step it.": [f"{HERE}::test_physics_is_not_guarded"],
    "Gymnasium: a step before a reset or after the end raises `ResetNeeded`.": [
        "envs/test_gym.py::test_order_of_calls",
        "envs/test_vector.py::test_calls_at_the_wrong_time",
    ],
    "dm_env: it is a reset.": [f"{HERE}::test_a_step_of_a_dm_env_without_an_episode_is_a_reset"],
    "Seeds are integers from 0 to 2**32 - 1.": [f"{HERE}::test_seeds_and_their_ranges"],
    "Evaluation has those below 10,000, and datasets the next, below 100,000.": [
        f"{HERE}::test_seeds_and_their_ranges"
    ],
    "Learning has those from 100,000 on, and judging those from 4,100,000,000 on.": [
        f"{HERE}::test_seeds_and_their_ranges"
    ],
    "The seed of a run, such as 0, is no seed of an episode: the run learns from episodes of its own, from 100,000 "
    "on.": [f"{HERE}::test_seeds_and_their_ranges"],
    "Evaluation refuses a policy whose file says that it learned from these episodes.": [
        "evaluation/test_memory.py::test_episodes_that_a_policy_learned_from_do_not_judge_it"
    ],
    "This protects against mistakes alone, as anyone can write another file.": [
        f"{HERE}::test_what_a_policy_learned_from_is_what_its_file_says"
    ],
    "Results of a seed are bit-identical in another process, on any number of threads, in a vector and alone.": [
        "house/test_endurance.py::test_the_same_bits_in_every_process_on_any_number_of_threads_and_in_a_batch"
    ],
    "dm_env observes in double precision, Gymnasium in single, so that a policy may earn other returns for a seed.": [
        f"{HERE}::test_faces_observe_in_different_precision"
    ],
    "Resets without a seed continue the random stream.": [
        "envs/test_gym.py::test_np_random_is_the_stream_of_resets",
        "envs/test_gym.py::test_seeds_of_all_kinds",
    ],
    "On the processor, the same `arc-suite train` command on one machine gives a bit-identical policy and table of "
    "evaluations, on any number of `--threads`.": [
        "learning/cli/test_train.py::test_the_same_command_learns_the_same_bits_on_any_number_of_threads"
    ],
    "Pickles and deep copies in mid-episode continue bit-identically.": [
        "envs/test_gym.py::test_copies_carry_on_bit_for_bit",
        "envs/test_vector.py::test_copies_carry_on_bit_for_bit",
    ],
    "An [error](contributing.md#errors) is one line on standard error and exit status 1.": [
        "cli/test_program.py::test_expected_errors_are_one_line"
    ],
    "Ctrl-C is one line and 130, SIGTERM one line and 143, from a program's first import on; its child processes end, "
    "too.": [
        "cli/test_interrupts.py::test_an_interrupt_is_one_line_and_leaves_nothing_half_done",
        "cli/test_interrupts.py::test_imports_can_be_interrupted",
        "cli/test_interrupts.py::test_interrupts_are_not_lost",
    ],
    "A file is complete or absent.": [
        "cli/test_kills.py::test_killed_at_any_change_of_files_the_same_command_completes_it",
        "cli/test_full_disks.py::test_a_file_that_is_too_large_is_one_line_with_its_name",
    ],
    "After a kill at any moment, an earlier dataset still opens, and the same command makes the same episodes.": [
        f"{STORAGE}::test_killed_at_any_change_of_files_the_dataset_opens_and_the_same_command_completes_it"
    ],
    "Every episode carries its sha256, which `arc_suite.data.open` checks at each reading.": [
        "data/test_verification.py::test_a_bit_that_changed_is_found"
    ],
    "`arc-suite collect --verify ID` replays a dataset from its seeds and checks that it is bit-identical.": [
        "data/test_verification.py::test_an_episode_that_is_whole_but_not_what_its_seed_gives_is_found"
    ],
    "`--overwrite` keeps the old dataset until the new one is complete.": [
        f"{STORAGE}::test_killed_at_any_change_of_files_the_dataset_opens_and_the_same_command_completes_it"
    ],
    "The settings contain the hash of a policy's file, also of a module with a function of your own.": [
        f"{HERE}::test_settings_of_a_dataset_hold_the_hash_of_the_file_of_a_function"
    ],
    "Files that it imports or reads do not count: collect again after you change those.": [
        f"{HERE}::test_settings_of_a_dataset_hold_the_hash_of_the_file_of_a_function"
    ],
    "Datasets and tracks are data: the suite imports nothing that they name.": [
        "data/test_bad_faith.py::test_metadata_import_nothing",
        "data/test_bad_faith.py::test_presets_of_a_dataset_import_nothing",
        f"{HERE}::test_names_in_tracks_import_nothing",
    ],
    "A dataset of a task, robot or arena of another package opens after an import of that package.": [
        "data/test_bad_faith.py::test_what_the_caller_names_is_imported"
    ],
    "The suite downloads nothing, and environments write no file.": [
        "house/test_surroundings.py::test_no_file_appears_and_nothing_is_downloaded"
    ],
    "An import changes only `MUJOCO_GL`, Gymnasium's registry, and the moment at which dm_control opens OpenGL.": [
        "house/test_surroundings.py::test_import_has_no_side_effect_but_registration",
        f"{OPENGL}::test_import_opens_nothing",
    ],
    "Files are read as data, without pickle, `eval` or YAML; zips of stable-baselines3 alone run code.": [
        "house/test_source_files.py::test_sources_read_files_as_data_and_text_by_its_encoding",
        f"{HERE}::test_zips_alone_are_read_by_pickle",
    ],
    "No XML is made from strings.": [
        "house/test_source_files.py::test_sources_read_files_as_data_and_text_by_its_encoding"
    ],
}
# Sentences that promise nothing.
SIGNPOSTS = (
    "[Limits](datasets.md#datasets-of-others) are those of other libraries.",
    "A command with `--minutes` is an exception, as CPU time differs from run to run.",
)


def sentences(page):
    """Return the sentences of all paragraphs that begin with a subject in bold."""
    paragraphs = [" ".join(part.split()) for part in page.split("\n\n") if part.startswith("**")]
    texts = [re.sub(r"^\*\*[^*]+\*\* ", "", paragraph) for paragraph in paragraphs]
    return [sentence for text in texts for sentence in re.split(r"(?<=\.) (?=[A-Z`\[]|dm_env)", text)]


def functions(file):
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_every_sentence_has_a_test():
    found = sentences(PAGE.read_text(encoding="utf-8"))
    without = [sentence for sentence in found if sentence not in TESTS and sentence not in SIGNPOSTS]
    assert without == []
    assert sorted(found) == sorted([*TESTS, *SIGNPOSTS])


@pytest.mark.parametrize("sentence", TESTS)
def test_the_tests_of_a_sentence_are_there(sentence):
    assert TESTS[sentence]
    for test in TESTS[sentence]:
        file, _, name = test.partition("::")
        assert name in functions(file), test


def test_a_sentence_without_a_test_is_seen():
    page = "# A\n\nNo promise.\n\n**One.** It holds. `This`\nholds. dm_env: it is.\n\n**Two.** [All](a.md) hold.\n"
    assert sentences(page) == ["It holds.", "`This` holds.", "dm_env: it is.", "[All](a.md) hold."]


def test_physics_is_not_guarded():
    environment = arc_suite.load("tick", "walk", {"random": 0})
    environment.reset()
    with environment._lock:  # as in a step of this thread
        errors = []

        def step(call):
            try:
                call()
            except RuntimeError as error:
                errors.append(str(error))

        for call in (environment.physics.step, lambda: environment.step(np.zeros(18))):
            thread = threading.Thread(target=step, args=[call])
            thread.start()
            thread.join()
    assert errors == ["cannot step: another thread is using this environment; make one for each thread"]


def test_a_step_of_a_dm_env_without_an_episode_is_a_reset():
    environment = arc_suite.load("tick", "walk", {"random": 0, "time_limit": 0.1})
    twin = arc_suite.load("tick", "walk", {"random": 0, "time_limit": 0.1})
    for _ in range(2):
        first, expected = environment.step(np.ones(18)), twin.reset()
        assert first.first() and first.reward is None
        np.testing.assert_array_equal(first.observation["posture"], expected.observation["posture"])
        while not environment.step(np.zeros(18)).last():
            pass


def test_seeds_and_their_ranges():
    ranges = seed_ranges.EVALUATION, seed_ranges.COLLECTING, seed_ranges.LEARNING, seed_ranges.JUDGING
    assert ranges == (
        range(10_000),
        range(10_000, 100_000),
        range(100_000, 4_100_000_000),
        range(4_100_000_000, 2**32),
    )
    assert checks.seed(0) == 0 and checks.seed(2**32 - 1) == 2**32 - 1
    assert seed_ranges.of_run(0).start == 100_000
    for seed in (-1, 2**32, 0.5):
        with pytest.raises(ValueError, match=r"^seed: expected an integer from 0 to 4294967295, got "):
            gymnasium.make("arc_suite/tick-walk-v0").reset(seed=seed)


def test_faces_observe_in_different_precision():
    observed = arc_suite.load("tick", "walk", {"random": 0}).reset().observation
    environment = gymnasium.make("arc_suite/tick-walk-v0")
    seen, _ = environment.reset(seed=0)
    environment.close()
    blocks = list(observed.values())
    assert {block.dtype for block in blocks} == {np.dtype(float)} and seen.dtype == np.float32
    np.testing.assert_array_equal(seen, np.concatenate(blocks, dtype=np.float32))


def test_what_a_policy_learned_from_is_what_its_file_says(tmp_path):
    """The seeds are a field of the file, which another program may write."""
    learned = network.load(network.PACKAGED / "tick-walk.npz")
    for seeds in ((range(5, 30),), (range(100_000, 100_010),)):
        network.save(tmp_path / "policy.npz", learned._replace(training_seeds=seeds))
        if seeds[0].start == 5:
            with pytest.raises(ValueError, match="learned from episodes of seeds 5 to 9"):
                provenance.training_seeds(str(tmp_path / "policy.npz"), range(10))
        else:
            assert provenance.training_seeds(str(tmp_path / "policy.npz"), range(10)) == seeds


def test_settings_of_a_dataset_hold_the_hash_of_the_file_of_a_function(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    setup, records = Setup.of("tick"), []
    for code in ("def make(robot):\n    return None\n", "def make(robot):\n    return len\n"):
        pathlib.Path("own.py").write_text(code)
        pathlib.Path("imported.py").write_text(code)
        records.append(data.DatasetSettings(setup, "own.py:make", ()).provenance())
    hashes = [record.pop("policy_sha256") for record in records]
    assert hashes[0] != hashes[1]
    assert records[0] == records[1] and records[0]["policy"] == "own.py:make"


def test_names_in_tracks_import_nothing(tmp_path):
    environment = arc_suite.load("tick", "walk", {"random": 0, "time_limit": 0.1})
    style.save(tmp_path / "a.npz", [style.record(environment, policies.policy("zero", "tick"), 0)])
    with np.load(tmp_path / "a.npz") as file:
        arrays = dict(file)
    setup = json.loads(str(arrays["setup"]))
    for field, value in (("task", "this:walk"), ("robot", "this:tick"), ("task_kwargs", {"arena": "this:flat"})):
        np.savez(tmp_path / "b.npz", **{**arrays, "setup": np.array(json.dumps({**setup, field: value}))})
        with pytest.raises(ValueError, match="this"):
            style.load(tmp_path / "b.npz")
        assert "this" not in sys.modules


def test_zips_alone_are_read_by_pickle():
    """Rules of the linter find calls of pickle and eval: none is excused, and one module calls what has its own."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "arc_suite").rglob("*.py")}
    assert [name for name, text in texts.items() if re.search(r"noqa.*\bS\d|\byaml\b", text)] == []
    loaders = [name for name, text in texts.items() if re.search(r"\b(PPO|VecNormalize|algorithm)\.load\(", text)]
    assert set(loaders) <= {"sb3_file"}
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]["lint"]["select"]
    assert {"S301", "S302", "S307", "S403"} <= set(rules)
