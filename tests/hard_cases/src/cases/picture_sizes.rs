//! Pictures of one pixel, of odd sizes, of none and of too many.

use clerestory::scene::load;
use clerestory::{Error, Result};

use crate::scenes::furnace;
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "picture-sizes",
    breaks: "Sizes that are not multiples of a workgroup leave pixels out or write beyond the last one; products of sides overflow 32 bits.",
    expects: "Every pixel has all of its samples, however few paths are in flight; a size that cannot be is refused by name.",
    picture: || load("builtin:cornell-box"),
    techniques: Some(judge),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    const SPP: u32 = 5;
    let mut judgement = Judgement::default();
    let scene = furnace()?;
    let uploaded = easel.upload(&scene)?;
    let in_flight: &[u32] = if easel.has("paths_in_flight") {
        &[0, 1, 64, 100]
    } else {
        &[0]
    };
    for size in [[1, 1], [17, 3], [1, 65], [63, 1], [7, 9]] {
        // One path at a time takes a wave for each sample: small pictures only.
        let some = |paths: &&u32| **paths != 1 || size[0] * size[1] < 60;
        for &paths in in_flight.iter().filter(some) {
            let easel = easel.with("paths_in_flight", paths);
            let mut technique = easel.prepare_uploaded(uploaded.clone(), &scene, size)?;
            let painted = crate::easel::finish(technique.as_mut(), SPP)?;
            let what = format!("{size:?}, {paths} paths");
            judgement.sound(&what, &painted);
            let wanted = u64::from(size[0] * size[1] * SPP);
            let done = painted.counters.get("paths").copied().unwrap_or(wanted);
            judgement.holds(format!("{what}: {done} samples instead of {wanted}"), done == wanted);
        }
    }
    for size in [[0, 4], [4, 0], [70_000, 70_000]] {
        let made = easel.prepare_uploaded(uploaded.clone(), &scene, size);
        judgement.refused(
            &format!("size {size:?}"),
            made,
            |error| matches!(error, Error::Setting { name, .. } if name == "size"),
        );
    }
    Ok(judgement)
}
