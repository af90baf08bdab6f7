//! `clerestory metal`: a metal's reflectance, and what cheaper forms of its Fresnel factor lose and cost.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clerestory::film::png;
use clerestory::input::read_text;
use clerestory::scene::metals::{self, IndexSpectrum, artistic::artistic_parameters};
use clerestory::scene::{ConductorIor, FresnelForm};
use clerestory::transport::fresnel::compensated::compensation;
use clerestory::transport::fresnel::curve::{CurveForm, FresnelCurve};
use clerestory::transport::fresnel::form::MetalFresnel;
use clerestory::transport::fresnel::tinted::TINT_COSINE;
use clerestory_tools::metal_forms::{FormError, STEPS, Way, sheet, split_sphere};
use clerestory_tools::timing::median;
use serde::Serialize;

use super::check_validation;
use crate::failure::{Failure, Outcome};
use crate::options::DeviceOptions;
use crate::output::{self, Table};
use crate::outputs::{Inputs, Outputs, Overwriting};

/// Shows a metal's reflectance over the angle, and what cheaper forms of its Fresnel factor lose and cost
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory metal gold
  clerestory metal aluminium --wavelengths 700,550,435 --sphere split.png
  clerestory metal coin.csv --cost              lines of a wavelength in nanometres, n, k
  clerestory metal copper --json | jq '.errors'

Scenes name a form in their sidecar: [metals] ring = { metal = \"gold\", fresnel = \"compensated\" }. Errors are relative to Fresnel's equations, over \
20,001 even cosines of incidence. The sphere is lit and seen from afar at 90, 85 … 50 degrees of incidence: exact above, --form below.")]
pub struct Arguments {
    /// A metal's name, or a file with its spectrum
    metal: String,
    /// Three wavelengths, in nanometres, within the metal's samples, in the place of the means over the red, green and blue channels
    #[arg(long, value_name = "R,G,B", value_parser = wavelengths)]
    wavelengths: Option<[f64; 3]>,
    /// Also times each form on the device
    #[arg(long)]
    cost: bool,
    /// Writes a picture of spheres that are exact above and of --form below
    #[arg(long, value_name = "FILE.png")]
    sphere: Option<PathBuf>,
    /// The form of the spheres' lower halves
    #[arg(long, default_value = "rescaled", requires = "sphere", value_parser = form)]
    form: FresnelForm,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    device: DeviceOptions,
}

const BANDS: [&str; 3] = ["red", "green", "blue"];
/// Cosines of the printed curve.
const COSINES: [f64; 12] = [1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.15, 0.1, 0.05, 0.02, 0.01, 0.0];
/// Degrees of incidence of the spheres.
const DEGREES: [f64; 9] = [90.0, 85.0, 80.0, 75.0, 70.0, 65.0, 60.0, 55.0, 50.0];
/// Pixels along a sphere's side.
const SIDE: u32 = 160;
/// Evaluations of an invocation, invocations and turns of a measurement of cost.
const COST: (u32, u32, usize) = (64, 1 << 16, 5);
/// Bytes of a spectrum's file at most.
const FILE_MAX: u64 = 1 << 24;

fn form(text: &str) -> Result<FresnelForm, String> {
    let found = FresnelForm::ALL.into_iter().find(|form| form.name() == text);
    found.ok_or_else(|| format!("known: {}", FresnelForm::ALL.map(FresnelForm::name).join(", ")))
}

fn wavelengths(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let three = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    let sound = three.filter(|all| all.iter().all(|w| w.is_finite() && *w > 0.0));
    sound.ok_or_else(|| "needs three numbers above 0, in nanometres, with commas between".into())
}

/// A band of a metal.
#[derive(Debug, Serialize)]
struct Band {
    band: &'static str,
    n: f64,
    k: f64,
    reflectance: f64,
    reflectance_at_82_degrees: f64,
    edge_tint: f64,
    average: f64,
    compensation: clerestory::transport::fresnel::compensated::Chosen,
    a: f64,
    alpha: f64,
}

/// A form of a band.
#[derive(Debug, Serialize)]
struct Error {
    form: &'static str,
    band: &'static str,
    #[serde(flatten)]
    error: FormError,
}

/// The exact factor at a cosine.
#[derive(Debug, Serialize)]
struct Point {
    cosine: f64,
    reflectance: [f64; 3],
}

/// What a form costs.
#[derive(Debug, Serialize)]
struct Cost {
    form: CurveForm,
    nanoseconds: f64,
    over_exact: f64,
}

/// All that is said.
#[derive(Debug, Serialize)]
struct Shown {
    metal: String,
    bands: Vec<Band>,
    curve: Vec<Point>,
    errors: Vec<Error>,
    costs: Option<Vec<Cost>>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let file = metals::spectrum(&arguments.metal)
        .is_none()
        .then(|| PathBuf::from(&arguments.metal));
    let plan = match &arguments.sphere {
        Some(path) => {
            let overwrite = arguments.overwriting.overwrite;
            Some((path, Outputs::one(path, &Inputs::of(file.iter()), overwrite)?))
        }
        None => None,
    };
    let spectrum = spectrum(&arguments.metal)?;
    let ior = match arguments.wavelengths {
        Some(wavelengths) => {
            check_wavelengths(&spectrum, wavelengths)?;
            spectrum.at_wavelengths(wavelengths)
        }
        None => spectrum.channels(),
    };
    let shown = Shown {
        metal: arguments.metal.clone(),
        bands: BANDS
            .iter()
            .enumerate()
            .map(|(i, band)| of_band(&ior, i, band))
            .collect(),
        curve: curve(&ior),
        errors: errors(&ior),
        costs: arguments.cost.then(|| costs(arguments, &ior)).transpose()?,
    };
    if arguments.json {
        output::print_json(&shown)?;
    } else {
        output::print(&shown.text())?;
    }
    if let Some((path, plan)) = plan {
        let [exact, below] = [FresnelForm::Exact, arguments.form]
            .map(|form| MetalFresnel::new(form, ior.eta.as_dvec3(), ior.k.as_dvec3()));
        let spheres = DEGREES.map(|degrees| split_sphere(&exact, &below, degrees, SIDE));
        let bytes = png::to_bytes(&sheet(&spheres, SIDE, 3), &path.display().to_string())?;
        let written = plan.write(&[bytes], || None);
        written.check()?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A metal by its name, or else from a file.
fn spectrum(metal: &str) -> Outcome<IndexSpectrum> {
    if let Some(spectrum) = metals::spectrum(metal) {
        return Ok(spectrum);
    }
    let known: Vec<&str> = metals::names().collect();
    let failed = |message: String| Failure {
        hint: Some(format!("metals with a name: {}", known.join(", "))),
        ..Failure::usage(message)
    };
    let text = read_text(Path::new(metal), FILE_MAX).map_err(|error| failed(error.to_string()))?;
    IndexSpectrum::parse(&text).map_err(|cause| failed(format!("{metal}: {cause}")))
}

/// Refuses wavelengths of which a spectrum knows nothing.
fn check_wavelengths(spectrum: &IndexSpectrum, wavelengths: [f64; 3]) -> Outcome<()> {
    let [first, last] = spectrum.range();
    let Some(outside) = wavelengths.into_iter().find(|w| !(first..=last).contains(w)) else {
        return Ok(());
    };
    Err(Failure {
        // As for files.
        hint: (outside < 100.0).then(|| "wavelengths are in nanometres; this looks like micrometres".into()),
        ..Failure::usage(format!(
            "--wavelengths: {outside} nm is outside of the metal's samples, from {first} to {last} nm"
        ))
    })
}

fn of_band(ior: &ConductorIor, i: usize, band: &'static str) -> Band {
    let (eta, k) = (ior.eta.as_dvec3(), ior.k.as_dvec3());
    let fresnel = MetalFresnel::new(FresnelForm::Exact, eta, k);
    let [reflectance, edge_tint] = artistic_parameters(eta, k);
    let (chosen, term) = compensation(eta[i], k[i]);
    Band {
        band,
        n: eta[i],
        k: k[i],
        reflectance: reflectance[i],
        reflectance_at_82_degrees: fresnel.at(TINT_COSINE)[i],
        edge_tint: edge_tint[i],
        average: fresnel.average()[i],
        compensation: chosen,
        a: term.a,
        alpha: term.alpha,
    }
}

fn curve(ior: &ConductorIor) -> Vec<Point> {
    let fresnel = MetalFresnel::new(FresnelForm::Exact, ior.eta.as_dvec3(), ior.k.as_dvec3());
    COSINES
        .iter()
        .map(|&cosine| Point {
            cosine,
            reflectance: fresnel.at(cosine).to_array(),
        })
        .collect()
}

fn errors(ior: &ConductorIor) -> Vec<Error> {
    let of = |way: Way| {
        BANDS.into_iter().enumerate().map(move |(i, band)| Error {
            form: way.name(),
            band,
            error: FormError::of(way, ior.eta[i].into(), ior.k[i].into(), STEPS),
        })
    };
    Way::ALL.into_iter().flat_map(of).collect()
}

/// Medians of forms that take turns.
fn costs(arguments: &Arguments, ior: &ConductorIor) -> Outcome<Vec<Cost>> {
    let gpu = arguments.device.open()?;
    let (chain, count, turns) = COST;
    let forms: Vec<CurveForm> = CurveForm::ALL.into();
    let kernels: Vec<FresnelCurve> = (forms.iter())
        .map(|form| FresnelCurve::new(&gpu, *form, ior, chain))
        .collect::<clerestory::Result<_>>()?;
    let mut times = vec![Vec::new(); forms.len()];
    // The first turn warms up.
    for turn in 0..=turns {
        for (kernel, times) in kernels.iter().zip(&mut times) {
            let (_, seconds) = kernel.run(&gpu, count)?;
            if turn > 0 {
                times.push(1e9 * seconds / f64::from(count) / f64::from(chain));
            }
        }
    }
    let log = gpu.validation_log();
    drop((kernels, gpu));
    check_validation(&log)?;
    let medians: Vec<f64> = times.into_iter().map(median).collect();
    let exact = forms
        .iter()
        .position(|form| *form == CurveForm::Exact)
        .map_or(f64::NAN, |i| medians[i]);
    let costs = forms.iter().zip(&medians).map(|(form, nanoseconds)| Cost {
        form: *form,
        nanoseconds: *nanoseconds,
        over_exact: nanoseconds / exact,
    });
    Ok(costs.collect())
}

impl Shown {
    fn text(&self) -> String {
        let mut bands = Table::new(
            &[
                "band",
                "n",
                "k",
                "0°",
                "82°",
                "edge tint",
                "average",
                "compensation",
                "a",
                "α",
            ],
            &[7],
        );
        for band in &self.bands {
            let numbers = [
                band.n,
                band.k,
                band.reflectance,
                band.reflectance_at_82_degrees,
                band.edge_tint,
                band.average,
            ];
            let mut cells = vec![band.band.to_owned()];
            cells.extend(numbers.map(|x| format!("{x:.4}")));
            cells.push(format!("{:?}", band.compensation).to_lowercase());
            cells.extend([band.a, band.alpha].map(|x| format!("{x:.4}")));
            bands.row(cells);
        }
        let mut curve = Table::new(&["cosine", "red", "green", "blue"], &[]);
        for point in &self.curve {
            let numbers = point.reflectance.map(|x| format!("{x:.4}"));
            curve.row([format!("{}", point.cosine)].into_iter().chain(numbers));
        }
        let mut errors = Table::new(&["form", "band", "greatest error (%)", "at cosine", "mean (%)"], &[1]);
        for Error { form, band, error } in &self.errors {
            errors.row([
                (*form).to_owned(),
                (*band).to_owned(),
                format!("{:.2}", 100.0 * error.worst),
                format!("{:.3}", error.at),
                format!("{:.2}", 100.0 * error.mean),
            ]);
        }
        let mut text = [bands.text(), curve.text(), errors.text()].join("\n");
        if let Some(costs) = &self.costs {
            let mut table = Table::new(&["form on the device", "ns", "over exact"], &[]);
            for cost in costs {
                let name = serde_json::to_value(cost.form).unwrap_or_default();
                table.row([
                    name.as_str().unwrap_or_default().to_owned(),
                    format!("{:.3}", cost.nanoseconds),
                    format!("{:.2}", cost.over_exact),
                ]);
            }
            text += &format!("\n{}", table.text());
        }
        text
    }
}
