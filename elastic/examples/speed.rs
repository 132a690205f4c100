//! Time of one force evaluation against the number of nodes, with the memory-traffic bound of the
//! same run: `cargo run --release -p phyxel-elastic --example speed [-- nodes...]`.
#![allow(clippy::print_stdout, reason = "prints a table")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "sizes of a benchmark are small"
)]

use std::time::Instant;

use glam::DVec3;
use testkit::block::Block;
use testkit::cloud::Random;

mod body;

/// Best of repeated timings in seconds, one warm-up first: what other programs on the machine take
/// away is not the subject.
fn best_time(budget: f64, mut work: impl FnMut()) -> f64 {
    work();
    let start = Instant::now();
    let (mut best, mut count) = (f64::INFINITY, 0);
    while count < 5 || (start.elapsed().as_secs_f64() < budget && count < 400) {
        let begin = Instant::now();
        work();
        best = best.min(begin.elapsed().as_secs_f64());
        count += 1;
    }
    best
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads").install(work)
}

fn main() {
    let mut sizes: Vec<usize> = std::env::args()
        .skip(1)
        .map(|n| n.parse().expect("a node count"))
        .collect();
    if sizes.is_empty() {
        sizes = vec![1_000, 6_000, 30_000, 100_000, 1_000_000];
    }
    println!(
        "Force evaluation (gradients, neo-Hookean stress, hourglass stabilization, forces, energy)."
    );
    println!("read: time to read once, front to back, as many bytes as the model holds.\n");
    println!(
        "| nodes | pairs/node | order | ms, 1 thread | ms, 2 threads | ns/pair | ns/node | tangent ms | bytes/node | read ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for size in sizes {
        let side = (size as f64).cbrt().round() as usize;
        let planes = |[x, y, z]: [usize; 3]| (z, y, x);
        let mut orders = vec![
            ("Morton", Block::eighteen([side; 3], 0.1)),
            ("planes", Block::eighteen_in_order([side; 3], 0.1, planes)),
        ];
        if size > 6_000 {
            // Columns of 16 by 16 nodes, plane after plane: what a node needs of its neighbours
            // stays in a window that a second-level cache holds.
            let columns = |[x, y, z]: [usize; 3]| (x / 16, y / 16, z, y, x);
            let block = Block::eighteen_in_order([side; 3], 0.1, columns);
            orders.push(("columns", block));
        }
        for (order, block) in &orders {
            row(block, order);
        }
    }
}

fn row(block: &Block, order: &str) {
    let mut body = body::body(block);
    let mut random = Random::new(1);
    let x: Vec<DVec3> = block
        .positions
        .iter()
        .map(|x| *x * 1.02 + random.vector(0.002))
        .collect();
    let mut f = vec![DVec3::ZERO; x.len()];
    let mut time = |threads: usize| {
        on_threads(threads, || {
            best_time(0.6, || {
                std::hint::black_box(body.forces_into(&x, &mut f));
            })
        })
    };
    let (one, two) = (time(1), time(2));
    let sum: DVec3 = f.iter().sum();
    let size: f64 = f.iter().map(|f| f.length()).sum();
    assert!(
        sum.length() <= 1e-13 * size,
        "forces sum to {sum} of {size} N"
    );
    let tangent = on_threads(1, || {
        best_time(0.3, || body.tangent_product_into(&x, &mut f))
    });
    let words = vec![1.0_f64; body.bytes().all / 8];
    let read = best_time(0.2, || {
        let mut sum = [0.0; 8];
        for eight in words.chunks_exact(8) {
            for k in 0..8 {
                sum[k] += eight[k];
            }
        }
        std::hint::black_box(sum);
    });
    println!(
        "| {} | {:.1} | {order} | {:.3} | {:.3} | {:.2} | {:.0} | {:.3} | {} | {:.3} |",
        body.node_count(),
        body.pair_count() as f64 / body.node_count() as f64,
        one * 1e3,
        two * 1e3,
        one * 1e9 / body.pair_count() as f64,
        one * 1e9 / body.node_count() as f64,
        tangent * 1e3,
        body.bytes().all / body.node_count(),
        read * 1e3
    );
}
