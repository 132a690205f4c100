//! Who may come in: single-use codes, the session's token, where a request says it comes from.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::http::{Request, only};
use crate::locked;

/// Random bytes of a code or a token: not to be guessed.
const SECRET_BYTES: usize = 16;
/// Time for which a code is good.
const CODE_LIFE: Duration = Duration::from_secs(3600);
/// Codes that may be good at a time; the oldest gives way.
const MOST_CODES: usize = 16;

/// Codes and the token.
#[derive(Debug)]
pub(crate) struct Gate {
    token: String,
    codes: Mutex<Vec<(String, Instant)>>,
}

impl Gate {
    /// A gate with a new token and no code.
    pub(crate) fn new() -> Result<Self, getrandom::Error> {
        Ok(Self {
            token: secret()?,
            codes: Mutex::new(Vec::new()),
        })
    }

    /// A new code, good for one exchange.
    pub(crate) fn code(&self) -> Result<String, getrandom::Error> {
        let code = secret()?;
        let mut codes = locked(&self.codes);
        codes.retain(|(_, made)| made.elapsed() < CODE_LIFE);
        if codes.len() == MOST_CODES {
            codes.remove(0);
        }
        codes.push((code.clone(), Instant::now()));
        Ok(code)
    }

    /// The token for a code, which is good no more, or for the token itself: who has it learns whether the
    /// session is still the same.
    pub(crate) fn exchange(&self, code: &str) -> Option<&str> {
        if self.knows(code) {
            return Some(&self.token);
        }
        let mut codes = locked(&self.codes);
        let known = codes
            .iter()
            .position(|(known, made)| same(known, code) && made.elapsed() < CODE_LIFE)?;
        codes.remove(known);
        Some(&self.token)
    }

    /// Whether someone has the token.
    pub(crate) fn knows(&self, token: &str) -> bool {
        same(&self.token, token)
    }
}

/// Whether a request is for this machine by a name that only it has, and does not come from a page
/// of someone else. Names that others may point here (DNS rebinding) are refused.
pub(crate) fn is_from_here(request: &Request) -> bool {
    let Some(host) = only(request, "host") else {
        return false;
    };
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    };
    if !["127.0.0.1", "localhost", "[::1]"].contains(&name) {
        return false;
    }
    let fits = |name: &str, good: &dyn Fn(&str) -> bool| {
        !request.headers().contains_key(name) || only(request, name).is_some_and(good)
    };
    // Programs send no origin; browsers always do when they open a socket.
    fits("origin", &|origin| {
        origin.strip_prefix("http://") == Some(host)
    }) && fits("sec-fetch-site", &|site| {
        site == "same-origin" || site == "none"
    })
}

fn secret() -> Result<String, getrandom::Error> {
    let mut bytes = [0; SECRET_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Compares in a time that does not tell where two secrets differ.
fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let differ = a.iter().zip(b).fold(0, |sum, (a, b)| sum | (a ^ b));
    a.len() == b.len() && differ == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_codes_give_way() {
        let gate = Gate::new().expect("random numbers");
        let first = gate.code().expect("a code");
        for _ in 0..MOST_CODES {
            gate.code().expect("a code");
        }
        assert!(gate.exchange(&first).is_none());
    }

    #[test]
    fn foreign_names_and_pages_are_refused() {
        let fits = |lines: &str| {
            let text = format!("GET / HTTP/1.1\r\n{lines}\r\n");
            is_from_here(&crate::http::parsed(text.as_bytes()).expect("a head"))
        };
        for good in [
            "Host: 127.0.0.1:8080\r\n",
            "Host: localhost:9\r\nOrigin: http://localhost:9\r\n",
            "Host: [::1]:80\r\nSec-Fetch-Site: none\r\n",
        ] {
            assert!(fits(good), "{good}");
        }
        for bad in [
            "",
            "Host: evil.example:8080\r\n",
            "Host: 127.0.0.1.evil.example\r\n",
            "Host: localhost:1\r\nHost: localhost:1\r\n",
            "Host: localhost:1\r\nOrigin: http://localhost:2\r\n",
            "Host: localhost:1\r\nOrigin: https://localhost:1\r\n",
            "Host: localhost:1\r\nOrigin: null\r\n",
            "Host: localhost:1\r\nOrigin: http://localhost:1\r\nOrigin: http://localhost:1\r\n",
            "Host: localhost:1\r\nSec-Fetch-Site: cross-site\r\n",
            "Host: localhost:1\r\nSec-Fetch-Site: same-site\r\n",
        ] {
            assert!(!fits(bad), "{bad}");
        }
    }
}
