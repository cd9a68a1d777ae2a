"""Launches the nodes of a mission under ROS 2: ros2 launch swath swath.launch.py mission:=FILE [store:=FILE] [bag:=FOLDER]."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

HERE = Path(__file__).absolute().parent
# In an ament prefix this file lies in share/swath/launch, in the repository in nodes/launch.
PROGRAMS = [HERE.parents[2] / "lib" / "swath", HERE.parents[1] / "target" / "release"]


def programs():
    return str(next((folder for folder in PROGRAMS if (folder / "swath-spacecraft").exists()), PROGRAMS[-1]))


def node(context, name, program, words=(), parameters=()):
    value = lambda argument: LaunchConfiguration(argument).perform(context)
    command = [f"{value('bin')}/{program}", *words, "--ros-args", "-r", f"__ns:={value('namespace')}"]
    for parameter in parameters:
        command += ["-p", parameter]
    return ExecuteProcess(cmd=command, name=name, output="screen")


def processes(context):
    mission, store, bag = (LaunchConfiguration(name).perform(context) for name in ("mission", "store", "bag"))
    flies = f"mission:={mission}"
    peers = "guidance,request_manager,planner"
    recorder = []
    if bag:
        peers += ",recorder"
        words = ["record", "--use-sim-time", "--manifest", mission, "--output", bag]
        recorder = [node(context, "recorder", "swath-bag", words)]
    flight = [
        node(context, "requests", "swath-requests", parameters=[flies] + ([f"store:={store}"] if store else [])),
        node(context, "planner", "swath-planner", parameters=[flies]),
        node(context, "guidance", "swath-guidance", parameters=[flies]),
        node(context, "spacecraft", "swath-spacecraft", parameters=[flies, f"wait_for:={peers}"]),
    ]
    # A mission without one of its nodes is no mission.
    ends = [
        RegisterEventHandler(OnProcessExit(target_action=process, on_exit=[EmitEvent(event=Shutdown())]))
        for process in recorder + flight
    ]
    return recorder + flight + ends


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("mission", description="Mission file (TOML)."),
        DeclareLaunchArgument("store", default_value="", description="Store of the requests (SQLite); none if empty."),
        DeclareLaunchArgument("bag", default_value="", description="Folder to record a bag into; none if empty."),
        DeclareLaunchArgument("bin", default_value=programs(), description="Folder of the programs."),
        DeclareLaunchArgument("namespace", default_value="/swath", description="Namespace of the nodes."),
        OpaqueFunction(function=processes),
    ])
