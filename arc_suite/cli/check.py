"""Tell what is wrong with a body in a spec file, and the value that would fit.

  arc-suite check examples/spider.json

Prints one line for each flaw: feet that hang in the air, legs that hold nothing up, none that can
step. Exit status 1 if there is any.
"""

from arc_suite.models.soundness import flaws
from arc_suite.robots.spec_files import load_body


def main(spec: str | None = None) -> int:
    """Print the flaws of the body in a spec file and return the exit status."""
    if spec is None:
        raise ValueError("expected a spec file; see --help")
    body = load_body(spec)
    found = flaws(body)
    for flaw in found:
        print(f"{spec}: {flaw.text}")
    if not found:
        print(f"{spec}: {body.name} stands and can take steps")
    return int(bool(found))
