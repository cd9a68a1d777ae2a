"""A client of the bridge: python foxglove.py URL topics|live|commands|bag; prints what it saw as JSON.

It speaks Foxglove's WebSocket protocol (foxglove.sdk.v1) and decodes with mcap-ros2-support.
"""

import base64
import json
import struct
import sys
import time

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from websockets.sync.client import connect

URL, WAY = sys.argv[1:3]


class Client:
    """One connection: what was advertised, and messages by topic as they come."""

    def __init__(self):
        self.socket = connect(URL, subprotocols=["foxglove.sdk.v1"], max_size=None).__enter__()
        self.channels, self.services, self.info = {}, {}, None
        self.topics, self.messages, self.statuses, self.failures, self.answers = {}, {}, [], [], {}
        self.time, self.playback = 0, []

    def hear(self, seconds, until=lambda: False):
        """Takes what comes for so long, or until something is so."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            try:
                message = self.socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            self.take_text(json.loads(message)) if isinstance(message, str) else self.take(message)
        return until()

    def take_text(self, message):
        match message["op"]:
            case "serverInfo":
                self.info = message
            case "advertise":
                self.channels |= {it["topic"]: it for it in message["channels"]}
            case "advertiseServices":
                self.services |= {it["name"]: it for it in message["services"]}
            case "status":
                self.statuses.append(message["message"])
            case "serviceCallFailure":
                self.failures.append(message["message"])

    def take(self, data):
        match data[0]:
            case 1:
                subscription, stamp = struct.unpack_from("<IQ", data, 1)
                self.messages.setdefault(self.topics[subscription], []).append((stamp, data[13:]))
            case 2:
                (self.time,) = struct.unpack_from("<Q", data, 1)
            case 3:
                _, call, length = struct.unpack_from("<III", data, 1)
                self.answers[call] = data[13 + length :]
            case 5:
                status, now, speed, seek = struct.unpack_from("<BQfB", data, 1)
                self.playback.append((status, now, speed, seek))

    def say(self, **message):
        self.socket.send(json.dumps(message))

    def subscribe(self, topics):
        subscriptions = []
        for topic in topics:
            number = self.channels[topic]["id"]
            self.topics[number] = topic
            subscriptions.append({"id": number, "channelId": number})
        self.say(op="subscribe", subscriptions=subscriptions)

    def decode(self, topic, message):
        channel = self.channels[topic]
        if channel["encoding"] != "cdr":
            # foxglove.GeoJSON as a protocol buffer: one string, field 1.
            return json.loads(message[message.index(b"{") :])
        return generate_dynamic(channel["schemaName"], channel["schema"])[channel["schemaName"]](message)

    def last(self, topic):
        return self.decode(topic, self.messages[topic][-1][1])

    def call(self, name, request, number, seconds=20):
        service = self.services[name]
        wanted = service["request"]
        encode = serialize_dynamic(wanted["schemaName"], wanted["schema"])[wanted["schemaName"]]
        head = struct.pack("<BIII", 2, service["id"], number, 3) + b"cdr"
        self.socket.send(head + encode(request))
        self.hear(seconds, lambda: number in self.answers or self.failures)
        answer = service["response"]
        decode = generate_dynamic(answer["schemaName"], answer["schema"])[answer["schemaName"]]
        return decode(self.answers[number])

    def play(self, command, speed, seek=None):
        head = struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, 1)
        self.socket.send(head + b"x")


def strips(client):
    """How many strips the channels of states show, by the last message of each."""
    topics = [it for it in client.channels if "/strips/" in it and not it.endswith("/scene")]
    client.subscribe(topics)
    client.hear(10, lambda: all(topic in client.messages for topic in topics))
    return {topic.rsplit("/", 1)[1]: len(client.last(topic)["features"]) for topic in topics}


def scene(client):
    """What a 3D panel draws: frame, entities, and how many lines each has."""
    topic = next(it for it in client.channels if it.endswith("/strips/scene"))
    channel = client.channels[topic]
    assert channel["encoding"] == "protobuf", channel
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(base64.b64decode(channel["schema"])).file:
        pool.Add(file)
    kind = GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
    client.subscribe([topic])
    client.hear(10, lambda: topic in client.messages)
    update = kind.FromString(client.messages[topic][-1][1])
    frames = sorted({it.frame_id for it in update.entities})
    lines = {it.id: sum(len(line.points) // 2 for line in it.lines) for it in update.entities}
    return {"frames": frames, "spheres": [it.id for it in update.entities if it.spheres], "lines": lines}


def topics():
    """Names of the channels that there are without a mission."""
    client = Client()
    client.hear(20, lambda: len(client.channels) >= 24)
    return sorted(client.channels)


def live():
    """All topics, decoded; a stuck client beside; what is not allowed."""
    client = Client()
    client.hear(20, lambda: len(client.channels) >= 24 and any("/strips/" in it for it in client.channels))
    saw = {"capabilities": client.info["capabilities"], "services": len(client.services)}
    saw["schemas"] = all(it["schemaEncoding"] == "ros2msg" for it in client.channels.values() if it["encoding"] == "cdr")
    saw["topics"] = sorted(client.channels)
    saw["strips"] = strips(client)
    saw["scene"] = scene(client)
    # Subscribed, and never read: its queue is full soon.
    stuck = Client()
    stuck.hear(20, lambda: "/swath/spacecraft/state" in stuck.channels)
    stuck.subscribe(["/swath/spacecraft/state", "/swath/guidance/wheel_torque", "/clock"])
    late = Client()
    late.hear(20, lambda: "/swath/planner/status" in late.channels)
    late.subscribe(["/swath/planner/status"])
    saw["late"] = late.hear(10, lambda: "/swath/planner/status" in late.messages)
    client.subscribe([it for it in client.channels if "/strips/" not in it])
    wanted = ["/swath/spacecraft/state", "/swath/spacecraft/sub_satellite_point", "/tf", "/swath/guidance/status", "/clock"]
    # A mission may only just have begun.
    client.hear(60, lambda: all(len(client.messages.get(topic, [])) > 2 for topic in wanted))
    states = [client.decode(wanted[0], it) for _, it in client.messages[wanted[0]][:50]]
    saw["ticks"] = [state.tick for state in states]
    saw["frames"] = sorted({it.child_frame_id for it in client.last("/tf").transforms})
    saw["latitude"] = client.last(wanted[1]).latitude
    ours = [topic for topic in client.messages if not topic.endswith("/scene")]
    saw["decoded"] = sum(1 for topic in ours if client.last(topic) is not None)
    stamp = client.messages["/clock"][-1][0]
    saw["clock"] = abs(client.time - stamp) < 3600e9 and stamp > 1.7e18
    # Not allowed: neither is advertised, and who tries is told.
    client.say(op="advertise", channels=[{"id": 1, "topic": "/x", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}])
    client.hear(5, lambda: client.statuses)
    saw["refused"] = client.statuses
    return saw


def commands():
    """A service is called, a message published, and what is wrong with either is told."""
    client = Client()
    client.hear(20, lambda: "/swath/requests/list" in client.services and "/swath/requests/events" in client.channels)
    saw = {"capabilities": client.info["capabilities"], "services": sorted(client.services)}
    client.subscribe(["/swath/requests/events", "/swath/requests/request"])
    empty = dict(states=[], in_area=False, south_deg=0.0, north_deg=0.0, west_deg=0.0, east_deg=0.0, after_id=0)
    none = dict(sec=0, nanosec=0)
    empty |= dict(opportunity_from=none, opportunity_until=none, order_id=0, limit=5, with_requests=False)
    listed = client.call("/swath/requests/list", empty, 1)
    saw["listed"] = len(listed.strips)
    known = client.channels["/swath/requests/request"]
    client.say(
        op="advertise",
        channels=[
            {"id": 1, "topic": "/swath/requests/request", "encoding": "cdr", "schemaName": known["schemaName"]},
            {"id": 2, "topic": "/swath/requests/request", "encoding": "cdr", "schemaName": "std_msgs/msg/Header"},
            {"id": 3, "topic": "/mine", "encoding": "json", "schemaName": "std_msgs/msg/Header"},
            {"id": 4, "topic": "/mine", "encoding": "cdr", "schemaName": "my_msgs/msg/Unknown"},
        ],
    )
    client.hear(10, lambda: len(client.statuses) >= 3)
    saw["statuses"] = client.statuses[:3]
    request = client.decode("/swath/requests/request", b"\0\1\0\0" + bytes(400))
    strip = {name: getattr(request, name) for name in request.__slots__}
    strip |= dict(name="by a client", client_ref="foxglove-1", submitter="foxglove", priority=0.5)
    strip |= dict(start_latitude_deg=10.0, start_longitude_deg=20.0, end_latitude_deg=11.0, end_longitude_deg=20.0)
    strip |= dict(acquisition_speed=3000.0)
    for name in ("valid_from", "valid_until"):
        strip[name] = none
    encode = serialize_dynamic(known["schemaName"], known["schema"])[known["schemaName"]]
    mine = lambda: any(
        client.decode("/swath/requests/events", it).strip.name == "by a client"
        for _, it in client.messages.get("/swath/requests/events", [])
    )
    # Its writer may not be matched yet: a request with a reference counts once.
    for _ in range(20):
        client.socket.send(struct.pack("<BI", 1, 1) + encode(strip))
        if client.hear(1, mine):
            break
    saw["published"] = mine()
    client.socket.send(struct.pack("<BI", 1, 1) + b"\0\1\0\0\1")
    client.hear(10, lambda: len(client.statuses) >= 4)
    saw["garbled"] = client.statuses[3:]
    return saw


def bag():
    """A bag: paused at first, played, moved through, played to its end."""
    client = Client()
    topic = "/swath/spacecraft/sub_satellite_point"
    client.hear(20, lambda: topic in client.channels and client.info)
    begin, end = (client.info[key]["sec"] * 10**9 + client.info[key]["nsec"] for key in ("dataStartTime", "dataEndTime"))
    saw = {"capabilities": client.info["capabilities"]}
    client.subscribe([topic])
    client.hear(1)
    saw["before"] = len(client.messages.get(topic, []))
    client.play(0, 1000.0)
    client.hear(20, lambda: len(client.messages.get(topic, [])) >= 10)
    stamps = [stamp for stamp, _ in client.messages[topic]]
    saw["ordered"] = stamps == sorted(stamps) and stamps[0] < begin + 60e9
    middle = (begin + end) // 2
    client.messages.clear()
    client.play(1, 1000.0, middle)
    client.hear(5, lambda: any(seek for *_, seek in client.playback))
    saw["strips"] = strips(client)
    saw["sought"] = [it[1] for it in client.playback if it[3]] == [middle]
    client.messages.pop(topic, None)
    client.play(0, 10000.0)
    client.hear(30, lambda: client.playback and client.playback[-1][0] == 3)
    # The state overtakes messages.
    client.hear(2)
    stamps = [stamp for stamp, _ in client.messages[topic]]
    saw["from the middle"] = middle <= stamps[0] < middle + 60e9 and stamps == sorted(stamps)
    saw["ended"] = client.playback[-1][0] == 3 and client.playback[-1][1] == end
    saw["at the end"] = {
        name.rsplit("/", 1)[1]: len(client.last(name)["features"]) for name in client.messages if "/strips/" in name
    }
    return saw


print(json.dumps({"topics": topics, "live": live, "commands": commands, "bag": bag}[WAY]()))
