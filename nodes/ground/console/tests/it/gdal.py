"""Opens the strips with GDAL's driver for OGC API Features: python gdal.py URL; prints what it saw as JSON."""

import json
import struct
import sys

import pyogrio

SOURCE = f"OAPIF:{sys.argv[1]}features"


def line(wkb):
    """The points of a line in well-known binary, little-endian; of one across the antimeridian those of its parts."""
    order, kind, count = struct.unpack_from("<BII", wkb)
    if kind == 2:
        return [struct.unpack_from("<dd", wkb, 9 + 16 * i) for i in range(count)]
    assert (order, kind) == (1, 5), (order, kind)
    # Of each part a head, and two points.
    return [line(wkb[9 + 41 * i :]) for i in range(count)]


def read(**how):
    """What there is of each strip: name, state, time of its last change, and its line."""
    meta, _, lines, columns = pyogrio.raw.read(SOURCE, layer="strips", **how)
    fields = dict(zip(meta["fields"], columns))
    rows = zip(fields["name"], fields["state"], fields["changed"].astype("datetime64[ms]").astype(str), lines)
    return [[name, state, changed, line(shape)] for name, state, changed, shape in rows]


def main():
    info = pyogrio.read_info(SOURCE, layer="strips")
    saw = {"driver": info["driver"], "crs": info["crs"], "layers": pyogrio.list_layers(SOURCE).tolist()}
    saw["all"] = read()
    # GDAL asks for the next page until there is none.
    saw["paged"] = read(PAGE_SIZE="7") == saw["all"]
    saw["completed"] = [row[0] for row in read(where="state = 'completed'")]
    saw["west"] = [row[0] for row in read(bbox=(-180.0, -90.0, -30.0, 90.0))]
    print(json.dumps(saw))


main()
