//! What waits to be sent to one client.
//!
//! Messages that build a client's picture of the scene are queued in order. A state replaces the one
//! that waits, and waits itself until the client has acknowledged the one before: a client that is
//! slow, hidden or gone makes nobody wait and fills no memory.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Bytes that may wait for a client before it counts as gone.
const MOST_BYTES: usize = 96 << 20;

/// One message on its way; clients share its bytes.
#[derive(Debug, Clone)]
pub(crate) enum Outgoing {
    Text(Arc<str>),
    Binary(Arc<Vec<u8>>),
    /// Bytes of a control frame that the reading side has made.
    Raw(Vec<u8>),
    Ping,
    Close,
}

impl Outgoing {
    fn bytes(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Binary(bytes) => bytes.len(),
            Self::Raw(bytes) => bytes.len(),
            Self::Ping | Self::Close => 0,
        }
    }
}

#[derive(Debug, Default)]
struct Waiting {
    queue: VecDeque<Outgoing>,
    bytes: usize,
    state: Option<(u32, Arc<Vec<u8>>)>,
    in_flight: Option<u32>,
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
        // Nothing that runs under the lock can leave it half done.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Queues a message. A client for whom too much waits is closed.
    pub(crate) fn push(&self, message: Outgoing) {
        let mut waiting = self.lock();
        waiting.bytes += message.bytes();
        waiting.queue.push_back(message);
        if waiting.bytes > MOST_BYTES {
            waiting.queue.clear();
            waiting.bytes = 0;
            waiting.closed = true;
        }
        drop(waiting);
        self.changed.notify_one();
    }

    /// Puts a state in place of the one that waits.
    pub(crate) fn put_state(&self, number: u32, state: Arc<Vec<u8>>) {
        self.lock().state = Some((number, state));
        self.changed.notify_one();
    }

    /// Whether a state would be sent at once.
    pub(crate) fn wants_state(&self) -> bool {
        let waiting = self.lock();
        waiting.in_flight.is_none() && waiting.state.is_none() && !waiting.closed
    }

    /// The client has drawn the state of this number.
    pub(crate) fn acknowledge(&self, number: u32) {
        let mut waiting = self.lock();
        if waiting.in_flight == Some(number) {
            waiting.in_flight = None;
        }
        drop(waiting);
        self.changed.notify_one();
    }

    /// Forgets states: a new epoch begins.
    pub(crate) fn forget_states(&self) {
        let mut waiting = self.lock();
        waiting.state = None;
        waiting.in_flight = None;
    }

    /// Ends the client.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_one();
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
                waiting.bytes -= message.bytes();
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

    fn state(byte: u8) -> Arc<Vec<u8>> {
        Arc::new(vec![byte])
    }

    fn next(mailbox: &Mailbox) -> Option<Vec<u8>> {
        match mailbox.next(Duration::ZERO)? {
            Outgoing::Binary(bytes) => Some(bytes.to_vec()),
            Outgoing::Ping => None,
            other => unreachable!("{other:?} was not sent"),
        }
    }

    #[test]
    fn one_state_is_in_flight_and_the_newest_follows() {
        let mailbox = Mailbox::default();
        assert!(mailbox.wants_state());
        mailbox.put_state(1, state(1));
        assert_eq!(next(&mailbox), Some(vec![1]));
        mailbox.put_state(2, state(2));
        mailbox.put_state(3, state(3));
        assert_eq!(next(&mailbox), None, "the first is not acknowledged");
        mailbox.acknowledge(7);
        assert_eq!(next(&mailbox), None, "another was acknowledged");
        // What is queued does not wait for states.
        mailbox.push(Outgoing::Binary(state(9)));
        assert_eq!(next(&mailbox), Some(vec![9]));
        mailbox.acknowledge(1);
        assert_eq!(next(&mailbox), Some(vec![3]), "the newest, not the second");
    }

    #[test]
    fn a_client_that_takes_nothing_is_closed_not_waited_for() {
        let mailbox = Mailbox::default();
        let large = Arc::new(vec![0; 16 << 20]);
        for _ in 0..7 {
            mailbox.push(Outgoing::Binary(Arc::clone(&large)));
        }
        assert!(mailbox.next(Duration::ZERO).is_none(), "it is closed");
        assert_eq!(mailbox.lock().queue.len(), 0);
    }
}
