//! Ctrl-C, or the system's request to end, which the run loop follows between two steps.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Whether someone asked to stop; clones share one flag.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    /// Looks that are left before it asks by itself.
    left: Option<Arc<AtomicU64>>,
}

impl Interrupt {
    /// Asks by itself when it has been looked at `looks` times: a run stops at a step that is known beforehand.
    #[must_use]
    pub fn after(looks: u64) -> Self {
        Self {
            asked: Arc::default(),
            left: Some(Arc::new(AtomicU64::new(looks))),
        }
    }

    /// Looks that are left of [`Self::after`].
    #[must_use]
    pub fn left(&self) -> Option<u64> {
        self.left.as_ref().map(|left| left.load(Ordering::SeqCst))
    }

    /// Asks to stop, from any thread.
    pub fn ask(&self) {
        self.asked.store(true, Ordering::SeqCst);
    }

    /// Starts to listen to Ctrl-C and to the system's request that the program end (SIGTERM, SIGHUP): the
    /// first sets the flag, so that the run can write a checkpoint and end; the second ends the program
    /// at once. Every call shares one flag. Where the system does not let the program listen, either
    /// ends it at once, as without this.
    #[must_use]
    pub fn listen() -> Self {
        static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
        let asked = FLAG.get_or_init(|| {
            let flag = Arc::new(AtomicBool::new(false));
            let seen = Arc::clone(&flag);
            let listening = ctrlc::set_handler(move || {
                if seen.swap(true, Ordering::SeqCst) {
                    // 128 + SIGINT, as shells report it.
                    std::process::exit(130);
                }
            });
            drop(listening);
            flag
        });
        Self {
            asked: Arc::clone(asked),
            left: None,
        }
    }

    /// Whether someone asked to stop.
    #[must_use]
    pub fn asked(&self) -> bool {
        let over = self.left.as_ref().is_some_and(|left| {
            let one_less = |left: u64| left.checked_sub(1);
            left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, one_less)
                .is_err()
        });
        over || self.asked.load(Ordering::SeqCst)
    }
}
