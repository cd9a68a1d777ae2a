//! Service servers and clients over a pair of topics.
//!
//! The middlewares of ROS 2 disagree on how a response names its request. [`Mapping::Cyclone`]
//! puts the client and a number before the message; [`Mapping::Enhanced`] (Fast DDS, Connext) puts
//! them into the DDS sample's header.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use ros2_client::{Gid, RmwRequestId};
use rustdds::{SampleIdentity, SequenceNumber};
use serde::{Deserialize, Serialize};
use swath_msgs::{RosMessage, RosService};

use crate::cdr::Cdr;
use crate::endpoint::{RawPublisher, RawSample, RawSubscription};
use crate::environment::Mapping;
use crate::error::RosError;
use crate::message::{decode, decode_as, encode, encode_as};
use crate::replies::{AllReplies, Replies, Reply};
use crate::rtps::{Prefix, prefix_of};
use crate::signal::Signal;

/// Names a request among all requests of all clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequestId {
    /// The client's process.
    process: Prefix,
    request: RmwRequestId,
}

/// A message with the header that [`Mapping::Cyclone`] puts before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Framed<M> {
    /// The second half of the client's identity.
    client: [u8; 8],
    number: i64,
    message: M,
}

impl RequestId {
    fn new(client: Gid, number: i64) -> Self {
        Self::from(RmwRequestId { writer_gid: client, sequence_number: number })
    }

    fn second_half(self) -> [u8; 8] {
        std::array::from_fn(|index| self.request.writer_gid.as_bytes()[8 + index])
    }
}

impl From<RmwRequestId> for RequestId {
    fn from(request: RmwRequestId) -> Self {
        Self { process: prefix_of(request.writer_gid), request }
    }
}

impl Mapping {
    fn wrap<M: RosMessage>(self, id: RequestId, message: M) -> Result<Cdr, RosError> {
        match self {
            Self::Cyclone => {
                let framed = Framed { client: id.second_half(), number: id.request.sequence_number, message };
                encode_as(M::TYPE_NAME, &framed)
            }
            Self::Enhanced => encode(&message),
        }
    }

    /// The identity that goes beside a response, in its sample's header. With [`Mapping::Cyclone`] it is in the message;
    /// beside it, RustDDS would fill datagrams beyond what UDP takes, and no response over 64 kB would arrive.
    fn beside(self, id: RequestId) -> Option<SampleIdentity> {
        (self == Self::Enhanced).then(|| id.request.into())
    }

    /// Takes a request or response apart. `client` is whose first half of the identity counts.
    fn unwrap<M: RosMessage>(self, sample: &RawSample, client: Gid) -> Result<(RequestId, M), RosError> {
        match self {
            Self::Cyclone => {
                let framed: Framed<M> = decode_as(M::TYPE_NAME, &sample.cdr)?;
                let mut named = *client.as_bytes();
                named[8..].copy_from_slice(&framed.client);
                let request = RmwRequestId { writer_gid: named.into(), sequence_number: framed.number };
                Ok((RequestId { process: prefix_of(client), request }, framed.message))
            }
            Self::Enhanced => {
                let own = RmwRequestId { writer_gid: sample.info.writer, sequence_number: sample.info.sequence_number };
                let mut id = sample.info.related.map_or(own, RmwRequestId::from);
                if id.sequence_number == i64::from(SequenceNumber::UNKNOWN) {
                    id.sequence_number = own.sequence_number;
                }
                Ok((id.into(), decode(&sample.cdr)?))
            }
        }
    }
}

/// Serves a service.
pub struct Server<S> {
    requests: RawSubscription,
    responses: Arc<Replies>,
    mapping: Mapping,
    service: PhantomData<fn() -> S>,
}

impl<S: RosService> Server<S> {
    pub(crate) fn new(requests: RawSubscription, responses: RawPublisher, mapping: Mapping, all: &AllReplies) -> Self {
        let responses = Arc::new(Replies::new(responses));
        all.add(&responses);
        Self { requests, responses, mapping, service: PhantomData }
    }

    /// The next request, if there is one; it is answered with [`Self::respond`].
    ///
    /// Once it has returned nothing, the next request to come raises the node's [`Signal`].
    ///
    /// Bytes that are no such request are passed over and counted (`Node::notices`).
    ///
    /// # Errors
    /// When DDS fails.
    pub fn take(&self) -> Result<Option<(RequestId, S::Request)>, RosError> {
        while let Some(sample) = self.requests.take()? {
            match self.mapping.unwrap(&sample, sample.info.writer) {
                Ok(request) => return Ok(Some(request)),
                Err(error) => self.requests.note_unreadable(|| error.to_string()),
            }
        }
        Ok(None)
    }

    /// Answers a request.
    ///
    /// The response is sent when the client's reader is matched, or after two seconds.
    ///
    /// # Errors
    /// When the response cannot be encoded, or DDS fails.
    pub fn respond(&self, id: RequestId, response: S::Response) -> Result<(), RosError> {
        let cdr = self.mapping.wrap(id, response)?;
        self.responses.send(Reply::new(id.process, cdr, self.mapping.beside(id)))
    }

    /// Answers all requests that have come, and returns how many.
    ///
    /// # Errors
    /// When a response cannot be encoded, or DDS fails.
    pub fn answer_all(&self, mut answer: impl FnMut(S::Request) -> S::Response) -> Result<usize, RosError> {
        let mut answered = 0;
        while let Some((id, request)) = self.take()? {
            self.respond(id, answer(request))?;
            answered += 1;
        }
        Ok(answered)
    }

    pub(crate) fn set_signal(&mut self, signal: &Signal) {
        self.requests.set_signal(signal);
    }
}

/// Calls a service.
pub struct Client<S> {
    requests: RawPublisher,
    responses: RawSubscription,
    mapping: Mapping,
    signal: Signal,
    service: String,
    next: AtomicI64,
    kind: PhantomData<fn() -> S>,
}

impl<S: RosService> Client<S> {
    pub(crate) fn new(
        service: String,
        requests: RawPublisher,
        mut responses: RawSubscription,
        mapping: Mapping,
    ) -> Self {
        let signal = Signal::new();
        responses.set_signal(&signal);
        let next = AtomicI64::new(1);
        Self { requests, responses, mapping, signal, service, next, kind: PhantomData }
    }

    /// Sends a request, and returns the id that its response will have.
    ///
    /// # Errors
    /// When the request cannot be encoded, or DDS fails.
    pub fn send(&self, request: S::Request) -> Result<RequestId, RosError> {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let id = RequestId::new(self.requests.gid(), number);
        let cdr = self.mapping.wrap(id, request)?;
        let sent = self.requests.send(cdr, None)?;
        Ok(match self.mapping {
            Mapping::Cyclone => id,
            Mapping::Enhanced => RmwRequestId::from(sent).into(),
        })
    }

    /// The next response to a request of this client, if there is one.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn take(&self) -> Result<Option<(RequestId, S::Response)>, RosError> {
        let own = self.requests.gid();
        while let Some(sample) = self.responses.take()? {
            match self.mapping.unwrap(&sample, own) {
                Ok((id, response)) if id.request.writer_gid == own => return Ok(Some((id, response))),
                // Meant for another client.
                Ok(_) => {}
                Err(error) => self.responses.note_unreadable(|| error.to_string()),
            }
        }
        Ok(None)
    }

    /// Sends a request and waits for its response.
    ///
    /// # Errors
    /// If no response comes in that time; the server may have received the request nevertheless.
    pub fn call(&self, request: S::Request, timeout: Duration) -> Result<S::Response, RosError> {
        self.call_repeatedly(request, timeout, timeout)
    }

    /// Sends a request once in each interval until one of them is answered, however late: only for requests that do no
    /// harm when they come twice.
    ///
    /// # Errors
    /// If no response comes in that time; the server may have received the request nevertheless.
    pub fn call_repeatedly(
        &self,
        request: S::Request,
        interval: Duration,
        timeout: Duration,
    ) -> Result<S::Response, RosError> {
        let begin = Instant::now();
        let mut sent = vec![self.send(request.clone())?];
        loop {
            while let Some((answered, response)) = self.take()? {
                if sent.contains(&answered) {
                    return Ok(response);
                }
            }
            let waited = begin.elapsed();
            if waited >= timeout {
                return Err(RosError::NoAnswer { service: self.service.clone(), waited: timeout });
            }
            let due = interval.saturating_mul(sent.len() as u32);
            if waited >= due {
                sent.push(self.send(request.clone())?);
            }
            self.signal.wait(due.min(timeout).saturating_sub(waited));
        }
    }

    /// Whether a server is matched in both directions.
    pub fn matched(&self) -> bool {
        self.requests.matched() > 0 && self.responses.matched() > 0
    }

    /// Fully qualified name of the service.
    pub fn service(&self) -> &str {
        &self.service
    }
}

#[cfg(test)]
mod tests {
    use swath_msgs::std_msgs::String as Text;

    use super::*;
    use crate::endpoint::SampleInfo;

    fn sample(cdr: Cdr, related: Option<SampleIdentity>) -> RawSample {
        let writer = Gid::from(std::array::from_fn(|index| index as u8));
        let info = SampleInfo { source_time_ns: None, received_time_ns: 0, writer, sequence_number: 5, related };
        RawSample { cdr, info }
    }

    #[test]
    fn cyclone_frames_carry_client_and_number_before_the_message() {
        let client = Gid::from(std::array::from_fn(|index| index as u8));
        let id = RequestId::new(client, 7);
        let text = Text { data: "a".to_owned() };
        let cdr = Mapping::Cyclone.wrap(id, text.clone()).unwrap();
        let expected =
            [&[0, 1, 0, 0][..], &[8, 9, 10, 11, 12, 13, 14, 15], &7_i64.to_le_bytes(), &[2, 0, 0, 0, b'a', 0]].concat();
        assert_eq!(cdr.as_bytes(), expected);
        let read = Mapping::Cyclone.unwrap::<Text>(&sample(cdr, None), client).unwrap();
        assert_eq!(read, (id, text));
    }

    #[test]
    fn enhanced_requests_are_named_by_the_sample() {
        let text = Text { data: "a".to_owned() };
        let id = RequestId::new([9; 16].into(), 7);
        let cdr = Mapping::Enhanced.wrap(id, text.clone()).unwrap();
        assert_eq!(cdr, encode(&text).unwrap());
        let unwrap = |related| {
            let sample = sample(cdr.clone(), related);
            Mapping::Enhanced.unwrap::<Text>(&sample, Gid::ZERO).unwrap().0
        };
        assert_eq!(unwrap(Some(id.request.into())), id);
        assert_eq!(unwrap(None).request.sequence_number, 5);
        let unknown = RmwRequestId { sequence_number: SequenceNumber::UNKNOWN.into(), ..id.request };
        assert_eq!(unwrap(Some(unknown.into())), RequestId::new(id.request.writer_gid, 5));
    }
}
