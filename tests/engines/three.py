"""Open clips with three.js in headless Chromium: bones, clips by name, every part where MuJoCo has it.

python tests/engines/three.py FOLDER BUNDLE, the bundle being that of loader.js
"""

import base64
import json
import pathlib
import shutil
import sys

import numpy as np
from playwright.sync_api import sync_playwright

NEAR = 1e-5  # m
TIMES = (0.0, 0.25, 0.5, 0.75)  # of a clip


def main(folder: str, bundle: str) -> None:
    """Check every file of a folder."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    files = sorted(pathlib.Path(folder).glob("*.glb"))
    assert files
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_page()
        tab.add_script_tag(path=bundle)
        for path in files:
            print(check(tab, path))
        browser.close()


def check(tab, path: pathlib.Path) -> str:
    """Return what there is to tell of a file."""
    name, rig = path.stem.rsplit("-", 1)
    truth = dict(np.load(path.with_name(f"{name}.npz")))
    parts = truth.pop("parts").tolist()
    data = base64.b64encode(path.read_bytes()).decode()
    opened = tab.evaluate("([data, times]) => window.opened(data, times)", [data, TIMES])
    assert opened["clips"].keys() == truth.keys()
    sidecar = json.loads(path.with_suffix(".clips.json").read_text())
    swinging = sidecar["swinging_bones"]
    assert opened["bones"] == (1 + len(parts) + len(swinging) if rig == "skin" else 0)
    worst = 0.0
    for clip, told in opened["clips"].items():
        assert told["contacts"] == len(sidecar["clips"][clip]["foot_contacts"])
        for time, places in zip(TIMES, told["frames"], strict=True):
            frame = time * (len(truth[clip]) - 1)
            if frame % 1.0:
                continue
            miss = [np.linalg.norm(places[part] - truth[clip][int(frame), i]) for i, part in enumerate(parts)]
            worst = max(worst, *miss)
    assert worst < NEAR, f"{path.name}: {worst} m"
    return f"{path.name}: {len(truth)} clips, {opened['bones']} bones, parts within {worst:.1e} m"


if __name__ == "__main__":
    main(*sys.argv[1:])
