//! What waits to be sent to one client.
//!
//! Messages that build a client's picture of the scene are queued in order. A state replaces the one
//! that waits, and waits itself until the client has acknowledged the one before. A client for whom too
//! much waits is sent no more until it has taken that, and then everything again: who is slow, hidden or
//! gone makes nobody wait and fills no memory.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::locked;

/// Bytes of changes that may wait for a client before it falls behind.
const MOST_BYTES: usize = 16 << 20;

/// One message on its way; clients share its bytes.
#[derive(Debug, Clone)]
pub(crate) enum Outgoing {
    Text(Arc<str>),
    Binary(Arc<Vec<u8>>),
    /// Bytes of a control frame that the reading side has made.
    Raw(Vec<u8>),
    Ping,
    /// The answer to a client that closes, which went before.
    Close,
    /// The session ends.
    End,
}

impl Outgoing {
    fn bytes(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Binary(bytes) => bytes.len(),
            Self::Raw(bytes) => bytes.len(),
            Self::Ping | Self::Close | Self::End => 0,
        }
    }
}

#[derive(Debug, Default)]
struct Waiting {
    queue: VecDeque<Outgoing>,
    bytes: usize,
    state: Option<(u32, Arc<Vec<u8>>)>,
    in_flight: Option<u32>,
    /// Whether changes were left out.
    behind: bool,
    closed: bool,
}

/// The messages of one client.
#[derive(Debug, Default)]
pub(crate) struct Mailbox {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

impl Mailbox {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        locked(&self.waiting)
    }

    /// Changes what waits, and wakes who sends it.
    fn change(&self, change: impl FnOnce(&mut Waiting)) {
        change(&mut self.lock());
        self.changed.notify_one();
    }

    /// Queues a message. Changes of the scene are left out from where too many wait.
    pub(crate) fn push(&self, message: Outgoing) {
        self.change(|waiting| {
            let bytes = waiting.bytes + message.bytes();
            if matches!(message, Outgoing::Binary(_)) {
                waiting.behind |= bytes > MOST_BYTES;
                if waiting.behind {
                    return;
                }
            }
            waiting.bytes = bytes;
            waiting.queue.push_back(message);
        });
    }

    /// Queues all of a scene, however much it is: what waits of an earlier one is out of date.
    pub(crate) fn begin(&self, scene: impl IntoIterator<Item = Outgoing>) {
        self.change(|waiting| {
            let mut queue = std::mem::take(&mut waiting.queue);
            queue.retain(|message| !matches!(message, Outgoing::Binary(_)));
            queue.extend(scene);
            *waiting = Waiting {
                queue,
                closed: waiting.closed,
                ..Waiting::default()
            };
        });
    }

    /// Whether changes were left out and all that waited has been taken: it is time for the whole scene.
    pub(crate) fn has_caught_up(&self) -> bool {
        let waiting = self.lock();
        waiting.behind && waiting.queue.is_empty()
    }

    /// Replaces the state that waits.
    pub(crate) fn put_state(&self, number: u32, state: Arc<Vec<u8>>) {
        self.change(|waiting| waiting.state = Some((number, state)));
    }

    /// Whether a state would be sent at once.
    pub(crate) fn wants_state(&self) -> bool {
        let waiting = self.lock();
        waiting.in_flight.is_none() && waiting.state.is_none() && !waiting.closed
    }

    /// The client has drawn the state of this number.
    pub(crate) fn acknowledge(&self, number: u32) {
        self.change(|waiting| waiting.in_flight = waiting.in_flight.filter(|own| *own != number));
    }

    /// Lets the client know that the session ends, before all that waits.
    pub(crate) fn end(&self) {
        self.change(|waiting| waiting.queue = [Outgoing::End].into());
    }

    /// Ends the client.
    pub(crate) fn close(&self) {
        self.change(|waiting| waiting.closed = true);
    }

    /// The next message; a ping after `patience` without one, `None` at the end.
    pub(crate) fn next(&self, patience: Duration) -> Option<Outgoing> {
        let until = Instant::now() + patience;
        let mut waiting = self.lock();
        loop {
            if waiting.closed {
                return None;
            }
            if let Some(message) = waiting.queue.pop_front() {
                waiting.bytes = waiting.bytes.saturating_sub(message.bytes());
                return Some(message);
            }
            if waiting.in_flight.is_none()
                && let Some((number, state)) = waiting.state.take()
            {
                waiting.in_flight = Some(number);
                return Some(Outgoing::Binary(state));
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Some(Outgoing::Ping);
            }
            let result = self.changed.wait_timeout(waiting, left);
            waiting = result.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_that_takes_nothing_falls_behind_and_begins_again() {
        let mailbox = Mailbox::default();
        let large = |byte| Outgoing::Binary(Arc::new(vec![byte; 6 << 20]));
        // A scene may be as large as it is.
        mailbox.begin((0..4).map(large));
        (4..9).for_each(|byte| mailbox.push(large(byte)));
        mailbox.push(Outgoing::Text("note".into()));
        let firsts = |mailbox: &Mailbox| {
            let taken = std::iter::from_fn(|| match mailbox.next(Duration::ZERO)? {
                Outgoing::Binary(bytes) => Some(u32::from(bytes[0])),
                Outgoing::Text(_) => Some(100),
                _ => None,
            });
            taken.collect::<Vec<_>>()
        };
        assert!(!mailbox.has_caught_up(), "it has taken nothing");
        assert_eq!(firsts(&mailbox), [0, 1, 2, 3, 4, 5, 100], "no more changes");
        assert!(mailbox.has_caught_up());
        mailbox.push(large(9));
        // A change of what it does not have.
        assert_eq!(firsts(&mailbox), [0; 0]);
        mailbox.begin([large(10)]);
        mailbox.push(large(11));
        mailbox.begin([large(12)]);
        assert!(!mailbox.has_caught_up());
        assert_eq!(firsts(&mailbox), [12], "what came before is out of date");
    }
}
