//! The generated interfaces: hashes, schema texts, defaults and the bytes on the wire.

use cdr_encoding::{from_bytes, to_vec};
use serde::Serialize;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::geometry_msgs::{Quaternion, Vector3};
use swath_msgs::sensor_msgs::NavSatStatus;
use swath_msgs::std_msgs::Header;
use swath_msgs::swath_msgs::{
    Decision, DecisionPoint, SpacecraftState, StripStatus, SubmitStrips, SubmitStripsRequest, TaskResult, WheelTorque,
};
use swath_msgs::{Interface, RosMessage, RosService, lifecycle_msgs, rcl_interfaces, schema_for, type_hash_for};

fn cdr(message: &impl Serialize) -> Vec<u8> {
    to_vec::<_, byteorder::LittleEndian>(message).unwrap()
}

fn read<M: RosMessage>(bytes: &[u8]) -> Result<M, cdr_encoding::Error> {
    from_bytes::<M, byteorder::LittleEndian>(bytes).map(|(message, _)| message)
}

fn round_trip<M: RosMessage>(message: &M) {
    assert_eq!(&read::<M>(&cdr(message)).unwrap(), message);
}

/// Hashes as ROS 2 Jazzy's tools and its bags give them.
#[test]
fn type_hashes_are_those_of_ros_2() {
    for (type_name, hash) in [
        ("std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
        ("std_msgs/msg/Header", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"),
        ("builtin_interfaces/msg/Time", "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"),
        ("rosgraph_msgs/msg/Clock", "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"),
        ("rcl_interfaces/msg/Log", "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"),
        ("rcl_interfaces/msg/ParameterEvent", "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"),
        ("service_msgs/msg/ServiceEventInfo", "41bcbbe07a75c9b52bc96bfd5c24d7f0fc0a08c0cb7921b3373c5732345a6f45"),
        ("tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
        ("sensor_msgs/msg/NavSatFix", "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"),
        ("sensor_msgs/msg/BatteryState", "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741"),
        ("sensor_msgs/msg/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"),
        ("diagnostic_msgs/msg/DiagnosticArray", "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"),
        ("lifecycle_msgs/msg/State", "dd2d02b82f3ebc858e53c431b1e6e91f3ffc71436fc81d0715214ac6ee2107a0"),
        ("lifecycle_msgs/msg/TransitionEvent", "d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38"),
        (
            "lifecycle_msgs/msg/TransitionDescription",
            "c5f1cd4bb1ad2ba0e3329d4ac7015c52a674a72c1faf7974c37a33f4f6048b28",
        ),
        // Ours, as PyPI `rosbags` computes them from the same files.
        ("swath_msgs/msg/Activity", "c164712359937c3ab6cc65a776db223ed2d5931270fb0f55fadfdaf6d395ebc6"),
        ("swath_msgs/msg/ResourceState", "0bc5f0af7799b0da55dbe586b89ced166d9a231d4d06e006c0e89e97b18677d3"),
        ("swath_msgs/msg/SpacecraftState", "b3c8ea426bb6a2a03cb18783bb8f78a7cbbb840432c23bb528c60a0dd0a95d21"),
        ("swath_msgs/msg/WheelTorque", "ca7578161bb3dca5662b2282469f9254d5ead42e57ab993a2e8691adb2de295b"),
        ("swath_msgs/msg/DecisionPoint", "1fb85392e11262746c1bb21d49a785718f78e85b0a6881a7bc80a9df22ac68d0"),
        ("swath_msgs/msg/StripReport", "c258448b77b7a230a9c5f0ce6ea791529830dd879ea121f32c2dc172ff2582e0"),
        ("swath_msgs/msg/PlannerStatus", "693426a82532062a8b00ee5e42990f5cf4ae24c3595d168cefbb1cc1fc42e501"),
        ("swath_msgs/msg/Decision", "6cf2e48f3726d92af6cb2751a1f9f66fc0e245b7cf45938fba0eeedc9f0e6219"),
        ("swath_msgs/msg/StandingAlarms", "73fcc18a42bdcf338356ef212b5d62b8a7bbc7687c52759ecc5c2a2ded7e6079"),
        ("swath_msgs/msg/AlarmEvent", "34c0791c3ef9652609ec8b24ed54fe5cda353bbc0411eb92cc67edb5d80601ba"),
        ("swath_msgs/msg/UpcomingStrips", "85f1f6c705dd469a2336343601f3c88e50235420c6d1857e61fa7d695185ed23"),
        ("swath_msgs/msg/RadioTurn", "0d5ae29134beb6cca4c232ec639711d9c75f5b7c9f4cd5e338a61bb536422d0e"),
        ("swath_msgs/msg/RadioSent", "e50156d72018b015195c9a477934b47981b1d37db532dc2571e933d4518f1829"),
        ("swath_msgs/msg/CatalogueHeard", "c65b2c6553479c4c9a2f76cbf73a55ca122911fb83e26deeac5d0a3bb20b78d2"),
        ("swath_msgs/msg/GuidanceReached", "c8d07605150eb9370beaeb5485879bf9a913b7efc0ec53d0a23883df4ab10dd9"),
        ("swath_msgs/msg/LinkStatus", "13dd719b2832603116f9dfc6e4be46de48c1f6400cbfc463ca43c241425356d4"),
        ("swath_msgs/msg/PredictedPlan", "3b075fa6869b637ea775570c6668f3ab299e41f23344635d0ce430be40abbf20"),
        ("swath_msgs/msg/StripWay", "e94987f3a20918abc68b5e7e48ce9d9386199e617680be417775d2873d335b08"),
    ] {
        assert_eq!(type_hash_for(type_name), Some(format!("RIHS01_{hash}").as_str()), "{type_name}");
    }
    assert_eq!(
        rcl_interfaces::GetParameters::TYPE_HASH,
        "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"
    );
    assert_eq!(
        rcl_interfaces::SetParameters::TYPE_HASH,
        "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0"
    );
    assert_eq!(
        lifecycle_msgs::ChangeState::TYPE_HASH,
        "RIHS01_356fe34f0475a43acf54542013af4167b0e729f77ea22ffb045c6ad8e20668e5"
    );
    assert_eq!(
        lifecycle_msgs::GetAvailableTransitions::TYPE_HASH,
        "RIHS01_59b7ecefce0982a8a844b9f2c4f14764c1c4543cc55e72924e2aa4adad83e9bc"
    );
}

#[test]
fn interfaces_are_found_by_name() {
    let interface = Interface::find("swath_msgs/msg/SpacecraftState").unwrap();
    assert_eq!(*interface, Interface::of::<SpacecraftState>());
    assert_eq!(Interface::find("swath_msgs/msg/Nothing"), None);
    assert_eq!(schema_for("nonsense"), None);
    let names: Vec<_> = Interface::all().iter().map(|interface| interface.type_name).collect();
    assert!(names.is_sorted() && names.contains(&"std_msgs/msg/Header"));
    assert_eq!(SubmitStrips::TYPE_NAME, "swath_msgs/srv/SubmitStrips");
    assert_eq!(SubmitStripsRequest::TYPE_NAME, "swath_msgs/srv/SubmitStrips_Request");
    assert_eq!(SubmitStripsRequest::NAME, "SubmitStrips_Request");
}

#[test]
fn schema_is_the_text_then_each_dependency_once() {
    let file = |path: &str| std::fs::read_to_string(format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let rule = "=".repeat(80);
    let expected = format!(
        "{}{rule}\nMSG: builtin_interfaces/Time\n{}{rule}\nMSG: geometry_msgs/Vector3\n{}{rule}\nMSG: std_msgs/Header\n{}{rule}\n\
         MSG: swath_msgs/ResourceState\n{}",
        file("msg/SpacecraftState.msg"),
        file("standard/builtin_interfaces/msg/Time.msg"),
        file("standard/geometry_msgs/msg/Vector3.msg"),
        file("standard/std_msgs/msg/Header.msg"),
        file("msg/ResourceState.msg"),
    );
    assert_eq!(SpacecraftState::SCHEMA, expected);
}

#[test]
fn cmake_builds_every_interface_file() {
    let root = env!("CARGO_MANIFEST_DIR");
    let cmake = std::fs::read_to_string(format!("{root}/CMakeLists.txt")).unwrap();
    let mut listed: Vec<String> =
        cmake.lines().filter_map(|line| line.trim().strip_prefix('"')?.strip_suffix('"').map(str::to_owned)).collect();
    listed.sort();
    let mut files = Vec::new();
    for kind in ["msg", "srv"] {
        for entry in std::fs::read_dir(format!("{root}/{kind}")).unwrap() {
            files.push(format!("{kind}/{}", entry.unwrap().file_name().to_string_lossy()));
        }
    }
    files.sort();
    assert_eq!(listed, files);
}

#[test]
fn defaults_are_those_of_the_files() {
    assert_eq!(Quaternion::default(), Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 });
    assert_eq!(NavSatStatus::default().status, NavSatStatus::STATUS_UNKNOWN);
    assert_eq!(WheelTorque::default().phase, WheelTorque::PHASE_HOLD);
    assert_eq!(StripStatus::STATE_FULFILLED_BY_LINK, 12);
}

/// Texts have a length with a closing zero; numbers are aligned to their size; arrays have no length.
#[test]
fn state_has_the_bytes_that_cdr_prescribes() {
    let vector = |x| Vector3 { x, y: x + 1.0, z: x + 2.0 };
    let state = SpacecraftState {
        header: Header { stamp: Time { sec: 7, nanosec: 500_000_000 }, frame_id: "N".to_owned() },
        tick: 15,
        r_bn_n: vector(1.0),
        v_bn_n: vector(4.0),
        sigma_bn: [7.0, 8.0, 9.0],
        omega_bn_b: vector(10.0),
        wheel_speed: [13.0, 14.0, 15.0],
        wheel_torque: [16.0, 17.0, 18.0],
        resources: Vec::new(),
    };
    let mut expected = Vec::new();
    expected.extend(7_i32.to_le_bytes());
    expected.extend(500_000_000_u32.to_le_bytes());
    expected.extend(2_u32.to_le_bytes());
    expected.extend([b'N', 0, 0, 0]);
    expected.extend(15_u64.to_le_bytes());
    for value in 1..=18_u8 {
        expected.extend(f64::from(value).to_le_bytes());
    }
    // No resources.
    expected.extend(0_u32.to_le_bytes());
    assert_eq!(cdr(&state), expected);
    round_trip(&state);
}

#[test]
fn bounded_sequence_and_flags_have_the_bytes_that_cdr_prescribes() {
    let mut point = DecisionPoint { mission_over: true, ..DecisionPoint::default() };
    point.result.push(TaskResult { task: 3, success: true, ..TaskResult::default() });
    let bytes = cdr(&point);
    // Header 16 (empty frame: 4 + 1 zero, padded), tick, task, then the state, whose resources are none (4 zero, padded).
    let before_flag = 16 + 8 + 8 + (16 + 8 + 18 * 8 + 8) + 9 * 8;
    assert_eq!(bytes[before_flag..before_flag + 8], [1, 0, 0, 0, 1, 0, 0, 0]);
    assert_eq!(bytes[before_flag + 8..before_flag + 16], 3_u64.to_le_bytes());
    round_trip(&point);
}

#[test]
fn beyond_its_bound_nothing_is_written_or_read() {
    let mut point = DecisionPoint { result: vec![TaskResult::default(); 2], ..Default::default() };
    let error = to_vec::<_, byteorder::LittleEndian>(&point).unwrap_err();
    assert!(error.to_string().contains("length 2 exceeds the bound 1"), "{error}");
    point.result.clear();
    let mut bytes = cdr(&point);
    let length = bytes.len() - 4;
    bytes[length] = 2;
    bytes.extend(vec![0; 400]);
    assert!(read::<DecisionPoint>(&bytes).is_err());

    let decision = Decision { policy_hash: "f".repeat(64), ..Decision::default() };
    round_trip(&decision);
    let decision = Decision { policy_hash: "f".repeat(65), ..Decision::default() };
    let error = to_vec::<_, byteorder::LittleEndian>(&decision).unwrap_err();
    assert!(error.to_string().contains("length 65 exceeds the bound 64"), "{error}");
}

#[test]
fn truncated_messages_are_errors() {
    let bytes = cdr(&StripStatus { client_ref: "delta".to_owned(), ..StripStatus::default() });
    for length in 0..bytes.len() {
        assert!(read::<StripStatus>(&bytes[..length]).is_err(), "{length} bytes were read");
    }
}
