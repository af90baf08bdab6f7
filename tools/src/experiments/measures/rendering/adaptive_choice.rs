//! Automatic choice with samples shared out by noise: is the error of the picture the one that was asked for?
//!
//! Scenes, errors and oracle are those of [`automatic_choice`](super::automatic_choice); pilots and pictures give pixels samples by their noise.

use clerestory::Result;
use serde_json::json;

use super::automatic_choice::{Aimed, Asked, PAIRS, SMOKE_PAIRS, found, goal};
use crate::experiments::findings::{Findings, Study};
use crate::experiments::measures::Context;

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    goals: Vec<Aimed>,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let pairs: &[(&str, Asked)] = context.pick(&PAIRS, &SMOKE_PAIRS);
        let errors: Vec<_> = pairs
            .iter()
            .filter(|(_, asked)| matches!(asked, Asked::Error(_)))
            .collect();
        Ok(Self {
            goals: context.each_kept(
                &gpu,
                &errors,
                |(address, _)| (*address).into(),
                |(address, asked)| goal(context, &gpu, address, *asked, json!({ "adaptive": "relative" })),
            )?,
        })
    }

    fn findings(&self) -> Findings {
        found(&self.goals)
    }
}
