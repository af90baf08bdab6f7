//! Runs `fuzz`: faults that are planted are found, made small and counted; totals go on where they were; what once broke something breaks nothing.
//!
//! Nothing here needs a device.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use clerestory_tools::fuzzing::campaign::FINDINGS;
use clerestory_tools::fuzzing::totals::{Kind, Totals};

type Tested = Result<(), Box<dyn std::error::Error>>;

fn fuzz(arguments: &[&str], folder: &Path) -> Result<Output, std::io::Error> {
    Command::new(env!("CARGO_BIN_EXE_fuzz"))
        .args(arguments)
        .arg("--folder")
        .arg(folder)
        .stdin(Stdio::null())
        .output()
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn planted_faults_are_found_small_and_counted() -> Tested {
    let folder = tempfile::tempdir()?;
    let run_in = |folder: &Path, inputs: &str| {
        let arguments = [
            "run",
            "--minutes",
            "9",
            "--no-steps",
            "--reader",
            "planted faults",
            "--inputs",
            inputs,
        ];
        fuzz(&arguments, folder)
    };
    let run = |inputs: &str| run_in(folder.path(), inputs);
    let first = run("250")?;
    assert_eq!(first.status.code(), Some(1), "{}", text(&first));
    let totals = Totals::read(folder.path())?.ok_or("no totals")?;
    let way = totals
        .readers
        .get("planted faults")
        .ok_or("no such reader")?
        .read
        .clone();
    assert_eq!((way.inputs, way.next, totals.runs), (250, 250, 1));
    let [panics, aborts] = [Kind::Panic, Kind::Abort].map(|kind| way.found(kind));
    assert!(panics > 3 && aborts > 3, "{panics} {aborts}");
    assert_eq!(totals.found(), panics + aborts, "{}", text(&first));
    assert_eq!(way.accepted, way.inputs - panics - aborts);

    let mut small = Vec::new();
    for finding in std::fs::read_dir(folder.path().join(FINDINGS))? {
        small.push(std::fs::read(finding?.path().join("main.txt"))?);
    }
    small.sort();
    assert_eq!(small, [b"ABORT", b"PANIC"]);

    // The same files again: nothing is left to do, and nothing new is found.
    let again = run("250")?;
    assert!(again.status.success(), "{}", text(&again));
    assert_eq!(Totals::read(folder.path())?.ok_or("no totals")?.inputs(), [250, 0]);
    // More files go on behind the last, and find the same as in one run.
    run("300")?;
    let other = tempfile::tempdir()?;
    run_in(other.path(), "300")?;
    let [ours, theirs] = [folder.path(), other.path()].map(Totals::read);
    let found = |totals: Totals| totals.readers["planted faults"].read.found.clone();
    let [ours, theirs] = [ours?, theirs?].map(|totals| totals.map(found));
    assert!(ours.is_some() && ours == theirs, "{ours:?} {theirs:?}");

    let wrong = fuzz(&["run", "--seed", "2", "--reader", "planted faults"], folder.path())?;
    assert!(text(&wrong).contains("seed"), "{}", text(&wrong));
    let unknown = fuzz(&["run", "--reader", "no such"], folder.path())?;
    assert_eq!(unknown.status.code(), Some(2), "{}", text(&unknown));
    Ok(())
}

#[test]
fn every_kind_of_fault_is_told() -> Tested {
    let folder = tempfile::tempdir()?;
    let mut kinds = vec![
        ("PANIC", "panic: "),
        ("ABORT", "abort: "),
        ("SLEEP", "time: "),
        ("words", "breaks nothing"),
    ];
    // Elsewhere nothing bounds what a process takes.
    if cfg!(target_os = "linux") {
        kinds.push(("HOARD", "memory: "));
    }
    for (word, told) in kinds {
        let case = folder.path().join(word);
        std::fs::create_dir(&case)?;
        std::fs::write(case.join("main.txt"), word)?;
        let place = case.display().to_string();
        let output = fuzz(
            &["case", &place, "--reader", "planted faults", "--seconds", "2"],
            &folder.path().join("run"),
        )?;
        assert_eq!(output.status.success(), word == "words", "{word}: {}", text(&output));
        assert!(text(&output).starts_with(told), "{word}: {}", text(&output));
    }
    Ok(())
}

#[test]
fn what_once_broke_something_breaks_nothing() -> Tested {
    let folder = tempfile::tempdir()?;
    let output = fuzz(&["kept"], folder.path())?;
    assert!(output.status.success(), "{}", text(&output));
    Ok(())
}
