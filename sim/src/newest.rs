//! A value whose newest version may be elsewhere.

use std::sync::{Mutex, OnceLock, PoisonError};

/// A value that is brought here by whoever reads it first, once it was left behind.
#[derive(Debug)]
pub(crate) struct Newest<T> {
    here: OnceLock<T>,
    behind: Mutex<Option<T>>,
}

impl<T> Newest<T> {
    pub(crate) fn new(value: T) -> Self {
        Self {
            here: OnceLock::from(value),
            behind: Mutex::new(None),
        }
    }

    pub(crate) fn is_here(&self) -> bool {
        self.here.get().is_some()
    }

    /// The value, which `bring` brings here if it is behind; it must not read this value.
    pub(crate) fn get(&self, bring: impl FnOnce(&mut T)) -> &T {
        self.here.get_or_init(|| {
            let mut behind = self.behind.lock().unwrap_or_else(PoisonError::into_inner);
            // In its place: it stays there if this panics.
            behind.as_mut().map(bring);
            behind.take().expect("it is here or behind")
        })
    }

    /// Reads of the value, here or behind, what is the same in both.
    pub(crate) fn peek<R>(&self, read: impl FnOnce(&T) -> R) -> R {
        if let Some(value) = self.here.get() {
            return read(value);
        }
        let behind = self.behind.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = &*behind {
            return read(value);
        }
        drop(behind);
        // Another thread is bringing it.
        read(self.get(|_| ()))
    }

    /// The value as it is, here or behind.
    pub(crate) fn as_it_is(&mut self) -> &mut T {
        let behind = self.behind.get_mut();
        let behind = behind.unwrap_or_else(PoisonError::into_inner).as_mut();
        (self.here.get_mut().or(behind)).expect("it is here or behind")
    }

    /// From now on the newest version is elsewhere.
    pub(crate) fn leave_behind(&mut self) {
        if let Some(value) = self.here.take() {
            self.behind = Mutex::new(Some(value));
        }
    }

    /// The value as it is becomes the newest version.
    pub(crate) fn take_up(&mut self) -> &mut T {
        self.get(|_| ());
        self.as_it_is()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_brought_once_after_it_was_left_behind() {
        let mut value = Newest::new(1);
        assert_eq!(*value.get(|_| panic!("it is here")), 1);
        value.leave_behind();
        value.leave_behind();
        assert!(!value.is_here() && value.peek(|v| *v) == 1);
        *value.as_it_is() = 2;
        assert_eq!(*value.get(|v| *v += 5), 7);
        assert_eq!(*value.get(|_| panic!("it was brought")), 7);
        value.leave_behind();
        *value.take_up() += 1;
        assert_eq!(*value.get(|_| panic!("it was taken up")), 8);
    }

    /// Whoever reads while another thread brings it waits for it.
    #[test]
    fn threads_see_it_before_or_after() {
        for _ in 0..100 {
            let mut value = Newest::new(0);
            value.leave_behind();
            let value = &value;
            std::thread::scope(|scope| {
                scope.spawn(|| assert_eq!(*value.get(|v| *v = 1), 1));
                let seen = value.peek(|v| *v);
                assert!(seen == 0 || seen == 1);
                assert_eq!(*value.get(|v| *v = 1), 1);
            });
        }
    }
}
