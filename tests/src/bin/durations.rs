//! How long tests took, from the report of cargo-nextest: the slowest ones, and the rows of the catalogue whose tests take long together.
//!
//! `durations target/nextest/default/junit.xml` reads what `.config/nextest.toml` has nextest write. It reports and never fails for a time:
//! a loaded machine is no fault. A row of the catalogue is to take 10 seconds on average and 20 at most.

use std::process::ExitCode;

use clerestory::catalogue;

/// Tests shown as the slowest.
const SLOWEST: usize = 10;
/// Seconds that the tests of a row may take together.
const ROW: f64 = 20.0;

/// A test that ran.
#[derive(Debug, PartialEq)]
struct Ran {
    /// Package and test program: `clerestory`, `clerestory-tests::photon`.
    program: String,
    /// Modules and function: `sphere::furnaces_are_uniform`.
    name: String,
    seconds: f64,
}

/// The value of an attribute of an element that stands in one line. Names of tests have no character that XML writes otherwise.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = element.split_once(&format!(" {name}=\""))?;
    Some(rest.split_once('"')?.0)
}

/// The tests in nextest's report, which has an element a line.
fn read(report: &str) -> Vec<Ran> {
    let elements = report
        .lines()
        .filter(|line| line.trim_start().starts_with("<testcase "));
    let ran = |element: &str| {
        Some(Ran {
            program: attribute(element, "classname")?.into(),
            name: attribute(element, "name")?.into(),
            seconds: attribute(element, "time")?.parse().ok()?,
        })
    };
    elements.filter_map(ran).collect()
}

/// Whether a test that ran is the catalogue's `file::function`.
fn is(ran: &Ran, test: &str) -> bool {
    let Some((file, function)) = test.split_once("::") else {
        return false;
    };
    let mut modules: Vec<&str> = ran.name.split("::").collect();
    if modules.pop() != Some(function) {
        return false;
    }
    let stem = file
        .trim_end_matches(".rs")
        .trim_end_matches("/mod")
        .trim_end_matches("/main");
    // The file of an integration test is its program, or a module of it; of other tests, it is a module, or holds an inner one.
    let last = stem.rsplit('/').next().unwrap_or(stem);
    let package = match file.split('/').next() {
        Some("engine") => "clerestory",
        Some("tests") => "clerestory-tests",
        Some("tools") => "clerestory-tools",
        Some("samples") => "clerestory-samples",
        _ => return false,
    };
    let (of, program) = ran.program.split_once("::").unwrap_or((&ran.program, ""));
    of == package && (program.trim_start_matches("bin/") == last || modules.contains(&last))
}

/// Sums over the tests of each row, longest first.
fn rows(ran: &[Ran]) -> Vec<(&'static str, f64)> {
    let of_row = |tests: &[&str]| {
        let own = ran.iter().filter(|ran| tests.iter().any(|test| is(ran, test)));
        own.map(|ran| ran.seconds).sum::<f64>()
    };
    let mut rows: Vec<_> = catalogue::all().iter().map(|row| (row.id, of_row(row.tests))).collect();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    rows
}

fn print(mut ran: Vec<Ran>) {
    let total: f64 = ran.iter().map(|ran| ran.seconds).sum();
    ran.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    println!("{} tests took {total:.0} s together; the slowest:", ran.len());
    for ran in ran.iter().take(SLOWEST) {
        println!("{:>8.1} s  {} {}", ran.seconds, ran.program, ran.name);
    }
    let rows = rows(&ran);
    let mean = rows.iter().map(|row| row.1).sum::<f64>() / rows.len().max(1) as f64;
    let long: Vec<_> = rows.iter().filter(|row| row.1 > ROW).collect();
    println!(
        "{} rows of the catalogue: {mean:.1} s of tests on average; above {ROW} s: {}",
        rows.len(),
        if long.is_empty() { "none" } else { "" }
    );
    for (id, seconds) in long {
        println!("{seconds:>8.1} s  {id}");
    }
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), None) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: durations JUNIT.XML");
        return ExitCode::from(2);
    };
    match std::fs::read_to_string(&file) {
        Ok(report) => {
            print(read(&report));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{file}: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPORT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="nextest-run" tests="3" failures="0" errors="0" time="3.5">
    <testsuite name="clerestory-tests::photon" tests="1" disabled="0" errors="0" failures="0">
        <testcase name="sphere::furnaces_are_uniform" classname="clerestory-tests::photon" timestamp="2026-11-22T00:00:00" time="2.250">
        </testcase>
        <testcase name="furnaces" classname="clerestory-tests::path_tracer" timestamp="2026-11-22T00:00:00" time="0.500"/>
        <testcase name="film::metrics::tests::flip" classname="clerestory" time="0.125"/>
    </testsuite>
</testsuites>
"#;

    #[test]
    fn tests_are_found_in_the_report_and_by_their_file() {
        let ran = read(REPORT);
        assert_eq!(
            ran.iter().map(|ran| ran.seconds).collect::<Vec<_>>(),
            [2.25, 0.5, 0.125]
        );
        for (i, test) in [
            "tests/tests/photon/sphere.rs::furnaces_are_uniform",
            "tests/tests/paths/path_tracer.rs::furnaces",
            "engine/src/film/metrics.rs::flip",
        ]
        .iter()
        .enumerate()
        {
            let found: Vec<usize> = (0..ran.len()).filter(|k| is(&ran[*k], test)).collect();
            assert_eq!(found, [i], "{test}");
        }
        assert!(
            !is(&ran[1], "tests/tests/paths/path_sets.rs::furnaces") && !is(&ran[2], "tests/tests/metrics.rs::flip")
        );
    }
}
