"""How fast the console's page is on what it shows: python console_speed.py CONSOLE; prints one JSON object.

First paint, everything shown, frames while the map is dragged and zoomed flat and as a globe, the size of the page.
"""

import gzip
import json
import statistics
import sys
import urllib.request

import browser
from playwright.sync_api import sync_playwright

URL = sys.argv[1]
FILES = ["/", "/console.js", "/console.css", "/stream.js", "/icon.svg"]
# Each frame's length, and the longest time from an input to the frame that shows it.
WATCH = """() => {
    window.frames_ms = [];
    window.input_ms = 0;
    let last = 0;
    const step = (now) => { if (last) window.frames_ms.push(now - last); last = now; requestAnimationFrame(step); };
    requestAnimationFrame(step);
    new PerformanceObserver((list) => {
        for (const it of list.getEntries()) window.input_ms = Math.max(window.input_ms, it.duration);
    }).observe({ type: "event", durationThreshold: 16 });
}"""


def drag(page):
    """Frames [ms] while the map is dragged and zoomed for a while, and the slowest input."""
    box = page.locator(".map canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.evaluate("() => { window.frames_ms.length = 0; window.input_ms = 0; }")
    page.mouse.move(x, y)
    page.mouse.down()
    for i in range(120):
        page.mouse.move(x + 3 * (i % 60) - 90, y + (i % 40) - 20)
    page.mouse.up()
    for i in range(20):
        page.mouse.wheel(0, -120 if i < 10 else 120)
    frames = page.evaluate("window.frames_ms")
    return {
        "redraw_ms": round(statistics.median(frames), 1),
        "redraw_p95_ms": round(statistics.quantiles(frames, n=20)[-1], 1),
        "input_max_ms": round(page.evaluate("window.input_ms"), 1),
    }


def main():
    saw = {}
    with sync_playwright() as playwright:
        page = browser.launch(playwright).new_page(viewport={"width": 1500, "height": 900})
        page.goto(URL)
        page.wait_for_selector(".rows .row", timeout=60_000)
        saw["rows_s"] = round(page.evaluate("performance.now()") / 1000, 2)
        paint = "performance.getEntriesByName('first-contentful-paint')[0].startTime"
        saw["first_paint_s"] = round(page.evaluate(paint) / 1000, 2)
        count = 0
        while True:
            page.wait_for_timeout(500)
            shown = page.locator(".legend li").all_inner_texts()
            now = sum(int(text.rsplit(" ", 1)[1]) for text in shown)
            if now == count:
                break
            count = now
        saw["strips"] = count
        page.evaluate(WATCH)
        page.get_by_role("button", name="whole").first.click()
        flat = drag(page)
        page.get_by_role("button", name="globe").click()
        page.wait_for_timeout(300)
        saw |= {f"flat_{key}": value for key, value in flat.items()}
        saw |= {f"globe_{key}": value for key, value in drag(page).items()}
        saw["heap_MB"] = round(page.evaluate("performance.memory.usedJSHeapSize") / 1e6, 1)
    size = sum(len(gzip.compress(urllib.request.urlopen(URL + path).read(), 9)) for path in FILES)
    saw["page_kB_gzipped"] = round(size / 1000, 1)
    print(json.dumps(saw))


main()
