"""An operator's day in the console alone: python console_day.py CONSOLE FOLDER DOMAIN; prints what was seen as JSON.

The browser is real, the mission flies, and two tabs look at it. Pictures of the panels go into FOLDER.
"""

import json
import sys
import time
from pathlib import Path

import ahead
import browser
from playwright.sync_api import expect, sync_playwright

URL, FOLDER, DOMAIN = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
# Another tab shows within a second what one did; machines that test may be slow.
SOON = 20_000
SAW = {"elsewhere": [], "errors": [], "seconds": {}}


def tab(page, name):
    page.get_by_role("tab", name=name).click()


def picture(page, name):
    page.wait_for_timeout(300)
    page.screenshot(path=FOLDER / f"{name}.png")


def seen(name, what, to_be):
    """Waits until another tab shows it, and keeps how long that took."""
    begin = time.monotonic()
    to_be(expect(what))
    SAW["seconds"][name] = round(time.monotonic() - begin, 3)


def visible(it):
    it.to_be_visible(timeout=SOON)


def message(page, *texts):
    for text in texts:
        expect(page.locator(".message")).to_contain_text(text, timeout=SOON)


def state(page):
    """The state of the strip that the drawer tells of."""
    return page.locator(".drawer header > span").first


def find(page, text):
    """Filters the table by a text and selects the first that is left."""
    tab(page, "requests")
    page.get_by_label("filter by state").select_option(label="every state")
    page.get_by_label("filter by text").fill(text)
    page.locator(".rows .row").first.click()


def draw(page):
    """A strip ahead, by two clicks on the map."""
    tab(page, "submit")
    page.get_by_role("button", name="whole").first.click()
    canvas = page.locator(".map canvas")
    box = canvas.bounding_box()
    scale = max(box["width"] / 6.283185307, box["height"] / 3.141592654)
    for minutes in range(14, 60):
        ends = ahead.strip(URL, 60 * minutes, 2.0)
        places = [
            {"x": box["width"] / 2 + scale * lon * 0.017453293, "y": box["height"] / 2 - scale * lat * 0.017453293}
            for lon, lat in ends
        ]
        free = "([x, y]) => document.elementFromPoint(x, y)?.tagName === 'CANVAS'"
        if all(page.evaluate(free, [box["x"] + it["x"], box["y"] + it["y"]]) for it in places):
            break
    page.get_by_role("button", name="draw on the map").click()
    for place in places:
        canvas.click(position=place)
    page.get_by_label("name").fill("drawn by hand")
    page.get_by_label("priority").fill("1")
    page.get_by_role("button", name="opportunities").click()
    expect(page.locator(".preview tbody tr").first).to_be_visible(timeout=SOON)
    picture(page, "submit")
    page.get_by_role("button", name="submit", exact=True).click()
    message(page, "1 accepted")


def drop(page):
    """A GeoJSON file with one strip that is refused, dropped on the panel."""
    tab(page, "submit")
    lon, lat = ahead.place(URL, 5400)
    line = lambda name, *ends: {
        "type": "Feature",
        "properties": {"name": name, "hold_for_approval": True},
        "geometry": {"type": "LineString", "coordinates": list(ends)},
    }
    south = lat - 1 if lat > 0 else lat + 1
    file = {
        "type": "FeatureCollection",
        "features": [
            line("dropped 1", [lon, lat], [lon, south]),
            line("dropped 2", [lon + 1, lat], [lon + 1, south]),
            line("impossible", [10, 95], [11, 96]),
        ],
    }
    page.locator(".submit").evaluate(
        """(target, text) => {
            const data = new DataTransfer();
            data.items.add(new File([text], "wishes.geojson", { type: "application/geo+json" }));
            target.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
        }""",
        json.dumps(file),
    )
    expect(page.locator(".preview .refused")).to_contain_text("latitude", timeout=SOON)
    expect(page.locator(".preview")).to_have_count(3)
    picture(page, "dropped")
    page.get_by_role("button", name="submit", exact=True).click()
    message(page, "2 accepted", "1 refused", "latitude")


def by_submitter(page):
    """What a program ordered, and nothing that was drawn."""
    tab(page, "requests")
    page.get_by_label("filter by text").fill("")
    page.get_by_label("filter by submitter").select_option(label="stapi")
    names = page.locator(".rows .row span:nth-child(2)")
    expect(names.filter(has_text="by STAPI").first).to_be_visible(timeout=SOON)
    expect(names.filter(has_text="drawn by hand")).to_have_count(0)
    page.get_by_label("filter by submitter").select_option(label="everybody's")


def focused(page):
    return page.evaluate(
        """() => { const it = document.activeElement;
            return (it.getAttribute('aria-label') || it.labels?.[0]?.innerText || it.innerText || '').trim(); }"""
    )


def tab_to(page, name):
    """Moves with the Tab key alone."""
    for _ in range(150):
        if focused(page).startswith(name):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"no way to {name!r} by the keyboard")


def by_keyboard(page):
    """Submits a strip, selects it and cancels it without a pointer."""
    lon, lat = ahead.place(URL, 9000)
    tab_to(page, "submit")
    page.keyboard.press("Enter")
    ends = [lat, lon, lat - 1 if lat > 0 else lat + 1, lon]
    for label, value in zip(["from lat", "lon", "to lat", "lon"], ends):
        tab_to(page, label)
        page.keyboard.press("Control+a")
        page.keyboard.type(f"{value:.3f}")
        page.keyboard.press("Tab")
    tab_to(page, "name")
    page.keyboard.press("Control+a")
    page.keyboard.type("typed")
    for _ in range(20):
        if focused(page) == "submit" and page.evaluate("document.activeElement.className") == "primary":
            break
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    message(page, "1 accepted")
    tab_to(page, "filter by text")
    page.keyboard.type("typed")
    tab_to(page, "requests; arrow keys")
    page.keyboard.press("ArrowDown")
    expect(page.locator(".drawer header b")).to_contain_text("typed", timeout=SOON)
    for _ in range(150):
        if focused(page) == "cancel":
            break
        page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    message(page, "1 cancelled")
    expect(state(page)).to_have_text("cancelled by user", timeout=SOON)


def decide_on_held(page, other):
    """What was dropped waits for approval: one is released, one rejected, both at once held and cancelled."""
    find(page, "dropped 1")
    find(other, "dropped 1")
    expect(state(page)).to_have_text("held", timeout=SOON)
    page.get_by_placeholder("reason").fill("looked at")
    page.get_by_role("button", name="release", exact=True).click()
    seen("release", state(other), lambda it: it.to_have_text("accepted", timeout=SOON))
    message(page, "1 released")
    page.get_by_role("button", name="hold", exact=True).last.click()
    seen("hold", state(other), lambda it: it.to_have_text("held", timeout=SOON))
    page.get_by_role("button", name="release", exact=True).click()
    find(page, "dropped")
    page.locator(".table").focus()
    page.keyboard.press("Control+a")
    page.get_by_role("button", name="cancel", exact=True).click()
    message(page, "2 cancelled")
    find(other, "dropped 2")
    seen("cancel", state(other), lambda it: it.to_have_text("cancelled by user", timeout=SOON))


def again(page):
    """A clone, and another strip in the place of one."""
    find(page, "drawn by hand")
    page.get_by_role("button", name="clone", exact=True).click()
    page.get_by_label("name").fill("cloned")
    page.get_by_label("hold for approval").check()
    page.get_by_label("to lat").fill("0")
    page.get_by_label("lon").last.press("Tab")
    lon, lat = ahead.place(URL, 7200)
    for label, value in [("from lat", lat), ("to lat", lat - 1 if lat > 0 else lat + 1)]:
        page.get_by_label(label).fill(f"{value:.3f}")
    for i in (0, 1):
        page.get_by_label("lon").nth(i).fill(f"{lon:.3f}")
    page.get_by_role("button", name="submit", exact=True).click()
    message(page, "1 accepted")
    expect(page.locator(".drawer header b")).to_contain_text("cloned", timeout=SOON)
    page.get_by_role("button", name="replace", exact=True).click()
    page.get_by_label("name").fill("closer look")
    page.get_by_label("speed").fill("2500")
    page.locator(".submit .primary").click()
    message(page, "1 in the place of")
    find(page, "cloned")
    expect(state(page)).to_have_text("superseded", timeout=SOON)
    page.get_by_role("button", name="replaced by").click()
    expect(page.locator(".drawer header b")).to_contain_text("closer look", timeout=SOON)
    picture(page, "requests")


def executing(page):
    """A strip that is being imaged cannot be cancelled, and the answer says why."""
    tab(page, "requests")
    page.get_by_label("filter by text").fill("")
    page.get_by_label("filter by state").select_option(label="executing")
    page.locator(".rows .row").first.click(timeout=180_000)
    page.get_by_role("button", name="cancel", exact=True).click()
    message(page, "reason 121")


def planner(page, other):
    """Approve in one tab, seen in another."""
    for it in (page, other):
        tab(it, "planner")
    page.get_by_role("button", name="approve", exact=True).click()
    pressed = lambda name: other.locator(f'.group button[aria-pressed="true"]:text-is("{name}")')
    seen("mode", pressed("approve"), visible)
    before = other.locator(".proposal h3")
    for _ in range(20):
        expect(before).to_contain_text("(open)", timeout=180_000)
        number = before.inner_text().split()[1]
        try:
            page.locator(".proposal .primary").click(timeout=3_000)
        except Exception:  # its window has closed meanwhile: the next one
            continue
        begin = time.monotonic()
        try:
            expect(other.locator(".planner")).to_contain_text(f"proposal {number} (approved)", timeout=5_000)
        except AssertionError:
            continue
        SAW["seconds"]["approve"] = round(time.monotonic() - begin, 3)
        break
    picture(page, "planner")
    expect(before).to_contain_text("(open)", timeout=180_000)
    page.get_by_role("button", name="reject", exact=True).click()
    page.get_by_role("button", name="autonomous", exact=True).click()
    seen("autonomous", pressed("autonomous"), visible)


def node_dies(page, other):
    """The request manager is killed: both tabs see that it came back and are told, and what was asked for is kept."""
    tab(page, "alarms")
    tab(other, "alarms")
    browser.kill("swath-requests", DOMAIN)
    again = lambda it: it.to_contain_text("request_manager · 1 restart", timeout=60_000)
    again(expect(page.locator(".nodes")))
    seen("restart", other.locator(".nodes"), again)
    seen("alarm", other.locator(".alarms tbody"), lambda it: it.to_contain_text("request_manager", timeout=60_000))
    picture(page, "alarms")
    page.get_by_role("button", name="acknowledge all").click()
    counter = other.locator("header.top button.pill")
    seen("acknowledge", counter, lambda it: it.to_have_text("0 alarms", timeout=SOON))
    find(page, "drawn by hand")
    expect(state(page)).to_have_text("completed", timeout=SOON)


def front(page):
    """The README's picture: a mission that flies, with a strip in hand, and the same on the globe."""
    find(page, "drawn by hand")
    page.get_by_label("filter by text").fill("")
    page.get_by_role("button", name="whole").first.click()
    picture(page, "console")
    page.get_by_role("button", name="globe").click()
    picture(page, "live")


def day(page, other):
    for it in (page, other):
        it.goto(URL)
        it.wait_for_selector(".rows .row", timeout=60_000)
    expect(page.locator("header.top .good")).to_have_text("live")
    draw(page)
    by_keyboard(other)
    drop(page)
    by_submitter(page)
    decide_on_held(page, other)
    find(page, "drawn by hand")
    expect(state(page)).to_have_text("completed", timeout=120_000)
    picture(page, "completed")
    again(page)
    executing(page)
    planner(page, other)
    node_dies(page, other)
    front(page)


def main():
    with sync_playwright() as playwright:
        chromium = browser.launch(playwright)
        context = chromium.new_context(viewport={"width": 1500, "height": 900})
        context.on("request", lambda it: None if it.url.startswith(URL) else SAW["elsewhere"].append(it.url))
        pages = [context.new_page(), context.new_page()]
        for page in pages:
            page.on("console", lambda it: SAW["errors"].append(it.text) if it.type == "error" else None)
            page.on("pageerror", lambda it: SAW["errors"].append(str(it)))
        try:
            day(*pages)
        except Exception:
            for i, page in enumerate(pages):
                page.screenshot(path=FOLDER / f"failed-{i}.png")
            raise
        chromium.close()
    print(json.dumps(SAW))


main()
