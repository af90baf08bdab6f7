//! `clerestory metal`: what it says of a metal, by name and from a file, and the picture that it writes.

use std::process::{Command, Output, Stdio};

use clerestory::transport::fresnel::curve::CurveForm;
use serde_json::Value;

fn run(arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_clerestory"));
    program
        .arg("metal")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("program")
}

fn json(arguments: &[&str]) -> Value {
    let output = run(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn metals_are_shown_with_their_forms() {
    let output = run(&["aluminium", "--wavelengths", "700,550,435"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && text.contains("rescaled") && text.contains("18.50"),
        "{text}"
    );
    let shown = json(&["gold", "--wavelengths", "700,550,435"]);
    let error = |form: &str, band: &str| {
        let errors = shown["errors"].as_array().expect("errors");
        let found = errors
            .iter()
            .find(|error| error["form"] == form && error["band"] == band);
        found.expect("form")["worst"].as_f64()
    };
    // What the published rule leaves without a bound is no number in JSON.
    assert_eq!(error("compensated, printed rule", "green"), None);
    let [compensated, rescaled] = ["compensated", "rescaled"].map(|form| error(form, "green").expect("number"));
    assert!(
        compensated < rescaled && (rescaled - 0.0125).abs() < 5e-4,
        "{compensated} {rescaled}"
    );
    assert_eq!(shown["bands"][1]["compensation"], "fitted");
    assert_eq!(shown["curve"][0]["cosine"], 1.0);
}

#[test]
fn forms_are_timed_where_it_is_asked_for() {
    assert!(json(&["gold"])["costs"].is_null());
    let shown = json(&["gold", "--cost"]);
    let costs = shown["costs"].as_array().expect("costs");
    for form in CurveForm::ALL {
        let name = serde_json::to_value(form).expect("name");
        let cost = costs.iter().find(|cost| cost["form"] == name).expect("form");
        let [time, share] = ["nanoseconds", "over_exact"].map(|key| cost[key].as_f64().expect("number"));
        assert!(time > 0.0 && share > 0.0, "{cost}");
        assert!(form != CurveForm::Exact || share == 1.0, "{cost}");
    }
    assert_eq!(costs.len(), CurveForm::ALL.len());
    let output = run(&["copper", "--cost"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && text.contains("form on the device") && text.contains("rescaled-f0"),
        "{text}"
    );
}

#[test]
fn spectra_come_from_files_and_spheres_go_into_them() {
    let folder = tempfile::tempdir().expect("folder");
    let (spectrum, picture) = (folder.path().join("coin.csv"), folder.path().join("split.png"));
    std::fs::write(&spectrum, "380 0.5 2\n780 0.5 2\n").expect("file");
    let [spectrum, picture] = [&spectrum, &picture].map(|path| path.to_str().expect("path"));
    let shown = json(&[spectrum, "--sphere", picture, "--form", "hoffman"]);
    let band = &shown["bands"][2];
    assert!((band["n"].as_f64().expect("n") - 0.5).abs() < 1e-6, "{band}");
    assert!(std::fs::read(picture).expect("picture").starts_with(b"\x89PNG"));
    for (arguments, words) in [
        (&["mithril"][..], "gold"),
        (&["gold", "--form", "quick"][..], "f82-tint"),
        (&["gold", "--wavelengths", "700,550,0"][..], "above 0"),
        (&["gold", "--wavelengths", "0.7,0.55,0.435"][..], "micrometres"),
        (&[spectrum, "--wavelengths", "700,550,370"][..], "370 nm is outside"),
        (&["gold", "--form", "hoffman"][..], "--sphere"),
        (&[picture][..], "UTF-8"),
    ] {
        let output = run(arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && text.contains(words),
            "{arguments:?}: {text}"
        );
    }
}
