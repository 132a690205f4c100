//! Threads that stay awake over a step.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    /// Whether this thread takes a step, or looks for work of one.
    static TAKEN: Cell<bool> = const { Cell::new(false) };
}

/// That the thread is taken, until dropped.
struct Taken(());

impl Taken {
    fn take() -> Option<Self> {
        (!TAKEN.replace(true)).then_some(Self(()))
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        TAKEN.set(false);
    }
}

/// Runs `work`, a step or several, while the other threads of the `rayon` pool look for parts of it.
///
/// Between two passes of a step they would fall asleep, and waking takes longer than a pass does. Outside of a pool and within
/// work that is awake it only runs `work`. Not for work without parallel passes: it keeps all threads busy.
///
/// # Examples
/// ```
/// let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
/// let sum: u32 = pool.install(|| phyxel_integrate::awake(|| (0..10).sum()));
/// assert_eq!(sum, 45);
/// # Ok::<(), rayon::ThreadPoolBuildError>(())
/// ```
pub fn awake<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    if rayon::current_thread_index().is_none() {
        return work();
    }
    let Some(_taken) = Taken::take() else {
        return work();
    };
    let done = AtomicBool::new(false);
    rayon::scope(|scope| {
        for _ in 1..rayon::current_num_threads() {
            scope.spawn(|_| attend(&done));
        }
        // Also if the work panics.
        let _end = End(&done);
        work()
    })
}

/// Not on a thread that is taken: two steps in one pool would wait for each other.
fn attend(done: &AtomicBool) {
    let Some(_taken) = Taken::take() else { return };
    while !done.load(Ordering::Acquire) {
        if rayon::yield_now() != Some(rayon::Yield::Executed) {
            // Other programs may need the core.
            std::thread::yield_now();
        }
    }
}

struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    /// A thread that takes a step waits for no other one, and is free after it, also where that panics.
    #[test]
    fn steps_do_not_wait_for_each_other() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
        let pool = pool.build().unwrap();
        pool.install(|| {
            let never = AtomicBool::new(false);
            awake(|| attend(&never));
            let fails = || awake(|| panic!("at work"));
            assert!(catch_unwind(fails).is_err());
            assert!(!TAKEN.get());
        });
    }

    /// It gives what the work gives, shared out or not, and ends where that panics.
    #[test]
    fn all_of_the_work_is_done_once() {
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            let sum = || {
                let halves = rayon::join(|| 1, || awake(|| 2));
                halves.0 + halves.1
            };
            assert_eq!(awake(sum), 3);
            assert_eq!(pool.install(|| awake(sum)), 3);
            let fails = || pool.install(|| awake(|| panic!("at work")));
            assert!(catch_unwind(AssertUnwindSafe(fails)).is_err());
        }
    }
}
