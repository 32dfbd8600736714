"""Measures how fast soft actor-critic learns on one core, against what the processor could do at most.

  python tools/bench_agents.py
  python tools/bench_agents.py --updates 300

Updates are counted per second of processor time of one thread, with the sizes of Queen. The limit is the rate of
products of matrices 256 x 256 in float32, measured before and after in the same run, over the products that an
update needs: those of the plain algorithm, which computes none of them only once. Where torch is installed, it also
times the same full update in a plain loop of PyTorch.
"""

from absl import flags

from arc_suite import versions
from arc_suite.cli import program

FLAGS = flags.FLAGS
flags.DEFINE_integer("updates", 200, "Updates of each kind that are measured.", lower_bound=1)


def main() -> None:
    """Measure and print a table."""
    try:
        from benchmark import learning
    except ImportError as error:
        raise versions.MissingExtra("learning needs JAX", "agents", error) from None
    line = "{:<44} {:>12} {:>12} {:>9}"
    header = line.format("updates per second of one core", "measured", "limit", "share")
    print(header, "-" * len(header), sep="\n")
    for name, rate, limit in learning.measure(FLAGS.updates):
        print(line.format(name, f"{rate:.1f}", f"{limit:.1f}", f"{100.0 * rate / limit:.0f} %"), flush=True)


if __name__ == "__main__":
    program.run(main)
