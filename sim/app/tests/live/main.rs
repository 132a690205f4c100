//! Sessions with a user: as a program drives them, and as someone at a browser does.
#![allow(
    clippy::missing_assert_message,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a failing test names its line; what is skipped or measured is said"
)]

mod browser;
mod chromium;
mod page;
mod session;
mod shown;
