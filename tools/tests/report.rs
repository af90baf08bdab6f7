//! Runs `clerestory report` on tiny sweeps and looks at what it keeps, what it measures again and what it writes.
//!
//! Needs a Vulkan device and fails without one. Nothing here depends on how long anything takes.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use clerestory::film::exr;
use clerestory::gpu::{Access, Gpu, GpuOptions, PipelineInfo, Recorder};
use clerestory::settings::SettingsDecl;
use clerestory::techniques::{Accumulated, Bias, Card, Foresight, Frame, FrameMethod, FrameTarget};
use clerestory::transport::PathSet;
use clerestory_tools::experiments::render_sweep::{self, Places};
use clerestory_tools::experiments::sweep::Cards;
use clerestory_tools::experiments::watch::Unwatched;
use clerestory_tools::experiments::{self, Kind};

type Tested = Result<(), Box<dyn std::error::Error>>;

/// A folder with an experiment of its own.
struct Bench {
    folder: tempfile::TempDir,
}

const TEXT: &str = "title = \"tiny\"\nabout = \"What a test looks at.\"\nsystems = [\"BG-2\"]\n[sweep]\nscenes = [\"builtin:cornell-box\"]\nsize = [16, 16]\n\
    spp = [1, 4]\nrepeats = 2\n[sweep.reference]\nspp = 64\n[[sweep.variant]]\nname = \"independent\"\n\
    settings = { sampler = \"pcg\" }\n";
/// A criterion that stands last.
const CRITERION: &str = "[[criterion]]\nname = \"falls\"\nis.slope = { of = \"independent\", at_most = 0.0 }\n";

impl Bench {
    fn new() -> Result<Self, std::io::Error> {
        Ok(Self {
            folder: tempfile::tempdir()?,
        })
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out/tiny")
    }

    fn run(&self, experiment: &str, more: &[&str]) -> Result<Output, std::io::Error> {
        let root = self.folder.path();
        std::fs::write(root.join("tiny.toml"), experiment)?;
        Command::new(env!("CARGO_BIN_EXE_clerestory"))
            .args(["report", "tiny.toml", "--folder", "out", "--references", "references"])
            .args(more)
            .current_dir(root)
            .stdin(Stdio::null())
            .output()
    }

    /// Runs and wants so many pictures measured and found.
    fn measured(&self, experiment: &str, measured: usize, found: usize) -> Tested {
        let output = self.run(experiment, &[])?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        let expected = format!("{measured} pictures measured, {found} found");
        assert!(said.contains(&expected), "{expected}: {said}");
        assert!(
            said.chars().all(|c| !c.is_control() || c == '\n'),
            "no bar in a pipe: {said:?}"
        );
        Ok(())
    }

    fn references(&self) -> Result<usize, std::io::Error> {
        Ok(std::fs::read_dir(self.folder.path().join("references"))?.count())
    }
}

fn read(path: &Path) -> Result<String, std::io::Error> {
    std::fs::read_to_string(path)
}

#[test]
fn a_second_run_measures_nothing_and_a_change_only_what_it_must() -> Tested {
    let bench = Bench::new()?;
    bench.measured(TEXT, 4, 0)?;
    let (first, csv) = (
        read(&bench.out().join("report.json"))?,
        read(&bench.out().join("measurements.csv"))?,
    );
    assert!(first.contains("\"relative_mse\""));
    bench.measured(TEXT, 0, 4)?;
    assert_eq!(
        csv,
        read(&bench.out().join("measurements.csv"))?,
        "kept to the last digit"
    );

    // Words are not part of a measurement, nor is a default that is spelled out.
    bench.measured(&TEXT.replace("independent", "pcg"), 0, 4)?;
    let spelled = format!("roulette_start = {}, sampler =", default_start()?);
    bench.measured(&TEXT.replace("sampler =", &spelled), 0, 4)?;
    // A repeat and a budget more.
    bench.measured(&TEXT.replace("repeats = 2", "repeats = 3"), 2, 4)?;
    bench.measured(&TEXT.replace("[1, 4]", "[1, 4, 16]"), 2, 4)?;
    // A variant more.
    bench.measured(&format!("{TEXT}[[sweep.variant]]\nname = \"sobol\"\n"), 4, 4)?;
    assert_eq!(bench.references()?, 1);
    // Another reference is another error.
    bench.measured(&TEXT.replace("spp = 64", "spp = 128"), 4, 0)?;
    // Another path set is another picture and another reference.
    bench.measured(&TEXT.replace("size =", "path_set = \"direct\"\nsize ="), 4, 0)?;
    assert_eq!(bench.references()?, 3);
    Ok(())
}

fn default_start() -> Result<u64, Box<dyn std::error::Error>> {
    let settings = clerestory::techniques::by_id("path")?.settings.defaults();
    Ok(settings["roulette_start"].as_u64().ok_or("no roulette_start")?)
}

#[test]
fn the_files_are_complete_and_the_page_loads_nothing() -> Tested {
    let bench = Bench::new()?;
    let text = TEXT.replace("repeats = 2", "repeats = 2\nstrips = [\"independent\"]");
    bench.measured(&format!("{text}{CRITERION}"), 4, 0)?;
    let out = bench.out();
    let page = read(&out.join("index.html"))?;
    assert_eq!(page.matches("<svg").count(), 3);
    assert_eq!(
        page.matches("src=").count(),
        page.matches("src=\"data:image/png;base64,").count()
    );
    assert_eq!(
        page.matches("http").count(),
        page.matches("http://www.w3.org/2000/svg").count()
    );
    for tag in ["<script", "<link", "url(", "@import"] {
        assert!(!page.contains(tag), "{tag}");
    }
    for name in ["time", "rays", "samples"] {
        assert!(read(&out.join(format!("plots/cornell-box-{name}.svg")))?.contains("slope −½"));
    }
    let strip = image::open(out.join("strips/cornell-box.png"))?;
    assert_eq!((strip.width(), strip.height()), (16 * 2 + 4, 16 * 3 + 8));
    let kept = image::open(out.join("cornell-box-strip.png"))?;
    assert_eq!((kept.width(), kept.height()), (16 * 2 + 4, 16 * 2 + 4));
    assert!(read(&out.join("report.md"))?.contains("Slopes and time to equal error"));
    for head in ["report.md", "index.html"] {
        let text = read(&out.join(head))?;
        let place = |words: &str| text.find(words).ok_or(format!("{words}: {head}"));
        assert!(place(": falls: ")? < place("What a test looks at.")?, "{head}");
    }
    assert_eq!(read(&out.join("measurements.csv"))?.lines().count(), 5);
    let names: Vec<String> = std::fs::read_dir(&out)?
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<Result<_, std::io::Error>>()?;
    assert!(names.iter().all(|name| !name.ends_with(".tmp")), "{names:?}");
    let references = bench.folder.path().join("references");
    let reference = std::fs::read_dir(references)?.next().ok_or("no reference")??.path();
    let picture = exr::read(&reference)?;
    assert!(
        picture
            .layer("variance")
            .is_some_and(|layer| layer.values().iter().any(|v| *v > 0.0))
    );
    assert!(picture.metadata.other.contains_key("kernels") && picture.metadata.seed == Some(1_000_003));

    // What was lost comes back, and only that.
    std::fs::remove_dir_all(out.join("pictures"))?;
    std::fs::remove_file(out.join("index.html"))?;
    bench.measured(TEXT, 1, 3)?;
    assert!(out.join("index.html").is_file());
    Ok(())
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_complete_files_and_the_next_run_goes_on() -> Tested {
    let bench = Bench::new()?;
    let long = TEXT
        .replace("[1, 4]", "[1, 4, 10000000]")
        .replace("repeats = 2", "repeats = 1");
    std::fs::write(bench.folder.path().join("tiny.toml"), &long)?;
    let mut child = Command::new(env!("CARGO_BIN_EXE_clerestory"))
        .args([
            "-v",
            "report",
            "tiny.toml",
            "--folder",
            "out",
            "--references",
            "references",
        ])
        .current_dir(bench.folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    // The program says at `-v` which picture begins.
    let mut stderr = std::io::BufReader::new(child.stderr.take().ok_or("no error output")?);
    let mut heard = String::new();
    while !heard.contains("10000000 spp") {
        if std::io::BufRead::read_line(&mut stderr, &mut heard)? == 0 {
            return Err(format!("ended too early: {heard}").into());
        }
    }
    let killed = Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()?;
    assert!(killed.success());
    std::io::Read::read_to_string(&mut stderr, &mut heard)?;
    assert_eq!(child.wait()?.code(), Some(130), "{heard}");
    assert!(read(&bench.out().join("report.md"))?.contains("Interrupted"));
    assert!(read(&bench.out().join("index.html"))?.ends_with("</html>\n"));
    bench.measured(&long.replace("10000000", "16"), 1, 2)?;
    Ok(())
}

#[test]
fn mistakes_in_an_experiment_are_named() -> Tested {
    let bench = Bench::new()?;
    for (from, to, code, word) in [
        ("spp = [1, 4]", "spp = [1, 4]\nseconds = [0.1]", 2, "exactly one"),
        ("repeats", "repeat", 2, "repeat"),
        ("sampler", "smapler", 2, "smapler"),
        ("of = \"independent\"", "of = \"indepedent\"", 2, "indepedent"),
        ("builtin:cornell-box", "builtin:nothing", 3, "cornell-box"),
        ("\"pcg\"", "\"dice\"", 2, "dice"),
    ] {
        let output = bench.run(&format!("{TEXT}{CRITERION}").replacen(from, to, 1), &[])?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{to}: {said}");
        assert!(said.contains(word) && said.contains("error:"), "{to}: {said}");
    }
    Ok(())
}

#[test]
fn a_black_reference_is_refused() -> Tested {
    let bench = Bench::new()?;
    let output = bench.run(&TEXT.replace("size =", "path_set = \"LVE\"\nsize ="), &[])?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && said.contains("the picture is black"),
        "{said}"
    );
    assert!(!bench.folder.path().join("references").exists());
    Ok(())
}

#[test]
fn scenes_for_a_measure_with_its_own_are_refused() -> Tested {
    let experiment =
        "title = \"tiny\"\nabout = \"What a test looks at.\"\nsystems = [\"BG-2\"]\nmeasure = \"phase-functions\"\n";
    let output = Bench::new()?.run(experiment, &["--scene", "builtin:cornell-box"])?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("leave out --scene"), "{said}");
    Ok(())
}

/// A host's own technique: every pixel has the same radiance.
struct Plain;

impl FrameMethod for Plain {
    fn record(&mut self, recorder: &mut Recorder, _: &Frame<'_>, target: &FrameTarget<'_>) -> clerestory::Result<()> {
        recorder.pass("plain: fill", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_WRITE);
            pass.fill(target.radiance.view(), 0.5f32.to_bits())?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            Ok(())
        })
    }

    fn path_set(&self) -> PathSet {
        PathSet::EMITTED
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        Vec::new()
    }
}

static PLAIN: Card = Card {
    id: "plain",
    summary: "the same radiance everywhere",
    rows: &[],
    bias: Bias::Biased("looks at nothing"),
    needs: &[],
    kernels: &[],
    path_set: PathSet::EMITTED,
    refusals: |_| Vec::new(),
    settings: SettingsDecl::NONE,
    variants: &[],
    foresight: Foresight::FRAMES,
    create: |gpu, _, view, _| Accumulated::boxed(gpu, view, Plain),
};

#[test]
fn sweeps_take_techniques_of_a_host() -> Tested {
    let bench = Bench::new()?;
    let file = bench.folder.path().join("host.toml");
    std::fs::write(
        &file,
        TEXT.replace("size =", "path_set = \"emitted\"\nsize =")
            .replace("settings = { sampler = \"pcg\" }\n", ""),
    )?;
    let experiment = experiments::find(&file.display().to_string())?;
    let Kind::Sweep(sweep) = experiment.kind()? else {
        return Err("no sweep".into());
    };
    let mut sweep = sweep.clone();
    sweep.variants[0].technique = "plain".into();
    assert!(sweep.check().is_err_and(|error| error.to_string().contains("plain")));
    sweep.cards = Cards(vec![&PLAIN]);
    let places = Places {
        folder: bench.out(),
        references: bench.folder.path().join("references"),
        fresh: false,
    };
    let gpu = Gpu::headless(&GpuOptions::default())?;
    let load = |address: &str| clerestory::scene::load(address);
    let results = render_sweep::run(&gpu, &experiment, &sweep, false, &places, &load, &Unwatched)?;
    let variant = &results.scenes[0].variants[0];
    assert_eq!((variant.technique.as_str(), variant.points.len()), ("plain", 2));
    let reference = results.scenes[0]
        .reference_picture
        .as_ref()
        .ok_or("no reference")?
        .main_layer()?
        .values();
    let squares = reference.iter().map(|value| (f64::from(*value) - 0.5).powi(2));
    let expected = squares.sum::<f64>() / reference.len() as f64;
    for point in &variant.points {
        for measured in &point.measurements {
            assert!((measured.error.mse + measured.error.reference_mse - expected).abs() < 1e-6 * expected);
            assert_eq!(measured.counters["frames"] as f64, measured.samples);
        }
    }
    // Another path set than its own is refused, not compared.
    sweep.path_set = "all".into();
    assert!(
        sweep
            .check()
            .is_err_and(|error| error.to_string().contains("no others"))
    );
    Ok(())
}
