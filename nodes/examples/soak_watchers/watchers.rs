//! Those who look at a mission: readers of the console's facts, and clients of Foxglove's protocol.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

/// All who look; each ends when its server does.
#[derive(Default)]
pub struct Watchers {
    told: Arc<AtomicU64>,
    threads: Vec<JoinHandle<()>>,
    stuck: Vec<TcpStream>,
}

impl Watchers {
    /// A reader of the console's facts.
    pub fn read_facts(&mut self, address: &str) -> Result<()> {
        let mut stream = TcpStream::connect(address)?;
        stream.write_all(format!("GET /api/facts HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes())?;
        self.discard(stream);
        Ok(())
    }

    /// A client of Foxglove that wants every topic; one that is stuck takes nothing of them.
    pub fn take_topics(&mut self, address: &str, stuck: bool) -> Result<()> {
        let mut stream = TcpStream::connect(address)?;
        stream.set_read_timeout(Some(Duration::from_secs(10)))?;
        let head = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                    Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        stream.write_all(format!("GET / HTTP/1.1\r\nHost: {address}\r\n{head}").as_bytes())?;
        let mut answer = Vec::new();
        while !answer.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).context("no answer of the bridge")?;
            answer.push(byte[0]);
        }
        ensure!(answer.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&answer));
        let channels = loop {
            let said: Value = serde_json::from_slice(&frame(&mut stream)?).unwrap_or_default();
            if said["op"] == "advertise" {
                break said["channels"].as_array().cloned().unwrap_or_default();
            }
        };
        let wish = |channel: &Value| json!({ "id": channel["id"], "channelId": channel["id"] });
        let subscriptions: Vec<_> = channels.iter().map(wish).collect();
        say(&mut stream, &json!({ "op": "subscribe", "subscriptions": subscriptions }).to_string())?;
        if stuck {
            self.stuck.push(stream)
        } else {
            self.discard(stream)
        }
        Ok(())
    }

    fn discard(&mut self, mut stream: TcpStream) {
        let told = Arc::clone(&self.told);
        self.threads.push(std::thread::spawn(move || {
            // Of this thread: it shares the processors with the mission, which whoever looks from elsewhere does not.
            let _ = rustix::process::nice(19);
            let mut piece = vec![0; 1 << 16];
            // Until its server has ended.
            let _ = stream.set_read_timeout(None);
            while let Ok(count @ 1..) = stream.read(&mut piece) {
                told.fetch_add(count as u64, Ordering::Relaxed);
            }
        }));
    }

    /// How much all were told [B], once the servers have ended.
    pub fn told(self) -> u64 {
        for thread in self.threads {
            // One that has panicked has said so.
            let _ = thread.join();
        }
        self.told.load(Ordering::Relaxed)
    }
}

/// The payload of the next frame (RFC 6455); servers do not mask.
fn frame(stream: &mut TcpStream) -> Result<Vec<u8>> {
    let mut head = [0; 2];
    stream.read_exact(&mut head)?;
    let length = match head[1] & 0x7f {
        126 => {
            let mut length = [0; 2];
            stream.read_exact(&mut length)?;
            usize::from(u16::from_be_bytes(length))
        }
        127 => {
            let mut length = [0; 8];
            stream.read_exact(&mut length)?;
            usize::try_from(u64::from_be_bytes(length))?
        }
        length => usize::from(length),
    };
    let mut payload = vec![0; length];
    stream.read_exact(&mut payload)?;
    Ok(payload)
}

/// Sends a text as a client does, masked with nothing.
fn say(stream: &mut TcpStream, text: &str) -> Result<()> {
    let length = u16::try_from(text.len()).context("a text of more than 64 kB")?;
    let mut frame = vec![0x81, 0x80 | 126];
    frame.extend(length.to_be_bytes());
    frame.extend([0; 4]);
    frame.extend(text.as_bytes());
    Ok(stream.write_all(&frame)?)
}
