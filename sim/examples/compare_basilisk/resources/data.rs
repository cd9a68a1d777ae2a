//! Instruments, storage and transmitter as Basilisk has them: its partitions, packets and quirks.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use serde::Deserialize;
use swath_sim::time::Tick;
use swath_sim::world::contacts::Contacts;

use super::access::Site;
use super::bus::is_on;
use super::read::Input;
use super::{Check, Comparison};

#[derive(Deserialize)]
struct Instrument {
    name: String,
    rate_bps: f64,
    on: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct TransmitterMeta {
    rate_bps: f64,
    packet_bits: f64,
    on: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct StorageMeta {
    kind: String,
    capacity_bits: f64,
    #[serde(default)]
    partitions: Vec<String>,
    #[serde(default)]
    initial: BTreeMap<String, i64>,
}

/// The one partition of a simple storage unit.
const SIMPLE: &str = "STORED DATA";

/// Partitions by name, in the order in which they came.
#[derive(Clone, Default)]
struct Unit {
    parts: Vec<(String, i64)>,
    capacity: f64,
    simple: bool,
}

/// What a node adds: name and rate [bit/s], negative for what is sent.
type Node = (String, f64);

impl Unit {
    fn sum(&self) -> i64 {
        self.parts.iter().map(|(_, bits)| bits).sum()
    }

    /// Adds what all nodes make in a step [s].
    fn add(&mut self, nodes: &[Node], step: f64) {
        let before = self.sum();
        for (name, rate) in nodes {
            let bits = rate * step;
            let sum = if self.simple { before } else { self.sum() };
            let fits = sum as f64 + bits.round() <= self.capacity || *rate < 0.0;
            let index = if self.simple { 0 } else { self.index(name).unwrap_or(usize::MAX) };
            match self.parts.get_mut(index) {
                Some((_, stored)) if fits => {
                    *stored = if *stored as f64 + bits >= 0.0 { *stored + bits.round() as i64 } else { 0 };
                }
                Some(_) => {}
                // The first node creates the simple unit's partition, and its data of that tick are skipped.
                None if self.simple => self.parts.push((SIMPLE.to_owned(), 0)),
                None if fits && !name.is_empty() => self.parts.push((name.clone(), bits.round() as i64)),
                None => {}
            }
        }
    }

    fn index(&self, name: &str) -> Option<usize> {
        self.parts.iter().position(|(part, _)| part == name)
    }
}

/// spaceToGroundTransmitter.
struct Transmitter {
    meta: TransmitterMeta,
    name: String,
    /// Bits of the packet that were sent.
    packet: f64,
    previous_s: f64,
}

impl Transmitter {
    /// What it sends at a time [s] out of the parts stored one tick ago.
    fn node(&mut self, time_s: f64, stored: &[(String, i64)], access: bool) -> Node {
        if !is_on(&self.meta.on, time_s) {
            return (String::new(), 0.0);
        }
        let step = time_s - self.previous_s;
        self.previous_s = time_s;
        let mut rate = -self.meta.rate_bps;
        if self.packet >= self.meta.packet_bits {
            self.packet = 0.0;
        }
        let (mut most, mut chosen) = (-1.0, None);
        if self.packet != 0.0 {
            let current = stored.iter().find(|(name, _)| *name == self.name);
            (most, chosen) = current.map_or((-1.0, None), |it| (it.1 as f64, Some(it)));
            if most <= 0.0 {
                (chosen, self.packet, rate) = (None, 0.0, 0.0);
            }
        }
        if self.packet == 0.0 {
            for part in stored {
                if part.1 as f64 > most {
                    (most, chosen) = (part.1 as f64, Some(part));
                }
            }
        }
        let Some(chosen) = chosen.filter(|_| access) else {
            self.packet = 0.0;
            return (self.name.clone(), 0.0);
        };
        if self.packet == 0.0 {
            self.name.clone_from(&chosen.0);
            if most < self.meta.packet_bits {
                return (self.name.clone(), 0.0);
            }
        }
        self.packet += self.meta.rate_bps * step;
        (self.name.clone(), rate)
    }
}

pub fn data(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let (config, orbit, period) = (meta.config()?, meta.orbit()?, meta.period()?);
    let (sites, mask): (Vec<Site>, f64) = (meta.get("stations")?, meta.number("mask_deg")?);
    let stations: Vec<_> = sites.iter().map(|site| site.station(mask, -1.0)).collect();
    let count: u64 = meta.get("ticks")?;
    let contacts = Contacts::new(&stations, &config, &orbit, period, Tick(count));
    let instruments: Vec<Instrument> = meta.get("instruments")?;
    let transmitter_meta: TransmitterMeta = meta.get("transmitter")?;
    let mut transmitter = Transmitter { meta: transmitter_meta, name: String::new(), packet: 0.0, previous_s: 0.0 };
    let storage: StorageMeta = meta.get("storage")?;
    if storage.kind != "partitioned" && storage.kind != "simple" {
        bail!("unknown storage `{}`", storage.kind);
    }
    let parts = storage.partitions.iter().map(|it| (it.clone(), storage.initial.get(it).copied().unwrap_or(0)));
    let mut unit = Unit { parts: parts.collect(), capacity: storage.capacity_bits, simple: storage.kind == "simple" };
    let names: Vec<String> = meta.get("partition_names")?;
    let ticks = data.ticks(period)?;
    let (access, rates, sent_names): (Vec<u8>, Vec<f64>, Vec<String>) =
        (data.get("any_access")?, data.get("transmitter_baud")?, data.get("transmitter_data_name")?);
    let (levels, stored): (Vec<i64>, Vec<Vec<Option<i64>>>) = (data.get("storage_level")?, data.get("stored")?);
    let mut checks = ["access", "rate", "name", "level", "partitions", "totals"].map(|it| Check::new(it, 0.0));
    let (mut row, mut status, mut sending, mut highest) = (0, Vec::new(), 0.0, 0);
    let differs = |different: bool| f64::from(u8::from(different));
    for tick in 0..count {
        let time_s = tick as f64 * period.seconds();
        let heard = contacts.any(Tick(tick));
        let mut nodes: Vec<Node> = instruments
            .iter()
            .map(|it| if is_on(&it.on, time_s) { (it.name.clone(), it.rate_bps) } else { (String::new(), 0.0) })
            .collect();
        let node = transmitter.node(time_s, &status, heard);
        nodes.push(node.clone());
        unit.add(&nodes, if tick == 0 { 0.0 } else { period.seconds() });
        status.clone_from(&unit.parts);
        sending += differs(node.1 != 0.0);
        highest = highest.max(unit.sum());
        if ticks.get(row).is_some_and(|it| it.0 == tick) {
            checks[0].add(f64::from(u8::from(heard)), f64::from(access[row]));
            checks[1].add(node.1, rates[row]);
            checks[2].add(differs(node.0 != sent_names[row]), 0.0);
            checks[3].add(unit.sum() as f64, levels[row] as f64);
            let ours: Vec<Option<i64>> =
                names.iter().map(|name| unit.index(name).map(|index| unit.parts[index].1)).collect();
            checks[4].add(differs(ours != stored[row]), 0.0);
            row += 1;
        }
    }
    checks[5].add(unit.sum() as f64, meta.number("end_level_bits")?);
    checks[5].add(highest as f64, meta.number("max_level_bits")?);
    checks[5].add(sending, meta.number("ticks_transmitting")?);
    Ok(Comparison { rows: row, checks: checks.into() })
}
