"""What tools/mutants does once the machine has what it needs; see there.

Faults are declared in tools/mutations/*.toml: a file, the row whose tests must find them, and pairs of old and new text. All are built at once.
In Rust, the old expression becomes `(if crate::mutant(N) { new } else { old })`; of shaders, every entry file that includes the mutated one is
compiled once more, and the engine takes that module in place of its own. The environment says which fault a test program has. That rewriting
happens in the worktree below out/mutants/ alone.
"""

import argparse
import concurrent.futures
import hashlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
WORK = ROOT / "out" / "mutants"
TREE = WORK / "tree"
MODULES = WORK / "modules"
LISTS = "tools/mutations"
# Shaders that are compiled: those of the engine, and those of the tests, which include the engine's.
SHADERS = ["shaders", "tests/shaders"]
STAGES = {".comp", ".vert", ".frag", ".geom"}
# As engine/build/compile.rs embeds them.
GLSLC_FLAGS = ["-Werror", "--target-env=vulkan1.1", "--target-spv=spv1.3", "-O"]
# Errors of a build take the faults of their lines out; what has other errors does not build without faults either.
BUILD_ROUNDS = 8
# A test program that a fault keeps from ending is given this many times the limit, once.
PATIENCE = 6
# Share of the limit that the tests of a fault take without it.
SHARE_OF_LIMIT = 0.5

SWITCH = """
/// The fault that the environment asks for; 0 for none.
fn mutant_chosen() -> u32 {
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("CLERESTORY_MUTANT").ok().and_then(|text| text.parse().ok()).unwrap_or(0))
}

/// Whether it is the one with this number.
pub(crate) fn mutant(number: u32) -> bool {
    mutant_chosen() == number
}

/// A shader's module with the fault, if it has it.
pub(crate) fn mutant_module(name: &str) -> Option<Vec<u8>> {
    let folder = std::env::var_os("CLERESTORY_MUTANT_MODULES")?;
    let file = format!("{}/{}.spv", mutant_chosen(), name.replace('/', "__"));
    std::fs::read(std::path::Path::new(&folder).join(file)).ok()
}
"""
SWITCH_FILE = "engine/src/lib.rs"
# Where modules become the driver's.
LOADER = "engine/src/gpu/layout.rs"
LOAD = "    ash::util::read_spv("
LOAD_MUTANT = "    let other = crate::mutant_module(name);\n    let spirv = other.as_deref().unwrap_or(spirv);\n"


def say(text):
    print(text, file=sys.stderr, flush=True)


def die(text):
    say(text)
    sys.exit(2)


def digest(*parts):
    hashed = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        hashed.update(len(data).to_bytes(8, "little") + data)
    return hashed.hexdigest()[:24]


def git(*arguments, folder=ROOT):
    return subprocess.run(["git", "-C", folder, *arguments], check=True, capture_output=True, text=True).stdout.strip()


class Unsound(Exception):
    """A declared fault is not of the code as it is."""


class Mutant:
    """A fault: `old` may mark the part that is replaced by « and », so that what stands about it makes it unique."""

    def __init__(self, number, path, row, old, new, is_of_few):
        self.number, self.path, self.row, self.new, self.is_of_few = number, path, row, new, is_of_few
        before, start, rest = old.partition("«")
        part, end, after = rest.partition("»")
        if not start:
            before, part, after = "", old, ""
        elif not end:
            die(f"{path}: « without » in {old}")
        self.context, self.part, self.begin = before + part + after, part, len(before)

    def __str__(self):
        return f"{self.row} {self.path}: {self.context!r}: {self.part!r} -> {self.new!r}"

    @property
    def is_rust(self):
        return self.path.endswith(".rs")

    def span(self, text):
        """Where the part stands in the file's text."""
        count = text.count(self.context)
        if count != 1:
            raise Unsound(f"{self}: the old text stands {count} times in the file, not once")
        if self.part == self.new:
            raise Unsound(f"{self}: changes nothing")
        begin = text.index(self.context) + self.begin
        if self.is_rust and "#[cfg(test)]\nmod tests {" in text and begin > text.index("#[cfg(test)]\nmod tests {"):
            raise Unsound(f"{self}: is of a test")
        return begin, begin + len(self.part)


def read_mutants(root):
    """All faults, numbered in the order of the lists."""
    mutants = []
    for file in sorted((root / LISTS).glob("*.toml")):
        for block in tomllib.loads(file.read_text())["file"]:
            unknown = set(block) - {"path", "row", "faults", "few"}
            if unknown:
                die(f"{file.name}: {block['path']}: unknown keys {unknown}")
            for index, (old, new) in enumerate(block["faults"]):
                few = index == 0 and block.get("few", False)
                mutants.append(Mutant(len(mutants) + 1, block["path"], block["row"], old, new, few))
    return mutants


def by_path(mutants):
    paths = {}
    for mutant in mutants:
        paths.setdefault(mutant.path, []).append(mutant)
    return paths


def rewritten(text, mutants):
    """A Rust file with switches, and the lines on which each fault then stands."""
    spans = {}
    for mutant in mutants:
        spans.setdefault(mutant.span(text), []).append(mutant)
    result, end, lines = "", 0, {}
    for (begin, stop), faults in sorted(spans.items(), key=lambda item: item[0]):
        if begin < end:
            raise Unsound(f"{faults[0]}: overlaps with another fault")
        result += text[end:begin]
        first = result.count("\n") + 1
        result += "("
        for fault in faults:
            result += f"if crate::mutant({fault.number}) {{ {fault.new} }} else "
        result += f"{{ {text[begin:stop]} }})"
        for fault in faults:
            lines[fault.number] = (first, result.count("\n") + 1)
        end = stop
    return result + text[end:], lines


def check(root, mutants):
    """Ends with all faults whose old text does not stand where it is said to."""
    unsound = []
    for path, faults in by_path(mutants).items():
        text = (root / path).read_text()
        before = len(unsound)
        for fault in faults:
            try:
                fault.span(text)
            except Unsound as why:
                unsound.append(str(why))
        if len(unsound) == before and faults[0].is_rust:
            rewritten(text, faults)
    if unsound:
        raise Unsound("\n".join(unsound))


# Shaders


class Sources:
    """The texts of all shaders, and which entry files include which."""

    def __init__(self, root):
        self.texts = {}
        for folder in SHADERS:
            for file in sorted((root / folder).rglob("*")):
                if file.is_file():
                    self.texts[str(file.relative_to(root))] = file.read_text()
        self.entries = [path for path in self.texts if Path(path).suffix in STAGES]
        names = [module_name(path) for path in self.entries]
        if len(set(names)) < len(names):
            die("two shaders have one name")
        self.uses = {path: self.used_by(path) for path in self.entries}

    def used_by(self, entry):
        used, still = set(), [entry]
        while still:
            path = still.pop()
            if path in used:
                continue
            used.add(path)
            for name in re.findall(r'^\s*#include\s*"([^"]+)"', self.texts[path], re.M):
                beside, own = os.path.normpath(f"{os.path.dirname(path)}/{name}"), os.path.normpath(f"{SHADERS[0]}/{name}")
                still.append(beside if beside in self.texts else own)
        return used

    def affected(self, path):
        return [entry for entry in self.entries if path in self.uses[entry]]


def module_name(path):
    folder = next(folder for folder in sorted(SHADERS, key=len, reverse=True) if path.startswith(folder + "/"))
    return path[len(folder) + 1 :].replace("/", "__")


def compiled(sources, entry, changed, folder):
    """The module of an entry file with one file changed; kept by what it depends on."""
    used = sorted(sources.uses[entry])
    text = {path: changed.get(path, sources.texts[path]) for path in used}
    kept = folder / (digest(GLSLC_FLAGS, entry, json.dumps(text)) + ".spv")
    if not kept.exists():
        with tempfile.TemporaryDirectory() as scratch:
            for path in used:
                (Path(scratch) / path).parent.mkdir(parents=True, exist_ok=True)
                (Path(scratch) / path).write_text(text[path])
            made = Path(scratch) / "module.spv"
            program = os.environ.get("GLSLC", "glslc")
            command = [program, *GLSLC_FLAGS, "-I", f"{scratch}/{SHADERS[0]}", f"{scratch}/{entry}", "-o", str(made)]
            run = subprocess.run(command, capture_output=True, text=True)
            if run.returncode != 0:
                die(f"{entry} with {list(changed)} changed:\n{run.stderr}")
            part = kept.with_suffix(f".{os.getpid()}-{id(made)}")
            shutil.copyfile(made, part)
            part.rename(kept)
    return kept


def compile_modules(root, mutants):
    """Modules of all shaders' faults, in a folder each; the faults that change no module."""
    sources = Sources(root)
    kept = MODULES / "kept"
    kept.mkdir(parents=True, exist_ok=True)
    for folder in MODULES.iterdir():
        if folder.name.isdigit():
            shutil.rmtree(folder)

    def modules(mutant):
        text = sources.texts[mutant.path]
        begin, end = mutant.span(text)
        changed = {mutant.path: text[:begin] + mutant.new + text[end:]}
        folder = MODULES / str(mutant.number)
        folder.mkdir()
        count = 0
        for entry in sources.affected(mutant.path):
            faulty, sound = compiled(sources, entry, changed, kept), compiled(sources, entry, {}, kept)
            if faulty.read_bytes() != sound.read_bytes():
                os.link(faulty, folder / f"{module_name(entry)}.spv")
                count += 1
        return count

    shaders = [mutant for mutant in mutants if not mutant.is_rust]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        counts = list(pool.map(modules, shaders))
    return [mutant for mutant, count in zip(shaders, counts) if count == 0]


# The tree with all faults in it


def cargo(*arguments, **options):
    """On the whole workspace: of one package other crates may have other features, and all of them would be built again."""
    return subprocess.run(["cargo", *arguments], cwd=TREE, stdin=subprocess.DEVNULL, text=True, **options)


def take_dependencies(built, folder):
    """Copies what the checkout has built of other crates, so that only the workspace's own are built. The tree cannot share the whole folder: cargo
    takes two checkouts of one workspace for the same, and would find what the other one has built fresh."""
    if folder.exists() or not built.exists():
        return

    def of_workspace(parent, names):
        # Test programs have names of their own.
        libraries = {".rlib", ".rmeta", ".so"} if Path(parent).name == "deps" else None
        return [name for name in names if "clerestory" in name or libraries and Path(name).suffix not in libraries]

    for part in ["deps", "build", ".fingerprint"]:
        if (built / part).is_dir():
            shutil.copytree(built / part, folder / part, ignore=of_workspace)


def write_tree(mutants, sound):
    """Puts the switches in; lines of each fault by its file."""
    places = {}
    for path, faults in by_path([mutant for mutant in mutants if mutant.is_rust]).items():
        text, places[path] = rewritten(sound(path), faults)
        write(path, text)
    write(SWITCH_FILE, sound(SWITCH_FILE) + SWITCH)
    loader = sound(LOADER)
    if loader.count(LOAD) != 1:
        die(f"{LOADER}: modules are made in another way than expected")
    write(LOADER, loader.replace(LOAD, LOAD_MUTANT + LOAD))
    return places


def write(path, text):
    """Only what differs, so that nothing is built again without need."""
    if (TREE / path).read_text() != text:
        (TREE / path).write_text(text)


def prepare(commit, few):
    """The tree of a commit with its faults, all or `few` of them; returns those that are in it, and says which are not."""
    stamp = digest(commit, few, Path(__file__).read_bytes())
    state = WORK / "prepared.json"
    known = json.loads(state.read_text()) if state.exists() else {}
    git("worktree", "prune")
    if not TREE.is_dir():
        git("worktree", "add", "-q", "--detach", str(TREE), commit)
        known = {}
    if known.get("stamp") == stamp:
        mutants = read_mutants(TREE)
        return mutants, set(known["left_out"])
    state.unlink(missing_ok=True)
    git("checkout", "-q", "--force", "--detach", commit, folder=TREE)
    mutants = read_mutants(TREE)
    texts = {path: (TREE / path).read_text() for path in [*by_path(mutants), SWITCH_FILE, LOADER]}
    left_out = {}
    wanted = [mutant for mutant in mutants if mutant.is_of_few or not few]
    for mutant in compile_modules(TREE, wanted):
        left_out[mutant.number] = "changes no module"
    for attempt in range(BUILD_ROUNDS):
        inside = [mutant for mutant in wanted if mutant.number not in left_out]
        places = write_tree(inside, texts.__getitem__)
        say(f"checking {len(inside)} faults")
        run = cargo("check", "-q", "--workspace", "--lib", "--color=never", capture_output=True)
        if run.returncode == 0:
            break
        (WORK / f"check-{attempt}.log").write_text(run.stderr)
        wrong = set()
        for path, line in re.findall(r"^error[^\n]*\n\s*--> ([^:\n]+):(\d+):", run.stderr, re.M):
            for number, (first, last) in places.get(path, {}).items():
                if first <= int(line) <= last:
                    wrong.add(number)
        if not wrong:
            die(f"the tree does not build: see {WORK}/check-{attempt}.log")
        left_out.update({number: "does not build" for number in wrong})
    else:
        die("the tree does not build")
    (WORK / "left-out.txt").write_text("".join(f"{mutants[number - 1]}: {why}\n" for number, why in sorted(left_out.items())))
    state.write_text(json.dumps({"stamp": stamp, "left_out": sorted(left_out)}))
    return mutants, set(left_out)


# Tests


def read_rows():
    """Of each row its tests: the options that build them, the program's name, and the function's."""
    build = cargo("build", "-q", "--workspace", "--bin=mutants", capture_output=True)
    if build.returncode != 0:
        die(build.stderr)
    run = subprocess.run([WORK / "target" / "debug" / "mutants"], capture_output=True, check=True, text=True)
    rows = {}
    for line in run.stdout.splitlines():
        row, kind, options, program, function = line.split("\t")
        rows.setdefault(row, []).append((kind, options, program, function))
    return rows


def tests_of(mutant, rows):
    """What runs on the host alone sees no shader."""
    if mutant.row not in rows:
        die(f"{mutant}: no such row, or none with tests")
    tests = [test for test in rows[mutant.row] if mutant.is_rust or test[0] == "device"]
    if not tests:
        die(f"{mutant}: its row has no test on the device")
    return tests


class Programs:
    """Test programs that are built, by the names that rows' tests have."""

    def __init__(self, options):
        say("building the tests")
        options = [option for option in options if not option.startswith("--package=")]
        build = cargo("test", "--no-run", "--workspace", "--message-format=json", "--color=never", *options, capture_output=True)
        (WORK / "build.log").write_text(build.stderr)
        if build.returncode != 0:
            die(f"the tests do not build: see {WORK}/build.log")
        self.files, self.folders = {}, {}
        for line in build.stdout.splitlines():
            message = json.loads(line)
            if message["reason"] == "compiler-artifact" and message["profile"]["test"] and message["executable"]:
                program = program_name(message)
                self.files[program] = message["executable"]
                self.folders[program] = Path(message["manifest_path"]).parent
        self.names = {}

    def names_of(self, program, function):
        """Whole names of the tests that a function's name stands for; none where the program has no such test, or ignores it."""
        if program not in self.names:
            lists = [
                subprocess.run([self.files[program], "--list", "--format=terse", *more], capture_output=True, check=True, text=True).stdout
                for more in ([], ["--ignored"])
            ]
            all_of, ignored = [{line.removesuffix(": test") for line in text.splitlines() if line.endswith(": test")} for text in lists]
            self.names[program] = all_of - ignored
        return sorted(name for name in self.names[program] if name.rsplit("::", 1)[-1] == function)

    def start(self, test, number):
        """Starts a test with a fault (0 for none), as the leader of a group of its own."""
        program, function = test
        environment = {**os.environ, "CLERESTORY_MUTANT": str(number), "CLERESTORY_MUTANT_MODULES": str(MODULES)}
        environment["CARGO_MANIFEST_DIR"] = str(self.folders[program])
        return subprocess.Popen(
            [self.files[program], "--exact", *self.names_of(program, function), "--color=never"],
            cwd=self.folders[program], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True,
        )

    def run(self, tests, number, limit=math.inf, seconds=None):
        """Runs tests with a fault (0 for none), as many at once as there are processors, to the first that fails. That one with what it said, `None`
        where all pass, and whether they ended in time. `seconds` gets those of each that passes."""
        end = time.monotonic() + limit
        failed, late, stopped = [], [], threading.Event()

        def work(test):
            if stopped.is_set():
                return
            start = time.monotonic()
            child = self.start(test, number)
            while True:
                try:
                    output, _ = child.communicate(timeout=0.2)
                    break
                except subprocess.TimeoutExpired:
                    if time.monotonic() > end:
                        late.append(test)
                        stopped.set()
                    if stopped.is_set():
                        ended(child)
                        return
            if child.returncode != 0:
                failed.append((test, output))
                stopped.set()
            elif seconds is not None:
                seconds[" ".join(test)] = time.monotonic() - start

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            try:
                list(pool.map(work, tests))
            finally:
                # An interrupt ends the tests that are running, too.
                stopped.set()
        return (failed[0] if failed else None), bool(failed) or not late


def program_name(message):
    """A test program's name, as `mutants` of the tests' crate prints it."""
    package = re.search(r'(?m)^name\s*=\s*"([^"]+)"', Path(message["manifest_path"]).read_text())[1]
    target = message["target"]
    if "test" in target["kind"]:
        return f"{package}::{target['name']}"
    return f"{package}::bin/{target['name']}" if "bin" in target["kind"] else package


def ended(child):
    """Ends a test with all that it started."""
    os.killpg(child.pid, signal.SIGKILL)
    child.communicate()


def durations(programs, wanted, stamp):
    """Seconds of each test without faults; all of them must pass."""
    file = WORK / "durations.json"
    known = json.loads(file.read_text()) if file.exists() else {}
    if known.get("stamp") != stamp:
        known = {"stamp": stamp, "seconds": {}}
    seconds = known["seconds"]
    missing = []
    for test in (test for test in wanted if " ".join(test) not in seconds):
        if programs.names_of(*test):
            missing.append(test)
        else:
            say(f"{' '.join(test)}: is left out, since it is no test, or ignored")
    if missing:
        say(f"running {len(missing)} tests without faults")
        try:
            failed, _ = programs.run(missing, 0, seconds=seconds)
        finally:
            file.write_text(json.dumps(known, indent=1))
        if failed:
            test, output = failed
            (WORK / "sound.log").write_text(output)
            raise Unsound(f"{' '.join(test)} fails without faults: see {WORK}/sound.log")
    return seconds


def quick(tests, seconds, limit):
    """The quickest tests, as many as take a share of the limit; one at least."""
    running = [test for test in tests if " ".join(test) in seconds]
    if not running:
        die(f"{tests}: none of these tests runs")
    chosen, sum_of = [], 0.0
    for test in sorted(running, key=lambda test: seconds[" ".join(test)]):
        sum_of += seconds[" ".join(test)]
        if chosen and sum_of > SHARE_OF_LIMIT * limit:
            break
        chosen.append(test)
    return chosen


class State:
    """Verdicts: what was found stays so until the fault, its file or its row's tests change; what was not, until anything does."""

    def __init__(self, commit):
        self.file, self.commit = WORK / "state.json", commit
        self.known = json.loads(self.file.read_text()) if self.file.exists() else {}

    def key(self, mutant, tests):
        blob = git("rev-parse", f"{self.commit}:{mutant.path}")
        return digest(blob, mutant.row, mutant.context, mutant.begin, mutant.part, mutant.new, sorted(tests))

    def verdict(self, key):
        known = self.known.get(key)
        return known["verdict"] if known and (known["verdict"].startswith("found") or known["commit"] == self.commit) else None

    def keep(self, key, verdict):
        self.known[key] = {"verdict": verdict, "commit": self.commit}
        part = self.file.with_suffix(".part")
        part.write_text(json.dumps(self.known, indent=1))
        part.rename(self.file)


def judged(programs, mutant, tests, limit):
    """What the tests say of a fault."""
    failed, in_time = programs.run(tests, mutant.number, limit)
    if not in_time:
        failed, in_time = programs.run(tests, mutant.number, PATIENCE * limit)
        if not in_time:
            return "found: its tests do not end"
    return f"found by {failed[0][1]}" if failed else "NOT FOUND"


def options_of_command_line():
    """The options, with the shard as a slice of the list of faults."""
    parser = argparse.ArgumentParser(prog="tools/mutants", description="Puts faults into the code, and says which of them no test finds.")
    parser.add_argument("--shard", default="1/1", metavar="k/n", help="every n-th fault, from the k-th on (1 to n)")
    parser.add_argument("--few", action="store_true", help="three faults alone, in two minutes once the tests are built")
    parser.add_argument("--limit", type=float, default=30.0, metavar="SECONDS", help="that the tests of a fault may take (default: 30)")
    parser.add_argument("--list", action="store_true", help="only shows what would be done")
    parser.add_argument("--check", action="store_true", help="only checks that the old text of each fault is there, once")
    parser.add_argument("--modules", action="store_true", help="only compiles the shaders with their faults")
    parser.add_argument("path", nargs="*", help="only faults of these files, such as engine/src/accel/kd/traverse.rs")
    options = parser.parse_args()
    shard = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", options.shard)
    if not shard or int(shard[1]) > int(shard[2]):
        parser.error("--shard takes k/n, k from 1 to n")
    options.shard = slice(int(shard[1]) - 1, None, int(shard[2]))
    return options


def chosen(mutants, options):
    """The faults that the command line asks for."""
    without = set(options.path) - {mutant.path for mutant in mutants}
    if without:
        die(f"no fault is declared of {', '.join(sorted(without))}")
    wanted = [m for m in mutants if (not options.path or m.path in options.path) and (m.is_of_few or not options.few)]
    return wanted[options.shard]


def look(options):
    """What needs no build: checks the faults, and lists them or compiles the shaders with theirs. The exit code."""
    mutants = read_mutants(ROOT)
    check(ROOT, mutants)
    if options.list:
        for mutant in chosen(mutants, options):
            print(f"{mutant.number} {mutant}")
    same = compile_modules(ROOT, chosen(mutants, options)) if options.modules else []
    for mutant in same:
        say(f"{mutant}: changes no module")
    return 1 if same else 0


def try_all(options):
    """Builds the last commit with its faults, and judges each that is asked for. The exit code."""
    WORK.mkdir(parents=True, exist_ok=True)
    take_dependencies(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug", WORK / "target" / "debug")
    os.environ.update(CARGO_TARGET_DIR=str(WORK / "target"), CLERESTORY_VALIDATION="off")
    commit = git("rev-parse", "HEAD")
    mutants, left_out = prepare(commit, options.few)
    inside = [mutant for mutant in chosen(mutants, options) if mutant.number not in left_out]
    rows = read_rows()
    of_each = {mutant.number: tests_of(mutant, rows) for mutant in inside}
    everything = [test for tests in of_each.values() for test in tests]
    programs = Programs(sorted({option for _, build, _, _ in everything for option in build.split()}))
    seconds = durations(programs, sorted({(program, name) for _, _, program, name in everything}), commit)
    state = State(commit)
    missed = []
    for mutant in inside:
        tests = quick(sorted({(program, name) for _, _, program, name in of_each[mutant.number]}), seconds, options.limit)
        key = state.key(mutant, tests)
        verdict = state.verdict(key)
        if verdict is None:
            verdict = judged(programs, mutant, tests, options.limit)
            state.keep(key, verdict)
        say(f"{mutant.number} {mutant}: {verdict}")
        if not verdict.startswith("found"):
            missed.append(mutant)
    (WORK / "missed.txt").write_text("".join(f"{mutant}\n" for mutant in missed))
    say(f"{len(inside) - len(missed)} of {len(inside)} faults were found; {WORK}/missed.txt has the others")
    if left_out:
        say(f"{len(left_out)} faults were left out: see {WORK}/left-out.txt")
    return 1 if missed or left_out else 0


def main():
    options = options_of_command_line()
    try:
        return look(options) if options.list or options.check or options.modules else try_all(options)
    except Unsound as why:
        die(why)


if __name__ == "__main__":
    sys.exit(main())
