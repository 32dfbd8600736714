"""What a benchmark's results say: tables, ratios and a plot."""

import pathlib
import re
import textwrap
from collections.abc import Iterator

import numpy as np

from benchmark import contestants as names

# Ratio -> least value that the suite promises; None where it promises nothing.
TARGETS = {
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
_MARKED = re.compile(r"(<!-- benchmark -->\n).*?(<!-- end of benchmark -->)", re.DOTALL)


def tables(results: dict) -> str:
    """All tables in Markdown: speeds, ratios, and what many environments cost."""
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
    """The ratios of one robot that its contestants allow, by the names of `TARGETS`."""
    times = {(c["name"], c["num_envs"], c["workers"]): np.array(c["microseconds"]) for c in contestants}
    single = {name: array for (name, rows, workers), array in times.items() if rows == workers == 1}
    most = max(workers for name, _, workers in times if name == names.VECTOR)
    rows = sorted(rows for name, rows, workers in times if name == names.VECTOR and workers == most)
    middle, largest = (times[names.VECTOR, number, most] for number in (names.reference(rows), rows[-1]))
    best_async = min((array for (name, *_), array in times.items() if name == names.ASYNC), key=np.median)
    pairs = {
        "dm_env / ordinary MujocoEnv": (single[names.ORDINARY], single[names.DM_ENV]),
        "Gymnasium env / ordinary MujocoEnv": (single[names.ORDINARY], single[names.GYM]),
        "dm_env / lean-model limit": (single[names.LEAN], single[names.DM_ENV]),
        "dm_env / lean-model limit without sensors": (single[names.SILENT], single[names.DM_ENV]),
        "vector env / best AsyncVectorEnv": (best_async, middle),
        "vector env / threads x lean-model limit": (single[names.LEAN] / most, middle),
        "vector env, most environments / reference": (middle, largest),
    }
    return {name: float(np.median(slow / fast)) for name, (slow, fast) in pairs.items()}


def document(path: str) -> pathlib.Path:
    """Checks that a Markdown file can take the tables.

    Raises:
        ValueError: it is not there or has no marks.
    """
    if not pathlib.Path(path).is_file():
        raise ValueError(f"--document: no file {path}")
    if not _MARKED.search(pathlib.Path(path).read_text(encoding="utf-8")):
        raise ValueError(f"{path} has no <!-- benchmark --> and <!-- end of benchmark -->")
    return pathlib.Path(path)


def into_document(path: pathlib.Path, text: str) -> None:
    """Puts the tables between the marks of a Markdown file."""
    page = path.read_text(encoding="utf-8")
    path.write_text(_MARKED.sub(lambda match: f"{match[1]}{text}{match[2]}", page), encoding="utf-8")


def plot(results: dict, path: pathlib.Path) -> None:
    """Draws steps per second of single environments, over sizes and over threads, and the cost of legs and links."""
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
    name, rows, workers = contestant["name"], contestant["num_envs"], contestant["workers"]
    if name == names.VECTOR:
        return f"{name}, {_count(rows, 'environment')}, {_count(workers, 'thread')}"
    if name == names.ASYNC:
        return f"{name}, {workers} processes"
    return name


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _speed_rows(results: dict) -> Iterator[list[str]]:
    fields = [robot["contestants"] for robot in results["robots"].values()]
    for same in zip(*fields, strict=True):
        cells = []
        for contestant in same:
            low, middle, high = np.percentile(contestant["microseconds"], (25, 50, 75))
            cells.append(f"{middle:.1f} ({low:.1f} to {high:.1f})")
        yield [_label(same[0]), *cells]


def _ratio_rows(results: dict) -> Iterator[list[str]]:
    columns = [ratios(robot["contestants"]) for robot in results["robots"].values()]
    for name, target in TARGETS.items():
        yield [name, f"{target:.2f}" if target else "", *(f"{column[name]:.3f}" for column in columns)]


def _size_rows(results: dict) -> Iterator[list[str]]:
    sizes = [robot["size"] for robot in results["robots"].values()]
    rows = sizes[0]["num_envs"]
    yield [f"building {rows} environments, s", *(f"{size['build_seconds']:.2f}" for size in sizes)]
    yield ["memory of an environment, kB", *(f"{size['kilobytes_per_environment']:.0f}" for size in sizes)]
    yield [
        f"restarting one of {rows} environments, us",
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
    first = results["robots"][robots[0]]["contestants"]
    singles = [
        index for index, c in enumerate(first) if c["num_envs"] == c["workers"] == 1 and c["name"] != names.VECTOR
    ]
    width = 0.85 / len(robots)
    for column, (robot, color, contestants) in enumerate(_colored(results)):
        speeds = [_speed(contestants[index]) for index in singles]
        places = np.arange(len(singles)) + (column - (len(robots) - 1) / 2) * width
        panel.bar(places, speeds, width, color=color, label=robot)
    labels = [textwrap.fill(first[index]["name"], 11) for index in singles]
    panel.set_xticks(range(len(singles)), labels, fontsize=8)
    panel.tick_params(axis="x", length=0)
    panel.set_title("One environment")
    panel.set_ylabel("control steps / s")
    panel.set_ylim(top=1.15 * panel.get_ylim()[1])
    panel.legend(fontsize=8, loc="upper center", ncols=len(robots))


def _plot_rows(panel, results: dict) -> None:
    for robot, color, contestants in _colored(results):
        most = max(c["workers"] for c in contestants if c["name"] == names.VECTOR)
        points = sorted(
            (c["num_envs"], _speed(c)) for c in contestants if c["name"] == names.VECTOR and c["workers"] == most
        )
        panel.plot(*zip(*points, strict=True), "o-", color=color, label=robot)
        best = max(_speed(c) for c in contestants if c["name"] == names.ASYNC)
        panel.axhline(best, color=color, linestyle=":", linewidth=1)
    panel.set_xscale("log", base=2)
    panel.set_xticks([rows for rows, _ in points], [str(rows) for rows, _ in points])
    panel.set_title("Vector env over environments\n(dotted: best AsyncVectorEnv of ordinary ones)")
    panel.set_xlabel("environments")
    panel.set_ylabel("control steps / s")


def _plot_threads(panel, results: dict) -> None:
    for robot, color, contestants in _colored(results):
        vectors = [c for c in contestants if c["name"] == names.VECTOR]
        rows = names.reference([c["num_envs"] for c in vectors])
        points = sorted((c["workers"], _speed(c)) for c in vectors if c["num_envs"] == rows)
        panel.plot(*zip(*points, strict=True), "o-", color=color, label=robot)
        lean = next(_speed(c) for c in contestants if c["name"] == names.LEAN)
        panel.plot([0, points[-1][0]], [0, lean * points[-1][0]], color=color, linestyle=":", linewidth=1)
    panel.set_xticks(sorted({point[0] for point in points}))
    panel.set_xlim(left=0)
    panel.set_title(f"Vector env of {rows} environments over threads\n(dotted: threads x lean mj_step)")
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


def _colored(results: dict) -> Iterator[tuple[str, str, list[dict]]]:
    for index, (robot, measured) in enumerate(results["robots"].items()):
        yield robot, _COLORS.get(robot, f"C{index}"), measured["contestants"]
