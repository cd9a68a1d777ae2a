//! Two ends over a channel that loses, doubles, reorders and damages, between passes and kills.

use std::collections::BTreeMap;

use proptest::prelude::*;
use swath_sim::rng;
use swath_sim::time::Tick;

use super::end::{Arrival, End, Kept, Rates};
use super::frame::{CLASSES, Item};

/// Rates of a slow radio: 800 bit a tick up, 4000 down, frames that take up to 3 ticks.
fn rates() -> [Rates; 2] {
    [Rates::new(800, 4000, 3, 20), Rates::new(4000, 800, 3, 20)]
}

/// A channel that does what channels do, and worse.
#[derive(Clone, Debug)]
struct Weather {
    loss: f64,
    double: f64,
    damage: f64,
    /// Ticks by which a frame may be late.
    jitter: u64,
    /// Length of a pass and of the gap after it [ticks].
    pass: (u64, u64),
    /// Probability that an end is killed at a tick.
    kill: f64,
    seed: u64,
}

/// Both ends, what is under way to each, and what each has handed on and kept.
struct Air {
    ends: [End; 2],
    under_way: [BTreeMap<(u64, u64), Vec<u8>>; 2],
    came: [Vec<Vec<Item>>; 2],
    kept: [(Kept, Vec<Vec<Item>>); 2],
    pushed: [Vec<Vec<Item>>; 2],
    count: u64,
}

impl Air {
    fn new() -> Self {
        let none = || vec![Vec::new(); CLASSES];
        Self {
            ends: rates().map(End::new),
            under_way: Default::default(),
            came: [none(), none()],
            kept: [(Kept::default(), none()), (Kept::default(), none())],
            pushed: [none(), none()],
            count: 0,
        }
    }

    fn push(&mut self, side: usize, class: usize, item: Item) {
        self.ends[side].push(class, item.clone());
        self.pushed[side][class].push(item);
        self.keep(side);
    }

    /// What is written down: all at once.
    fn keep(&mut self, side: usize) {
        self.kept[side] = (self.ends[side].kept(), self.came[side].clone());
    }

    fn kill(&mut self, side: usize) {
        let (kept, came) = self.kept[side].clone();
        self.ends[side] = End::restored(rates()[side], kept);
        self.came[side] = came;
    }

    fn step(&mut self, tick: u64, weather: &Weather, rng: &mut rng::Rng) {
        use rand::RngExt as _;
        for side in [0, 1] {
            while let Some(entry) = self.under_way[side].first_entry().filter(|it| it.key().0 <= tick) {
                let bytes = entry.remove();
                for Arrival { class, number, item } in self.ends[side].hear(Tick(tick), &bytes).unwrap_or_default() {
                    assert_eq!(number as usize, self.came[side][class].len(), "in order and once");
                    self.came[side][class].push(item);
                }
            }
            // A process dies before or after it has written down what came.
            if rng.random::<f64>() < weather.kill {
                self.kill(side);
            }
            self.keep(side);
        }
        let open = tick % (weather.pass.0 + weather.pass.1) < weather.pass.0;
        for side in [0, 1] {
            if !open {
                continue;
            }
            for sent in self.ends[side].transmit(Tick(tick)) {
                let copies = 1 + usize::from(rng.random::<f64>() < weather.double);
                for _ in 0..copies {
                    let late = 1 + sent.air_ticks + rng.random_range(0..=weather.jitter);
                    let mut bytes = sent.bytes.clone();
                    if rng.random::<f64>() < weather.damage {
                        let at = rng.random_range(0..bytes.len());
                        bytes[at] ^= 1 << rng.random_range(0..8);
                    }
                    if rng.random::<f64>() >= weather.loss {
                        self.count += 1;
                        self.under_way[1 - side].insert((tick + late, self.count), bytes);
                    }
                }
            }
            if rng.random::<f64>() < weather.kill {
                self.kill(side);
            }
        }
    }

    fn all_came(&self) -> bool {
        (0..2).all(|side| self.came[1 - side] == self.pushed[side])
    }
}

fn weather() -> impl Strategy<Value = Weather> {
    let share = |max: f64| (0..=10u32).prop_map(move |tenth| f64::from(tenth) * max / 10.0);
    (share(0.7), share(0.5), share(0.2), 0..8u64, (40..200u64, 0..200u64), share(0.03), any::<u64>()).prop_map(
        |(loss, double, damage, jitter, pass, kill, seed)| Weather { loss, double, damage, jitter, pass, kill, seed },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn every_item_arrives_once_and_in_order_whatever_the_channel_does(
        weather in weather(),
        items in prop::collection::vec((0..2usize, 0..CLASSES, 0..60usize, 0..2000u64, 0..2000u64), 0..40),
    ) {
        let mut air = Air::new();
        let mut rng = rng::stream(weather.seed, 0);
        let mut to_come = items;
        to_come.sort_by_key(|it| std::cmp::Reverse(it.4));
        let mut tick = 0;
        while !to_come.is_empty() || !air.all_came() {
            while let Some((side, class, length, data_bits, _)) = to_come.pop_if(|it| it.4 <= tick) {
                let bytes = (0..length).map(|at| (at * 7 + to_come.len()) as u8).collect();
                air.push(side, class, Item { bytes, data_bits });
            }
            air.step(tick, &weather, &mut rng);
            tick += 1;
            prop_assert!(tick < 3_000_000, "not all came");
        }
        // And nothing more comes.
        for more in tick..tick + 1000 {
            air.step(more, &weather, &mut rng);
        }
        prop_assert!(air.all_came());
    }
}

const CALM: Weather =
    Weather { loss: 0.0, double: 0.0, damage: 0.0, jitter: 0, pass: (800, 10_000), kill: 0.0, seed: 1 };

#[test]
fn a_pass_carries_what_it_could() {
    // 400 s at 64 kbit/s and 2 Hz, with orders of 110 bytes.
    let bits = 32_000;
    for (loss, least) in [(0.0, 0.9), (0.1, 0.9 * 0.9), (0.5, 0.8 * 0.5)] {
        let mut air = Air::new();
        air.ends = [End::new(Rates::new(bits, 100 * bits, 1, 120)), End::new(Rates::new(100 * bits, bits, 1, 120))];
        for _ in 0..60_000 {
            air.ends[0].push(1, Item { bytes: vec![7; 110], data_bits: 0 });
        }
        let weather = Weather { loss, ..CALM };
        let mut rng = rng::stream(2, 0);
        (0..900).for_each(|tick| air.step(tick, &weather, &mut rng));
        let carried = air.came[1][1].len() as f64 * 880.0 / (800 * bits) as f64;
        assert!((least..=1.0).contains(&carried), "loss {loss}: {carried} of the pass");
    }
}

#[test]
fn what_is_urgent_overtakes() {
    let mut air = Air::new();
    for _ in 0..50 {
        air.push(0, 2, Item { bytes: vec![1; 100], data_bits: 0 });
    }
    let mut rng = rng::stream(3, 0);
    (0..4).for_each(|tick| air.step(tick, &CALM, &mut rng));
    air.push(0, 0, Item { bytes: vec![2], data_bits: 0 });
    let came = |air: &Air, class: usize| air.came[1][class].len();
    let mut tick = 4;
    while came(&air, 0) == 0 {
        air.step(tick, &CALM, &mut rng);
        tick += 1;
    }
    assert!(came(&air, 2) < 40, "{} came before", came(&air, 2));
}

#[test]
fn between_passes_nothing_is_sent_again_and_nothing_is_lost() {
    let mut air = Air::new();
    let weather = Weather { pass: (30, 5000), ..CALM };
    let mut rng = rng::stream(4, 0);
    for _ in 0..100 {
        air.push(0, 1, Item { bytes: vec![3; 100], data_bits: 0 });
    }
    let mut sent = Vec::new();
    for tick in 0..5030 * 6 {
        air.step(tick, &weather, &mut rng);
        if tick % 5030 == 5029 {
            sent.push(air.ends[0].counts().sent);
        }
    }
    assert!(air.all_came());
    // 100 items of 100 bytes are a dozen frames; what is cut off at the end of a pass is sent again.
    assert!(sent[5] < 60, "{sent:?}");
}

#[test]
fn a_clock_that_is_ahead_is_counted_and_believed_nothing() {
    let [up, down] = rates();
    let (mut one, mut two) = (End::new(up), End::new(down));
    one.push(0, Item { bytes: vec![1], data_bits: 0 });
    let frame = one.transmit(Tick(1000)).remove(0).bytes;
    assert_eq!(two.hear(Tick(999), &frame), Ok(Vec::new()));
    assert_eq!((two.counts().ahead, two.counts().heard), (1, 0));
    assert_eq!(two.hear(Tick(1001), &frame).unwrap().len(), 1);
    assert!(two.hear(Tick(1001), &frame[1..]).unwrap_err().to_string().contains("is damaged"));
    assert_eq!(two.counts().damaged, 1);
}

#[test]
fn what_came_early_and_was_lost_with_a_process_is_sent_again() {
    let mut air = Air::new();
    // The first of three frames is lost, the others wait for it on the other side, which says so and dies.
    for _ in 0..3 {
        air.push(0, 1, Item { bytes: vec![5; 1000], data_bits: 0 });
    }
    let (mut frames, mut tick) = (Vec::new(), 0);
    while frames.len() < 3 {
        frames.extend(air.ends[0].transmit(Tick(tick)));
        tick += 1;
    }
    for frame in &frames[1..] {
        assert_eq!(air.ends[1].hear(Tick(tick), &frame.bytes), Ok(Vec::new()));
    }
    for answer in air.ends[1].transmit(Tick(tick)) {
        air.ends[0].hear(Tick(tick), &answer.bytes).unwrap();
    }
    air.kill(1);
    let mut rng = rng::stream(5, 0);
    for more in tick + 1..tick + 300 {
        air.step(more, &CALM, &mut rng);
    }
    assert!(air.all_came());
}
