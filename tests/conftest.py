"""What all tests share: a browser, the interrupt, and a garbage collector that spares what pytest collects."""

import gc
import shutil
import signal

import pytest

from arc_suite.simulation import falls

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # in the background of a shell; programs would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session):
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(autouse=True, scope="session")
def few_falls():
    """Tables of falls from few drops, which take a tenth of a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(falls, "DROPS", 12)
        yield


@pytest.fixture(scope="session")
def browser():
    """Chromium without a window; tests that need it are skipped where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright here: make check-web, check-play, check-studio"
    )
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no Chromium here: make check-web, check-play, check-studio")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # no graphics card needed
    with playwright.sync_playwright() as running:
        opened = running.chromium.launch(executable_path=chromium, args=flags)
        yield opened
        opened.close()
