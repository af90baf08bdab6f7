//! What a technique leaves out of its kernels for a scene, by what they are specialized to.

use super::Skipped;
use crate::gpu::PipelineInfo;

/// A specialization constant, what it stands for, and why it is off where nothing else is known.
pub(super) type Omission = (&'static str, &'static str, &'static str);

/// Those that are left out of the pipelines of a shader.
pub(super) fn skipped(pipelines: &[PipelineInfo], shader: &str, omissions: &[Omission]) -> Vec<Skipped> {
    let of_shader = pipelines.iter().filter(|pipeline| pipeline.shader == shader);
    let constants: Vec<_> = of_shader.flat_map(|pipeline| &pipeline.specialization).collect();
    let is_off = |name: &str| constants.iter().any(|(known, value)| *known == name && *value == 0);
    omissions
        .iter()
        .filter(|(name, ..)| is_off(name))
        .map(|&(_, what, why)| Skipped { what, why })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_in_the_shader_is_said_and_what_is_on_or_elsewhere_is_not() {
        let pipeline = |shader, specialization: &[(&'static str, u32)]| PipelineInfo {
            shader,
            specialization: specialization.to_vec(),
        };
        let pipelines = [
            pipeline("a.comp", &[("has_fur", 0), ("has_glass", 1)]),
            pipeline("b.comp", &[("has_smoke", 0), ("has_glass", 0)]),
        ];
        let omissions = [
            ("has_fur", "fur", "nobody has any"),
            ("has_glass", "glass", "nobody has any"),
            ("has_smoke", "smoke", "nobody has any"),
        ];
        let names = |shader| -> Vec<_> { skipped(&pipelines, shader, &omissions).iter().map(|s| s.what).collect() };
        assert_eq!(names("a.comp"), ["fur"]);
        assert_eq!(names("b.comp"), ["glass", "smoke"]);
        assert!(names("c.comp").is_empty());
    }
}
