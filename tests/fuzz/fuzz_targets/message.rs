//! A client's message to the page's server: understood or left aside.
#![no_main]

use libfuzzer_sys::fuzz_target;
use phyxel_live::Control;

fuzz_target!(|bytes: &[u8]| {
    let _ = serde_json::from_slice::<Control>(bytes);
});
