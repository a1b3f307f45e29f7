"""Debian's chromium without a screen, whose files all lie in one folder."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from selenium.webdriver import Chrome, ChromeOptions
from selenium.webdriver.chrome.service import Service

PATIENCE = 60  # s


@contextmanager
def browser(folder: Path) -> Iterator[Chrome]:
    """Start one; it keeps the log of its console."""
    options = ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    words = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--no-proxy-server"]
    words += [f"--user-data-dir={folder / 'browser'}", "--disable-background-networking", "--disable-extensions", "--disable-sync"]
    for word in words + ["--no-sandbox"] * (os.geteuid() == 0):  # chromium's own sandbox refuses root
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = Chrome(options, Service("/usr/bin/chromedriver", log_output=str(folder / "chromedriver.log")))
    try:
        driver.set_page_load_timeout(PATIENCE)
        driver.set_script_timeout(PATIENCE)
        yield driver
    finally:
        driver.quit()
