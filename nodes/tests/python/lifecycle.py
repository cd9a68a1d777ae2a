"""An outside ROS 2 peer over CycloneDDS that manages a node: lifecycle.py DOMAIN NODE [TRANSITION...].

Takes the transitions one after another and prints one JSON object: the state before, what is available, the whole graph,
and for each transition whether it was done, the events that told of it and the state after it. Exits with 1 when
something does not come in time.
"""

import json
import sys
import time
from dataclasses import dataclass

import cyclonedds.idl.annotations as ann
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

CLIENT = 78
TIMEOUT_S = 60.0


@dataclass
@ann.final
class State(IdlStruct, typename="lifecycle_msgs::msg::dds_::State_"):
    id: uint8
    label: str


@dataclass
@ann.final
class Transition(IdlStruct, typename="lifecycle_msgs::msg::dds_::Transition_"):
    id: uint8
    label: str


@dataclass
@ann.final
class TransitionDescription(IdlStruct, typename="lifecycle_msgs::msg::dds_::TransitionDescription_"):
    transition: Transition
    start_state: State
    goal_state: State


@dataclass
@ann.final
class TransitionEvent(IdlStruct, typename="lifecycle_msgs::msg::dds_::TransitionEvent_"):
    timestamp: uint64
    transition: Transition
    start_state: State
    goal_state: State


@dataclass
@ann.final
class ChangeStateRequest(IdlStruct, typename="lifecycle_msgs::srv::dds_::ChangeState_Request_"):
    client: uint64
    number: int64
    transition: Transition


@dataclass
@ann.final
class ChangeStateResponse(IdlStruct, typename="lifecycle_msgs::srv::dds_::ChangeState_Response_"):
    client: uint64
    number: int64
    success: bool


@dataclass
@ann.final
class EmptyRequest(IdlStruct, typename="lifecycle_msgs::srv::dds_::Empty_Request_"):
    client: uint64
    number: int64
    structure_needs_at_least_one_member: uint8


@dataclass
@ann.final
class GetStateRequest(EmptyRequest, typename="lifecycle_msgs::srv::dds_::GetState_Request_"):
    pass


@dataclass
@ann.final
class GetStateResponse(IdlStruct, typename="lifecycle_msgs::srv::dds_::GetState_Response_"):
    client: uint64
    number: int64
    current_state: State


@dataclass
@ann.final
class StatesRequest(EmptyRequest, typename="lifecycle_msgs::srv::dds_::GetAvailableStates_Request_"):
    pass


@dataclass
@ann.final
class StatesResponse(IdlStruct, typename="lifecycle_msgs::srv::dds_::GetAvailableStates_Response_"):
    client: uint64
    number: int64
    available_states: sequence[State]


@dataclass
@ann.final
class TransitionsRequest(EmptyRequest, typename="lifecycle_msgs::srv::dds_::GetAvailableTransitions_Request_"):
    pass


@dataclass
@ann.final
class TransitionsResponse(IdlStruct, typename="lifecycle_msgs::srv::dds_::GetAvailableTransitions_Response_"):
    client: uint64
    number: int64
    available_transitions: sequence[TransitionDescription]


class Manager:
    def __init__(self, domain, node):
        participant = DomainParticipant(domain)
        reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100))

        def reader(name, kind):
            return DataReader(participant, Topic(participant, name, kind), reliable)

        def writer(name, kind):
            return DataWriter(participant, Topic(participant, name, kind), reliable)

        self.events = reader(f"rt{node}/transition_event", TransitionEvent)
        self.services = {
            name: (writer(f"rq{node}/{name}Request", request), reader(f"rr{node}/{name}Reply", response), request)
            for name, request, response in [
                ("change_state", ChangeStateRequest, ChangeStateResponse),
                ("get_state", GetStateRequest, GetStateResponse),
                ("get_available_states", StatesRequest, StatesResponse),
                ("get_available_transitions", TransitionsRequest, TransitionsResponse),
                ("get_transition_graph", TransitionsRequest, TransitionsResponse),
            ]
        }
        self.number = 0

    def call(self, name, argument):
        """Calls a service once both ends see each other."""
        requests, responses, kind = self.services[name]
        deadline = time.monotonic() + TIMEOUT_S
        matched = lambda: requests.get_matched_subscriptions() and responses.get_matched_publications()
        while not matched() and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.1)
        self.number += 1
        requests.write(kind(CLIENT, self.number, argument))
        while time.monotonic() < deadline:
            for response in responses.take(10):
                # Among them are notes that a server has gone.
                if (getattr(response, "client", None), getattr(response, "number", 0)) == (CLIENT, self.number):
                    return response
            time.sleep(0.01)
        sys.exit(f"nobody answers {name}")

    def state(self):
        return self.call("get_state", 0).current_state.label

    def change(self, label):
        self.events.take(100)
        done = self.call("change_state", Transition(0, label)).success
        time.sleep(0.2)
        events = [named(event) for event in self.events.take(100) if isinstance(event, TransitionEvent)]
        return {"asked": label, "done": done, "events": events, "state": self.state() if label != "shutdown" else None}


def named(it):
    return [it.transition.id, it.transition.label, it.start_state.label, it.goal_state.label]


def main():
    domain, node, wishes = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
    manager = Manager(domain, node)
    seen = {
        "before": manager.state(),
        "states": [[state.id, state.label] for state in manager.call("get_available_states", 0).available_states],
        "available": [named(it) for it in manager.call("get_available_transitions", 0).available_transitions],
        "graph": [named(it) for it in manager.call("get_transition_graph", 0).available_transitions],
        "steps": [manager.change(wish) for wish in wishes],
    }
    print(json.dumps(seen))


if __name__ == "__main__":
    main()
