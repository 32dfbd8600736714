"""What a benchmark's results say: tables, ratios and a plot."""

import pathlib
import re
import textwrap
from collections.abc import Iterator

import numpy as np

from benchmark import contestants as names

# Ratio -> least value that the suite promises; None where it promises nothing.
PROMISES = {
    "dm_env / ordinary MujocoEnv": 1.50,
    "Gymnasium env / ordinary MujocoEnv": 1.42,
    "dm_env / lean-model limit": 0.88,
    "dm_env / lean-model limit without sensors": None,
    "vector env / best AsyncVectorEnv": 2.70,
    "vector env / threads x lean-model limit": 0.95,
    "vector env, most environments / reference": 0.95,
}
# A robot that is not here has a color of matplotlib's.
_COLORS = {"queen": "#b8860b", "bastion": "#2a7f8e", "tick": "#7a5195", "leaper": "#c8443c"}
_MARKED_TEXT = re.compile(r"(<!-- benchmark -->\n).*?(<!-- end of benchmark -->)", re.DOTALL)


def tables(results: dict) -> str:
    """Return all tables in Markdown: speeds, ratios, and the cost of many environments."""
    robots = list(results["robots"])
    parts = [
        _about(results["machine"]),
        "### Speed\n\nus per control step of one environment: median (spread of the middle half).",
    ]
    parts.append(_table(["", *robots], _speed_rows(results)))
    parts.append("### Ratios\n\nof steps per second: median over the rounds.")
    parts.append(_table(["", "at least", *robots], _ratio_rows(results)))
    parts.append("### Many environments")
    parts.append(_table(["", *robots], _size_rows(results)))
    parts.append("### Legs and links\n\nus per control step, 25 times `mj_step` of a standing body: median.")
    parts.append(_growth_table(results["growth"]))
    return "\n\n".join(parts) + "\n"


def ratios(contestants: list[dict]) -> dict[str, float]:
    """Return the ratios of one robot, by the names of `PROMISES`."""
    times = {
        (contestant["name"], contestant["num_envs"], contestant["workers"]): np.array(contestant["microseconds"])
        for contestant in contestants
    }
    single = {name: array for (name, num_envs, workers), array in times.items() if num_envs == workers == 1}
    most_threads = max(workers for name, _, workers in times if name == names.VECTOR)
    env_counts = sorted(
        num_envs for name, num_envs, workers in times if name == names.VECTOR and workers == most_threads
    )
    reference = times[names.VECTOR, names.reference(env_counts), most_threads]
    largest = times[names.VECTOR, env_counts[-1], most_threads]
    best_async = min((array for (name, *_), array in times.items() if name == names.ASYNC), key=np.median)
    pairs = {
        "dm_env / ordinary MujocoEnv": (single[names.ORDINARY], single[names.DM_ENV]),
        "Gymnasium env / ordinary MujocoEnv": (single[names.ORDINARY], single[names.GYM]),
        "dm_env / lean-model limit": (single[names.LEAN], single[names.DM_ENV]),
        "dm_env / lean-model limit without sensors": (single[names.SILENT], single[names.DM_ENV]),
        "vector env / best AsyncVectorEnv": (best_async, reference),
        "vector env / threads x lean-model limit": (single[names.LEAN] / most_threads, reference),
        "vector env, most environments / reference": (reference, largest),
    }
    return {name: float(np.median(slow / fast)) for name, (slow, fast) in pairs.items()}


def document(path: str) -> pathlib.Path:
    """Return the path of a Markdown file that can take the tables.

    Raises:
        ValueError: it is not there or has no marks.
    """
    if not pathlib.Path(path).is_file():
        raise ValueError(f"--document: no file {path}")
    if not _MARKED_TEXT.search(pathlib.Path(path).read_text(encoding="utf-8")):
        raise ValueError(f"{path} has no <!-- benchmark --> and <!-- end of benchmark -->")
    return pathlib.Path(path)


def into_document(path: pathlib.Path, text: str) -> None:
    """Put the tables between the marks of a Markdown file."""
    page = path.read_text(encoding="utf-8")
    path.write_text(_MARKED_TEXT.sub(lambda match: f"{match[1]}{text}{match[2]}", page), encoding="utf-8")


def plot(results: dict, path: pathlib.Path) -> None:
    """Draw steps per second of single environments, over sizes and over threads, and the cost of legs and links."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 8.5), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2)
    _plot_singles(panels[0, 0], results)
    _plot_rows(panels[0, 1], results)
    _plot_threads(panels[1, 0], results)
    _plot_growth(panels[1, 1], results["growth"])
    for panel in panels.flat:
        panel.grid(alpha=0.3)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
        panel.set_ylim(bottom=0)
    figure.savefig(path)


def _about(machine: dict) -> str:
    versions = ", ".join(f"{name} {machine[name]}" for name in ("mujoco", "dm-control", "gymnasium", "shimmy", "numpy"))
    return f"{machine['processor']}, {machine['threads']} threads; Python {machine['python']}, {versions}."


def _label(contestant: dict) -> str:
    name = contestant["name"]
    workers = contestant["workers"]
    if name == names.VECTOR:
        return f"{name}, {_count(contestant['num_envs'], 'environment')}, {_count(workers, 'thread')}"
    if name == names.ASYNC:
        return f"{name}, {workers} processes"
    return name


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _speed_rows(results: dict) -> Iterator[list[str]]:
    contestants_by_robot = [robot["contestants"] for robot in results["robots"].values()]
    for contestants in zip(*contestants_by_robot, strict=True):
        cells = []
        for contestant in contestants:
            low, middle, high = np.percentile(contestant["microseconds"], (25, 50, 75))
            cells.append(f"{middle:.1f} ({low:.1f} to {high:.1f})")
        yield [_label(contestants[0]), *cells]


def _ratio_rows(results: dict) -> Iterator[list[str]]:
    columns = [ratios(robot["contestants"]) for robot in results["robots"].values()]
    for name, target in PROMISES.items():
        yield [name, f"{target:.2f}" if target else "", *(f"{column[name]:.3f}" for column in columns)]


def _size_rows(results: dict) -> Iterator[list[str]]:
    sizes = [robot["size"] for robot in results["robots"].values()]
    num_envs = sizes[0]["num_envs"]
    yield [f"building {num_envs} environments, s", *(f"{size['build_seconds']:.2f}" for size in sizes)]
    yield ["memory of an environment, kB", *(f"{size['kilobytes_per_environment']:.0f}" for size in sizes)]
    yield [
        f"restarting one of {num_envs} environments, us",
        *(f"{size['masked_reset_microseconds']:.0f}" for size in sizes),
    ]


def _growth_table(growth: list[dict]) -> str:
    legs = sorted({size["legs"] for size in growth})
    cost = {(size["legs"], size["links"]): np.median(size["microseconds"]) for size in growth}
    rows = [
        [_count(links, "link") + " a leg", *(f"{cost[number, links]:.0f}" for number in legs)]
        for links in sorted({size["links"] for size in growth})
    ]
    return _table(["", *(_count(number, "leg") for number in legs)], rows)


def _table(header: list[str], rows) -> str:
    lines = [header, ["---"] + ["---:"] * (len(header) - 1), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _speed(contestant: dict) -> float:
    return 1e6 / float(np.median(contestant["microseconds"]))


def _plot_singles(panel, results: dict) -> None:
    robots = list(results["robots"])
    contestants_of_first = results["robots"][robots[0]]["contestants"]
    singles = []  # indices of contestants
    for index, contestant in enumerate(contestants_of_first):
        is_alone = contestant["num_envs"] == contestant["workers"] == 1
        if is_alone and contestant["name"] != names.VECTOR:
            singles.append(index)
    width = 0.85 / len(robots)
    for column, (robot, color, contestants) in enumerate(_robots_with_colors(results)):
        speeds = [_speed(contestants[index]) for index in singles]
        centers = np.arange(len(singles)) + (column - (len(robots) - 1) / 2) * width
        panel.bar(centers, speeds, width, color=color, label=robot)
    labels = [textwrap.fill(contestants_of_first[index]["name"], 11) for index in singles]
    panel.set_xticks(range(len(singles)), labels, fontsize=8)
    panel.tick_params(axis="x", length=0)
    panel.set_title("One environment")
    panel.set_ylabel("control steps / s")
    panel.set_ylim(top=1.15 * panel.get_ylim()[1])
    panel.legend(fontsize=8, loc="upper center", ncols=len(robots))


def _plot_rows(panel, results: dict) -> None:
    for robot, color, contestants in _robots_with_colors(results):
        vectors = _of_name(names.VECTOR, contestants)
        most_threads = max(contestant["workers"] for contestant in vectors)
        points = sorted(
            (contestant["num_envs"], _speed(contestant))
            for contestant in vectors
            if contestant["workers"] == most_threads
        )
        panel.plot(*zip(*points, strict=True), "o-", color=color, label=robot)
        best = max(_speed(contestant) for contestant in _of_name(names.ASYNC, contestants))
        panel.axhline(best, color=color, linestyle=":", linewidth=1)
    panel.set_xscale("log", base=2)
    env_counts = [num_envs for num_envs, _ in points]
    panel.set_xticks(env_counts, map(str, env_counts))
    panel.set_title("Vector env over environments\n(dotted: best AsyncVectorEnv of ordinary ones)")
    panel.set_xlabel("environments")
    panel.set_ylabel("control steps / s")


def _plot_threads(panel, results: dict) -> None:
    for robot, color, contestants in _robots_with_colors(results):
        vectors = _of_name(names.VECTOR, contestants)
        num_envs = names.reference([contestant["num_envs"] for contestant in vectors])
        points = sorted(
            (contestant["workers"], _speed(contestant)) for contestant in vectors if contestant["num_envs"] == num_envs
        )
        panel.plot(*zip(*points, strict=True), "o-", color=color, label=robot)
        lean_speed = _speed(_of_name(names.LEAN, contestants)[0])
        most_threads, _ = points[-1]
        panel.plot([0, most_threads], [0, lean_speed * most_threads], color=color, linestyle=":", linewidth=1)
    panel.set_xticks(sorted({point[0] for point in points}))
    panel.set_xlim(left=0)
    panel.set_title(f"Vector env of {num_envs} environments over threads\n(dotted: threads x lean mj_step)")
    panel.set_xlabel("threads")
    panel.set_ylabel("control steps / s")


def _plot_growth(panel, growth: list[dict]) -> None:
    for links in sorted({size["links"] for size in growth}):
        points = [(size["legs"], np.median(size["microseconds"])) for size in growth if size["links"] == links]
        panel.plot(*zip(*points, strict=True), "o-", color=str(0.75 - 0.18 * links), label=_count(links, "link"))
    panel.set_title("25 x mj_step over legs, by links of a leg")
    panel.set_xlabel("legs")
    panel.set_ylabel("us / control step")
    panel.legend(fontsize=8)


def _of_name(name: str, contestants: list[dict]) -> list[dict]:
    """Return the contestants of a name."""
    return [contestant for contestant in contestants if contestant["name"] == name]


def _robots_with_colors(results: dict) -> Iterator[tuple[str, str, list[dict]]]:
    """Yield each robot, its color and its contestants."""
    for index, (robot, robot_results) in enumerate(results["robots"].items()):
        yield robot, _COLORS.get(robot, f"C{index}"), robot_results["contestants"]
