"""Parts of a step of the cut liver, from samples of one thread: python3 benches/step_parts.py PROGRAM.

Runs `PROGRAM run liver` to its end, resumes it, and samples with perf from five seconds on, when it is set up. PROGRAM is a
release build with CARGO_PROFILE_RELEASE_DEBUG=line-tables-only.
"""

import collections
import re
import subprocess
import sys
import tempfile

# The first row that fits a sample's place in the sources, outermost call first, names its part.
PARTS = [
    (r"mls/|discretize/|enrich/|splat/|eigenvalue|tangent|elastic/part|linear", "step's eigenvalue, cut state"),
    (r"forces.rs(?!.*gather).*(arithmetic|planes|lanes|law/|fixed|coefficients|mean|prestrain)", "forces: node part"),
    (r"watch|worst|stiffness.rs", "watch"),
    (r"bond|state.rs|cut.rs", "bonds"),
    (r"front", "fronts"),
    (r"lanes.rs.*gather", "forces: pass one"),
    (r"forces.rs.*(gather|received)", "forces: pass two"),
    (r"elastic/", "forces: node part"),
    (r"rigid.rs|pieces.rs", "damping"),
    (r"contact|tool.rs|shape.rs|view.rs|outside", "tools"),
    (r"sweep.rs.*dot_in_order|sweep.rs.*weighted|sum_in_order", "audit: sums of energy"),
    (r"audit|guard", "guard"),
    (r"sweep|explicit|motion|nodes.rs|supports|vector", "passes over nodes"),
    (r"", "other: copies, allocation, system"),
]


def sample(program):
    """Samples (address, library) of the steps, and the address at which the program was loaded."""
    with tempfile.TemporaryDirectory() as folder:
        run = [program, "run", "--threads", "1", "--out"]
        subprocess.run([*run, f"{folder}/a", "liver", "--set", "pictures=None"], check=True, stdout=subprocess.DEVNULL)
        resumed = [*run, f"{folder}/b", "--resume", f"{folder}/a/state.checkpoint", "--set", "integration.duration=12"]
        data = f"{folder}/perf"
        record = ["perf", "record", "-e", "cpu-clock", "-F", "2000", "-D", "5000", "-o", data]
        subprocess.run([*record, *resumed], check=True, stdout=subprocess.DEVNULL)
        script = ["perf", "script", "-i", data, "-F", "ip,dso"]
        lines = subprocess.run(script, capture_output=True, text=True, check=True).stdout
        maps = subprocess.run([*script[:4], "--show-mmap-events"], capture_output=True, text=True, check=True).stdout
    name = re.escape(program.split("/")[-1])
    found = re.search(rf"\[0x([0-9a-f]+)\(.*?\) @ (0x)?([0-9a-f]+) .*r-xp .*/{name}\n", maps)
    headers = subprocess.run(["readelf", "-lW", program], capture_output=True, text=True, check=True).stdout
    load = next(line.split() for line in headers.splitlines() if "LOAD" in line and " R E " in line)
    base = int(found[1], 16) - int(found[3], 16) - int(load[2], 16) + int(load[1], 16)
    return [line.split() for line in lines.splitlines() if line.strip()], base


def places(program, addresses):
    """Files and functions of the calls that were inlined at each address, outermost first."""
    text = "\n".join(hex(address) for address in addresses)
    command = ["addr2line", "-C", "-f", "-i", "-a", "-e", program]
    lines = subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout.splitlines()
    chains = []
    for line in lines:
        if re.fullmatch(r"0x[0-9a-f]+", line):
            chains.append([])
        elif found := re.match(r".*/(\w+)/src/(.*\.rs):", line):
            if "/.cargo/" not in line and "/rustc/" not in line:
                chains[-1].append(f"{found[1]}/{found[2]}:{name}")
        else:
            name = re.sub(r"<.*", "", line).split("::")[-1]
    return [" ".join(reversed(chain)) for chain in chains]


def main():
    program = sys.argv[1]
    samples, base = sample(program)
    own = [int(address, 16) - base for address, library in samples if library.endswith(f"{program.split('/')[-1]})")]
    unique = sorted(set(own))
    chain = dict(zip(unique, places(program, unique)))
    counts = collections.Counter({PARTS[-1][1]: len(samples) - len(own)})
    for address in own:
        counts[next(part for pattern, part in PARTS if re.search(pattern, chain[address]))] += 1
    print("| part | % of a step |\n|---|---:|")
    for part, count in counts.most_common():
        print(f"| {part} | {100 * count / len(samples):.1f} |")
    print(f"| all {len(samples)} samples | {100 * sum(counts.values()) / len(samples):.1f} |")


main()
