//! Runs the program under limits of time and memory.

use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// Processor time and memory that the program may take for a body below 1e5 nodes.
pub(crate) const SECONDS: f64 = 10.0;
pub(crate) const BYTES: f64 = (1_u64 << 30) as f64;
/// Wall time after which a program that takes no processor time hangs.
const PATIENCE: Duration = Duration::from_secs(300);
/// Longest message that is still one.
const LONGEST: usize = 2000;
/// Most lines of them: a scene's mistakes are reported all at once.
const MOST_LINES: usize = 101;

/// How the program ended.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
    /// The limit that it passed; it was then ended.
    over: Option<String>,
}

impl Ended {
    /// What is wrong with the way it ended, whatever it was given.
    pub(crate) fn fault(&self) -> Option<String> {
        if let Some(over) = &self.over {
            return Some(over.clone());
        }
        if let Some(signal) = self.status.signal() {
            return Some(format!("ended by signal {signal}: {}", self.stderr));
        }
        let lines: Vec<&str> = self.stderr.lines().collect();
        let unprintable = self.stderr.chars().any(|c| c.is_control() && c != '\n');
        match self.status.code() {
            _ if self.stderr.contains("panicked") => Some(self.stderr.clone()),
            _ if unprintable => Some(format!("control characters in {:?}", self.stderr)),
            Some(0) => self.not_a_number(),
            Some(1) => {
                let says = |line: &&str| {
                    let why = line.strip_prefix("error: ");
                    line.len() < LONGEST && why.is_some_and(|why| why.len() > 10)
                };
                let said = (1..=MOST_LINES).contains(&lines.len()) && lines.iter().all(says);
                (!said).then(|| format!("no reason in a line: {}", self.stderr))
            }
            code => Some(format!("status {code:?}: {}", self.stderr)),
        }
    }

    /// The same, or what it says where it did not succeed.
    pub(crate) fn failure(&self) -> Option<String> {
        let failed = || (!self.status.success()).then(|| self.stderr.clone());
        self.fault().or_else(failed)
    }

    fn not_a_number(&self) -> Option<String> {
        let mut words = self.stdout.split(|c: char| !c.is_alphanumeric());
        words
            .any(|word| word == "NaN" || word == "inf")
            .then(|| format!("not a number in {}", self.stdout))
    }
}

/// The program with the words of a line, in a folder, its output going to files there.
fn start(folder: &Path, line: &str) -> Child {
    begin(Command::new(program()), folder, line)
}

fn program() -> std::ffi::OsString {
    let built = env!("CARGO_BIN_EXE_phyxel").into();
    std::env::var_os("PHYXEL_ATTACK_PROGRAM").unwrap_or(built)
}

fn begin(mut command: Command, folder: &Path, line: &str) -> Child {
    let file = |name: &str| File::create(folder.join(name)).unwrap();
    command
        .env("RAYON_NUM_THREADS", "1")
        .args(line.split_whitespace())
        .current_dir(folder)
        .stdout(file(".stdout"))
        .stderr(file(".stderr"))
        .spawn()
        .unwrap()
}

/// Runs the program to its end, or to the first limit that it passes.
pub(crate) fn run(folder: &Path, line: &str) -> Ended {
    wait(folder, start(folder, line), None)
}

/// Runs the program with a limit of so many blocks of 512 bytes a file, beyond which writing fails.
pub(crate) fn run_with_little_space(folder: &Path, line: &str, blocks: usize) -> Ended {
    let limited = "trap '' XFSZ; ulimit -f \"$0\"; exec \"$@\"";
    let mut shell = Command::new("sh");
    shell
        .args(["-c", limited, &blocks.to_string()])
        .arg(program());
    wait(folder, begin(shell, folder, line), None)
}

/// Runs the program and kills it after a time, if it has not ended by then; whether it was killed.
pub(crate) fn run_and_kill(folder: &Path, line: &str, after: Duration) -> (Ended, bool) {
    let ended = wait(folder, start(folder, line), Some(after));
    let killed = ended.status.signal() == Some(9);
    (ended, killed)
}

fn wait(folder: &Path, mut child: Child, kill_after: Option<Duration>) -> Ended {
    let begun = Instant::now();
    let mut over = None;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        let (seconds, bytes) = spent(child.id());
        over = if seconds > SECONDS {
            Some(format!("more than {SECONDS} s of processor time"))
        } else if bytes > BYTES {
            Some(format!("more than {BYTES:.2e} bytes"))
        } else if begun.elapsed() > PATIENCE {
            Some("it hangs".to_owned())
        } else {
            None
        };
        if over.is_some() || kill_after.is_some_and(|after| begun.elapsed() >= after) {
            child.kill().unwrap();
            break child.wait().unwrap();
        }
        // At first often.
        let nap = (begun.elapsed() / 50).clamp(Duration::from_millis(2), Duration::from_millis(10));
        std::thread::sleep(nap);
    };
    let read = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    Ended {
        status,
        stdout: read(".stdout"),
        stderr: read(".stderr"),
        over,
    }
}

/// Processor time (s) and largest resident memory (bytes) of a process so far.
fn spent(process: u32) -> (f64, f64) {
    let read = |name: &str| std::fs::read_to_string(format!("/proc/{process}/{name}"));
    let stat = read("stat").unwrap_or_default();
    // Fields 14 and 15, in hundredths of a second; the name before may hold spaces.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks: f64 = ticks.flat_map(|x| x.parse::<f64>()).sum();
    let status = read("status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = peak.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    (ticks / 100.0, 1024.0 * kibibytes.unwrap_or(0.0))
}
