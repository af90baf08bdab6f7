//! Metals beside Mitsuba's rough and smooth conductors, within noise, by distributions of both kinds.
//!
//! Oracle: converged pictures by Mitsuba, as of [`super::mitsuba`], whose rows and criteria these are; nothing is raced. Without Mitsuba the table says so.

use clerestory::Result;

use super::mitsuba::{Agreement, OF_AGREEMENT, agreements, comparison, not_measured, without_mitsuba};
use crate::agreement::{AgreementOptions, AgreementReport, mitsuba_version, run_with};
use crate::experiments::findings::{Findings, Study};
use crate::experiments::measures::Context;

/// Scenes by name: smooth and rough metals of GGX, a rough one of Beckmann's distribution, and a white one, which loses what it would scatter more than once: Mitsuba's conductors scatter once, and so do ours here.
const SCENES: [&str; 3] = ["cornell-metals", "cornell-beckmann", "furnace-metal"];
const SMOKE_SCENES: usize = 1;
const SMOKE_SIZE: u32 = 16;
const SMOKE_PASSES: u32 = 32;
const SMOKE_SAMPLES: u32 = 4;

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// Why nothing was measured.
    cause: Option<String>,
    agreement: Vec<Agreement>,
    /// How it was compared, in a sentence.
    compared: String,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let options = options(context);
        let version = match mitsuba_version(&options.python) {
            Ok(version) => version,
            Err(cause) => {
                return Ok(Self {
                    cause: Some(without_mitsuba(cause)?),
                    ..Self::default()
                });
            }
        };
        context.watch.note(&format!("Mitsuba {version}"));
        let gpu = (context.gpu)()?;
        let report = AgreementReport::begin(&gpu, &options)?;
        let report = run_with(&gpu, report, context.watch, &mut |_| Ok(()))?;
        Ok(Self {
            cause: None,
            agreement: agreements(&report),
            compared: comparison(&report),
        })
    }

    fn findings(&self) -> Findings {
        match &self.cause {
            Some(cause) => Findings::from(vec![not_measured(cause)]).judged(&self.agreement, OF_AGREEMENT),
            None => Findings::of(&self.agreement, OF_AGREEMENT).note(self.compared.as_str()),
        }
    }
}

fn options(context: &Context<'_>) -> AgreementOptions {
    let names = context.first(&SCENES, SMOKE_SCENES).iter();
    let all = AgreementOptions {
        scenes: names.map(|&name| name.to_owned()).collect(),
        timing_rounds: 0,
        output: context.folder.join("scenes"),
        ..AgreementOptions::default()
    };
    if !context.smoke {
        return all;
    }
    AgreementOptions {
        size: SMOKE_SIZE,
        passes: SMOKE_PASSES,
        samples_per_pass: SMOKE_SAMPLES,
        ..all
    }
}
