"""Orders images through STAPI: python stapi.py CONSOLE SECONDS; prints what it saw as JSON.

Every answer goes through the models of stapi-pydantic, and where they forgive, what the specification says is looked
at. The strip that is ordered lies ahead of the satellite; it is waited for, SECONDS at most, until it is imaged.
"""

import json
import sys
import time
import urllib.request
from urllib.error import HTTPError

import ahead
from stapi_pydantic import (
    Conformance,
    Link,
    OpportunityCollection,
    Order,
    OrderCollection,
    OrderStatus,
    OrderStatuses,
    Product,
    ProductsCollection,
    RootResponse,
)

BASE, SECONDS = f"{sys.argv[1]}/stapi", float(sys.argv[2])
LINE = {"type": "LineString", "coordinates": list(ahead.strip(sys.argv[1], 900))}
BACK = {"type": "LineString", "coordinates": LINE["coordinates"][::-1]}


def ask(method, url, body=None):
    """Status, media type, headers and JSON of an answer."""
    data = None if body is None else json.dumps(body).encode()
    headers = {"Content-Type": "application/json"} if data else {}
    try:
        answer = urllib.request.urlopen(urllib.request.Request(url, data, headers, method=method), timeout=60)
    except HTTPError as error:
        answer = error
    text = answer.read()
    return answer.status, answer.headers.get_content_type(), answer.headers, json.loads(text)


def get(url, media_type="application/json"):
    status, given, _, body = ask("GET", url)
    assert (status, given) == (200, media_type), (url, status, given, body)
    return body


def rel(links, wanted):
    """The one link of a relation; all are absolute."""
    found = [link for link in links if link["rel"] == wanted]
    assert len(found) == 1, (wanted, links)
    Link.model_validate(found[0])
    assert found[0]["href"].startswith("http"), found
    return found[0]


def problem(answer, status):
    """An error is problem details (RFC 9457)."""
    assert answer[0] == status, answer
    assert answer[1] == "application/problem+json", answer
    assert answer[3]["status"] == status and answer[3]["detail"], answer


def first_pages():
    """From the landing page to the product."""
    root = get(BASE)
    RootResponse.model_validate(root)
    assert any("stapi" in it and "0.1.0" in it for it in root["conformsTo"]), root["conformsTo"]
    conformance = get(rel(root["links"], "conformance")["href"])
    Conformance.model_validate(conformance)
    assert conformance["conformsTo"] == root["conformsTo"]
    rel(root["links"], "service-desc")
    products = get(rel(root["links"], "products")["href"])
    ProductsCollection.model_validate(products)
    (product,) = products["products"]
    Product.model_validate(product)
    same = get(rel(product["links"], "self")["href"])
    assert same == product
    for name in ("queryables", "order-parameters"):
        schema = get(rel(product["links"], name)["href"])
        assert schema["type"] == "object" and "properties" in schema, schema
    Conformance.model_validate(get(rel(product["links"], "conformance")["href"]))
    problem(ask("GET", f"{BASE}/products/nothing"), 404)
    return root, product


def opportunities(product):
    """All pages of a search, two opportunities each."""
    link = rel(product["links"], "opportunities")
    search = {"datetime": "../..", "geometry": LINE, "limit": 2}
    found, pages = [], 0
    while link:
        status, media_type, _, page = ask("POST", link["href"], link.get("body") or search)
        assert (status, media_type) == (200, "application/geo+json"), page
        OpportunityCollection.model_validate(page)
        found += page["features"]
        pages += 1
        more = [it for it in page["links"] if it["rel"] == "next"]
        link = more[0] if more and pages < 3 else None
    times = [it["properties"]["datetime"] for it in found]
    assert times == sorted(times) and len(set(times)) == len(times), times
    high = {**search, "limit": 100, "filter": {"op": ">", "args": [{"property": "min_elevation_deg"}, 60]}}
    _, _, _, filtered = ask("POST", rel(product["links"], "opportunities")["href"], high)
    assert all(it["properties"]["min_elevation_deg"] > 60 for it in filtered["features"]), filtered
    for wrong in ({**search, "limit": 0}, {**search, "datetime": "yesterday"}, {**search, "geometry": {}}, {}):
        answer = ask("POST", rel(product["links"], "opportunities")["href"], wrong)
        assert answer[0] in (400, 422), (wrong, answer)
        problem(answer, answer[0])
    return found


def order(product):
    """An order that is imaged, and what its statuses were."""
    create = rel(product["links"], "create-order")["href"]
    payload = {
        "datetime": "../..",
        "geometry": LINE,
        "order_parameters": {"name": "by STAPI", "priority": 1.0, "client_ref": "stapi-1"},
    }
    status, media_type, headers, made = ask("POST", create, payload)
    assert (status, media_type) == (201, "application/geo+json"), made
    Order[OrderStatus].model_validate(made)
    here = rel(made["links"], "self")["href"]
    assert headers["Location"] == here
    again = ask("POST", create, payload)
    assert again[0] in (201, 409), again
    monitor = rel(made["links"], "monitor")["href"]
    codes, until = [], time.monotonic() + SECONDS
    while time.monotonic() < until and "completed" not in codes:
        statuses = get(monitor)
        OrderStatuses[OrderStatus].model_validate(statuses)
        codes = [it["status_code"] for it in statuses["statuses"]]
        time.sleep(0.3)
    now = get(here, "application/geo+json")
    Order[OrderStatus].model_validate(now)
    return codes, now["properties"]["status"]["status_code"], made["id"]


def cancelled(product):
    """An order that is taken back, by the link that says how."""
    payload = {
        "datetime": "../..",
        "geometry": BACK,
        "order_parameters": {"hold_for_approval": True, "priority": 0.1},
    }
    _, _, _, made = ask("POST", rel(product["links"], "create-order")["href"], payload)
    Order[OrderStatus].model_validate(made)
    link = rel(made["links"], "cancel")
    status, _, _, gone = ask(link["method"], link["href"])
    assert status == 200, gone
    problem(ask(link["method"], link["href"]), 409)
    return made["properties"]["status"]["status_code"], gone["properties"]["status"]["status_code"]


def pages(root):
    """Identities of all orders, three a page."""
    url, found = rel(root["links"], "orders")["href"] + "?limit=3", []
    while url:
        page = get(url, "application/geo+json")
        OrderCollection[OrderStatus].model_validate(page)
        assert len(page["features"]) <= 3
        found += [it["id"] for it in page["features"]]
        url = next((it["href"] for it in page["links"] if it["rel"] == "next"), None)
    assert len(set(found)) == len(found) == page["numberMatched"], found
    return found


def main():
    root, product = first_pages()
    saw = {"opportunities": len(opportunities(product))}
    saw["codes"], saw["status"], number = order(product)
    saw["held"], saw["cancelled"] = cancelled(product)
    saw["listed"] = number in pages(root)
    problem(ask("GET", f"{BASE}/orders/99999999"), 404)
    problem(ask("GET", f"{BASE}/orders?limit=0"), 400)
    print(json.dumps(saw))


main()
