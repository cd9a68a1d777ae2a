"""Launches the nodes of a mission under ROS 2: ros2 launch nodes/launch/swath.launch.py mission:=FILE [bin:=FOLDER]."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution

NODES = ["requests", "planner", "guidance", "spacecraft"]


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument("mission", description="Mission file (TOML)."),
        DeclareLaunchArgument("bin", default_value="target/release", description="Folder of the programs."),
        DeclareLaunchArgument("namespace", default_value="/swath", description="Namespace of the nodes."),
    ]
    processes = [
        ExecuteProcess(
            cmd=[
                PathJoinSubstitution([LaunchConfiguration("bin"), f"swath-{name}"]),
                "--ros-args",
                "-r", ["__ns:=", LaunchConfiguration("namespace")],
                "-p", ["mission:=", LaunchConfiguration("mission")],
            ],
            name=name,
            output="screen",
        )
        for name in NODES
    ]
    # A mission without one of its nodes is no mission.
    ends = [
        RegisterEventHandler(OnProcessExit(target_action=process, on_exit=[EmitEvent(event=Shutdown())]))
        for process in processes
    ]
    return LaunchDescription(arguments + processes + ends)
