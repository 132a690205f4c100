//! What ranks counted, as a table.

use std::fmt::Write;

use crate::traffic::Traffic;
use crate::worker::Counted;

/// Bytes of a node's position in a message.
const PLACE: f64 = 24.0;

/// Ghosts that a cube of so many nodes has in two layers on its six sides and beyond its edges: what no
/// partition of a large body into equal parts can be much below.
fn least_ghosts(own: f64) -> f64 {
    (own.cbrt() + 4.0).powi(3) - own
}

/// A row per rank: nodes, ghosts, and what an exchange of them cost.
/// Then what went between rank 0 and the others besides steps.
pub(crate) fn table(counted: &[Counted], traffic: &[Traffic; Traffic::KINDS]) -> String {
    let mut text = String::from(
        "rank      nodes     ghosts  ghosts/cube  messages/step  bytes/step  bytes/ghost  \
         bytes/node  forces s  exchange s  estimates s\n",
    );
    for (rank, found) in counted.iter().enumerate() {
        let each = found.exchanges.max(1.0);
        let _ = writeln!(
            text,
            "{rank:4} {:10} {:10} {:12.2} {:14.1} {:11.0} {:12.1} {:11.0} {:9.3} {:11.3} {:12.3}",
            found.own,
            found.ghosts,
            found.ghosts / least_ghosts(found.own.max(1.0)),
            found.messages / each,
            found.bytes / each,
            found.bytes / each / found.ghosts.max(1.0),
            found.heap / found.own.max(1.0),
            found.in_forces,
            found.in_exchange,
            found.in_estimates,
        );
    }
    let sent: f64 = counted
        .iter()
        .map(|found| found.bytes / found.exchanges.max(1.0))
        .sum();
    let ghosts: f64 = counted.iter().map(|found| found.ghosts).sum();
    let _ = writeln!(
        text,
        "sent per step by all ranks: {sent:.0} bytes; {PLACE} bytes for each of {ghosts} ghosts are {:.0}",
        PLACE * ghosts
    );
    let kinds = [
        "models given",
        "changes of models given",
        "states given",
        "states brought",
    ];
    for (what, traffic) in kinds.iter().zip(traffic) {
        let Traffic {
            times,
            spent,
            bytes,
        } = traffic;
        let spent = spent.as_secs_f64();
        let _ = writeln!(
            text,
            "{what}: {times} times, {spent:.3} s, {bytes} bytes in all"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_two_layers_round_it() {
        assert!((least_ghosts(1000.0) - (14.0_f64.powi(3) - 1000.0)).abs() < 1e-6);
        let one = Counted {
            own: 1000.0,
            ghosts: 1744.0,
            exchanges: 2.0,
            messages: 6.0,
            bytes: 4800.0,
            ..Counted::default()
        };
        let text = table(&[one], &[Traffic::default(); Traffic::KINDS]);
        assert!(text.contains("1.00") && text.contains("3.0"), "{text}");
        assert!(text.contains("2400 bytes"), "{text}");
    }
}
