"""A node that is away for a while, as ten tabs of one browser see it.

python console_missing.py CONSOLE FOLDER DOMAIN NODE PROGRAM prints as JSON the seconds from the kill until all tabs say
that the node is missing, and until none does any more, and how many connections to the console the browser has.
"""

import json
import sys
import time
from pathlib import Path

import browser
from playwright.sync_api import expect, sync_playwright

URL, FOLDER, DOMAIN, NODE, PROGRAM = sys.argv[1], Path(sys.argv[2]), *sys.argv[3:6]
# More than HTTP/1.1 lets a browser have streams of one server: six.
TABS = 10


def connections():
    """Open connections to the console, seen from those who ask."""
    port = f":{int(URL.rsplit(':', 1)[1]):04X}"
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return sum(remote.endswith(port) and state == "01" for _, _, remote, state, *_ in rows)


def live(page):
    """The page's clock goes on."""
    clock = page.get_by_label("simulated time")
    expect(clock).not_to_have_text(clock.inner_text(), timeout=20_000)


def main():
    saw = {}
    with sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        context = chromium.new_context(viewport={"width": 1500, "height": 900})
        pages = [context.new_page() for _ in range(TABS)]
        banners = [page.get_by_role("alert") for page in pages]
        for page, banner in zip(pages, banners):
            page.goto(URL)
            page.wait_for_selector(".rows .row", timeout=60_000)
            expect(banner).to_have_count(0, timeout=60_000)
            page.get_by_role("tab", name="alarms").click()
        for page in pages:
            live(page)
        saw["tabs"], saw["connections"] = len(pages), connections()
        browser.kill(PROGRAM, DOMAIN)
        begin = time.monotonic()
        for page, banner in zip(pages, banners):
            expect(banner).to_have_text(f"missing: {NODE}", timeout=60_000)
            expect(page.locator(".nodes")).to_contain_text(f"{NODE} is missing", timeout=5_000)
        saw["missing"] = round(time.monotonic() - begin, 3)
        pages[0].screenshot(path=FOLDER / "missing.png")
        for page, banner in zip(pages, banners):
            expect(banner).to_have_count(0, timeout=120_000)
            expect(page.locator(".nodes")).to_contain_text(f"{NODE} · 1 restart", timeout=20_000)
        saw["back"] = round(time.monotonic() - begin, 3)
        chromium.close()
    print(json.dumps(saw))


main()
