"""arc-suite train and export, run as a user runs them."""

import contextlib
import importlib.util
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import programs
import pytest
from gymnasium.vector import AutoresetMode
from refusals import refused

from arc_suite import evaluation, policies, registry
from arc_suite.evaluation import judging
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.next_commands import has_built_pages

HAS_JAX = importlib.util.find_spec("jax") is not None
ROOT = pathlib.Path(__file__).parents[3]
TINY = ["--robot=tick", "--algorithm=sope_eo", "--set", "time_limit=2", "--steps=200", "--evaluate_every=100"]
for number in ("hidden=16", "batch=8", "start_steps=20", "phase_every=100", "phase_updates=60", "check_every=20"):
    TINY += ["--hp", number]
WORDS = f"(there are: {', '.join(registry.robot_words())}, module:name to import it)"
FINISHED = re.compile(
    r"runs/tick-walk-sope_eo-0: finished, return \d+\.\d at step 200, deviation \d+\.\d, score -?\d\.\d\d "
    r"\(standing still \d+\.\d, demonstrator refined \d+\.\d, standard errors \d+\.\d and \d+\.\d, "
    r"over other seeds\)\n"
)


def run(*arguments, cwd):
    return programs.run("-m", "arc_suite", *arguments, cwd=cwd, path=ROOT)


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (["--algorithm=sopee"], "arc-suite train: unknown algorithm 'sopee'; did you mean 'sope'? (there are: sac, "),
        (
            ["--algorithm=my_algorithms:patien"],
            "arc-suite train: algorithm 'patien': my_algorithms registers no such algorithm by arc_suite.register; "
            "did you mean 'patient'?\n",
        ),
        (
            ["--algorithm=my_algorithms:patient"],
            "arc-suite train: algorithm 'my_algorithms:patient': expected an Algorithm, got int\n",
        ),
        (
            ["--hp=network=my_algorithms:depp"],
            "arc-suite train: network 'depp': my_algorithms registers no such network by arc_suite.register; "
            "did you mean 'deep'?\n",
        ),
        (
            ["--algorithm=sac", "--hp=network=my_algorithms:deep"],
            "arc-suite train: unknown network of soft actor-critic 'my_algorithms:deep' (there are: perceptron, legs)",
        ),
        (["--robot=all"], "arc-suite train: --robot=all: expected one robot"),
        (["--robot=tock"], f"arc-suite train: unknown robot 'tock'; did you mean 'tick'? {WORDS}\n"),
        (
            ["--stps=5"],
            "arc-suite train: unknown flag 'stps'; did you mean 'steps'? (there are: algorithm, arena, best, ",
        ),
        (["--steps=abc"], "arc-suite train: flag --steps=abc: expected a positive integer\n"),
        (["--minutes=x"], "arc-suite train: flag --minutes=x: expected a non-negative number\n"),
        (["--config=none.json"], "arc-suite train: cannot read none.json: no such file or directory\n"),
        (["--config=policy.npz"], "arc-suite train: cannot read policy.npz: expected text in UTF-8\n"),
        (["--algorithm=sac", "--hp=batsch=3"], "arc-suite train: unknown hyperparameter 'batsch'; did you mean 'b"),
        (["--hp=batch"], "arc-suite train: --hp batch: expected name=value"),
        (["--set=lr=0.1"], "arc-suite train: --set lr=0.1: it is a hyperparameter; did you mean --hp policy_rate=0.1"),
        (["--hp=kicks=1"], "arc-suite train: hyperparameter 'kicks': it is a setting of the task; expected in --set"),
        (["--config=a.json", "--seed=3"], "arc-suite train: --seed: expected none with --config, which has the whole "),
        (["--seed=0,a"], "arc-suite train: --seed=0,a: expected different integers, such as 0,1,2 or 0-15\n"),
        (["--seeds=0-2,1"], "arc-suite train: --seed=0-2,1: expected different integers, such as 0,1,2 or 0-15\n"),
        (["--seed=3-1"], "arc-suite train: --seed=3-1: expected different integers, such as 0,1,2 or 0-15\n"),
        (["--seed=1,1"], "arc-suite train: --seed=1,1: expected different integers, such as 0,1,2 or 0-15\n"),
        (["--until_score=nan"], "arc-suite train: score: expected a finite number, got nan\n"),
        (["--seed=40001"], "arc-suite train: seed: expected an integer from 0 to 40000, got 40001"),
        (["--set=time_limit=Infinity"], "arc-suite train: time_limit: expected a finite number, as every"),
        (["--minutes=nan"], "arc-suite train: minutes: expected a finite number of at least 0, got nan"),
        (["--task=wlak"], "arc-suite train: unknown task 'wlak'; did you mean 'walk'?"),
    ],
)
def test_errors_are_one_line(flags, line, tmp_path):
    parts = 'module=__name__, algorithms={"patient": 3}, networks={"deep": "a:b"}'
    (tmp_path / "my_algorithms.py").write_text(f"import arc_suite\narc_suite.register({parts})\n")
    (tmp_path / "policy.npz").write_bytes(b"PK\x80")
    programs.refused(run("train", *flags, cwd=tmp_path), line)
    assert not list(tmp_path.rglob("*.csv"))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{", "expected JSON; line 1, column 2: the text ends before its last bracket"),
        ("[]", "configuration: expected a mapping of names to values, got []"),
        ("{}", "expected a robot, got none"),
        ('{"robot": "tik"}', "unknown robot 'tik'; did you mean 'tick'?"),
        ('{"robot": "tick", "stops": 3}', "unknown field of a configuration 'stops'; did you mean 'steps'?"),
        ('{"robot": "tick", "steps": "many"}', "steps: expected an integer from 1, got 'many'"),
        ('{"robot": "tick", "hyperparameters": {"batsch": 3}}', "unknown hyperparameter 'batsch'; did you mean "),
        ('{"robot": "tick", "prior": 3}', "prior: expected the id of a dataset, got 3"),
    ],
)
def test_configurations_that_do_not_fit_are_one_line(text, line, tmp_path):
    (tmp_path / "run.json").write_text(text)
    with refused(f"{tmp_path / 'run.json'}: {line}", begins=True):
        configuration.read(tmp_path / "run.json")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("runs/none", "-o", "a.txt"), "unknown extension '.txt' (there are: .onnx)"),
        (("runs/none",), "cannot read runs/none: no such file"),
        ((), "expected the folder of a run, a policy file or a zip of stable-baselines3; see --help"),
    ],
)
def test_export_of_what_is_no_run(tmp_path, arguments, message):
    programs.refused(run("export", *arguments, cwd=tmp_path), f"arc-suite export: {message}")


CLIMB = ["--robot=tick", "--algorithm=tiny_studies:climb", "--set", "time_limit=0.2", "--steps=40"]
CLIMB += ["--evaluate_every=20"]
REACHED = (
    r"run: score -100 reached at step 20, after \d+ s \(\d+ s of CPU time\), return \S+ at step 20, deviation \S+, "
    r"score \S+ \(.*"
)
NEXT = ["arc-suite evaluate --policy run", "arc-suite render --policy run -o run.mp4"]
NEXT.append("arc-suite play --policy run -o run.html" if has_built_pages() else "arc-suite view --policy run")
STOPPED = "other: stopped at --minutes=0 of CPU time; more minutes resume it, no evaluation yet\n"


def test_until_a_score(tmp_path):
    """A run stops at the first evaluation that reaches it, and the same command has nothing left to do."""
    shutil.copy(ROOT / "tests" / "fixtures" / "tiny_studies.py", tmp_path)
    for _ in range(2):
        done = run("train", *CLIMB, "--until_score=-100", "-o", "run", cwd=tmp_path)
        reached, judged, *following = done.stdout.splitlines()[-6:]
        assert following == ["next:", *(f"  {command}" for command in NEXT)]
        assert done.returncode == 0 and re.fullmatch(REACHED, reached), done
        evaluations = run_folder.table(tmp_path / "run", "evaluations")
        assert evaluations["step"].tolist() == [20] * 10 and evaluations["seed"].tolist() == [*range(9000, 9010)]
        finals = run_folder.lines(tmp_path / "run", "final")
        sha256 = policies.digest(str(tmp_path / "run"))
        assert {row["policy_sha256"] for row in finals} == {sha256}
        assert [int(row["seed"]) for row in finals] == list(judging.seeds_of(sha256))
        returns = np.array([float(row["return"]) for row in finals])
        line = f"run: judged in 100 episodes, seeds {finals[0]['seed']} on: return {returns.mean():.1f}, "
        assert judged.startswith(f"{line}standard error {returns.std(ddof=1) / 10.0:.1f}, score ")
    (tmp_path / "run" / "README.md").unlink()
    done = run("train", *CLIMB, "--minutes=0", "-o", "run", cwd=tmp_path)
    stopped, *following = done.stdout.splitlines()[-5:]
    assert stopped.startswith("run: stopped at --minutes=0 of CPU time; more minutes resume it, return ")
    assert following == ["next:", *(f"  {command}" for command in NEXT)]
    assert (tmp_path / "run" / "README.md").is_file()
    done = run("train", *CLIMB, "--minutes=0", "-o", "other", cwd=tmp_path)
    assert done.stdout.endswith(STOPPED)


@pytest.mark.long
def test_several_seeds(tmp_path):
    """Each is the run that it is alone; one that fails does not stop the others."""
    shutil.copy(ROOT / "tests" / "fixtures" / "tiny_studies.py", tmp_path)
    name = "tick-walk-tiny_studies.climb"
    foreign = tmp_path / "runs" / f"{name}-1" / "mine.txt"
    foreign.parent.mkdir(parents=True), foreign.write_text("")
    done = run("train", *CLIMB, "--seed=0,1,2", "--jobs=3", cwd=tmp_path)
    lines = done.stdout.splitlines()
    running_lines = [f"{name}-{seed}: running, runs/{name}-{seed}.log" for seed in range(3)]
    assert done.returncode == 1 and lines[:3] == running_lines
    assert f"{name}-1: failed" in lines
    assert f"runs/{name}-1.log: arc-suite train: runs/{name}-1: no folder of a run, and not empty: " in done.stderr
    returns = [run_folder.table(tmp_path / "runs" / f"{name}-{seed}", "evaluations")["return"][-10:] for seed in (0, 2)]
    for seed, each in zip((0, 2), returns, strict=True):
        (line,) = (line for line in lines if line.startswith(f"runs/{name}-{seed}: finished"))
        assert f", return {each.mean():.1f} at step 40, deviation {each.std():.1f}, score " in line
        assert f"runs/{name}-{seed}: judged in 100 episodes, seeds 4" in lines[lines.index(line) + 1]
    means = [each.mean() for each in returns]
    best = f"runs/{name}-{(0, 2)[np.argmax(means)]}"
    assert lines[-4:-2] == ["next:", f"  arc-suite evaluate --policy {best}"]
    assert lines[-5].startswith(
        f"runs: mean of 2 seeds, return {np.mean(means):.1f}, deviation {np.std(means):.1f}, score "
    )
    assert run("train", *CLIMB, "--seed=2", "-o", "alone", cwd=tmp_path).returncode == 0
    tables = [(tmp_path / each / "evaluations.csv").read_text() for each in ("alone", f"runs/{name}-2")]
    assert tables[0] == tables[1]


@pytest.mark.slow
@pytest.mark.skipif(not HAS_JAX, reason="of the extra learn: make check-agents")
def test_the_same_command_learns_the_same_bits_on_any_number_of_threads(tmp_path):
    short = ["--robot=tick", "--set", "time_limit=2", "--steps=256", "--evaluate_every=128"]
    for number in ("num_envs=8", "horizon=16", "minibatch=32", "hidden=16"):
        short += ["--hp", number]
    for threads in "12":
        done = run("train", *short, f"--threads={threads}", "-o", threads, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert policies.digest(str(tmp_path / "1")) == policies.digest(str(tmp_path / "2"))
    for table in ("evaluations.csv", "training.csv", "final.csv"):
        assert (tmp_path / "1" / table).read_bytes() == (tmp_path / "2" / table).read_bytes()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """That of a run, which one command has trained."""
    path = tmp_path_factory.mktemp("trained")
    done = run("train", *TINY, "--tensorboard", cwd=path)
    assert done.returncode == 0, done.stderr
    first, *evaluations, last, judged = done.stdout.partition("next:\n")[0].splitlines(keepends=True)
    assert judged.startswith("runs/tick-walk-sope_eo-0: judged in 100 episodes, seeds 4")
    start = 'runs/tick-walk-sope_eo-0: tick, walk, {"time_limit": 2}, sope_eo, 200 steps'
    assert first == f"{start}; the next evaluation comes after 100 (--evaluate_every)\n"
    line = re.compile(r"runs/tick-walk-sope_eo-0: return \d+\.\d after (\d+) steps\n")
    returns = list(map(line.fullmatch, evaluations))
    assert [found and found[1] for found in returns] == ["100", "200"] and FINISHED.fullmatch(last)
    return path / "runs" / "tick-walk-sope_eo-0"


@pytest.mark.skipif(not HAS_JAX, reason="of the extra learn: make check-agents")
class TestRun:
    """One command from nothing to a policy that every program takes."""

    def test_files(self, folder):
        names = {path.name for path in folder.iterdir()}
        assert names >= {"config.json", "checkpoint.npz", "policy.npz", "policy.onnx", "curve.png", "tensorboard"}
        assert names >= {"evaluations.csv", "training.csv", "times.csv"}
        assert json.loads((folder / "config.json").read_text())["hyperparameters"]["phase_updates"] == 60

    def test_the_same_command_has_nothing_left_to_do(self, folder):
        before = (folder / "evaluations.csv").read_bytes()
        done = run("train", *TINY, cwd=folder.parents[1])
        assert done.returncode == 0 and FINISHED.search(done.stdout)
        assert " 200 steps\n" in done.stdout and "next evaluation" not in done.stdout
        assert (folder / "evaluations.csv").read_bytes() == before

    def test_the_best_checkpoint_is_kept(self, folder):
        done = run("train", *TINY, "--best", cwd=folder.parents[1])
        assert done.returncode == 0, done.stderr
        kept = json.loads((folder / "best" / "agent.json").read_text())
        checkpoint = folder / "checkpoints" / str(kept["steps"])
        assert (folder / "best" / "policy.npz").read_bytes() == (checkpoint / "policy.npz").read_bytes()
        setup = configuration.read(folder / "config.json").validation
        seeds = range(9_000, 9_100)
        means = {}
        for step in (100, 200):
            policy = policies.policy(
                str(folder / "checkpoints" / str(step)), setup.body, None, 100, task=setup.definition
            )
            with contextlib.closing(setup.make_vec(100, autoreset_mode=AutoresetMode.DISABLED)) as environment:
                episodes = evaluation.episodes_in_batch(environment, policy, seeds)
            means[step] = np.mean([episode.total for episode in episodes])
        assert kept["steps"] == max(means, key=means.get)
        assert kept["mean_return"] == pytest.approx(means[kept["steps"]])
        assert re.search(r"/tick-walk-sope_eo-0: .*best.* in 100 episodes of validation", done.stdout)
        evaluated = run("evaluate", f"--policy={folder / 'best'}", "--episodes=1", "--set=time_limit=2", cwd=folder)
        assert evaluated.returncode == 0, evaluated.stderr

    @pytest.mark.long
    def test_its_configuration_trains_the_same_run(self, folder, tmp_path):
        done = run("train", f"--config={folder / 'config.json'}", cwd=tmp_path)
        assert done.returncode == 0 and FINISHED.search(done.stdout), done.stderr
        again = tmp_path / "runs" / folder.name
        for name in ("config.json", "evaluations.csv", "training.csv"):
            assert (again / name).read_text() == (folder / name).read_text()

    def test_another_command_is_refused(self, folder):
        done = run("train", *TINY, "--hp=dropout=0.02", cwd=folder.parents[1])
        line = "runs/tick-walk-sope_eo-0: of another run, with hyperparameters.dropout 0.01, not 0.02;"
        programs.refused(done, f"arc-suite train: {line} write to another folder")

    @pytest.mark.parametrize(
        "command",
        [
            ["evaluate", "--episodes=2", "--set", "time_limit=2"],
            ["style", "--episodes=1", "--set", "time_limit=2"],
            ["collect", "--episodes=2", "--steps=20", "--id=arc_suite/tick/walk/learned-v0"],
        ],
        ids=lambda command: command[0],
    )
    def test_every_program_takes_it(self, command, folder, monkeypatch, tmp_path):
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
        done = run(*command, "--robot=tick", "--policy=runs/tick-walk-sope_eo-0", cwd=folder.parents[1])
        programs.passed(done)
        done = run(*command, "--robot=queen", "--policy=runs/tick-walk-sope_eo-0", cwd=folder.parents[1])
        line = "policy runs/tick-walk-sope_eo-0: made for tick, and not for queen"
        programs.refused(done, f"arc-suite {command[0]}: {line}")

    def test_evaluation_is_that_of_the_table(self, folder, tmp_path):
        command = [
            "evaluate",
            "--set",
            "time_limit=2",
            f"--policy={folder}",
            "--episodes=10",
            "--seed=9000",
            "--json=a.json",
        ]
        assert run(*command, cwd=tmp_path).returncode == 0
        episodes = json.loads((tmp_path / "a.json").read_text())["robots"]["tick"]["episodes"]
        lines = (folder / "evaluations.csv").read_text().splitlines()[-10:]
        assert [float(line.split(",")[2]) for line in lines] == [episode["total"] for episode in episodes]

    def test_export(self, folder, tmp_path):
        done = run("export", str(folder), "-o", "tick.onnx", cwd=tmp_path)
        size = (tmp_path / "tick.onnx").stat().st_size
        assert done.stdout == f"wrote tick.onnx: 199 observations, 18 actions, {size} bytes\n"

    @pytest.mark.long
    def test_ctrl_c_is_one_line_and_the_run_resumes(self, tmp_path):
        command = [sys.executable, "-m", "arc_suite", "train", *TINY, "--steps=100000", "-o", "run"]
        process = subprocess.Popen(
            command, cwd=tmp_path, text=True, stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": str(ROOT)}
        )
        try:
            while not (tmp_path / "run" / "checkpoint.npz").exists():
                assert process.poll() is None
                time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=120)
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 130
        assert errors.splitlines()[-1] == "arc-suite train: interrupted; the same command resumes run"
