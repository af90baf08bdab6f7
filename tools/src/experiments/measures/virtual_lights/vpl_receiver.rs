//! A body that moves under kept virtual lights whose lamp stands still: it receives their light, and they stay where they are.
//!
//! Source: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR 2007, whose dynamic objects receive light alone. Oracle: the path tracer.

use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::techniques::instant_radiosity::many_light::{ManyLightSettings, Placement, Visibility};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use glam::{DAffine3, DVec3, Vec3};

use super::vpl_incremental::{
    Form, INDIRECT, ORACLE_SEED, RENEWED, SCENES, Subject, difference, frame, oracle, renderer, side_by_side, traced,
};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, rows};
use crate::experiments::measures::pictures::Panel;
use crate::experiments::reference::short_name;

/// The scene, the body's name in it, and how far it rises in a frame, m.
const SCENE: &str = "builtin:cornell-box?boxes=short";
const BODY: &str = "short block";
const RISE: f64 = 0.006;

rows! {
    /// A body that moves.
    struct Receiver = "A body that moves under kept lights" by [scene] {
        scene: String = "scene",
        renewed: u64 = "new lights",
        kept: Repeats = "relative RMSE of kept lights",
        new: Repeats = "relative RMSE of new walks",
        over: Repeats = "error of kept lights over that of new walks",
    }
}

const CRITERIA: &[Criterion<Receiver>] = &[
    Criterion::each(
        "a body that moves takes no new light: new lights",
        Bound::AtMost(0.0),
        |row: &Receiver| row.renewed.into(),
    )
    .in_every_form(),
    Criterion::each(
        "under a body that moves kept lights err no more than new ones: ratio of errors",
        Bound::AtMost(1.0),
        |row: &Receiver| (&row.over).into(),
    ),
];

/// What a page says of such bodies.
pub fn findings(receivers: &[Receiver]) -> Findings {
    Findings::of(receivers, CRITERIA).note(
        "The short block of the Cornell box rises under a point light that stands still; shadow rays meet it where it is. Lights that were placed on it stay where it was.",
    )
}

/// Lifts the body frame by frame; panels of the last one by kept lights, by new walks and by the oracle.
///
/// # Errors
/// Those of the scene and of rendering.
pub(super) fn measure(gpu: &Gpu, form: Form) -> Result<(Receiver, Vec<Panel>)> {
    let (_, _, start, _) = SCENES[0];
    let subject = Subject::new((SCENE, false, start, Vec3::ZERO))?;
    let body = subject
        .scene
        .instances
        .iter()
        .position(|instance| instance.name == BODY);
    let body = body.ok_or_else(|| Error::scene(SCENE, BODY, "is not there"))?;
    let scene = Arc::new(GpuScene::new(gpu, &subject.scene)?);
    let by = |placement| {
        let settings = ManyLightSettings {
            lights: form.lights,
            placement,
            visibility: Visibility::Rays,
            renewed: RENEWED,
            path_set: INDIRECT.parse()?,
            ..ManyLightSettings::default()
        };
        renderer(gpu, &scene, &subject, settings, form)
    };
    let mut kept = by(Placement::Incremental)?;
    let mut new = by(Placement::Walks)?;
    let mut oracle = oracle(gpu, &scene, &subject, form)?;
    let (mut of_kept, mut of_new, mut panels) = (Vec::new(), Vec::new(), Vec::new());
    // The first frame places all lights.
    let mut placed = 0;
    for number in 0..=form.frames {
        let up = DVec3::Y * RISE * f64::from(number);
        scene.move_object(gpu, &subject.scene, body, DAffine3::from_translation(up))?;
        scene.refit_index(gpu)?;
        let (by_kept, _) = frame(&mut kept, &subject, None)?;
        if number == 0 {
            placed = kept.counts().renewed;
        } else if number % form.every == 0 {
            let truth = traced(&mut oracle, form, ORACLE_SEED + number)?;
            let (by_new, _) = frame(&mut new, &subject, Some(number))?;
            of_kept.push(difference(&by_kept, &truth));
            of_new.push(difference(&by_new, &truth));
            panels = side_by_side([&by_kept, &by_new, &truth]);
        }
    }
    let (of_kept, of_new) = (Repeats(of_kept), Repeats(of_new));
    let receiver = Receiver {
        scene: short_name(SCENE).into(),
        renewed: kept.counts().renewed - placed,
        over: of_kept.over(&of_new),
        kept: of_kept,
        new: of_new,
    };
    Ok((receiver, panels))
}
