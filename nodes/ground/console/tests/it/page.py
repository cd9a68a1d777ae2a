"""Looks at a replayed mission in a browser: python page.py URL FOLDER; prints what it saw as JSON, leaves pictures."""

import gzip
import json
import os
import shutil
import sys
import urllib.request
from pathlib import Path

from playwright.sync_api import sync_playwright

URL, FOLDER = sys.argv[1], Path(sys.argv[2])
FILES = ["", "console.js", "console.css", "stream.js", "icon.svg"]
NAMES = ["chromium", "chromium-browser", "google-chrome"]
CHROMIUM = os.environ.get("SWATH_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
if CHROMIUM is None:
    sys.exit("no Chromium to look at the console with: apt-get install chromium, or set SWATH_CHROMIUM")


def legend(page):
    """How many strips the map shows in each state."""
    texts = page.locator(".legend li").all_inner_texts()
    return {text.strip().rsplit(" ", 1)[0]: int(text.strip().rsplit(" ", 1)[1]) for text in texts}


def at(page, time_ms):
    """Moves the slider to a time."""
    page.locator('input[type="range"]').evaluate(
        "(it, t) => { it.value = t; it.dispatchEvent(new Event('input', { bubbles: true })); }", time_ms
    )
    page.wait_for_timeout(300)
    return int(page.locator('input[type="range"]').input_value())


def follows(page, key):
    """Whether the row that a key selects is seen in the table."""
    page.keyboard.press(key)
    page.wait_for_timeout(200)
    row, table = page.locator(".row.selected").bounding_box(), page.locator(".table").bounding_box()
    return row["y"] > table["y"] and row["y"] + row["height"] <= table["y"] + table["height"] + 1


def look(page, saw):
    page.goto(URL)
    page.wait_for_selector(".rows .row", timeout=60000)
    page.wait_for_timeout(1000)
    slider = page.locator('input[type="range"]')
    first, last = (int(float(slider.get_attribute(name))) for name in ("min", "max"))
    saw["title"] = page.title()
    saw["tabs"] = page.locator('[role="tab"]').all_inner_texts()
    saw["states"] = [[last, legend(page)]]
    page.get_by_role("button", name="whole").nth(1).click()
    page.wait_for_timeout(500)
    page.screenshot(path=FOLDER / "replay.png")
    for share in (0.25, 0.5, 0.75):
        time_ms = at(page, first + share * (last - first))
        saw["states"].append([time_ms, legend(page)])
    page.get_by_role("button", name="now").click()
    page.get_by_label("filter by state").select_option(label="completed")
    saw["completed"] = int(page.locator(".filters span").inner_text())
    page.locator(".table").focus()
    page.keyboard.press("ArrowDown")
    saw["drawer"] = page.locator(".drawer tbody tr").count()
    saw["selected"] = page.locator(".row.selected").count()
    saw["followed"] = all(follows(page, key) for key in ["End", "PageUp", "ArrowUp", "Home", "PageDown", "ArrowDown"])
    page.get_by_role("button", name="globe").click()
    page.wait_for_timeout(500)
    page.screenshot(path=FOLDER / "globe.png")
    page.get_by_role("tab", name="planner").click()
    saw["candidates"] = page.locator(".planner tbody tr").count()
    page.screenshot(path=FOLDER / "planner.png")


def main():
    saw = {"elsewhere": [], "errors": []}
    saw["gzipped"] = sum(len(gzip.compress(urllib.request.urlopen(URL + name).read(), 9)) for name in FILES)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1500, "height": 900})
        page.on("request", lambda it: None if it.url.startswith(URL) else saw["elsewhere"].append(it.url))
        page.on("console", lambda it: saw["errors"].append(it.text) if it.type == "error" else None)
        page.on("pageerror", lambda it: saw["errors"].append(str(it)))
        look(page, saw)
        browser.close()
    print(json.dumps(saw))


main()
