//! Ticks of the radio in turn.

use swath_mission::file::Mission;
use swath_mission::link::channel::Channel;
use swath_mission::link::end::Sent;
use swath_mission::link::radio::{Direction, Radio};
use swath_sim::time::Tick;

use super::logic::LinkLogic;

fn link(text: &str) -> (LinkLogic, Radio, Tick) {
    let mission: Mission = toml::from_str(&format!("orbits = 3.0\n[link]\n{text}\n")).unwrap();
    let model = mission.model().unwrap();
    let radio = Radio::of(&mission, &model).unwrap().unwrap();
    let horizon = mission.horizon(&model);
    (LinkLogic::new(Channel::new(radio.clone()), horizon), radio, horizon)
}

fn frame(bytes: &[u8]) -> Sent {
    Sent { bytes: bytes.to_vec(), air_ticks: 0 }
}

#[test]
fn between_passes_time_jumps_and_a_frame_is_heard_once_at_its_tick() {
    let (mut link, radio, horizon) = link("stations = [\"merritt\", \"santiago\"]");
    let (rise, set) = radio.contacts().all().iter().map(|it| (it.rise, it.set)).find(|it| it.0 > Tick(0)).unwrap();
    let (mut turns, mut heard) = (Vec::new(), Vec::new());
    loop {
        let up = link.turn(Direction::Up).unwrap();
        assert_eq!(link.turn(Direction::Up), Some(up.clone()), "it is told again until it is answered");
        let pause = turns.last().is_some_and(|last: &Tick| last.after(1) != up.tick);
        assert_eq!(link.turn(Direction::Down).is_none(), pause, "after a pause the satellite is there first");
        turns.push(up.tick);
        heard.extend(up.frames.iter().map(|bytes| (up.tick, bytes.clone())));
        assert_eq!(up.open, radio.open(up.tick));
        link.on_sent(Direction::Down, up.tick, Vec::new());
        // What comes twice, late or early counts once, or not at all.
        link.on_sent(Direction::Down, up.tick, vec![frame(b"again")]);
        link.on_sent(Direction::Up, up.tick.after(1), vec![frame(b"early")]);
        assert!(link.turn(Direction::Up).is_none() && link.turn(Direction::Down).unwrap().frames.is_empty());
        let sent = if up.tick == rise { vec![frame(b"hello")] } else { Vec::new() };
        link.on_sent(Direction::Up, up.tick, sent);
        if up.tick == horizon {
            break;
        }
        assert_eq!(link.turn(Direction::Up).unwrap().tick, up.next);
    }
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].0 > rise && heard[0].0 < rise.after(4) && heard[0].1 == b"hello", "{heard:?}");
    assert!((rise.0..set.0).all(|tick| turns.contains(&Tick(tick))));
    assert_eq!((turns.first(), turns.last()), (Some(&Tick(0)), Some(&horizon)));
    let open = (0..=horizon.0).filter(|tick| radio.open(Tick(*tick))).count();
    assert!(turns.len() < open + 10, "{} turns, {open} ticks at which it is open", turns.len());
}
