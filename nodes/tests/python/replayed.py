"""What a replay in the console shows at several times: python replayed.py CONSOLE MS ...; prints states as JSON."""

import json
import sys

import browser
from playwright.sync_api import sync_playwright

URL, TIMES = sys.argv[1], [float(it) for it in sys.argv[2:]]


def legend(page):
    """How many strips the map shows in each state."""
    texts = page.locator(".legend li").all_inner_texts()
    return {text.strip().rsplit(" ", 1)[0]: int(text.strip().rsplit(" ", 1)[1]) for text in texts}


def main():
    with sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        page = chromium.new_page(viewport={"width": 1500, "height": 900})
        page.goto(URL)
        page.wait_for_selector(".rows .row", timeout=60_000)
        slider = page.locator('input[type="range"]')
        saw = {"states": [], "buttons": page.get_by_role("button", name="cancel", exact=True).count()}
        move = "(it, t) => { it.value = t; it.dispatchEvent(new Event('input', { bubbles: true })); }"
        for time_ms in TIMES:
            slider.evaluate(move, time_ms)
            page.wait_for_timeout(400)
            saw["states"].append([float(slider.input_value()), legend(page)])
        chromium.close()
    print(json.dumps(saw))


main()
